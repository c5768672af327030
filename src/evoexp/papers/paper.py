"""A paper as its pages use it: its name and the words of pages, figures, tables and checks.

The words stand in `words.yaml` beside the pages; words in braces are given where they are used:

    name: "Lavoie & Boudreau 2001"
    pages:
      arms: "A genetic algorithm searches …"  # the introduction of a page
    figures:
      attempts:                               # the stem of its files, unless `stem` gives another
        title: "Attempts"
        caption: "Share of runs that took so many attempts, with Wilson's {level:g} % interval."
    tables:
      tasks: {heading: "Tasks", headers: [task, goal met], note: "Median [quartiles]."}
    checks:
      arms: [["Time of a run", "the paper prints its own"]]
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml
from matplotlib.figure import Figure

from evoexp.report.kit import ConditionResults, Drawing, Page, PlayedRun, Results, Table


class Paper(NamedTuple):
    """The name of a paper, and the words of its pages."""

    name: str  # "Chen & Zalzala 1995"
    words: Mapping[str, Mapping[str, Any]]  # pages, figures, tables and checks, by their names

    def page(self, results: Results, name: str, base: Page | None = None, **parts: Any) -> Page:
        """Build a page with its introduction.

        Args:
            results: Name the experiment in the title.
            name: Of the page among the words.
            base: The page that it extends; None: an empty one.
            parts: Of `Page`.
        """
        title = f"{self.name}: {results.experiment or 'stored runs'}"
        introduction = self.words["pages"][name]
        return (base or Page("", ""))._replace(
            **{"title": title, "introduction": introduction, **parts}
        )

    def drawing(
        self,
        name: str,
        table: Callable[[], pd.DataFrame],
        draw: Callable[[pd.DataFrame], Figure],
        conditions: Sequence[ConditionResults],
        plays: Sequence[PlayedRun] = (),
        suffix: str = "",
        **words: object,
    ) -> Drawing:
        """Return a figure with its title and its caption.

        Args:
            name: Of the figure among the words.
            table: Gives its data.
            draw: Draws its data.
            conditions: Whose results it shows.
            plays: Runs whose motions it shows.
            suffix: Ends the stem of one of several figures; the title then names the condition.
            words: Filled in for the words in braces.
        """
        entry = self.words["figures"][name]
        title, caption = (entry[part].format(**words) for part in ("title", "caption"))
        stem = entry.get("stem", name).format(**words) + suffix
        title += f" ({conditions[0].label})" if suffix else ""
        return Drawing(stem, title, caption, table, draw, tuple(conditions), tuple(plays))

    def table(self, name: str, rows: Sequence[tuple[object, ...]], **words: object) -> Table:
        """Return a table with its heading, its headers and its note."""
        entry = self.words["tables"][name]
        headers = tuple(header.format(**words) for header in entry["headers"])
        note = entry.get("note", "").format(**words)
        return Table(entry["heading"], headers, tuple(rows), note)

    def checks(self, name: str) -> tuple[tuple[str, str], ...]:
        """Return the checks of a page that no results change: (title, finding)."""
        return tuple((title, finding) for title, finding in self.words["checks"][name])


def read_paper(path: Path) -> Paper:
    """Read a file of words."""
    words = yaml.safe_load(path.read_text(encoding="utf-8"))
    return Paper(words.pop("name"), words)
