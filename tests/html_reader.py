"""Reads an HTML page as strictly as is needed to trust its tests."""

import re
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote

VOID = {"meta", "link", "img", "input", "br", "hr"}
ADDRESSES = {"href", "src", "srcset", "action", "poster", "data"}


class Element(SimpleNamespace):
    """An element: its tag, its attributes, the tags that it is inside of, and the text in it."""


class Page(HTMLParser):
    """A page whose elements are all closed in order, and each of whose attributes occurs once."""

    def __init__(self, content: bytes) -> None:
        """Read it."""
        super().__init__(convert_charrefs=True)
        self.elements: list[Element] = []
        self._open: list[Element] = []
        self.feed(content.decode())
        self.close()
        assert not self._open, [each.tag for each in self._open]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Open an element."""
        assert len(dict(attrs)) == len(attrs), (tag, attrs)
        inside = tuple(each.tag for each in self._open)
        element = Element(tag=tag, attributes=dict(attrs), inside=inside, text="")
        self.elements.append(element)
        if tag not in VOID:
            self._open.append(element)

    def handle_endtag(self, tag: str) -> None:
        """Close an element."""
        assert self._open and self._open[-1].tag == tag, (tag, [e.tag for e in self._open])
        self._open.pop()

    def handle_data(self, data: str) -> None:
        """Add text to all open elements."""
        for element in self._open:
            element.text += data

    def all(self, tag: str, **attributes: str) -> list[Element]:
        """Return the elements of a tag that have some attributes."""
        items = {name.rstrip("_"): value for name, value in attributes.items()}.items()
        return [e for e in self.elements if e.tag == tag and items <= e.attributes.items()]

    def tables(self, kind: str = "sortable") -> list[list[list[str]]]:
        """Return the tables of a class as rows of cells."""
        found: list[list[list[str]]] = []
        shown = False
        for each in self.elements:
            if each.tag == "table" and (shown := each.attributes.get("class") == kind):
                found.append([])
            elif each.tag == "tr" and shown:
                found[-1].append([])
            elif each.tag in ("td", "th") and shown:
                found[-1][-1].append(" ".join(each.text.split()))
        return found

    def addresses(self) -> list[str]:
        """Return every address that the page refers to."""
        every = [pair for each in self.elements for pair in each.attributes.items()]
        return [str(value) for name, value in every if name in ADDRESSES]

    def check(self, folder: Path) -> None:
        """Assert that addresses are files of the folder or places of the page; nothing runs."""
        ids = [e.attributes["id"] for e in self.elements if "id" in e.attributes]
        assert len(ids) == len(set(ids)), ids
        for address in self.addresses():
            file, _, place = address.partition("#")
            if file.startswith("data:,"):
                continue
            assert ":" not in file and not file.startswith("/"), address
            if file:
                assert (folder / unquote(file.partition("?")[0])).is_file(), address
            else:
                assert place in ids, address
        names = [name for each in self.elements for name in each.attributes]
        assert not [name for name in names if name.startswith("on")]


def markdown_tables(text: str) -> list[list[list[str]]]:
    """Return the tables of a page in Markdown as rows of cells, without marks."""
    found: list[list[list[str]]] = []
    before = ""
    for line in text.splitlines():
        if line.startswith("| "):
            cells = re.split(r" (?<!\\)\| ", line[2:-2])
            if not before.startswith("| "):
                found.append([])
            if set(line) != set("| -"):
                found[-1].append([_plain(cell) for cell in cells])
        before = line
    return found


def _plain(cell: str) -> str:
    for mark, sign in (("\\|", "|"), ("&lt;", "<"), ("]\\(", "]("), ("**", ""), ("`", "")):
        cell = cell.replace(mark, sign)
    return " ".join(cell.split())
