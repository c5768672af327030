"""Planners ranked over problems: the problem is the unit, and seeds are its repetitions.

Runs of one problem are no independent evidence that a planner is good elsewhere, so each problem
gives a planner one number only: the expected running time to a proven answer for performance
profiles (Dolan and Moré 2002), the median proven length for mean ranks (Demšar 2006).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

from evoexp.records import FloatArray
from evoexp.report.results.planner_runs import PlannerRuns
from evoexp.report.statistics.inference import expected_effort, quantile

MIN_PLANNERS = 3  # of a critical-difference diagram: two are compared by a test of pairs
MIN_PROBLEMS = 5  # of it: with fewer, Friedman's test can hardly reject anything


class Friedman(NamedTuple):
    """Friedman's test whether some planner ranks differently from the others."""

    statistic: float  # χ², corrected for ties
    p_value: float  # of the χ² distribution


class Standing(NamedTuple):
    """How planners stand on the problems that all of them were run on."""

    planners: tuple[str, ...]  # their names
    problems: tuple[str, ...]  # names of the problems
    left_out: tuple[str, ...]  # problems that some of these planners was not run on
    # Planners run on less than half of the problems that two planners were run on
    outsiders: tuple[str, ...]
    # Expected running time to a proven answer, (problems, planners) [collision queries]
    efforts: FloatArray
    # Median of the best proven lengths, (problems, planners); inf: half have none
    lengths: FloatArray

    @property
    def can_be_profiled(self) -> bool:
        """Whether there are planners and problems enough for a performance profile."""
        return len(self.planners) > 1 and len(self.problems) > 1

    @property
    def can_be_tested(self) -> bool:
        """Whether there are planners and problems enough for a critical-difference diagram."""
        return len(self.planners) >= MIN_PLANNERS and len(self.problems) >= MIN_PROBLEMS

    @property
    def ranks(self) -> FloatArray:
        """Rank of each planner's median length, (problems, planners); 1 is best, ties averaged."""
        return np.asarray(stats.rankdata(self.lengths, axis=1))

    @property
    def mean_ranks(self) -> FloatArray:
        """Mean over problems of the ranks, (planners,)."""
        return np.asarray(self.ranks.mean(axis=0))


def standing(runs: Sequence[PlannerRuns]) -> Standing:
    """Return how planners stand, each problem counted once."""
    every = tuple(dict.fromkeys(own.planner for own in runs))
    problems = tuple(dict.fromkeys(own.problem.name for own in runs))
    cells: dict[tuple[str, str], list[PlannerRuns]] = {}
    for own in runs:
        cells.setdefault((own.problem.name, own.planner), []).append(own)
    contested = [name for name in problems if sum((name, each) in cells for each in every) > 1]
    planners = tuple(
        each
        for each in every
        if 2 * sum((name, each) in cells for name in contested) >= len(contested)
    )
    common = tuple(name for name in problems if all((name, each) in cells for each in planners))

    def matrix(value: Callable[[Sequence[PlannerRuns]], float]) -> FloatArray:
        rows = [[value(cells[name, each]) for each in planners] for name in common]
        return np.array(rows, dtype=np.float64).reshape(len(common), len(planners))

    def effort(same: Sequence[PlannerRuns]) -> float:
        spent, reached = zip(*(own.first_reached() for own in same), strict=True)
        return expected_effort(np.concatenate(spent), np.concatenate(reached))

    def length(same: Sequence[PlannerRuns]) -> float:
        return quantile(np.concatenate([own.best_lengths for own in same]), 0.5)

    left_out = tuple(name for name in problems if name not in common)
    outsiders = tuple(each for each in every if each not in planners)
    return Standing(planners, common, left_out, outsiders, matrix(effort), matrix(length))


def effort_ratios(efforts: FloatArray) -> FloatArray:
    """Return each effort (problems, planners) over its problem's least (Dolan and Moré, Eq. 2.1).

    Never solved are infinite ones, also where no planner solves the problem.
    """
    best = efforts.min(axis=1, keepdims=True)
    ratios = np.full(efforts.shape, np.inf)
    np.divide(efforts, best, out=ratios, where=np.isfinite(efforts) & (best > 0.0))
    return np.where(efforts == best, np.where(np.isfinite(best), 1.0, np.inf), ratios)


def friedman(lengths: FloatArray) -> Friedman:
    """Test whether three planners or more rank alike (Friedman 1937), (problems, planners)."""
    if (lengths == lengths[:, :1]).all():  # nothing but ties
        return Friedman(0.0, 1.0)
    found = stats.friedmanchisquare(*lengths.T)
    return Friedman(float(found.statistic), float(found.pvalue))


def critical_difference(num_planners: int, num_problems: int, significance: float) -> float:
    """Return the difference of mean ranks that Nemenyi's test calls significant (Demšar 2006)."""
    q = float(stats.studentized_range.ppf(1.0 - significance, num_planners, np.inf)) / np.sqrt(2.0)
    return float(q * np.sqrt(num_planners * (num_planners + 1) / (6.0 * num_problems)))


def alike(mean_ranks: Sequence[float], difference: float) -> list[tuple[int, int]]:
    """Return (first, last) of the groups of ascending ranks that do not differ significantly."""
    groups: list[tuple[int, int]] = []
    for first, low in enumerate(mean_ranks):
        last = max(k for k, rank in enumerate(mean_ranks) if rank - low < difference)
        if last > first and (not groups or last > groups[-1][1]):
            groups.append((first, last))
    return groups
