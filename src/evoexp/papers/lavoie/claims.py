"""The claims of Lavoie & Boudreau 2001, judged by their experiment and against controls."""

from collections.abc import Iterator, Sequence

import numpy as np

from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.rules import RULES
from evoexp.report import kit
from evoexp.report.kit import markdown

ELSEWHERE = (
    ("more_solutions", {"who": "", "control": ""}),
    ("precision", {"where": ", with more generations"}),
    ("coding", {"where": "", "word": "better"}),
)


def percentages(judge: kit.Judge, conditions: Sequence[kit.ConditionResults]) -> list[kit.Claim]:
    """Judge the percentages printed for arms of so many joints, as one family of tests.

    Both percentages are samples: a printed one is contradicted where Fisher's exact test, adjusted
    by Holm over all percentages judged here, tells it from ours.
    """
    pairs = [(c, printed) for c in conditions for printed in measures.printed(c)]
    shares = [(measures.below(c, printed.bound), printed.proportion) for c, printed in pairs]
    p_values = kit.holm([kit.fisher_exact(own, theirs) for own, theirs in shares])
    # Bonferroni: all intervals together have the level
    level, each = judge.level, 1.0 - (1.0 - judge.level) / max(1, len(pairs))
    claims = []
    for (c, printed), (own, theirs), p_adjusted in zip(pairs, shares, p_values, strict=True):
        within, their_own = own.interval(level), theirs.interval(level)
        place = "within" if within.low <= theirs.share <= within.high else "outside"
        evidence = (
            f"{judge.share(own, 1)}; the printed share lies {place}, its own thousand runs give "
            f"[{100 * their_own.low:.1f}, {100 * their_own.high:.1f}]; "
            f"{_difference(own, theirs, each)}, {100 * level:g} % over the {len(pairs)} together; "
            f"Fisher's exact p, adjusted by Holm over {len(pairs)}, {markdown.p_value(p_adjusted)}"
        )
        words = {"bound": f"{printed.bound:g}", "share": f"{100 * theirs.share:.1f}"}
        hearing = judge.on("share_below", who=c.label, **words)
        claims.append(hearing.same_share(evidence, own, theirs, p_adjusted))
    return claims


def _difference(own: kit.Proportion, theirs: kit.Proportion, level: float) -> str:
    """Return how many points more our share has than the paper's, with its interval."""
    low, high = kit.newcombe(own, theirs, level)
    points = (
        f"ours − printed {100 * (own.share - theirs.share):+.1f} "
        f"[{100 * low:+.1f}, {100 * high:+.1f}] points"
    ).replace("-", "−")
    return f"{points} (Newcombe's {100 * level:g} % interval)"


def more_joints_are_better(
    judge: kit.Judge, conditions: Sequence[kit.ConditionResults]
) -> Iterator[kit.Claim]:
    """Judge that the arm of ten joints does better than that of seven, where both were run."""
    by_joints = {kit.num_joints(c): c for c in conditions}
    for bound in measures.BOUNDS if {7, 10} <= set(by_joints) else ():
        ten, seven = (measures.below(by_joints[joints], bound) for joints in (10, 7))
        told = " against ".join(judge.share(share, 1) for share in (ten, seven))
        evidence = f"{told}; {kit.fisher_evidence(ten, seven)}, two-sided"
        yield judge.on("longer_arm", bound=f"{bound:g}").greater(evidence, ten, seven)


def no_start_needed(judge: kit.Judge, condition: kit.ConditionResults) -> kit.Claim | None:
    """Judge that random populations are a good enough start; None where the paper prints no share.

    The paper's own runs do not all end with a solution. An error of 2 or more is none (the
    objective is at least the error, and a search is successful below 2), so the share that the
    paper prints for errors below 2 is its share of runs with a solution.
    """
    printed = [one for one in measures.printed(condition) if one.bound == max(measures.BOUNDS)]
    if not printed:
        return None
    own, theirs = kit.success(condition), printed[0].proportion
    hearing = judge.on("no_start", who=condition.label)
    low, high = kit.newcombe(own, theirs, judge.level)
    margin = -0.01 * hearing.rule.limits["margin"]
    holds = None if low <= margin <= high else low > margin
    evidence = (
        f"runs with a solution: {judge.share(own, 1)}; the paper's own, errors below "
        f"{printed[0].bound:g}: {judge.share(theirs, 1)}; {_difference(own, theirs, judge.level)}"
    )
    return hearing.own(evidence, f"{own.total} and {theirs.total}", holds)


