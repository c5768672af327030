"""The claims of Corsépius 2001: on tasks, and on the size of the population, metric by metric."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.measures import Tasks
from evoexp.planners.posture_es.phases import Problem
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference, judging
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import Interval, quantile
from evoexp.report.statistics.judging import Judge, fisher_evidence

TILTS = ("upright", "keep_parallel")
BALL = "ball"  # the object of the task whose planning time the paper prints
RECOMMENDED = 100.0  # individuals (section 5)
REASONABLE = {RECOMMENDED: ("reasonable", "section 5"), 50.0: ("typical", "section 4.2")}
# what else a smaller population changes
KEPT, SCALED = "all else equal", "parents in proportion, patience in evaluations"
# (task, size, its condition, that of the recommended size)
SizePair = tuple[str, float, ConditionResults, ConditionResults]
METRICS: dict[str, Values] = {
    "cycles": measures.cycles,
    "evaluations": measures.evaluations,
    "CPU time": measures.usual_seconds,
}


def judge_tasks(judge: Judge, results: Results) -> Iterator[Claim]:
    """Judge the claims that the conditions of an experiment allow to judge."""
    found = measures.obstructed(results.main)
    for c in found:
        yield judge_met(judge, c)
        if avoids := judge_free(judge, c, results):
            yield avoids
        yield from _tilt(judge, c)
        # the planning time that the paper prints beside ours
        objects = [getattr(phase.goal, "object", "") for phase in c.scenario.phases]
        if objects == [BALL] and c.solved:
            times, cycles = 1e3 * measures.usual_seconds(c), measures.cycles(c)
            shapes = c.problem(Problem).bodies.num_shapes
            words = {"milliseconds": times, "cycles": cycles, "shapes": shapes}
            verdict = f"{judging.NOT_JUDGED} (another machine, another model)"
            yield judge.on("planning_time", who=c.label).made(words, c.done, verdict)
    # for highly redundant arms the approach finds a certified path
    many = judge.rules["redundant_arms"].limits["joints"]
    arms = [c for c in found if run_measures.num_joints(c) > many]
    free = {c.label: run_measures.certified(c).having for c in arms}
    told = "; ".join(
        f"{c.label}, {run_measures.num_joints(c)} joints: goal met "
        f"{judge.share(run_measures.success(c))}, {free[c.label]} of them certified"
        for c in arms
    )
    if arms:
        runs = sum(c.done for c in arms)
        yield judge.on("redundant_arms").own(told, runs, any(free.values()))
    # the search gets stuck where the same task with a sub-goal finds a way
    for stuck, helped in measures.pairs_but_for("subgoals", found):
        one, two = run_measures.success(helped), run_measures.success(stuck)
        told = (
            f"goal met {judge.share(two)}; {helped.label}: {judge.share(one)}; "
            f"{fisher_evidence(one, two)}; ended by stagnation: "
            f"{judge.share(measures.reasons(stuck)['stagnation'])}"
        )
        yield judge.on("stuck_without_sub_goal", who=stuck.label).greater(told, one, two)
    if results.experiment in judge.rules["times_vary"].experiments:
        yield _unforeseeable(judge, found)
    if pairs := measures.pairs_but_for("empty_scene", results.main):
        yield _at_obstacles(judge, pairs)


def _unforeseeable(judge: Judge, conditions: measures.Conditions) -> Claim:
    """Judge that planning times differ from run to run: that they can hardly be foreseen."""
    spreads = {}
    for c in conditions:
        efforts = measures.evaluations(c)
        spreads[c.label] = quantile(efforts, 0.9) / quantile(efforts, 0.1)
    hearing = judge.on("times_vary")
    times = hearing.rule.limits["times"]
    wide = [name for name, ratio in spreads.items() if ratio > times]
    told = ", ".join(f"{name} {ratio:.1f}" for name, ratio in spreads.items())
    return hearing.own(told, sum(c.done for c in conditions), 2 * len(wide) > len(spreads))


def judge_met(judge: Judge, condition: ConditionResults) -> Claim:
    """Judge that goals given in work space are met by a search in configuration space."""
    met = run_measures.success(condition)
    hearing = judge.on("goals_met", who=condition.label)
    return hearing.majority(f"goal met {judge.share(met)}", *met)


def judge_free(judge: Judge, condition: ConditionResults, results: Results) -> Claim | None:
    """Judge that binary ratings of distances keep the whole motion free.

    None where no obstacle of the task ever acts: then its paths say nothing of obstacles.
    """
    if not measures.obstacles_act(condition, results):
        return None
    refuted, free = measures.refuted(condition), run_measures.certified(condition).having
    planned = refuted.total if condition.done == condition.planned else 0
    told = (
        f"{markdown.share(free, refuted.total)} solved runs certified; refuted "
        f"{judge.share(refuted)}: postures are free, motions between them are not rated"
    )
    if pairs := measures.allowed_contacts(condition):
        limit, unit = float(condition.scenario.allowed_penetration), condition.length_unit
        told += f"; may touch, {limit:g} {unit} deep at most: {pairs}"
    hearing = judge.on("paths_avoid_obstacles", who=condition.label)
    return hearing.every(told, free, refuted.total, planned)


def _tilt(judge: Judge, condition: ConditionResults) -> Iterator[Claim]:
    """Judge that a grasped object is not tilted."""
    limits = {term: getattr(condition.planner.objective, term) for term in TILTS}
    for term, limit in limits.items():
        if limit is not None and condition.solved:
            at, between = (
                condition.column(f"term_greatest_{term}{part}_deg")[run_measures.solved(condition)]
                for part in ("", "_between")
            )
            kept = run_measures.counted(between <= limit.limit)
            told = (
                f"greatest tilt at postures {markdown.number(float(at.max()))}°, between them "
                f"{markdown.number(float(between.max()))}°, limit {limit.limit:g}°; within it all "
                f"the way: {markdown.share(*kept)} solved runs"
            )
            planned = len(at) if condition.done == condition.planned else 0
            yield judge.on("not_tilted", who=condition.label).every(told, *kept, planned)


def _at_obstacles(judge: Judge, pairs: list[tuple[ConditionResults, ConditionResults]]) -> Claim:
    """Judge that obstacles, and nothing else, keep the search from its goals."""
    shares = [(run_measures.success(c), run_measures.success(empty)) for c, empty in pairs]
    adjusted = inference.fisher_family(shares)
    told = "; ".join(
        f"{c.label} {own}, empty scene {empty}, p = {markdown.p_value(p)}"
        for (c, _), (own, empty), p in zip(pairs, shares, adjusted, strict=True)
    )
    less = [
        p < judge.settings.significance
        for (own, empty), p in zip(shares, adjusted, strict=True)
        if own.share < empty.share
    ]
    runs = sum(one.total for pair in shares for one in pair)
    holds = True if any(less) else None if less else False
    return judge.on("stuck_at_obstacles").own(told, runs, holds)


class SizeComparison(NamedTuple):
    """The effort of a size over that of the recommended one, expected running times both."""

    task: str  # name of the task
    value: float  # the size
    ratio: float  # ratio of the expected efforts
    interval: Interval  # its interval
    bound: float  # the ratio that it is compared with: 1, or a proportional increase

    @property
    def says(self) -> int:
        """1 if the ratio is above the bound, −1 if it is below, 0 if neither is certain."""
        return int(self.interval.low > self.bound) - int(self.interval.high < self.bound)


def judge_study(
    judge: Judge, results: Results, sizes: Tasks, size_ratios: dict[str, list[SizeComparison]]
) -> tuple[Claim, ...]:
    """Judge the claims on the size."""
    kept, scaled = list(_beside_recommended(sizes)), list(_scaled(results, sizes))
    rows = _compared(scaled, "evaluations", judge.settings)
    return (
        *(claim for metric, rows in size_ratios.items() for claim in _larger(judge, metric, rows)),
        *(_over_proportional(judge, metric, KEPT, rows) for metric, rows in size_ratios.items()),
        _over_proportional(judge, "evaluations", SCALED, rows),
        _converges_less(judge, KEPT, kept),
        _converges_less(judge, SCALED, scaled),
        *(
            _reasonable(judge, size, metric, sizes, values)
            for size in REASONABLE
            for metric, values in METRICS.items()
        ),
    )


def _beside_recommended(found: Tasks) -> Iterator[SizePair]:
    """Yield (task, size, its condition, that of the recommended size) where either solves it."""
    for task in found:
        own = task.by_value.get(RECOMMENDED)
        for value, c in task.by_value.items():
            if own is not None and value != RECOMMENDED and (own.solved or c.solved):
                yield task.name, value, c, own


def _scaled(results: Results, found: Tasks) -> Iterator[SizePair]:
    """Yield the same of sizes whose parents and patience change with the size."""
    for task in found:
        if own := task.by_value.get(RECOMMENDED):
            for c in results.main:
                scaled = c.planner.ga.num_parents != own.planner.ga.num_parents
                if scaled and measures.scene(c) == measures.scene(own) and own.solved + c.solved:
                    yield task.name, float(c.planner.ga.num_offspring), c, own


def compare_sizes(found: Tasks, metric: str, settings: ReportSettings) -> list[SizeComparison]:
    """Compare every size with the recommended one, task by task.

    Tasks that neither size ever solves are left out.
    """
    return _compared(list(_beside_recommended(found)), metric, settings)


def _compared(pairs: list[SizePair], metric: str, settings: ReportSettings) -> list[SizeComparison]:
    """Compare efforts, as one family: levels of intervals are Bonferroni's over all of them."""
    level = 1.0 - (1.0 - settings.confidence) / max(1, len(pairs))
    rows = []
    for name, value, c, own in pairs:
        one, two = run_measures.on_common_seeds(c, own, METRICS[metric])
        above, below = inference.expected_effort(*one), inference.expected_effort(*two)
        ratio = above / below if np.isfinite(below) else 0.0
        proportional = RECOMMENDED / value if metric == "cycles" and value < RECOMMENDED else 1.0
        interval = inference.effort_ratio(one, two, level, settings.num_resamples)
        rows.append(SizeComparison(name, value, ratio, interval, proportional))
    return rows


