"""The figures that all sweeps share: values, effect sizes and shares of conditions side by side."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from evoexp.report.comparisons import Comparison
from evoexp.report.figures import effects, shares
from evoexp.report.figures.effects import Values
from evoexp.report.page_parts import Drawing
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import Results
from evoexp.report.statistics import Proportion

WHISKERS = "whiskers to the last value within 1.5 interquartile ranges"
CENSORED = (
    'A run that never gets there counts as infinite ("never"), so that boxes are of all runs; '
    "beside: runs that get there, of all."
)
BOXES = (
    f"Boxes: median and quartiles, {WHISKERS}; points: every replicate, or those beyond where "
    "there are many; dashed: median of the first condition."
)
A12 = "Vargha and Delaney's A12 with its bootstrap interval: the share of pairs of runs in which"
BETTER = "the first condition is better than the other one; dashed: no difference."


def values_drawing(results: Results, values: Mapping[str, Values], caption: str = BOXES) -> Drawing:
    """Return the figure of quantities, one panel each: boxes of all conditions.

    Args:
        results: Whose conditions are drawn.
        values: Name with unit → its values of a condition, (done,); inf: never.
        caption: Of the figure; where a run never gets there, it goes on to say how that is drawn.
    """
    table = partial(effects.values_table, results, values)
    shown = results.with_data
    if any(np.isposinf(of(c)).any() for of in values.values() for c in shown):
        caption = f"{caption} {CENSORED}"
    return Drawing("values", "Every condition", caption, table, effects.draw_values, shown)


def effects_drawings(
    results: Results,
    settings: ReportSettings,
    rows: Mapping[str, Sequence[Comparison]],
    first: str,
    caption: str = f"{A12} {BETTER}",
) -> tuple[Drawing, ...]:
    """Return the figure of effect sizes: a first condition against each of the others.

    There is none where nothing can be compared: a sweep has only begun.

    Args:
        results: Whose conditions are drawn.
        settings: Significance.
        rows: Name of a quantity → its comparisons.
        first: Name of the first condition, or of the first ones.
    """
    if not any(rows.values()):
        return ()
    table = partial(effects.effects_table, rows, settings.significance)
    title, shown = f"How often {first} is better", results.with_data
    return (Drawing("effects", title, caption, table, effects.draw_effects, shown),)


def shares_drawing(
    results: Results,
    settings: ReportSettings,
    rows: Sequence[tuple[str, int, str, Proportion]],
    caption: str,
    printed: Mapping[str, float] | None = None,
) -> Drawing:
    """Return the figure of shares of runs, one panel per quantity.

    Args:
        results: Whose conditions are drawn.
        settings: Level of the intervals.
        rows: (quantity, position, condition, how many).
        printed: Quantity → the share that a paper prints for it.
    """
    table = partial(shares.shares_table, rows, printed or {}, settings.confidence)
    shown = results.with_data
    return Drawing("shares", "Shares of runs", caption, table, shares.draw_shares, shown)
