"""The claims of Lavoie & Boudreau 2001, judged by their experiment and against controls."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from evoexp.papers.lavoie import measures
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim, EffectSize
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference, judging
from evoexp.report.statistics.comparisons import Values, by_column, compared
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Judge, fisher_evidence

Group = tuple[ConditionResults, ...]
Counts = Callable[[ConditionResults], RefutedMotions]
ELSEWHERE = (
    ("more_solutions", {"who": "", "control": ""}),
    ("precision", {"where": ", with more generations"}),
    ("coding", {"where": "", "word": "better"}),
)


def percentages(judge: Judge, conditions: Sequence[ConditionResults]) -> list[Claim]:
    """Judge the percentages printed for arms of so many joints, as one family of tests.

    Both percentages are samples: a printed one is contradicted where Fisher's exact test, adjusted
    by Holm over all percentages judged here, tells it from ours.
    """
    pairs = [(c, printed) for c in conditions for printed in measures.printed(c)]
    shares = [(measures.below(c, printed.bound), printed.proportion) for c, printed in pairs]
    p_values = inference.fisher_family(shares)
    # Bonferroni: all intervals together have the level
    level, each = (
        judge.level,
        1.0 - (1.0 - judge.level) / max(1, len(pairs)),
    )
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


def more_joints_are_better(judge: Judge, conditions: Sequence[ConditionResults]) -> Iterator[Claim]:
    """Judge that the arm of ten joints does better than that of seven, where both were run."""
    by_joints = {run_measures.num_joints(c): c for c in conditions}
    for bound in measures.BOUNDS if {7, 10} <= set(by_joints) else ():
        ten, seven = (measures.below(by_joints[joints], bound) for joints in (10, 7))
        told = " against ".join(judge.share(share, 1) for share in (ten, seven))
        evidence = f"{told}; {fisher_evidence(ten, seven)}, two-sided"
        yield judge.on("longer_arm", bound=f"{bound:g}").greater(evidence, ten, seven)


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
    evidence = (
        f"runs with a solution: {judge.share(own, 1)}; the paper's own, errors below "
        f"{printed[0].bound:g}: {judge.share(theirs, 1)}; {_difference(own, theirs, judge.level)}"
    )
    return hearing.own(evidence, f"{own.total} and {theirs.total}", holds)


def free_of_collision(judge: Judge, condition: ConditionResults) -> Claim:
    """Judge that accepted motions touch nothing."""
    refuted = run_measures.counted(run_measures.touches(condition)[run_measures.solved(condition)])
    free = run_measures.certified(condition).having
    planned = condition.planned if condition.solved == condition.done else 0
    evidence = f"{markdown.share(free, refuted.total)} certified; refuted {judge.share(refuted, 1)}"
    hearing = judge.on("free_of_collision", who=condition.label)
    return hearing.every(evidence, free, refuted.total, planned)


def judged_elsewhere(judge: Judge) -> list[Claim]:
    """Return the claims that need controls or a sweep, not judged."""
    told = "judged by `evoexp run experiment={}`"
    return [
        judge.on(name, **words).elsewhere(told.format(judge.rules[name].experiments[0]))
        for name, words in ELSEWHERE
    ]


def judge_controls(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge every condition against the best of its controls, in solutions and in effort.

    Controls draw uniformly where the algorithm evolves: sub-path by sub-path under the same loop,
    or both sub-paths at once.
    """
    beside = []  # (algorithm, uniform draws and itself without crossover)
    for own in results.main:
        if not _breeds_alone(own):
            scene = (own.robot, own.scenario, own.planner)
            drawn = [c for c in results.with_data if (c.robot, c.scenario, c.planner) == scene]
            bred = [c for group in groups_but_for(results, "ga") if own in group for c in group]
            controls = [c for c in drawn if c.is_control] + [*filter(_breeds_alone, bred)]
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
    within = judge.share(solved_within(own, control), 1)
    evidence = (
        f"runs with a solution: {judge.share(one, 1)} against {judge.share(two, 1)} "
        f"({control.label}), adjusted p = {markdown.p_value(p_adjusted)} (Fisher, Holm over the "
        f"arms); the algorithm adds {100 * (one.share - two.share):.0f} "
        f"[{100 * low:.0f}, {100 * high:.0f}] points; within the algorithm's median effort the "
        f"control has solved {within}"
    )
    hearing = judge.on("more_solutions", who=f"{own.label}: ", control=f", {control.label}")
    return hearing.greater(evidence, one, two, p_adjusted)


def solved_within(own: ConditionResults, control: ConditionResults) -> Proportion:
    """Count the control's runs that are solved within the algorithm's median effort.

    The effort of a run of the algorithm without a solution is infinite.
    """
    most = np.median(measures.effort(own))
    return run_measures.counted(run_measures.solved(control) & (measures.effort(control) <= most))


def groups_but_for(results: Results, *path: str) -> list[Group]:
    """Return groups of conditions, without controls, that agree in all settings but one.

    The names of the path lead to it: "ga", "num_generations".
    """

    def key(condition: ConditionResults) -> tuple[Any, ...]:
        part = planner = condition.planner.canonical()
        for name in path[:-1]:
            part[name] = part = dict(part[name])
        part.pop(path[-1], None)
        scene = condition.robot, condition.scenario
        return *(one.canonical() for one in scene), planner

    return [group for group in run_measures.grouped(results.main, key) if len(group) > 1]


