"""The words of pages, kept as data beside the code: titles, captions, headings, notes.

Those of evoexp's own pages stand in `report/pages/page.yaml`, those of a paper in its `page.yaml`
(see `page_file`).
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from evoexp.report.pages.page_parts import Quantity, Table
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import spread


class PageWords(NamedTuple):
    """The words of a paper's pages, or of evoexp's own."""

    name: str  # "Chen & Zalzala 1995"
    words: Mapping[str, Mapping[str, Any]]  # pages, figures, tables, …, by their names

    def table(
        self,
        name: str,
        rows: Iterable[tuple[object, ...]],
        before: Sequence[str] = (),
        behind: Sequence[str] = (),
        **words: object,
    ) -> Table:
        """Return a table with its heading, its headers and its note.

        Args:
            name: Of the table among the words.
            rows: Its cells.
            before: Headers of further columns on the left.
            behind: Headers of further columns on the right.
            words: Filled in for the words in braces.
        """
        entry = self.words["tables"][name]
        headers = (header.format(**words) for header in entry["headers"])
        heading, note = (entry.get(part, "").format(**words) for part in ("heading", "note"))
        return Table(heading, (*before, *headers, *behind), tuple(rows), note)


def quantity(results: Results, name: str, unit: str, values: Values) -> Quantity:
    """Return a row of the table of results."""
    return Quantity(name, unit, {c.label: spread(values(c)) for c in results.with_data})


def read_words(path: Path) -> PageWords:
    """Read the words of a file."""
    words = yaml.safe_load(path.read_text(encoding="utf-8"))
    return PageWords(words.pop("name"), words)


WORDS = read_words(Path(__file__).with_name("page.yaml"))  # of the pages that are no paper's
