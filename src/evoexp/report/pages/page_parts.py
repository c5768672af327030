"""The parts of a page: as papers give them, and as texts before they are Markdown, HTML or LaTeX.

Texts are plain but for one mark: `words between grave accents` are code.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison, Values
from evoexp.report.statistics.inference import Spread, spread

if TYPE_CHECKING:  # loaded only where something is drawn
    from matplotlib.figure import Figure


class PlayedRun(NamedTuple):
    """A replicate whose motion a figure shows: the page plays it beside the figure."""

    condition: ConditionResults
    replicate: int

    @property
    def key(self) -> tuple[str, int]:
        """Full hash of the condition, and the replicate."""
        return self.condition.condition.id, self.replicate


class Drawing(NamedTuple):
    """One figure: from results to its table, from its table to a picture."""

    stem: str  # of its files
    title: str  # heading; names the paper's figure
    caption: str  # the statement of the paper, and our finding
    table: Callable[[], pd.DataFrame]  # gives the data
    draw: "Callable[[pd.DataFrame], Figure]"  # draws the data
    conditions: tuple[ConditionResults, ...]  # whose results it shows
    plays: tuple[PlayedRun, ...] = ()  # runs whose motions it shows
    columns: str = ""  # description of the table's columns


class Quantity(NamedTuple):
    """A row of the table of results: median and quartiles of a quantity, per condition."""

    name: str
    unit: str
    spreads: dict[str, Spread]  # by label


def quantity(results: Results, name: str, unit: str, values: Values) -> Quantity:
    """Return a row of the table of results."""
    return Quantity(name, unit, {c.label: spread(values(c)) for c in results.with_data})


class Table(NamedTuple):
    """A table, which is a section of a page."""

    heading: str  # above it
    headers: tuple[str, ...]  # of its columns
    rows: tuple[tuple[object, ...], ...]  # their cells: texts, numbers, verdicts
    note: str = ""  # below it
    file: str = ""  # name of the file that holds it as LaTeX; empty: there is none


class Verdict(NamedTuple):
    """A cell of a table that holds the verdict on a claim."""

    text: str  # such as "reproduced", or "not judged (budget smoke)"
    number: str = ""  # that decides it, with its name; empty: there is none
    is_ours: bool = False  # whether the claim is a question of ours, no sentence of the paper
    rule: str = ""  # name of the claim's rule

    def __str__(self) -> str:
        """Return the verdict as Markdown."""
        return f"**{self.text}**"


class EffectSize(NamedTuple):
    """The number that decides a claim, with its interval."""

    name: str  # "A12", "share of runs"
    value: float
    low: float
    high: float
    neutral: float  # where neither answer is favoured; of a claim about every run: all of them
    equal: float = 0.0  # the smallest difference from `neutral` that matters; 0: any does

    @property
    def is_negligible(self) -> bool:
        """Whether the whole interval is nearer to `neutral` than any difference that matters."""
        return self.neutral - self.equal <= self.low and self.high <= self.neutral + self.equal

    def __str__(self) -> str:
        """Return the number with its interval in words: "A12 0.812 [0.771, 0.847]"."""
        return f"{self.name} {self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"


class Claim(NamedTuple):
    """A claim of a paper with our evidence and verdict."""

    text: str  # the claim in our words
    source: str  # where the paper makes it
    evidence: str  # the numbers
    verdict: str  # one of the words of `judging`
    name: str = ""  # of the claim among the paper's
    rule: str = ""  # when it is reproduced, and when contradicted
    n: str = ""  # runs, pairs of runs, or whatever was counted
    size: EffectSize | None = None  # the number that decides, where the rule has one


class Page(NamedTuple):
    """A report before it is written."""

    title: str  # heading
    introduction: str  # one paragraph
    quantities: tuple[Quantity, ...] = ()  # the table of results
    claims: tuple[Claim, ...] = ()  # with verdicts; empty where there is no paper to judge
    # (title, finding): known defects and checks of the scene, shown at every budget
    checks: tuple[tuple[str, str], ...] = ()
    # Of conditions, by heading
    comparisons: tuple[tuple[str, tuple[Comparison, ...]], ...] = ()
    drawings: tuple[Drawing, ...] = ()  # the figures
    tables: tuple[Table, ...] = ()  # of its own, shown behind the table of results


class Player(NamedTuple):
    """A page that plays a motion in any browser, offline; `evoexp view` writes the same."""

    title: str
    file: str  # its name
    content: bytes = b""  # HTML


class Document(NamedTuple):
    """The whole text of a page."""

    title: str  # heading
    command: str  # that makes it
    experiment: str  # name of the experiment; empty for runs given by their hashes
    budget: str  # name of the budget; empty for runs given by their hashes
    notices: tuple[tuple[str, str], ...]  # (title, text): remarks on the results as a whole
    introduction: str  # one paragraph
    results: tuple[Table, ...]  # tables above the figures, without empty ones
    figures: tuple[Drawing, ...]
    appendix: tuple[Table, ...]  # tables below the figures
    runs: tuple[ConditionResults, ...]  # that it shows
    provenance: str = ""  # the sentence that tells them: how many, of which seeds and hashes
    formats: tuple[str, ...] = ()  # kinds of the figures' pictures
    players: Mapping[tuple[str, int], Player] = {}  # by the keys of the runs that figures play

    @property
    def origin(self) -> str:
        """The sentence that names command, experiment and budget."""
        named = {"experiment": self.experiment, "budget": self.budget}
        words = [f"{kind} `{name}`" for kind, name in named.items() if name]
        return ", ".join([f"Made by `{self.command}`", *words]) + "."

    def rows_below(self, heading: str) -> tuple[tuple[object, ...], ...]:
        """Return the rows of the table of a heading; none if there is no such table."""
        tables = (*self.results, *self.appendix)
        return next((table.rows for table in tables if table.heading == heading), ())

    def picture(self, figure: Drawing, *preferred: str) -> str:
        """Return the name of a figure's first picture of these kinds; empty if there is none."""
        return next((f"{figure.stem}.{kind}" for kind in preferred if kind in self.formats), "")
