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
    """Read XML as TinyXML does, which knows no namespaces; return its root element, shared by all.

    Args:
        field: That names it in errors.
        tag: The root's.

    Raises:
        SettingError: If it is no such XML, or one that declares entities or is deep or large.
    """
    must = f"XML with the root <{tag}>"
    if reason := stand_in(content):
        raise SettingError(field, must, reason)
    builder, parser = _PlainTree(field), expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.StartDoctypeDeclHandler = builder.doctype
    try:
        parser.Parse(content, True)
        root = builder.close()
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise SettingError(field, must, str(error)) from None
    if root.tag != tag:
        raise SettingError(field, must, f"<{root.tag}>")
    return root


class _PlainTree(ET.TreeBuilder):
    """Builds a tree that is neither deep nor large, of a text that declares no entities."""

    def __init__(self, field: str) -> None:
        super().__init__()
        self._field, self._depth, self._count = field, 0, 0

    def doctype(self, name: str, *_: Any) -> None:
        """Refuse document types: their entities unfold to any size, or name other files."""
        raise SettingError(self._field, "XML without a document type", f"<!DOCTYPE {name}>")

    def start(self, tag: str, attributes: Any) -> Any:
        """Open an element."""
        self._depth, self._count = self._depth + 1, self._count + 1
        if self._depth > MOST_NESTED or self._count > MOST_ELEMENTS:
            must = f"XML of at most {MOST_ELEMENTS:,} elements, nested {MOST_NESTED} deep"
            raise SettingError(self._field, must, f"more, at <{tag[:40]}>")
        return super().start(tag, attributes)

    def end(self, tag: str) -> Any:
        """Close an element."""
        self._depth -= 1
        return super().end(tag)
