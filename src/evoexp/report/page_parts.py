"""The parts of a page, before it is written."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from evoexp.report.results import ConditionResults
from evoexp.report.statistics import Spread
from evoexp.report.verdicts import Claim, Comparison

if TYPE_CHECKING:  # loaded only where something is drawn
    from matplotlib.figure import Figure


class PlayedRun(NamedTuple):
    """A replicate whose motion a figure shows: the page plays it beside the figure."""

    condition: ConditionResults
    replicate: int


class Drawing(NamedTuple):
    """One figure: from results to its table, from its table to a picture."""

    stem: str  # of its files
    title: str  # heading; names the paper's figure
    caption: str  # the statement of the paper, and our finding
    table: Callable[[], pd.DataFrame]  # gives the data
    draw: "Callable[[pd.DataFrame], Figure]"  # draws the data
    conditions: tuple[ConditionResults, ...]  # whose results it shows
    plays: tuple[PlayedRun, ...] = ()  # runs whose motions it shows


class Quantity(NamedTuple):
    """A row of the table of results: median and quartiles of a quantity, per condition."""

    name: str
    unit: str
    spreads: dict[str, Spread]  # by label


class Table(NamedTuple):
    """A table of a page's own."""

    heading: str  # above it
    headers: tuple[str, ...]  # of its columns
    rows: tuple[tuple[object, ...], ...]  # their cells, as text or numbers
    note: str = ""  # below it


class Page(NamedTuple):
    """A report before it is written."""

    title: str  # heading
    introduction: str  # one paragraph
    quantities: tuple[Quantity, ...] = ()  # the table of results
    claims: tuple[Claim, ...] = ()  # with verdicts; empty where there is no paper to judge
    # (title, finding): known defects and checks of the scene, shown at every budget
    checks: tuple[tuple[str, str], ...] = ()
    # Of conditions on common seeds, by heading
    comparisons: tuple[tuple[str, tuple[Comparison, ...]], ...] = ()
    drawings: tuple[Drawing, ...] = ()  # the figures
    tables: tuple[Table, ...] = ()  # of its own, shown behind the table of results
