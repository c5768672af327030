"""The figures that all sweeps share: values, effect sizes and shares of conditions side by side."""

from collections.abc import Mapping, Sequence

import numpy as np

from evoexp.report.figures import effects, shares
from evoexp.report.pages.page_parts import Drawing
from evoexp.report.pages.page_words import WORDS
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import Comparison, Values
from evoexp.report.statistics.inference import Proportion

CENSORED = (
    ' A run that never gets there counts as infinite ("never"), so that boxes are of all runs; '
    "beside: runs that get there, of all."
)


def values_drawing(results: Results, values: Mapping[str, Values]) -> Drawing:
    """Return the figure of quantities, one panel each: boxes of all conditions.

    Args:
        results: Whose conditions are drawn.
        values: Name with unit → its values of a condition, (done,); inf: never.
    """
    shown = results.with_data
    never = any(np.isposinf(of(c)).any() for of in values.values() for c in shown)
    censored = CENSORED if never else ""
    return WORDS.drawing("values", effects.VALUES, shown, results, values, censored=censored)


def effects_drawings(
    results: Results,
    settings: ReportSettings,
    rows: Mapping[str, Sequence[Comparison]],
    first: str,
    better: str = "the first condition is better than the other one",
) -> tuple[Drawing, ...]:
    """Return the figure of effect sizes: a first condition against each of the others.

    There is none where nothing can be compared: a sweep has only begun.

    Args:
        results: Whose conditions are drawn.
        settings: Significance.
        rows: Name of a quantity → its comparisons.
        first: Name of the first condition, or of the first ones.
        better: What A12 is the share of.
    """
    if not any(rows.values()):
        return ()
    given = results.with_data, rows, settings.significance
    return (WORDS.drawing("effects", effects.EFFECTS, *given, first=first, better=better),)


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
        caption: Of the figure.
        printed: Quantity → the share that a paper prints for it.
    """
    given = results.with_data, rows, printed or {}, settings.confidence
    return WORDS.drawing("shares", shares.SHARES, *given, caption=caption)
