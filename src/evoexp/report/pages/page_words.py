"""The words of pages, kept as data beside the code: titles, captions, headings, notes.

Those of evoexp's own pages stand in `report/pages/words.yaml`, those of a paper in its `page.yaml`
(see `page_file`). Words in braces are given where they are used.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml
from matplotlib.figure import Figure

from evoexp.report.pages.page_parts import Drawing, PlayedRun, Quantity, Table
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import spread

# give the table of a figure, and draw it
Functions = tuple[Callable[..., pd.DataFrame], Callable[[pd.DataFrame], Figure]]


class PageWords(NamedTuple):
    """The words of a paper's pages, or of evoexp's own."""

    name: str  # "Chen & Zalzala 1995"
    words: Mapping[str, Mapping[str, Any]]  # pages, figures, tables, …, by their names

    def introduction(self, name: str, **words: object) -> str:
        """Return the first paragraph of a page."""
        return str(self.words["pages"][name]).format(**words)

    def drawing(
        self,
        name: str,
        functions: Functions,
        conditions: Sequence[ConditionResults],
        *arguments: Any,
        plays: Sequence[PlayedRun] = (),
        suffix: str = "",
        **words: object,
    ) -> Drawing:
        """Return a figure with its title and its caption.

        Args:
            name: Of the figure among the words.
            functions: Give the table, and draw it.
            conditions: Whose results it shows.
            arguments: Of the function that gives the table.
            plays: Runs whose motions it shows.
            suffix: Ends the stem of one of several figures; the title then names the condition.
            words: Filled in for the words in braces.
        """
        entry, (table, draw) = self.words["figures"][name], functions
        title, caption = (entry[part].format(**words) for part in ("title", "caption"))
        return Drawing(
            stem=entry.get("stem", name).format(**words) + suffix,
            title=f"{title} ({conditions[0].label})" if suffix else title,
            caption=caption,
            table=partial(table, *arguments),
            draw=draw,
            conditions=tuple(conditions),
            plays=tuple(plays),
            columns=entry.get("columns", ""),
        )

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


WORDS = read_words(Path(__file__).with_name("words.yaml"))  # of the pages that are no paper's
