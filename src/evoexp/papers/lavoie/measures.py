"""What the pages on Lavoie & Boudreau 2001 measure alike.

Errors, effort, and motions that are refuted.
"""

from typing import NamedTuple

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.planners.planner import judge_motion
from evoexp.records import FloatArray
from evoexp.report import body_contacts, markdown
from evoexp.report.proportions import Proportion
from evoexp.report.results import ConditionResults, Results

PRINTED_RUNS = 1000  # section 5: "a thousand experiments were conducted for each simulation"


class Printed(NamedTuple):
    """A percentage that the paper prints beside Fig. 3.

    Attributes:
        joints: Of the arm.
        bound: x of P(position error < x) [length unit].
        having: How many of the thousand runs.
    """

    joints: int
    bound: float
    having: int

    @property
    def proportion(self) -> Proportion:
        """Of the paper's own runs, which are a sample, too."""
        return Proportion(self.having, PRINTED_RUNS)


PRINTED = (
    Printed(7, 1.0, 935),
    Printed(7, 2.0, 998),
    Printed(10, 1.0, 991),
    Printed(10, 2.0, 1000),
)
BOUNDS = (1.0, 2.0)  # those of the printed percentages


def fits(results: Results) -> bool:
    """Whether there are results, and all of arms that go by a via point into a box."""
    return bool(results.with_data) and all(
        hasattr(c.planner, "stop_cost_sp2") for c in results.with_data
    )


def num_joints(condition: ConditionResults) -> int:
    """Return how many joints the arm has."""
    return len(condition.condition.scenario.q_start)  # type: ignore[attr-defined]


def solved(condition: ConditionResults) -> np.ndarray:
    """Return whether each run ended with a solution, (done,)."""
    return condition.summaries["solved"].to_numpy(dtype=bool)


def errors(condition: ConditionResults) -> FloatArray:
    """Return the position error at the end of SP2 of each run, (done,) [length unit].

    Inf without a solution.
    """
    return np.where(solved(condition), condition.column("term_position_error_sp2"), np.inf)


def effort(condition: ConditionResults) -> FloatArray:
    """Return the evaluations that each run took to its solution, (done,).

    Inf without a solution.
    """
    return np.where(solved(condition), condition.column("evaluations"), np.inf)


def below(condition: ConditionResults, bound: float) -> Proportion:
    """Return how many of all runs have a solution with a position error below a bound."""
    return Proportion(int(np.count_nonzero(errors(condition) < bound)), condition.done)


def search_seconds(condition: ConditionResults) -> FloatArray:
    """Return the CPU time of each run without that of the exact verdict, (done,) [s]."""
    return np.asarray(condition.column("cpu_s") - condition.column("certificate_s"))


def evaluations_per_second(condition: ConditionResults) -> FloatArray:
    """Return the evaluations per second of CPU time of each search, (done,) [1/s]."""
    return np.asarray(condition.column("evaluations") / search_seconds(condition))


def tests_per_second(condition: ConditionResults) -> FloatArray:
    """Return the tests of a link against an ellipse that each search asks for per second.

    (done,) [1/s].

    Chords are not counted, and kernels skip what cannot touch: it is what the algorithm would take
    without that.
    """
    pairs = num_joints(condition) * len(condition.condition.scenario.obstacles)  # type: ignore[attr-defined]
    return np.asarray(pairs * condition.column("collision_queries") / search_seconds(condition))


def contacts(
    condition: ConditionResults, replicate: int, verdict: tuple[float, str]
) -> list[tuple[float, str]]:
    """Return the first contact (instant, bodies) on each sub-path that has one.

    A verdict names the first contact of the whole motion only; where that is on SP1, SP2 is judged
    by itself.

    Args:
        condition: Whose replicate it is.
        replicate: Which.
        verdict: Its first contact.
    """
    if verdict[0] >= 1.0:
        return [verdict]
    prepared = condition.prepared
    q = prepared.planner.motion(prepared.problem, condition.solutions[replicate]).q
    second = judge_motion(prepared.planner, prepared.problem, Motion(np.ascontiguousarray(q[1:])))
    return (
        [verdict]
        if second.refuted_at is None
        else [verdict, (1.0 + second.refuted_at, second.refuted_pair)]
    )


def touches(condition: ConditionResults) -> np.ndarray:
    """Return whether the exact verdict refutes each run's motion, (done,)."""
    return condition.summaries["certified"].eq(False).fillna(False).to_numpy(dtype=bool)


def refuted_paths(condition: ConditionResults) -> np.ndarray:
    """Return which sub-paths of each run's motion the exact verdict refutes, (done, 2)."""
    refuted = np.zeros((condition.done, 2), dtype=bool)
    for replicate, verdict in body_contacts.refuted(condition).items():
        row = condition.summaries.index.get_loc(replicate)
        for instant, _ in contacts(condition, replicate, verdict):
            refuted[row, int(instant >= 1.0)] = True
    return refuted


class Refuted(NamedTuple):
    """How many of a condition's accepted motions touch an obstacle.

    Attributes:
        anywhere: Of all solved runs.
        sp1: On the first sub-path.
        sp2: On the second one.
    """

    anywhere: Proportion
    sp1: Proportion
    sp2: Proportion


def refuted(condition: ConditionResults) -> Refuted:
    """Count the solved runs whose motion the exact verdict refutes, and on which sub-path."""
    accepted = solved(condition)
    paths, total = refuted_paths(condition)[accepted], int(np.count_nonzero(accepted))
    counts = (np.count_nonzero(paths.any(axis=1)), *np.count_nonzero(paths, axis=0))
    return Refuted(*(Proportion(int(count), total) for count in counts))


def text(proportion: Proportion, confidence: float) -> str:
    """Return a proportion with its interval: "964 of 1000 = 96.4 % [95.1, 97.4]"."""
    if not proportion.total:
        return "0 of 0"
    low, high = proportion.interval(confidence)
    return (
        f"{markdown.share(proportion.having, proportion.total)} = {100 * proportion.share:.1f} % "
        f"[{100 * low:.1f}, {100 * high:.1f}]"
    )
