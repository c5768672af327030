"""Files of XML: a URDF or an SRDF, parsed once per content."""

import functools
import xml.etree.ElementTree as ET
from typing import Any
from xml.parsers import expat

from evoexp.errors import SettingError
from evoexp.input_files import stand_in

MOST_NESTED, MOST_ELEMENTS = 50, 100_000  # of XML


@functools.lru_cache(maxsize=32)
def parsed_xml(content: bytes, field: str, tag: str) -> Any:
    """Read XML as TinyXML does, without namespaces; return its root element, shared by all."""
    must, builder, open_tags, count = f"XML with the root <{tag}>", ET.TreeBuilder(), [], 0

    def start(name: str, attributes: Any) -> None:
        nonlocal count
        open_tags.append(name)
        count += 1
        if len(open_tags) > MOST_NESTED or count > MOST_ELEMENTS:
            most = f"XML of at most {MOST_ELEMENTS:,} elements, nested {MOST_NESTED} deep"
            raise SettingError(field, most, f"more, at <{name[:40]}>")
        builder.start(name, attributes)

    def doctype(name: str, *_: Any) -> None:  # entities unfold to any size, or name other files
        raise SettingError(field, "XML without a document type", f"<!DOCTYPE {name}>")

    if reason := stand_in(content):
        raise SettingError(field, must, reason)
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.StartDoctypeDeclHandler = start, doctype
    parser.EndElementHandler = lambda name: builder.end(open_tags.pop())
    try:
        parser.Parse(content, True)
        root = builder.close()
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise SettingError(field, must, str(error)) from None
    if root.tag != tag:
        raise SettingError(field, must, f"<{root.tag}>")
    return root