def _ratios(rows: list[SizeComparison], says: int) -> str:
    """Return the ratios that say so, task by task: "ball × 1.8 (200), 3.4 (400)"."""
    by_task: dict[str, list[str]] = {}
    for row in rows:
        if row.says == says:
            by_task.setdefault(row.task, []).append(f"{_short(row.ratio)} ({row.value:g})")
    return "; ".join(f"{task} × {', '.join(texts)}" for task, texts in by_task.items()) or "none"


def _short(ratio: float) -> str:
    return markdown.number(float(f"{ratio:.2g}")) if np.isfinite(ratio) else "∞"


def _unless(against: object, favour: object) -> bool | None:
    """Return whether a claim holds: not if anything is against, but if anything favours it."""
    return False if against else True if favour else None


def _larger(judge: Judge, metric: str, compared: list[SizeComparison]) -> Iterator[Claim]:
    """Judge that nothing larger is faster, on any task, or, weaker, that there are such tasks."""
    rows = [row for row in compared if row.value > RECOMMENDED]
    says: dict[str, list[int]] = {}
    for row in rows:
        says.setdefault(row.task, []).append(row.says)
    told = (
        f"expected {metric} over those of 100 individuals, λ in brackets: less for "
        f"{_ratios(rows, -1)}; more for {_ratios(rows, 1)}"
    )
    seen = {row.says for row in rows}
    hearing = judge.on("larger_no_faster", metric=metric)
    yield hearing.own(told, f"{len(rows)} ratios", _unless(-1 in seen, 1 in seen))
    never = [name for name, own in says.items() if min(own) >= 0]
    slower = [name for name in never if max(says[name]) > 0]
    told = (
        f"of {len(says)} tasks nothing larger than 100 is faster on {len(never)}: "
        f"{', '.join(never) or '–'}; something larger is slower on {len(slower)} of them"
    )
    hearing = judge.on("larger_not_necessarily_faster", metric=metric)
    yield hearing.own(told, f"{len(says)} tasks", _unless(not never, slower))


