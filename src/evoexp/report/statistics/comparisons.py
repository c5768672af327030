"""Compares conditions on their common seeds, pair by pair."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from evoexp.condition import Condition
from evoexp.records import FloatArray
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import ConditionResults, Results, wrapped
from evoexp.report.statistics.inference import (
    Effect,
    RankSum,
    SignedRank,
    effect,
    holm,
    quantile,
    rank_sum,
    signed_rank,
)

Values = Callable[[ConditionResults], FloatArray]
Pair = tuple[ConditionResults, ConditionResults]


class Comparison(NamedTuple):
    """One quantity of two conditions on their common seeds."""

    quantity: str  # its name, or that of the pair in a table of one quantity
    num_seeds: int  # replicates that both have
    median_difference: float  # of first minus second
    # Signed-rank test of the pairs; positive ranks are those of the first being better
    test: SignedRank
    # Its p-value by Holm over all quantities compared; equal to the plain one until `adjusted`
    p_adjusted: float
    unpaired: RankSum  # the same values tested as independent samples
    unpaired_adjusted: float  # its p-value by Holm, a family of its own
    better: Effect  # a12 of the first being better than the second

    def says(self, significance: float) -> int:
        """Return 1 if the first is significantly better, −1 if significantly worse, else 0.

        Significance and direction are those of one statistic, the signed ranks: A12 and medians may
        point the other way.
        """
        return self.test.direction if self.p_adjusted < significance else 0


class Measure(NamedTuple):
    """A quantity that conditions are compared in."""

    name: str
    values: Values  # of a condition, (done,)
    unit: str = "–"
    lower_is_better: bool = True


class Family(NamedTuple):
    """Conditions that are compared with each other."""

    name: str  # of the first ones of the pairs
    pairs: tuple[Pair, ...]  # (first, other)

    @classmethod
    def of(cls, conditions: Sequence[ConditionResults]) -> "Family":
        """Return the first of several conditions against each of the others."""
        first, *others = conditions
        return cls(first.label, tuple((first, other) for other in others))


class FamilyComparison(NamedTuple):
    """A family compared in one quantity."""

    measure: Measure
    family: Family
    rows: tuple[Comparison, ...]  # one per pair that shares seeds; p-values are adjusted over them


def compare_families(
    families: Iterable[Family], measures: Iterable[Measure], settings: ReportSettings
) -> tuple[FamilyComparison, ...]:
    """Compare every family in every quantity."""
    own = tuple(families)
    return tuple(
        FamilyComparison(
            measure,
            family,
            compared(
                family.pairs,
                measure.values,
                settings,
                lower_is_better=measure.lower_is_better,
            ),
        )
        for measure in measures
        for family in own
    )


def headed(found: Iterable[FamilyComparison]) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Return comparisons with their headings, as a page takes them; none without rows."""
    return tuple(
        (f"{one.measure.name}: {one.family.name} against …", one.rows) for one in found if one.rows
    )


def rows_by_name(found: Iterable[FamilyComparison]) -> dict[str, tuple[Comparison, ...]]:
    """Return the rows of all families together, by the name of their quantity."""
    rows: dict[str, tuple[Comparison, ...]] = {}
    for one in found:
        rows[one.measure.name] = rows.get(one.measure.name, ()) + one.rows
    return rows


def by_column(name: str) -> Values:
    """Return the function that reads this column of a condition's summaries."""
    return lambda condition: condition.column(name)


def compare(
    quantity: str,
    first: FloatArray,
    second: FloatArray,
    lower_is_better: bool,
    confidence: float,
    num_resamples: int,
) -> Comparison:
    """Compare a quantity of two conditions, (seeds,) each without NaN, seed by seed."""
    sign = -1.0 if lower_is_better else 1.0
    test, unpaired = signed_rank(sign * first, sign * second), rank_sum(first, second)
    better = effect(sign * first, sign * second, confidence, num_resamples)
    differences = np.zeros(len(first))  # two infinite costs do not differ
    np.subtract(first, second, out=differences, where=first != second)
    median = quantile(differences, 0.5)
    return Comparison(
        quantity, len(first), median, test, test.p_value, unpaired, unpaired.p_value, better
    )


def adjusted(comparisons: Iterable[Comparison]) -> list[Comparison]:
    """Return comparisons with p-values adjusted by Holm; either test is a family of its own."""
    rows = list(comparisons)
    paired = holm([row.test.p_value for row in rows])
    unpaired = holm([row.unpaired.p_value for row in rows])
    found = zip(rows, paired, unpaired, strict=True)
    return [row._replace(p_adjusted=p, unpaired_adjusted=q) for row, p, q in found]


def compared_with_controls(
    results: Results, settings: ReportSettings, compared: Sequence[tuple[str, bool, Values]]
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare every condition with its controls: those that wrap the same planner.

    Args:
        settings: Levels and resamples.
        compared: (quantity, whether lower is better, its values).

    Returns:
        (heading, one comparison per quantity), p-values adjusted over the quantities.
    """
    found = (
        (f"{first.label} against {second.label}", _common(first, second, compared, settings))
        for first in results.evolved
        for second in results.evolved
        if not first.is_control and second.is_control and beside(first.condition, second.condition)
    )
    return tuple((heading, tuple(adjusted(rows))) for heading, rows in found if rows)


def beside(first: Condition, control: Condition) -> bool:
    """Return whether a control wraps this very planner in the same scene, with its seeds."""
    return control._replace(planner=wrapped(control.planner)) == first


def compared(
    pairs: Iterable[Pair],
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
    rows = (
        row
        for a, b in pairs
        for row in _common(a, b, [(named(a, b), lower_is_better, values)], settings)
    )
    return tuple(adjusted(rows))


def _common(
    first: ConditionResults,
    second: ConditionResults,
    quantities: Sequence[tuple[str, bool, Values]],
    settings: ReportSettings,
) -> list[Comparison]:
    """Compare quantities over the replicates that both have; none where they share no replicate."""
    common = first.summaries.index.intersection(second.summaries.index)
    found = []
    for name, lower_is_better, values in quantities:
        x = values(first)[first.summaries.index.get_indexer(common)]
        y = values(second)[second.summaries.index.get_indexer(common)]
        known = ~(np.isnan(x) | np.isnan(y))
        if known.any():
            levels = settings.confidence, settings.num_resamples
            found.append(compare(name, x[known], y[known], lower_is_better, *levels))
    return found
