"""Measures of Lavoie & Boudreau 2001 that several pages share: errors, effort, refuted motions."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.planners.proofs import judge_motion
from evoexp.planners.reaching_tasks import Problem
from evoexp.records import BoolArray, FloatArray
from evoexp.report.results import motion_geometry, run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Family, by_column
from evoexp.report.statistics.inference import Proportion, newcombe

PRINTED_RUNS = 1000  # section 5: "a thousand experiments were conducted for each simulation"
Contact = tuple[float, str]
"""Instant of a first contact, names of the bodies."""


# position error at the end of SP2, (done,) [length unit], evaluations, and CPU time of the search
# [s]; inf: no solution
errors = run_measures.where_solved(by_column("term_position_error_sp2"))
effort = run_measures.where_solved(by_column("evaluations"))
seconds = run_measures.where_solved(run_measures.search_seconds)
BOUNDS = (1.0, 2.0)  # those of the printed percentages
BOUND = BOUNDS[0]  # by which the percentages differ most


class Percentage(NamedTuple):
    """A percentage that the paper prints beside Fig. 3."""

    joints: int  # number of joints of the arm
    bound: float  # x of P(position error < x) [length unit]
    proportion: Proportion  # of the paper's own runs, which are a sample, too


PRINTED = (
    Percentage(7, 1.0, Proportion(935, PRINTED_RUNS)),
    Percentage(7, 2.0, Proportion(998, PRINTED_RUNS)),
    Percentage(10, 1.0, Proportion(991, PRINTED_RUNS)),
    Percentage(10, 2.0, Proportion(1000, PRINTED_RUNS)),
)


def arms(results: Results) -> tuple[Family, ...]:
    """Return the first condition of each arm against its others; arms differ in joints."""
    return tuple(map(Family.of, run_measures.grouped(results.with_data, run_measures.num_joints)))


def printed(condition: ConditionResults) -> list[Percentage]:
    """Return the percentages that the paper prints for an arm of so many joints."""
    return [one for one in PRINTED if one.joints == run_measures.num_joints(condition)]


def below(condition: ConditionResults, bound: float) -> Proportion:
    """Count the runs that have a solution with a position error below a bound."""
    return run_measures.counted(errors(condition) < bound)


def runs_by_attempts(condition: ConditionResults) -> str:
    """Return how many runs took each number of attempts: "1: 985, 2: 15"."""
    numbers, counts = np.unique(condition.column("term_attempts"), return_counts=True)
    return ", ".join(f"{n:.0f}: {count}" for n, count in zip(numbers, counts, strict=True))


def tests_per_second(condition: ConditionResults) -> FloatArray:
    """Return the tests of a link against an ellipse per second of each search, (done,) [1/s].

    They are those that the algorithm asks for: kernels skip tests of links that cannot touch.
    Chords are not counted.
    """
    scenario = condition.scenario
    pairs = run_measures.num_joints(condition) * len(scenario.obstacles)
    return np.asarray(
        pairs * condition.column("collision_queries") / run_measures.search_seconds(condition)
    )


def contacts(condition: ConditionResults, replicate: int, verdict: Contact) -> list[Contact]:
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


class RefutedMotions(NamedTuple):
    """Counts of a condition's accepted motions that touch an obstacle."""

    anywhere: Proportion  # motions that touch on either sub-path, of all solved runs
    sp1: Proportion  # motions that touch on the first sub-path
    sp2: Proportion  # motions that touch on the second one


def refuted(condition: ConditionResults) -> RefutedMotions:
    """Count the solved runs whose motion the exact verdict refutes, by sub-path."""
    touching = np.zeros((condition.done, 2), dtype=bool)  # by sub-path
    for replicate, verdict in motion_geometry.refuted(condition).items():
        row = condition.summaries.index.get_loc(replicate)
        for instant, _ in contacts(condition, replicate, verdict):
            touching[row, int(instant >= 1.0)] = True
    paths = touching[run_measures.solved(condition)]
    return RefutedMotions(*map(run_measures.counted, (paths.any(axis=1), *paths.T)))


def untouched(condition: ConditionResults) -> BoolArray:
    """Return whether each accepted motion touches nothing, (solved,)."""
    touches = run_measures.touches(condition)[run_measures.solved(condition)]
    return np.asarray(~touches, dtype=np.bool_)


