"""Checks of the cross-over: its two readings, and how often its distance keeps pairs apart."""

from collections.abc import Sequence

import numpy as np

from evoexp.papers.rana import motions
from evoexp.planners.via_point_ga.planner import ViaPointGa
from evoexp.records import FloatArray, generations
from evoexp.report.kit import Comparison, ConditionResults, Results, markdown

GENERATIONS = (0, 10, 50)  # whose pairs of strings are looked at
PAIRS = 2000  # drawn of each generation


def checks(
    results: Results, costs: Sequence[Comparison], evenness: Sequence[Comparison]
) -> list[tuple[str, str]]:
    """Return the checks of an experiment whose conditions change the cross-over."""
    first, *others = results.with_data
    if not isinstance(first.planner, ViaPointGa) or first.is_control:
        return []
    found = [
        (
            '"Double cross-over" of the string p : q can be read in two ways: both tails are '
            f"exchanged ({first.label}), or the segment between both sites ({other.label})",
            _difference(other, {"best cost": costs, "unevenness C3 + C4": evenness}),
        )
        for other in others
        if _changed(first, other, "crossover_reading")
    ]
    distances = [c for c in others if _changed(first, c, "crossover_distance")]
    if not distances:
        return found
    told = "; ".join(f"{c.label}: {_difference(c, {'best cost': costs})}" for c in distances)
    apart = ", ".join(
        f"{100 * share:.1f} % in generation {generation}"
        for generation, share in kept_apart(first).items()
    )
    limit = f"{first.planner.crossover_distance:g}°"
    return [
        *found,
        (
            f"Pairs of strings that cross_over_distance = {limit} keeps from being crossed at "
            "random sites (first replicate, pairs drawn uniformly)",
            apart,
        ),
        (f"Other distances than {limit}: is there a difference?", told),
    ]


def kept_apart(condition: ConditionResults) -> dict[int, float]:
    """Return the share of pairs that are too far apart to be crossed, by generation.

    The first replicate is run again for some generations; sites and pairs are drawn at random.
    """
    planner, problem = condition.planner, motions.problem(condition)
    draw = np.random.Generator(np.random.PCG64(0))
    found = {}
    for generation in generations(planner.evolve(problem, condition.condition.rng(0))):
        if generation.index in GENERATIONS:
            strings = generation.population[:, :, : planner.ga.population_size]
            found[generation.index] = _share_apart(
                strings, problem.arm_slices, planner.crossover_distance, draw
            )
        if generation.index >= max(GENERATIONS):
            break
    return found


def _share_apart(
    strings: FloatArray, arm_slices: np.ndarray, distance: float, rng: np.random.Generator
) -> float:
    """Return the share of pairs that are too far apart at the site of an arm at least.

    Args:
        strings: (nq, N + 1, individuals) [deg].
        arm_slices: (arms, 2) rows of each arm.
        distance: Below it they are crossed [deg].
        rng: Of pairs and sites.
    """
    num_points, individuals = strings.shape[1:]
    if num_points < 3 or individuals < 2:
        return 0.0
    one = rng.integers(individuals, size=PAIRS)
    two = (one + rng.integers(1, individuals, size=PAIRS)) % individuals
    apart = np.zeros(PAIRS, dtype=bool)
    for first, stop in arm_slices:
        site = rng.integers(1, num_points - 1, size=PAIRS)  # 1 … N − 1
        gap = strings[first:stop, site, one] - strings[first:stop, site, two]
        apart |= np.linalg.norm(gap, axis=0) >= distance
    return float(np.mean(apart))


def _difference(other: ConditionResults, tables: dict[str, Sequence[Comparison]]) -> str:
    """Return the differences of the first condition from another one in words."""
    told = [
        f"{name} differs by {markdown.number(row.median_difference)} in the median of pairs, "
        f"p = {markdown.p_value(row.test.p_value)}"
        for name, rows in tables.items()
        for row in rows
        if row.quantity == other.label
    ]
    return "; ".join(told) or "nothing to compare"


def _changed(first: ConditionResults, other: ConditionResults, name: str) -> bool:
    """Return whether this setting, and no other, differs from the first condition's."""
    if other.is_control or not isinstance(other.planner, ViaPointGa):
        return False
    value = getattr(first.planner, name)
    same = bool(other.planner.model_copy(update={name: value}) == first.planner)
    return same and bool(getattr(other.planner, name) != value)
