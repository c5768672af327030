"""Measures of Lavoie & Boudreau 2001 (errors, effort, refuted motions), and claims on them."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.planners.answers import judge_motion
from evoexp.planners.reaching_tasks import Problem
from evoexp.records import BoolArray, FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, EffectSize
from evoexp.report.results import motion_geometry, run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference, judging
from evoexp.report.statistics.comparisons import Family, Values, by_column, compared
from evoexp.report.statistics.inference import Proportion, newcombe
from evoexp.report.statistics.judging import Judge

PRINTED_RUNS = 1000  # section 5: "a thousand experiments were conducted for each simulation"
Contact = tuple[float, str]  # instant of a first contact, names of the bodies
Group = tuple[ConditionResults, ...]
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
                f"{own[0].label} and others: errors below {BOUND:g} that agree with the "
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


def share_rows(
    results: Results, refuted: Callable[[ConditionResults], RefutedMotions]
) -> Iterator[tuple[str, int, str, Proportion]]:
    """Yield the counts that are drawn, by sub-path if the tests of paths differ."""
    for position, c in enumerate(results.with_data):
        found = refuted(c)
        told = {"touch an obstacle": found.anywhere, "on SP1": found.sp1, "on SP2": found.sp2}
        if not paths_differ(results):
            near = {f"error below {BOUND:g}": below(c, BOUND)}
            told = near | {"with a solution": run_measures.success(c)} | dict([*told.items()][:1])
        yield from ((name, position, c.label, share) for name, share in told.items())


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


def percentages(judge: Judge, conditions: Sequence[ConditionResults]) -> Iterator[Claim]:
    """Judge the percentages printed for arms of so many joints, as one family of tests.

    Both percentages are samples: a printed one is contradicted where Fisher's exact test, adjusted
    by Holm over all percentages judged here, tells it from ours.
    """
    pairs = [(c, one) for c in conditions for one in printed(c)]
    shares = [(below(c, one.bound), one.proportion) for c, one in pairs]
    p_values = inference.fisher_family(shares)
    each = 1.0 - (1.0 - judge.level) / max(1, len(pairs))  # Bonferroni: of all intervals together
    for (c, one), (own, theirs), p_adjusted in zip(pairs, shares, p_values, strict=True):
        within, (low, high) = own.interval(judge.level), theirs.interval(judge.level)
        place = "within" if within.low <= theirs.share <= within.high else "outside"
        told = {"own": own, "place": place, "low": 100 * low, "high": 100 * high, "p": p_adjusted}
        told |= {"difference": _difference(own, theirs, each), "count": len(pairs)}
        words = {"bound": f"{one.bound:g}", "share": f"{100 * theirs.share:.1f}"}
        hearing = judge.on("share_below", who=c.label, **words)
        told |= {"confidence": judge.level, "level": 100 * judge.level}
        yield hearing.same_share(told, own, theirs, p_adjusted)


def first_percentage(judge: Judge, condition: ConditionResults, main: Group) -> Claim:
    """Judge the percentage that is printed for errors below 1, the least bound.

    The percentages of the other arm, as assumed, belong to the same family of tests, so that the
    verdict as assumed is that of the experiment itself.
    """
    # number of joints → the condition as assumed, which is the first one of the arm
    assumed = {run_measures.num_joints(c): c for c in reversed(main)}
    others = [c for joints, c in assumed.items() if joints != run_measures.num_joints(condition)]
    return next(percentages(judge, [condition, *others]))


def _difference(own: Proportion, theirs: Proportion, level: float) -> str:
    low, high = newcombe(own, theirs, level)
    points = (
        f"ours − printed {100 * (own.share - theirs.share):+.1f} "
        f"[{100 * low:+.1f}, {100 * high:+.1f}] points"
    ).replace("-", "−")
    return f"{points} (Newcombe's {100 * level:g} % interval)"


def no_start_needed(judge: Judge, condition: ConditionResults) -> Claim | None:
    """Judge that random populations are a good enough start; None where the paper prints no share.

    The paper's own runs do not all end with a solution. An error of 2 or more is none (the
    objective is at least the error, and a search is successful below 2), so the share that the
    paper prints for errors below 2 is its share of runs with a solution.
    """
    widest = [one for one in printed(condition) if one.bound == max(BOUNDS)]
    if not widest:
        return None
    own, theirs = run_measures.success(condition), widest[0].proportion
    hearing = judge.on("no_start", who=condition.label)
    low, high = newcombe(own, theirs, judge.level)
    margin = -0.01 * hearing.rule.limits["margin"]
    holds = None if low <= margin <= high else low > margin
    told = {"own": own, "bound": widest[0].bound, "theirs": theirs, "confidence": judge.level}
    told |= {"difference": _difference(own, theirs, judge.level)}
    return hearing.own(told, f"{own.total} and {theirs.total}", holds)


def judge_controls(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge every condition against the best of its controls, in solutions and in effort.

    Controls draw uniformly where the algorithm evolves: sub-path by sub-path under the same loop,
    or both sub-paths at once.
    """
    beside = []  # (algorithm, uniform draws and itself without crossover)
    for own in results.main:
        if not _breeds_alone(own):
            controls = [
                c
                for c in results.with_data
                if (c.is_control or _breeds_alone(c))
                and (c.robot, c.scenario) == (own.robot, own.scenario)
                and c.planner.model_copy(update={"ga": own.planner.ga}) == own.planner
            ]
            beside += [(own, controls)] if controls else []
    pairs = [(own, best_control(controls)) for own, controls in beside]
    shares = [(run_measures.success(own), run_measures.success(control)) for own, control in pairs]
    p_values = inference.fisher_family(shares)
    for (own, controls), pair, p_adjusted in zip(beside, pairs, p_values, strict=True):
        yield more_solutions(judge, *pair, p_adjusted)
        # fewer evaluations per solution
        pair = own, min(controls, key=_expected_effort)
        first, second = run_measures.on_common_seeds(*pair, by_column("evaluations"))
        expected = [inference.expected_effort(*each) for each in (first, second)]
        low, high = inference.effort_ratio(first, second, judge.level, judge.settings.num_resamples)
        ratio = expected[0] / expected[1] if np.isfinite(expected[0]) else np.inf
        told = " against ".join(f"{value:.0f}" for value in expected).replace("inf", "∞")
        label, control = (c.label for c in pair)
        evidence = (
            f"expected running time {told} evaluations ({control}); ratio {ratio:.3g} "
            f"[{low:.3g}, {high:.3g}] ({100 * judge.level:g} % bootstrap interval over seeds)"
        )
        hearing = judge.on("less_effort", who=f"{label}: ", control=f", {control}")
        holds = None if low <= 1.0 <= high else high < 1.0
        size = EffectSize("ratio of expected efforts", ratio, low, high, 1.0)
        yield hearing.own(evidence, len(first[0]), holds, size)