def told_shares(condition: ConditionResults, confidence: float) -> str:
    """Return the shares of a condition's runs in words, and its mean attempts."""
    own = refuted(condition)
    shares = {
        "with a solution": run_measures.success(condition),
        f"error below {BOUND:g}": below(condition, BOUND),
        "accepted and in contact": own.anywhere,
        "on SP1": own.sp1,
        "on SP2": own.sp2,
    }
    texts = [f"{name}: {p.with_interval(confidence, 1)}" for name, p in shares.items() if p.total]
    if not condition.is_control:
        texts.append(f"mean attempts: {condition.column('term_attempts').mean():.2f}")
    return "; ".join(texts)


def weak_evidence(results: Results, confidence: float) -> Iterator[tuple[str, str]]:
    """Count the settings of each arm that agree with a printed percentage.

    The more settings agree, the less agreement says about any of them. Nothing is counted where
    conditions are controls or blind, or differ in the places of their tests.
    """
    is_other = any(c.is_control or c.planner.collision.blind for c in results.with_data)
    if is_other or paths_differ(results):
        return
    for own in run_measures.grouped(results.with_data, run_measures.num_joints):
        for theirs in (one.proportion for one in printed(own[0]) if one.bound == BOUND):
            intervals = {c.label: newcombe(below(c, BOUND), theirs, confidence) for c in own}
            same = [label for label, (low, high) in intervals.items() if low <= 0.0 <= high]
            yield (
                f"{own[0].label} and others: whose errors below {BOUND:g} cannot be told from the "
                f"printed {100 * theirs.share:.1f} %",
                f"{len(same)} of {len(own)}{': ' if same else ''}{', '.join(same)} (0 within "
                f"Newcombe's {100 * confidence:g} % interval of the difference; at most "
                f"{max(c.done for c in own)} runs each). Agreement with Fig. 3 is weak evidence "
                "for a setting as long as others agree as well",
            )


def paths_differ(results: Results) -> bool:
    """Return whether conditions differ in the places at which they test paths for collision."""
    collisions = (c.planner.collision for c in results.with_data)
    return len({(model.num_positions, model.swept) for model in collisions}) > 1


def printed_shares(results: Results) -> dict[str, float]:
    """Return the shares that the paper prints, by the names of `share_rows`, of a single arm."""
    one_arm = len(arms(results)) == 1
    points = printed(results.with_data[0]) if one_arm else []
    return {f"error below {p.bound:g}": p.proportion.share for p in points}


def stopping_values_differ(conditions: tuple[ConditionResults, ...]) -> bool:
    """Return whether searches stop at different values."""
    return len({c.planner.stop_cost_sp2 for c in conditions}) > 1


def share_rows(
    results: Results, refuted: Callable[[ConditionResults], RefutedMotions]
) -> list[tuple[str, int, str, Proportion]]:
    """Return the counts that are drawn, by sub-path if the tests of paths differ."""
    rows = []
    for position, c in enumerate(results.with_data):
        found = refuted(c)
        told = {"touch an obstacle": found.anywhere, "on SP1": found.sp1, "on SP2": found.sp2}
        if not paths_differ(results):
            near = {f"error below {BOUND:g}": below(c, BOUND)}
            told = near | {"with a solution": run_measures.success(c)} | dict([*told.items()][:1])
        rows += [(name, position, c.label, proportion) for name, proportion in told.items()]
    return rows


def literal_start(condition: ConditionResults) -> str:
    """Say whether the start is free if the printed shift of obstacles is read literally.

    The words vertically and horizontally are not swapped then. Empty if nothing is shifted. The
    arm's collision model judges the start among the obstacles of the literal reading.
    """
    scenario, problem = condition.scenario, condition.problem(Problem)
    dx, dy = scenario.obstacle_shift
    if dx == dy:
        return ""
    literal = scenario.model_copy(update={"obstacle_shift": (dy, dx)})
    model = condition.planner.collision.bind(problem.assembly, literal.obstacle_table())
    contact = model.contact(problem.start, problem.start)
    if contact is None:
        return "free of collision"
    return f"not free of collision: link {contact.link} touches obstacle {contact.obstacle}"
