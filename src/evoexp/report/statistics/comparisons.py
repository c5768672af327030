"""Compares conditions, pair by pair: their runs are independent samples."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.condition import Condition
from evoexp.records import FloatArray
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import ConditionResults, Results, wrapped
from evoexp.report.statistics.inference import Effect, effect, holm, quantile, runs_for_effect

Values = Callable[[ConditionResults], FloatArray]  # a measure: a number per run, (done,)
Pair = tuple[ConditionResults, ConditionResults]


AGAINST = "{0.label} against {1.label}".format  # the name of a pair


class Comparison(NamedTuple):
    """One quantity of the runs of two conditions."""

    quantity: str  # its name, or that of the pair in a table of one quantity
    sizes: tuple[int, int]  # runs of the first, and of the second, that have the quantity
    median_difference: float  # the first's median minus the second's
    better: Effect  # a12 of the first being better than the second
    # of `better`, by Holm over all that are compared; before `adjusted` it is the plain p-value
    p_adjusted: float

    @property
    def num_runs(self) -> str:
        """In words: "20", or "20 and 18"."""
        return " and ".join(map(str, dict.fromkeys(self.sizes)))

    def says(self, significance: float) -> int:
        """Return 1 if the first is significantly better, −1 if significantly worse, else 0."""
        return self.better.direction if self.p_adjusted < significance else 0

    def runs_to_decide(self, significance: float) -> float:
        """Return how many runs of each would decide it if A12 stays: more than there are."""
        level = significance * (self.better.p_value / self.p_adjusted if self.p_adjusted else 1.0)
        return max(max(self.sizes) + 1.0, runs_for_effect(self.better.a12, level))


class Measure(NamedTuple):
    """A quantity that conditions are compared in."""

    name: str
    values: Values  # of a condition, (done,)
    unit: str = "–"
    lower_is_better: bool = True

    def compared(
        self, pairs: Iterable[Pair], settings: ReportSettings, **named: Any
    ) -> tuple[Comparison, ...]:
        """Compare pairs of conditions in this quantity, see `compared`."""
        lower = self.lower_is_better
        return compared(pairs, self.values, settings, lower_is_better=lower, **named)


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
    rows: tuple[Comparison, ...]  # one per pair; p-values are adjusted over them


def compare_families(
    families: Iterable[Family], measures: Iterable[Measure], settings: ReportSettings
) -> tuple[FamilyComparison, ...]:
    """Compare every family in every quantity."""
    return tuple(
        FamilyComparison(measure, family, measure.compared(family.pairs, settings))
        for measure, family in itertools.product(measures, tuple(families))
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
    quantity: str, first: FloatArray, second: FloatArray, lower_is_better: bool, confidence: float
) -> Comparison:
    """Compare a quantity of two conditions, (n,) and (m,) without NaN."""
    sign = -1.0 if lower_is_better else 1.0
    better = effect(sign * first, sign * second, confidence)
    one, two = quantile(first, 0.5), quantile(second, 0.5)
    difference = 0.0 if one == two else one - two  # both may be infinite
    sizes = len(first), len(second)
    return Comparison(quantity, sizes, difference, better, better.p_value)


def adjusted(comparisons: Iterable[Comparison]) -> list[Comparison]:
    """Return comparisons with p-values adjusted by Holm over all of them."""
    rows = list(comparisons)
    p_values = holm([row.better.p_value for row in rows])
    return [row._replace(p_adjusted=p) for row, p in zip(rows, p_values, strict=True)]


def compared_with_controls(
    results: Results, settings: ReportSettings, measures: Sequence[Measure]
) -> Iterator[tuple[str, tuple[Comparison, ...]]]:
    """Yield (heading, a comparison per quantity) of every condition with each of its controls."""
    for first, second in itertools.product(results.evolved, repeat=2):
        is_pair = not first.is_control and second.is_control
        if is_pair and beside(first.condition, second.condition):
            rows = [
                row._replace(quantity=each.name)
                for each in measures
                for row in each.compared([(first, second)], settings)
            ]
            if rows:
                yield AGAINST(first, second), tuple(adjusted(rows))


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
    """Compare pairs of conditions in one quantity, p-values adjusted over the pairs.

    Pairs without runs of both are left out. `named` gives the name of a pair's row.
    """
    rows = []
    for pair in pairs:
        x, y = (own[~np.isnan(own)] for own in map(values, pair))
        if len(x) and len(y):
            rows.append(compare(named(*pair), x, y, lower_is_better, settings.confidence))
    return tuple(adjusted(rows))