def _breeds_alone(condition: ConditionResults) -> bool:
    return float(condition.planner.ga.crossover_rate) == 0.0


def _expected_effort(condition: ConditionResults) -> float:
    efforts = condition.column("evaluations")
    return inference.expected_effort(efforts, run_measures.solved(condition))


def best_control(controls: Sequence[ConditionResults]) -> ConditionResults:
    """Return the control that solves most; of equal ones that of the least expected effort."""
    return min(controls, key=lambda c: (-run_measures.success(c).share, _expected_effort(c)))


def more_solutions(
    judge: Judge, own: ConditionResults, control: ConditionResults, p_adjusted: float
) -> Claim:
    """Judge that the algorithm finds more solutions than a control."""
    one, two = run_measures.success(own), run_measures.success(control)
    low, high = newcombe(one, two, judge.level)
    told = {"one": one, "two": two, "control": control.label, "p": p_adjusted}
    told |= {"points": 100 * (one.share - two.share), "low": 100 * low, "high": 100 * high}
    told |= {"within": solved_within(own, control), "confidence": judge.level}
    hearing = judge.on("more_solutions", who=f"{own.label}: ", control=f", {control.label}")
    return hearing.greater(told, one, two, p_adjusted)


def solved_within(own: ConditionResults, control: ConditionResults) -> Proportion:
    """Count the control's runs that are solved within the algorithm's median effort.

    The effort of a run of the algorithm without a solution is infinite.
    """
    most = np.median(effort(own))
    return run_measures.counted(run_measures.solved(control) & (effort(control) <= most))


def either_success(judge: Judge, main: Group) -> Iterator[Claim]:
    """Judge the printed percentages by either reading of a success, each a family of tests."""
    for reading in (", below its value", ", any finite cost"):
        yield from percentages(judge, [c for c in main if c.label.endswith(reading)])


def precision(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge that smaller stopping values give smaller errors, step by step."""
    stopped = [c for c in results.main if c.label.startswith("stop below ")]
    for own in run_measures.grouped(stopped, lambda c: c.planner.ga.num_generations):
        steps = [(small, large) for large, small in itertools.pairwise(own)]
        rows = compared(steps, errors, judge.settings, named="{0.label} against {1.label}".format)
        medians = (f"{_median(c, errors)} below {c.planner.stop_cost_sp2:g}" for c in own)
        told = "; ".join(f"{row.quantity}: {judging.evidence(row, 'smaller')}" for row in rows)
        where = f": at most {own[0].planner.ga.num_generations} generations"
        told = f"median errors: {', '.join(medians)}; step by step: {told}"
        yield judge.on("precision", where=where).better_than_all(told, rows)


def _median(condition: ConditionResults, values: Values) -> str:
    value = float(np.median(values(condition)))
    return markdown.number(float(round(value)) if 1e3 < value < np.inf else value)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "bounds": lambda: BOUNDS,
    # searches stop at different values
    "stopping_values_differ": lambda conditions: (
        len({c.planner.stop_cost_sp2 for c in conditions}) > 1
    ),
    "anywhere": lambda refuted: refuted.anywhere,  # accepted motions that touch an obstacle
    "clear": lambda anywhere: Proportion(anywhere.total - anywhere.having, anywhere.total),
    "median_error": lambda condition: _median(condition, errors),
    "median_effort": lambda condition: _median(condition, effort),
    # whether effort says something: what never stops takes all its evaluations
    "can_stop": lambda real: "never stopped" not in real,
    "many_positions": lambda fine: "M = 10," not in fine,
}
