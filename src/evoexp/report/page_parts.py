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
    """One figure: from results to its table, from its table to a picture.

    Attributes:
        stem: Of its files.
        title: Heading; names the paper's figure.
        caption: The statement of the paper, and our finding.
        table: Gives the data.
        draw: Draws the data.
        conditions: Whose results it shows.
        plays: Runs whose motions it shows.
    """

    stem: str
    title: str
    caption: str
    table: Callable[[], pd.DataFrame]
    draw: "Callable[[pd.DataFrame], Figure]"
    conditions: tuple[ConditionResults, ...]
    plays: tuple[PlayedRun, ...] = ()


class Quantity(NamedTuple):
    """A row of the table of results: median and quartiles of a quantity, per condition."""

    name: str
    unit: str
    spreads: dict[str, Spread]  # by label


class Table(NamedTuple):
    """A table of a page's own.

    Attributes:
        heading: Above it.
        headers: Of its columns.
        rows: Their cells, as text or numbers.
        note: Below it.
    """

    heading: str
    headers: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]
    note: str = ""


class Page(NamedTuple):
    """A report before it is written.

    Attributes:
        title: Heading.
        introduction: One paragraph.
        quantities: The table of results.
        claims: With verdicts; empty where there is no paper to judge.
        checks: (title, finding): known defects and checks of the scene, shown at every budget.
        comparisons: Of conditions on common seeds, by heading.
        drawings: The figures.
        tables: Of its own, shown behind the table of results.
    """

    title: str
    introduction: str
    quantities: tuple[Quantity, ...] = ()
    claims: tuple[Claim, ...] = ()
    checks: tuple[tuple[str, str], ...] = ()
    comparisons: tuple[tuple[str, tuple[Comparison, ...]], ...] = ()
    drawings: tuple[Drawing, ...] = ()
    tables: tuple[Table, ...] = ()
