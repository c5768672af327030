"""Measures of Lavoie & Boudreau 2001 that several pages share: errors, effort, refuted motions."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.planners.proofs import judge_motion
from evoexp.planners.redundant_ga.planner import RedundantGa
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import motion_geometry

PRINTED_RUNS = 1000  # section 5: "a thousand experiments were conducted for each simulation"
Contact = tuple[float, str]
"""Instant of a first contact, names of the bodies."""


# position error at the end of SP2, (done,) [length unit], and evaluations; inf: no solution
errors = kit.where_solved(kit.by_column("term_position_error_sp2"))
effort = kit.where_solved(kit.by_column("evaluations"))
BOUNDS = (1.0, 2.0)  # those of the printed percentages


class Percentage(NamedTuple):
    """A percentage that the paper prints beside Fig. 3."""

    joints: int  # number of joints of the arm
    bound: float  # x of P(position error < x) [length unit]
    having: int  # number of the thousand runs with a smaller error

    @property
    def proportion(self) -> kit.Proportion:
        """Proportion of the paper's own runs, which are a sample, too."""
        return kit.Proportion(self.having, PRINTED_RUNS)


PRINTED = (
    Percentage(7, 1.0, 935),
    Percentage(7, 2.0, 998),
    Percentage(10, 1.0, 991),
    Percentage(10, 2.0, 1000),
)


def fits(results: kit.Results) -> bool:
    """Return whether there are results, all of arms that go by a via point into a box."""
    return kit.planned_by(results, RedundantGa)


def printed(condition: kit.ConditionResults) -> list[Percentage]:
    """Return the percentages that the paper prints for an arm of so many joints."""
    return [one for one in PRINTED if one.joints == kit.num_joints(condition)]


def below(condition: kit.ConditionResults, bound: float) -> kit.Proportion:
    """Count the runs that have a solution with a position error below a bound."""
    return kit.counted(errors(condition) < bound)


def tests_per_second(condition: kit.ConditionResults) -> FloatArray:
    """Return the tests of a link against an ellipse per second of each search, (done,) [1/s].

    They are those that the algorithm asks for: kernels skip tests of links that cannot touch.
    Chords are not counted.
    """
    scenario: Any = condition.condition.scenario
    pairs = kit.num_joints(condition) * len(scenario.obstacles)
    return np.asarray(pairs * condition.column("collision_queries") / kit.search_seconds(condition))


def contacts(condition: kit.ConditionResults, replicate: int, verdict: Contact) -> list[Contact]:
    """Return the first contacts on both sub-paths, as far as there are any.

    A verdict names the first contact of the whole motion only; if that is on SP1, the planner's
    motion on SP2 is judged by itself.
    """
    if verdict[0] >= 1.0:
        return [verdict]
    q = np.ascontiguousarray(condition.motion(replicate).q[1:])
    second = judge_motion(*condition.prepared, Motion(q))
    if second.refuted_at is None:
        return [verdict]
    return [verdict, (1.0 + second.refuted_at, second.refuted_pair)]


def touches(condition: kit.ConditionResults) -> np.ndarray:
    """Return whether the exact verdict refutes each run's motion, (done,)."""
    return condition.summaries["certified"].eq(False).fillna(False).to_numpy(dtype=bool)


def refuted_paths(condition: kit.ConditionResults) -> np.ndarray:
    """Return which sub-paths of each run's motion the exact verdict refutes, (done, 2)."""
    refuted = np.zeros((condition.done, 2), dtype=bool)
    for replicate, verdict in motion_geometry.refuted(condition).items():
        row = condition.summaries.index.get_loc(replicate)
        for instant, _ in contacts(condition, replicate, verdict):
            refuted[row, int(instant >= 1.0)] = True
    return refuted


class RefutedMotions(NamedTuple):
    """Counts of a condition's accepted motions that touch an obstacle."""

    anywhere: kit.Proportion  # motions that touch on either sub-path, of all solved runs
    sp1: kit.Proportion  # motions that touch on the first sub-path
    sp2: kit.Proportion  # motions that touch on the second one


def refuted(condition: kit.ConditionResults) -> RefutedMotions:
    """Count the solved runs whose motion the exact verdict refutes, by sub-path."""
    paths = refuted_paths(condition)[kit.solved(condition)]
    return RefutedMotions(kit.counted(paths.any(axis=1)), *map(kit.counted, paths.T))
