"""Reads an HTML page as strictly as is needed to trust its tests."""

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

VOID = {"meta", "link", "img", "input", "br", "hr"}
ADDRESSES = {"href", "src", "srcset", "action", "poster", "data"}


class Element:
    """An element: its tag, its attributes, and the text in it."""

    def __init__(
        self, tag: str, attributes: dict[str, str | None], inside: tuple[str, ...]
    ) -> None:
        """Begin it, inside of others, of which the tags are given."""
        self.tag, self.attributes, self.inside, self.text = tag, attributes, inside, ""


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
        element = Element(tag, dict(attrs), tuple(each.tag for each in self._open))
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
        wanted = {name.rstrip("_"): value for name, value in attributes.items()}
        return [
            each
            for each in self.elements
            if each.tag == tag and wanted.items() <= each.attributes.items()
        ]

    def tables(self, kind: str = "sortable") -> list[list[list[str]]]:
        """Return the tables of a class as rows of cells."""
        found: list[list[list[str]]] = []
        shown = False
        for each in self.elements:
            if each.tag == "table":
                shown = each.attributes.get("class") == kind
                found += [[]] if shown else []
            elif each.tag == "tr" and shown:
                found[-1].append([])
            elif each.tag in ("td", "th") and shown:
                found[-1][-1].append(" ".join(each.text.split()))
        return found

    def addresses(self) -> list[str]:
        """Return every address that the page refers to."""
        return [
            str(value)
            for each in self.elements
            for name, value in each.attributes.items()
            if name in ADDRESSES
        ]

    def check(self, folder: Path) -> None:
        """Assert that every address is a file of the folder or a place of the page; nothing runs.

        No element has a script of its own.
        """
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
