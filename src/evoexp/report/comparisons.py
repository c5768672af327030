"""Compares conditions on their common seeds, pair by pair."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from evoexp.condition import Condition
from evoexp.records import FloatArray
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results, wrapped
from evoexp.report.verdicts import Comparison, adjusted, compare

Values = Callable[[ConditionResults], FloatArray]


def by_column(name: str) -> Values:
    """Return the function that reads this column of a condition's summaries."""
    return lambda condition: condition.column(name)


def compared_with_controls(
    results: Results, settings: ReportSettings, compared: Sequence[tuple[str, bool, Values]]
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare every condition with its controls: those that wrap the same planner.

    Args:
        results: Of the experiment.
        settings: Levels and resamples.
        compared: (quantity, whether lower is better, its values).

    Returns:
        (heading, one comparison per quantity), p-values adjusted over the quantities.
    """
    found = []
    for first in results.evolved:
        for second in results.evolved:
            if (
                first.is_control
                or not second.is_control
                or not beside(first.condition, second.condition)
            ):
                continue
            rows = [compare_on_common_seeds(first, second, *what, settings) for what in compared]
            kept = [row for row in rows if row is not None]
            if kept:
                found.append((f"{first.label} against {second.label}", tuple(adjusted(kept))))
    return tuple(found)


def beside(first: Condition, control: Condition) -> bool:
    """Return whether a control wraps this very planner in the same scene, with its seeds."""
    return control._replace(planner=wrapped(control.planner)) == first


def compared(
    pairs: Iterable[tuple[ConditionResults, ConditionResults]],
    values: Values,
    settings: ReportSettings,
    *,
    lower_is_better: bool = True,
    named: Callable[[ConditionResults, ConditionResults], str] = lambda first, second: second.label,
) -> tuple[Comparison, ...]:
    """Compare pairs of conditions in one quantity on their common seeds.

    Args:
        pairs: (first, second); pairs without a common seed are left out.
        values: The quantity of a condition, (done,).
        settings: Levels and resamples.
        lower_is_better: Which of two values is better.
        named: Gives the name of a pair's row; by default the label of the second condition.

    Returns:
        One comparison per pair, p-values adjusted over the pairs.
    """
    rows = [
        compare_on_common_seeds(a, b, named(a, b), lower_is_better, values, settings)
        for a, b in pairs
    ]
    return tuple(adjusted([row for row in rows if row is not None]))


def compare_on_common_seeds(
    first: ConditionResults,
    second: ConditionResults,
    quantity: str,
    lower_is_better: bool,
    values: Values,
    settings: ReportSettings,
) -> Comparison | None:
    """Compare a quantity over the replicates that both have; None if they share no replicate."""
    common = first.summaries.index.intersection(second.summaries.index)
    x = values(first)[first.summaries.index.get_indexer(common)]
    y = values(second)[second.summaries.index.get_indexer(common)]
    known = ~(np.isnan(x) | np.isnan(y))
    if not known.any():
        return None
    return compare(
        quantity, x[known], y[known], lower_is_better, settings.confidence, settings.num_resamples
    )
