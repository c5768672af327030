"""The parts of a page: as papers give them, and as texts before they are Markdown, HTML or LaTeX.

Texts are plain but for one mark: `words between grave accents` are code.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Comparison, Values
from evoexp.report.statistics.inference import Spread, spread

if TYPE_CHECKING:  # loaded only where something is drawn
    from matplotlib.figure import Figure

MOST_NAMED = 4  # runs whose hashes a caption spells out


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
    """A table, which is a section of a page by itself."""

    heading: str  # above it
    headers: tuple[str, ...]  # of its columns
    rows: tuple[tuple[object, ...], ...]  # their cells: texts, numbers, verdicts
    note: str = ""  # below it
    file: str = ""  # name of the file that holds it as LaTeX; empty: there is none


class Verdict(NamedTuple):
    """A cell of a table that holds the verdict on a claim."""

    text: str  # such as "reproduced", or "not judged (budget smoke)"

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


class FigureText(NamedTuple):
    """A figure as text."""

    stem: str  # of its files
    title: str  # heading
    caption: str  # below it
    formats: tuple[str, ...]  # kinds of its pictures
    motions: tuple[Player, ...] = ()  # pages that play the motions that it shows

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """(kind, name) of every file: pictures, data rows, sidecar."""
        return tuple((kind, f"{self.stem}.{kind}") for kind in (*self.formats, "csv", "json"))

    def picture(self, *preferred: str) -> str:
        """Return the name of the first picture there is of these kinds; empty if there is none."""
        return next((f"{self.stem}.{kind}" for kind in preferred if kind in self.formats), "")


class Figures(NamedTuple):
    """The section of all figures."""

    figures: tuple[FigureText, ...]
    heading: str = "Figures"


class RunText(NamedTuple):
    """A stored run that the page shows."""

    label: str  # of the condition
    condition_id: str  # full hash, 64 hex digits
    done: int  # finished replicates
    failed: int  # failed replicates
    is_reference: bool  # whether it is a reference, which has no motion to view
    # Of every finished or failed replicate, in order: its index; the address of its log, or of the
    # file that tells why it failed; best cost and exact verdict, or "failed"
    logs: tuple[tuple[int, str, str], ...] = ()

    @property
    def hash12(self) -> str:
        """The twelve hex digits that name the run."""
        return self.condition_id[:12]


class Document(NamedTuple):
    """The whole text of a page."""

    title: str  # heading
    command: str  # that makes it
    experiment: str  # name of the experiment; empty for runs given by their hashes
    budget: str  # name of the budget; empty for runs given by their hashes
    notices: tuple[tuple[str, str], ...]  # (title, text): remarks on the results as a whole
    introduction: str  # one paragraph
    sections: tuple[Table | Figures, ...]  # without empty ones
    runs: tuple[RunText, ...]  # those that it shows
    provenance: str = ""  # the sentence that tells them: how many, of which seeds and hashes

    @property
    def origin(self) -> str:
        """The sentence that names command, experiment and budget."""
        named = {"experiment": self.experiment, "budget": self.budget}
        words = [f"{kind} `{name}`" for kind, name in named.items() if name]
        return ", ".join([f"Made by `{self.command}`", *words]) + "."

    @property
    def tables(self) -> tuple[Table, ...]:
        """Its tables, in order."""
        return tuple(each for each in self.sections if isinstance(each, Table))

    def rows_below(self, heading: str) -> tuple[tuple[object, ...], ...]:
        """Return the rows of the table of a heading; none if there is no such table."""
        return next((table.rows for table in self.tables if table.heading == heading), ())


def provenance(runs: Sequence[tuple[str, int]], seeds: Sequence[int]) -> str:
    """Return the sentence that tells whose runs something shows; empty without any."""
    # `runs` are (hash, finished replicates) of every condition
    counts = sorted({done for _, done in runs})
    if not counts:
        return ""
    number = str(counts[0]) if len(counts) == 1 else f"{counts[0]}–{counts[-1]}"
    each = " of each condition" if len(runs) > 1 else ""
    seed = f"seed{'s' * (len(seeds) > 1)} {', '.join(map(str, seeds))}"
    names = dict.fromkeys(name for name, _ in runs)
    shown = ", ".join(f"`{name}`" for name in list(names)[:MOST_NAMED])
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"n = {number}{each}, {seed}; run{'s' * (len(names) > 1)} {shown}{more}."
