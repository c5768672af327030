"""Families of conditions in a sweep, the quantities they are compared in, and their tests."""

from functools import partial
from typing import Any, NamedTuple

from evoexp.papers.curkovic import measures
from evoexp.report import kit
from evoexp.report.kit import markdown


class Family(NamedTuple):
    """Conditions that are compared with each other."""

    name: str  # of the first ones in the comparisons
    pairs: tuple[tuple[kit.ConditionResults, kit.ConditionResults], ...]  # (first, other)


class Measure(NamedTuple):
    """A quantity that conditions are compared in; lower is better."""

    name: str  # with unit where it has one
    values: kit.Values  # of a condition, (done,)
    # whether it says how fast or how far a method converges; else it is about the motions
    # found
    converges: bool = True


class FamilyComparison(NamedTuple):
    """A family compared in one quantity."""

    measure: Measure  # the quantity
    family: Family  # the conditions
    # one per pair that shares seeds, each named by its other condition; p-values are adjusted
    # over them
    rows: tuple[kit.Comparison, ...]


def families(results: kit.Results) -> tuple[Family, ...]:
    """Return the families of a sweep.

    Conditions that differ in collision substeps are compared with their twins; if there are none,
    all conditions with the first one that reads Eq. 9 as they do.
    """
    conditions = results.with_data
    fewest = min(_substeps(c) for c in conditions)
    finer = [c for c in conditions if _substeps(c) > fewest]
    if finer:
        firsts = {_without_substeps(c): c for c in reversed(conditions) if _substeps(c) == fewest}
        pairs = ((firsts.get(_without_substeps(c)), c) for c in finer)
        twins = tuple((first, c) for first, c in pairs if first is not None)
        return (Family("each method, tested at its configurations only,", twins),)
    found = []
    for reading in dict.fromkeys(c.planner.ga.mutation_direction for c in conditions):
        first, *others = (c for c in conditions if c.planner.ga.mutation_direction == reading)
        found.append(Family(first.label, tuple((first, other) for other in others)))
    return tuple(found)


def tested(
    results: kit.Results, settings: kit.ReportSettings, threshold: float
) -> tuple[FamilyComparison, ...]:
    """Return all comparisons of a sweep."""
    return tuple(
        FamilyComparison(one, family, kit.compared(family.pairs, one.values, settings))
        for one in _measures(results, threshold)
        for family in families(results)
    )


def curved(results: kit.Results) -> bool:
    """Return whether any motion is executed as a curve."""
    return any(c.planner.interpolation == "cubic" for c in results.with_data)


def _measures(results: kit.Results, threshold: float) -> tuple[Measure, ...]:
    to = f"to a team of cost ≤ {markdown.number(threshold)}"
    found = [
        Measure("best cost", kit.by_column("best_cost")),
        Measure(f"generations {to}", partial(measures.generations_to, threshold=threshold)),
        Measure(measures.CERTIFIED, measures.certified_cost),
    ]
    sizes = [
        tuple(c.planner.ga.population_size for c in pair)
        for family in families(results)
        for pair in family.pairs
    ]
    if any(one != other for one, other in sizes):
        found.append(
            Measure(f"evaluations {to}", partial(measures.evaluations_to, threshold=threshold))
        )
    if len({_substeps(c) for c in results.with_data}) > 1 or curved(results):
        found.append(
            Measure(f"solved motion {measures.REFUTED}", measures.refuted, converges=False)
        )
    return tuple(found)


def _substeps(condition: kit.ConditionResults) -> int:
    return int(condition.planner.collision.collision_substeps)


def _without_substeps(condition: kit.ConditionResults) -> str:
    planner: dict[str, Any] = condition.planner.canonical()
    return repr(planner | {"collision": planner["collision"] | {"collision_substeps": None}})