def _over_proportional(
    judge: Judge, metric: str, how: str, compared: list[SizeComparison]
) -> Claim:
    """Judge that on every task every smaller population costs over-proportionally more."""
    rows = [row for row in compared if row.value < RECOMMENDED]
    says = [row.says for row in rows]
    exceeds = "100/λ" if metric == "cycles" else "1 (time goes with evaluations)"
    told = (
        f"above: {_ratios(rows, 1)}; below: {_ratios(rows, -1)}; not certain: {says.count(0)} of "
        f"{len(rows)}"
    )
    hearing = judge.on("smaller_over_proportional", metric=metric, how=how, exceeds=exceeds)
    return hearing.own(told, f"{len(rows)} ratios", _unless(-1 in says, says and 0 not in says))


def _converges_less(judge: Judge, how: str, sizes: list[SizePair]) -> Claim:
    """Judge that smaller populations meet their goals less often."""
    pairs = [pair for pair in sizes if pair[1] < RECOMMENDED]
    shares = [(run_measures.success(own), run_measures.success(c)) for _, _, c, own in pairs]
    says = [
        judging.greater(*pair, p, judge.settings.significance)
        for pair, p in zip(shares, inference.fisher_family(shares), strict=True)
    ]
    texts = "; ".join(
        f"{name} {value:g}: {smaller} for {recommended}"
        for (name, value, *_), (recommended, smaller), said in zip(pairs, shares, says, strict=True)
        if said
    )
    less, more = says.count(1), says.count(-1)
    told = (
        f"goal met significantly less often than with 100 in {less} of {len(pairs)} cases, more "
        f"often in {more}: {texts or '–'}"
    )
    hearing = judge.on("smaller_converge_less", how=how)
    return hearing.own(told, f"{len(pairs)} pairs", _unless(more, less))


def _reasonable(judge: Judge, size: float, metric: str, found: Tasks, values: Values) -> Claim:
    """Judge that a size is a reasonable one on every task that can be solved."""
    factors = {}
    for task in found:
        efforts = {
            v: inference.expected_effort(values(c), run_measures.solved(c))
            for v, c in task.by_value.items()
        }
        best = min(efforts, key=lambda value: efforts[value])
        if size in efforts and np.isfinite(efforts[best]):
            factors[task.name] = efforts[size] / efforts[best], best
    texts = (f"{name} {_short(factor)} (best: {b:g})" for name, (factor, b) in factors.items())
    most = judge.rules["reasonable"].limits["most"]
    told = f"effort of {size:g} over that of the best size: {', '.join(texts) or '–'}"
    word, where = REASONABLE[size]
    hearing = judge.on("reasonable", size=f"{size:g}", word=word, where=where, metric=metric)
    against = any(factor > most for factor, _ in factors.values())
    return hearing.own(told, f"{len(factors)} tasks", _unless(against, factors))
