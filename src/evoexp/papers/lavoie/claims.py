"""The claims of Lavoie & Boudreau 2001, judged by their experiment and against controls."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from evoexp.papers.lavoie import measures
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, EffectSize
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference, judging
from evoexp.report.statistics.comparisons import Values, by_column, compared
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Judge

Group = tuple[ConditionResults, ...]
ARMS = ("7-DOF", "10-DOF")


def percentages(judge: Judge, conditions: Sequence[ConditionResults]) -> list[Claim]:
    """Judge the percentages printed for arms of so many joints, as one family of tests.

    Both percentages are samples: a printed one is contradicted where Fisher's exact test, adjusted
    by Holm over all percentages judged here, tells it from ours.
    """
    pairs = [(c, printed) for c in conditions for printed in measures.printed(c)]
    shares = [(measures.below(c, printed.bound), printed.proportion) for c, printed in pairs]
    p_values = inference.fisher_family(shares)
    each = 1.0 - (1.0 - judge.level) / max(1, len(pairs))  # Bonferroni: of all intervals together
    claims = []
    for (c, printed), (own, theirs), p_adjusted in zip(pairs, shares, p_values, strict=True):
        within, (low, high) = own.interval(judge.level), theirs.interval(judge.level)
        place = "within" if within.low <= theirs.share <= within.high else "outside"
        told = {"own": own, "place": place, "low": 100 * low, "high": 100 * high, "p": p_adjusted}
        told |= {"difference": _difference(own, theirs, each), "count": len(pairs)}
        words = {"bound": f"{printed.bound:g}", "share": f"{100 * theirs.share:.1f}"}
        hearing = judge.on("share_below", who=c.label, **words)
        told |= {"confidence": judge.level, "level": 100 * judge.level}
        claims.append(hearing.same_share(told, own, theirs, p_adjusted))
    return claims


def first_percentage(judge: Judge, condition: ConditionResults, main: Group) -> Claim:
    """Judge the percentage that is printed for errors below 1, the least bound.

    The percentages of the other arm, as assumed, belong to the same family of tests, so that the
    verdict as assumed is that of the experiment itself.
    """
    # number of joints → the condition as assumed, which is the first one of the arm
    assumed = {run_measures.num_joints(c): c for c in reversed(main)}
    others = [c for joints, c in assumed.items() if joints != run_measures.num_joints(condition)]
    return percentages(judge, [condition, *others])[0]


def _difference(own: Proportion, theirs: Proportion, level: float) -> str:
    """Return how many points more our share has than the paper's, with its interval."""
    low, high = inference.newcombe(own, theirs, level)
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
    printed = [one for one in measures.printed(condition) if one.bound == max(measures.BOUNDS)]
    if not printed:
        return None
    own, theirs = run_measures.success(condition), printed[0].proportion
    hearing = judge.on("no_start", who=condition.label)
    low, high = inference.newcombe(own, theirs, judge.level)
    margin = -0.01 * hearing.rule.limits["margin"]
    holds = None if low <= margin <= high else low > margin
    told = {"own": own, "bound": printed[0].bound, "theirs": theirs, "confidence": judge.level}
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
    """Whether a condition is the algorithm by mutation alone, a control."""
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
    low, high = inference.newcombe(one, two, judge.level)
    told = {"one": one, "two": two, "control": control.label, "p": p_adjusted}
    told |= {"points": 100 * (one.share - two.share), "low": 100 * low, "high": 100 * high}
    told |= {"within": solved_within(own, control), "confidence": judge.level}
    hearing = judge.on("more_solutions", who=f"{own.label}: ", control=f", {control.label}")
    return hearing.greater(told, one, two, p_adjusted)


def solved_within(own: ConditionResults, control: ConditionResults) -> Proportion:
    """Count the control's runs that are solved within the algorithm's median effort.

    The effort of a run of the algorithm without a solution is infinite.
    """
    most = np.median(measures.effort(own))
    return run_measures.counted(run_measures.solved(control) & (measures.effort(control) <= most))


def either_success(judge: Judge, main: Group) -> Iterator[Claim]:
    """Judge the printed percentages by either reading of a success, each a family of tests."""
    for reading in (", below its value", ", any finite cost"):
        yield from percentages(judge, [c for c in main if c.label.endswith(reading)])


def precision(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge that smaller stopping values give smaller errors, step by step."""
    stopped = [c for c in results.main if c.label.startswith("stop below ")]
    for own in run_measures.grouped(stopped, lambda c: c.planner.ga.num_generations):
        steps = [(small, large) for large, small in itertools.pairwise(own)]
        rows = compared(steps, measures.errors, judge.settings, named=_against)
        medians = (f"{_median(c, measures.errors)} below {c.planner.stop_cost_sp2:g}" for c in own)
        told = "; ".join(f"{row.quantity}: {judging.evidence(row, 'smaller')}" for row in rows)
        where = f": at most {own[0].planner.ga.num_generations} generations"
        told = f"median errors: {', '.join(medians)}; step by step: {told}"
        yield judge.on("precision", where=where).better_than_all(told, rows)


def _against(one: ConditionResults, two: ConditionResults) -> str:
    return f"{one.label} against {two.label}"


def _median(condition: ConditionResults, values: Values) -> str:
    value = float(np.median(values(condition)))
    return markdown.number(float(round(value)) if 1e3 < value < np.inf else value)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "bounds": lambda: measures.BOUNDS,
    "anywhere": lambda refuted: refuted.anywhere,  # accepted motions that touch an obstacle
    "clear": lambda anywhere: Proportion(anywhere.total - anywhere.having, anywhere.total),
    "median_error": lambda condition: _median(condition, measures.errors),
    "median_effort": lambda condition: _median(condition, measures.effort),
    # whether effort says something: what never stops takes all its evaluations
    "can_stop": lambda real: "never stopped" not in real,
    # labels of conditions that differ in their coding alone: real, binary
    "codings": lambda: [
        (f"{arm}real{end}", f"{arm}binary{rate}{end}")
        for arm, end, rate in itertools.product(
            ("", "10-DOF, "), ("", ", never stopped"), ("", ", pm per bit")
        )
    ],
    # labels of conditions that differ in their tests of a path alone: the coarse and the fine ones
    "finer_tests": lambda: [
        *((f"{arm}, M = 10, none", f"{arm}, M = 10, chords") for arm in ARMS),
        *(
            (f"{arm}, M = 10, chords", f"{arm}, M = {positions}, chords")
            for arm, positions in itertools.product(ARMS, (50, 100))
        ),
    ],
    "many_positions": lambda fine: "M = 10," not in fine,
}
