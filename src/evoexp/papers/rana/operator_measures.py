"""Effects of the operators of Rana & Zalzala 1995 on strings that nothing has selected."""

from collections.abc import Callable
from typing import Any

import numpy as np

from evoexp.planners.via_point_ga.strings import Problem
from evoexp.records import BoolArray, FloatArray
from evoexp.report.results import motion_geometry
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import Proportion

FRESH = 1000  # strings
UNEVEN, EVEN = 2.0, 1.05  # ratios of the longest step of a path to its shortest one (ours)


def fresh(condition: ConditionResults, *, redistributed: bool) -> FloatArray:
    """Return new random walks (section 3.3), not relaxed, (nq, N + 1, `FRESH`) [deg]."""
    settings = {"redistribution": redistributed, "relaxation_step": 0.0}
    planner = condition.planner.model_copy(update=settings)
    rng = np.random.Generator(np.random.PCG64(0))
    return np.asarray(planner.sample(condition.problem(Problem), rng, FRESH))


def steps(condition: ConditionResults, q: FloatArray) -> list[FloatArray]:
    """Return the lengths of each arm's steps between via-points of q, (nq, N + 1, …) [deg]."""
    arms = condition.problem(Problem).arm_slices
    return [np.linalg.norm(np.diff(q[first:stop], axis=1), axis=0) for first, stop in arms]


def _unequal(condition: ConditionResults, strings: FloatArray, ratio: float) -> np.ndarray:
    """Return whether the steps of a path differ by more than a ratio, (arms, strings)."""
    return np.array([s.max(axis=0) > ratio * s.min(axis=0) for s in steps(condition, strings)])


def shortened(condition: ConditionResults) -> Proportion:
    """Count the fresh strings, redistributed, that one relaxation makes shorter."""
    strings = fresh(condition, redistributed=True)
    relaxing = condition.planner.model_copy(update={"redistribution": False})
    rng = np.random.Generator(np.random.PCG64(0))  # the operator draws nothing
    relaxed = relaxing.improve(condition.problem(Problem), strings, rng)
    before, after = (sum(s.sum(axis=0) for s in steps(condition, q)) for q in (strings, relaxed))
    return counted(np.less(after, before))


def crossed_jumps(condition: ConditionResults) -> Proportion:
    """Count the paths that cross-over leaves with a jump, of pairs of fresh redistributed strings.

    A child takes its path from another parent from a site on (section 3.4 b), as far as both are
    close there. A jump is a step into the site of more than `UNEVEN` mean steps of the child.
    """
    problem = condition.problem(Problem)
    strings = fresh(condition, redistributed=True)
    num_points, rng = strings.shape[1], np.random.Generator(np.random.PCG64(0))
    one, two = rng.permutation(FRESH).reshape(2, -1)
    crossed, jumps = np.ones(len(one), dtype=bool), []
    for first, stop in problem.arm_slices:
        own = strings[first:stop]
        site = rng.integers(1, num_points - 1, size=len(one))  # 1 … N − 1
        gap = np.linalg.norm(own[:, site, one] - own[:, site, two], axis=0)
        crossed &= gap < condition.planner.crossover_distance
        from_mate = np.arange(num_points)[:, None] >= site
        child = np.where(from_mate, own[:, :, two], own[:, :, one])
        step = np.linalg.norm(np.diff(child, axis=1), axis=0)
        jumps.append(step[site - 1, np.arange(len(site))] > UNEVEN * step.mean(axis=0))
    return counted(np.array(jumps)[:, crossed].ravel())


def falls(condition: ConditionResults, prefix: str) -> BoolArray:
    """Return whether terms with a prefix, summed, fell in each run or are 0 at its end, (done,).

    The best string of the last generation beside that of the first one.
    """
    found = []
    for replicate, solution in condition.solutions.items():
        first, last = (
            sum(value for name, value in condition.evaluate(q).items() if name.startswith(prefix))
            for q in (condition.first_solution(replicate), solution)
        )
        found.append(last < first or last == 0.0)
    return np.array(found)


def speed_variation(condition: ConditionResults) -> FloatArray:
    """Return how much joint speed varies along each run's best motion, (done,) [-].

    Standard deviation over mean of an arm's speed from via-point to via-point, which it passes in
    equal times; the mean of all arms.
    """
    found = []
    for solution in condition.solutions.values():
        speeds = steps(condition, motion_geometry.configurations(condition.prepared, solution))
        found.append(np.mean([speed.std() / speed.mean() for speed in speeds]))
    return np.array(found)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # k1 / k2: how many times the weight of unevenness that of the length is
    "length_over_unevenness": lambda condition: (
        condition.planner.objective.length_weight / condition.planner.objective.unevenness_weight
    ),
    # paths of fresh walks whose steps are uneven, and of redistributed ones whose steps are even
    "uneven_walks": lambda condition: counted(
        _unequal(condition, fresh(condition, redistributed=False), UNEVEN).ravel()
    ),
    "even_paths": lambda condition: counted(
        ~_unequal(condition, fresh(condition, redistributed=True), EVEN).ravel()
    ),
    # runs in which a criterion of the best string fell, or is 0 at the end
    "shorter": lambda condition: falls(condition, "length_arm_"),
    "evener": lambda condition: falls(condition, "unevenness_arm_"),
    "fewer_collisions": lambda condition: falls(condition, "collisions"),
    # motions whose bodies never come closer than the safety distance, exactly
    "with_margin": lambda condition: Proportion(
        condition.verdicts.with_margin, condition.verdicts.judged
    ),
}