def either_success(judge: Judge, results: Results) -> list[Claim]:
    """Judge the printed percentages by either reading of a success, each a family of tests."""
    by_reading: dict[str, list[ConditionResults]] = {}
    for condition in itertools.chain(*groups_but_for(results, "success")):
        by_reading.setdefault(condition.planner.success, []).append(condition)
    families = (percentages(judge, own) for own in by_reading.values())
    return list(itertools.chain(*families))


def precision(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge that smaller stopping values give smaller errors, step by step."""
    for group in groups_but_for(results, "stop_cost_sp2"):
        own = sorted(group, key=lambda c: -float(c.planner.stop_cost_sp2))
        steps = [(small, large) for large, small in itertools.pairwise(own)]
        rows = compared(steps, measures.errors, judge.settings, named=_against)
        medians = (f"{_median(c, measures.errors)} below {c.planner.stop_cost_sp2:g}" for c in own)
        told = "; ".join(f"{row.quantity}: {judging.evidence(row, 'smaller')}" for row in rows)
        where = f": at most {own[0].planner.ga.num_generations} generations"
        told = f"median errors: {', '.join(medians)}; step by step: {told}"
        yield judge.on("precision", where=where).better_than_all(told, rows)


def generations(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge that more generations are needed at the smallest stopping value."""
    least = min(c.planner.stop_cost_sp2 for c in results.main)
    for group in groups_but_for(results, "ga", "num_generations"):
        few, *_, many = sorted(group, key=lambda c: int(c.planner.ga.num_generations))
        if few.planner.stop_cost_sp2 > least:
            continue
        attempts = (f"{c.column('term_attempts').mean():.2f}" for c in (many, few))
        spent = (_median(c, measures.effort) for c in (many, few))
        one, two = run_measures.success(many), run_measures.success(few)
        told = (
            f"runs with a solution: {judge.share(one, 1)} with at most "
            f"{many.planner.ga.num_generations} generations, {judge.share(two, 1)} "
            f"with {few.planner.ga.num_generations}; {fisher_evidence(one, two)}; mean "
            f"attempts {' and '.join(attempts)}, median evaluations {' and '.join(spent)}"
        )
        yield judge.on("generations", least=f"{least:g}").greater(told, one, two)


def coding(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge real against binary coding."""
    for group in groups_but_for(results, "ga"):
        real = [c for c in group if c.planner.ga.component == "real_genetic"]
        binary = [c for c in group if c.planner.ga.component == "binary_genetic"]
        for pair in itertools.product(real, binary):
            for what, values, word in (
                ("position error", measures.errors, "smaller"),
                ("evaluations to a solution", measures.effort, "fewer"),
            ):
                row = judge.compared(*pair, values)
                where = f", judged by {what}: {_against(*pair)}"
                told = f"median {' against '.join(_median(c, values) for c in pair)}; {{}}"
                yield judge.on("coding", where=where).better(row, word, told)


def blindness(judge: Judge, results: Results, refuted: Counts) -> Iterator[Claim]:
    """Judge that the scene is not trivial: an arm that ignores obstacles meets them."""
    for group in groups_but_for(results, "collision", "blind"):
        seeing, blind = sorted(group, key=lambda c: bool(c.planner.collision.blind))
        one, two = refuted(blind).anywhere, refuted(seeing).anywhere
        hearing = judge.on("blind_collides", who=_against(blind, seeing))
        yield hearing.greater(_shares(judge, one, two), one, two)


def positions(judge: Judge, results: Results, refuted: Counts) -> Iterator[Claim]:
    """Judge that chords, and more positions with chords, leave fewer contacts between positions."""
    pairs: list[Group] = []  # (coarse, fine)
    least = min(int(c.planner.collision.num_positions) for c in results.main)
    for group in groups_but_for(results, "collision", "swept"):
        if group[0].planner.collision.num_positions == least:
            by_name = sorted(group, key=lambda c: str(c.planner.collision.swept), reverse=True)
            pairs.append(tuple(by_name))
    for group in groups_but_for(results, "collision", "num_positions"):
        if group[0].planner.collision.swept == "chords":
            coarse, *finer = sorted(group, key=lambda c: int(c.planner.collision.num_positions))
            pairs += [(coarse, fine) for fine in finer]
    # contacts of either condition, and the tests of all pairs as one family
    counts = [(refuted(coarse).anywhere, refuted(fine).anywhere) for coarse, fine in pairs]
    p_values = inference.fisher_family(counts)
    for (coarse, fine), (one, two), p in zip(pairs, counts, p_values, strict=True):
        told = f"{_shares(judge, two, one)}; adjusted (Holm) {markdown.p_value(p)}"
        yield judge.on("fewer_contacts", who=_against(fine, coarse)).greater(told, one, two, p)
    for (_, fine), (_, two) in zip(pairs, counts, strict=True):
        positions = fine.planner.collision.num_positions
        if positions > least:
            told = f"refuted: {judge.share(two, 1)}"
            hearing = judge.on("no_contacts", positions=positions, who=fine.label)
            runs = two.total - two.having, two.total, fine.solved
            yield hearing.every(told, *runs)


def _against(one: ConditionResults, two: ConditionResults) -> str:
    return f"{one.label} against {two.label}"


def _median(condition: ConditionResults, values: Values) -> str:
    value = float(np.median(values(condition)))
    return markdown.number(float(round(value)) if 1e3 < value < np.inf else value)


def _shares(judge: Judge, one: Proportion, two: Proportion) -> str:
    shares = " against ".join(judge.share(proportion, 1) for proportion in (one, two))
    return f"{shares}; {fisher_evidence(one, two)}"