def free_of_collision(
    judge: kit.Judge, condition: kit.ConditionResults, refuted: kit.Proportion
) -> kit.Claim:
    """Judge that accepted motions touch nothing."""
    free = kit.certified(condition).having
    planned = condition.planned if condition.solved == condition.done else 0
    evidence = f"{markdown.share(free, refuted.total)} certified; refuted {judge.share(refuted, 1)}"
    hearing = judge.on("free_of_collision", who=condition.label)
    return hearing.every(evidence, free, refuted.total, planned)


def judged_elsewhere(judge: kit.Judge) -> list[kit.Claim]:
    """Return the claims that need controls or a sweep, not judged."""
    told = "judged by `evoexp run experiment={}`"
    return [
        judge.on(name, **words).elsewhere(told.format(RULES[name].experiments[0]))
        for name, words in ELSEWHERE
    ]


def judge_controls(judge: kit.Judge, results: kit.Results) -> Iterator[kit.Claim]:
    """Judge every condition against the best of its controls, in solutions and in effort.

    Controls draw uniformly where the algorithm evolves: sub-path by sub-path under the same loop,
    or both sub-paths at once.
    """
    pairs = [
        (own, best_control(controls))
        for own in results.with_data
        if not own.is_control and (controls := _controls(results, own))
    ]
    p_values = kit.holm(
        [kit.fisher_exact(kit.success(own), kit.success(control)) for own, control in pairs]
    )
    for (own, control), p_adjusted in zip(pairs, p_values, strict=True):
        yield more_solutions(judge, own, control, p_adjusted)
        yield _less_effort(judge, own, control)


def best_control(controls: Sequence[kit.ConditionResults]) -> kit.ConditionResults:
    """Return the control that solves most; of equal ones that of the least expected effort."""

    def order(control: kit.ConditionResults) -> tuple[float, float]:
        expected = kit.expected_effort(control.column("evaluations"), kit.solved(control))
        return -kit.success(control).share, expected

    return min(controls, key=order)


def more_solutions(
    judge: kit.Judge, own: kit.ConditionResults, control: kit.ConditionResults, p_adjusted: float
) -> kit.Claim:
    """Judge that the algorithm finds more solutions than a control."""
    one, two = kit.success(own), kit.success(control)
    low, high = kit.newcombe(one, two, judge.level)
    within = judge.share(solved_within(own, control), 1)
    evidence = (
        f"runs with a solution: {judge.share(one, 1)} against {judge.share(two, 1)} "
        f"({control.label}), adjusted p = {markdown.p_value(p_adjusted)} (Fisher, Holm over the "
        f"arms); evolution adds {100 * (one.share - two.share):.0f} "
        f"[{100 * low:.0f}, {100 * high:.0f}] points; within the algorithm's median effort the "
        f"control has solved {within}"
    )
    hearing = judge.on("more_solutions", who=f"{own.label}: ", control=f", {control.label}")
    return hearing.greater(evidence, one, two, p_adjusted)


def _less_effort(
    judge: kit.Judge, own: kit.ConditionResults, control: kit.ConditionResults
) -> kit.Claim:
    """Judge that the algorithm takes fewer evaluations per solution than a control."""
    first, second = kit.on_common_seeds(own, control, kit.by_column("evaluations"))
    expected = [kit.expected_effort(*each) for each in (first, second)]
    low, high = kit.effort_ratio(first, second, judge.level, judge.settings.num_resamples)
    ratio = expected[0] / expected[1] if np.isfinite(expected[0]) else np.inf
    told = " against ".join(f"{value:.0f}" for value in expected).replace("inf", "∞")
    evidence = (
        f"expected running time {told} evaluations ({control.label}); ratio {ratio:.3g} "
        f"[{low:.3g}, {high:.3g}] ({100 * judge.level:g} % bootstrap interval over seeds)"
    )
    hearing = judge.on("less_effort", who=f"{own.label}: ", control=f", {control.label}")
    holds = None if low <= 1.0 <= high else high < 1.0
    return hearing.own(evidence, f"{len(first[0])} pairs", holds)


def solved_within(own: kit.ConditionResults, control: kit.ConditionResults) -> kit.Proportion:
    """Count the control's runs that are solved within the algorithm's median effort.

    The effort of a run of the algorithm without a solution is infinite.
    """
    most = np.median(measures.effort(own))
    return kit.counted(kit.solved(control) & (measures.effort(control) <= most))


def _controls(results: kit.Results, own: kit.ConditionResults) -> list[kit.ConditionResults]:
    """Return the controls that stand beside this very planner in the same scene."""
    same = own.condition.robot, own.condition.scenario, own.planner
    return [
        c
        for c in results.with_data
        if c.is_control and (c.condition.robot, c.condition.scenario, c.planner) == same
    ]
