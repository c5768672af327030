"""The words of pages, kept as data beside the code: titles, captions, headings, notes, checks.

A paper has them in `words.yaml` beside its pages, evoexp's own pages in `report/pages/words.yaml`;
words in braces are given where they are used:

    name: "Lavoie & Boudreau 2001"
    pages:
      arms: "A genetic algorithm searches …"  # the introduction of a page
    figures:
      attempts:                               # the stem of its files, unless `stem` gives another
        title: "Attempts"
        caption: "Share of runs that took so many attempts, with Wilson's {level:g} % interval."
        columns: "Columns attempts, having, total, …"  # of its table, for the file beside it
    tables:
      tasks: {heading: "Tasks", headers: [task, goal met], note: "Median [quartiles]."}
    checks:
      arms: [["Time of a run", "the paper prints its own"]]
    quantities:                               # rows of the table of results: name, unit, column
      arms: [[attempts, "–", term_attempts]]  # or the name of a function of a run's values
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml
from matplotlib.figure import Figure

from evoexp.report.pages.markdown import filled
from evoexp.report.pages.page_parts import Drawing, Page, PlayedRun, Quantity, Table
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.claim_rules import Rules, read_rules
from evoexp.report.statistics.comparisons import Values, by_column
from evoexp.report.statistics.inference import spread

# give the table of a figure, and draw it
Functions = tuple[Callable[..., pd.DataFrame], Callable[[pd.DataFrame], Figure]]
VALUES: dict[str, Values] = {  # of runs, that rows of the table of results may name
    "first_feasible": run_measures.first_feasible,
    "search_seconds": run_measures.search_seconds,
    "evaluations_per_second": run_measures.evaluations_per_second,
}


class PageWords(NamedTuple):
    """The words of a paper's pages, or of evoexp's own."""

    name: str  # "Chen & Zalzala 1995"
    words: Mapping[str, Mapping[str, Any]]  # pages, figures, tables, …, by their names

    def page(self, results: Results, name: str, base: Page | None = None, **parts: Any) -> Page:
        """Build a page with its introduction.

        Args:
            results: Name the experiment in the title.
            name: Of the page among the words.
            base: The page that it extends; None: an empty one.
            parts: Of `Page`.
        """
        title = f"{self.name}: {results.experiment or 'stored runs'}"
        return (base or Page("", ""))._replace(
            **{"title": title, "introduction": self.introduction(name), **parts}
        )

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

    def quantities(
        self,
        results: Results,
        name: str,
        values: Mapping[str, Values] | None = None,
        **words: object,
    ) -> tuple[Quantity, ...]:
        """Return rows of the table of results.

        Args:
            results: With data.
            name: Of the rows among the words; the unit "length" is the scene's unit of length.
            values: Functions that the rows name, beside those of every paper.
            words: Filled in for the words in braces.
        """
        length, known = results.with_data[0].condition.length_unit, VALUES | dict(values or {})
        return tuple(
            quantity(
                results,
                title.format(**words),
                length if unit == "length" else unit,
                known.get(column, by_column(column)),
            )
            for title, unit, column in self.words["quantities"][name]
        )

    def checks(self, name: str, **words: object) -> tuple[tuple[str, str], ...]:
        """Return rows of checks, (title, finding), with their words in braces filled in."""
        return tuple(
            (filled(title, words), filled(finding, words))
            for title, finding in self.words["checks"][name]
        )


def quantity(results: Results, name: str, unit: str, values: Values) -> Quantity:
    """Return a row of the table of results."""
    return Quantity(name, unit, {c.label: spread(values(c)) for c in results.with_data})


def read_words(path: Path) -> PageWords:
    """Read the words of a file."""
    words = yaml.safe_load(path.read_text(encoding="utf-8"))
    return PageWords(words.pop("name"), words)


def read_paper(module: str) -> tuple[PageWords, Rules]:
    """Read the words and the rules that stand beside a module, given by its file."""
    folder = Path(module).parent
    return read_words(folder / "words.yaml"), read_rules(folder / "claims.yaml")


WORDS = read_words(Path(__file__).with_name("words.yaml"))  # of the pages that are no paper's
