"""The claims of Corsépius 2001: on tasks, and on the size of the population, metric by metric."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.measures import Conditions, Tasks
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference, judging
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import Interval, quantile
from evoexp.report.statistics.judging import Judge

BALL = "ball"  # the object of the task whose planning time the paper prints
RECOMMENDED = 100.0  # individuals (section 5)
SCALES = {"cycles": 1.0, "evaluations": 1.0, "CPU time": 1e3}  # [1/s] of a time
SCALED = "parents in proportion, patience in evaluations"
# (task, size, its condition, that of the recommended size)
SizePair = tuple[str, float, ConditionResults, ConditionResults]
METRICS: dict[str, Values] = {
    "cycles": measures.cycles,
    "evaluations": measures.evaluations,
    "CPU time": measures.usual_seconds,
}


def redundant_arms(judge: Judge, obstructed: Conditions) -> Iterator[Claim]:
    """Judge that for highly redundant arms the approach finds a certified path."""
    many = judge.rules["redundant_arms"].limits["joints"]
    arms = [c for c in obstructed if run_measures.num_joints(c) > many]
    free = {c.label: run_measures.certified(c).having for c in arms}
    told = "; ".join(
        f"{c.label}, {run_measures.num_joints(c)} joints: goal met "
        f"{judge.share(run_measures.success(c))}, {free[c.label]} of them certified"
        for c in arms
    )
    if arms:
        runs = sum(c.done for c in arms)
        yield judge.on("redundant_arms").own(told, runs, any(free.values()))


def times_vary(judge: Judge, results: Results, obstructed: Conditions) -> Iterator[Claim]:
    """Judge that planning times differ from run to run: that they can hardly be foreseen."""
    hearing = judge.on("times_vary")
    if results.experiment in hearing.rule.experiments:
        efforts = {c.label: measures.evaluations(c) for c in obstructed}
        ratios = {name: quantile(e, 0.9) / quantile(e, 0.1) for name, e in efforts.items()}
        wide = [name for name, ratio in ratios.items() if ratio > hearing.rule.limits["times"]]
        told = ", ".join(f"{name} {ratio:.1f}" for name, ratio in ratios.items())
        yield hearing.own(told, sum(c.done for c in obstructed), 2 * len(wide) > len(ratios))


def stuck_at_obstacles(judge: Judge, empty_scenes: measures.EmptyScenes) -> Iterator[Claim]:
    """Judge that obstacles, and nothing else, keep the search from its goals."""
    told = "; ".join(
        f"{c.label} {own}, empty scene {empty}, p = {markdown.p_value(p)}"
        for (c, _), (own, empty), p in empty_scenes
    )
    level = judge.settings.significance
    less = [p < level for _, (own, empty), p in empty_scenes if own.share < empty.share]
    if empty_scenes:
        runs = sum(one.total for _, shares, _ in empty_scenes for one in shares)
        holds = True if any(less) else None if less else False
        yield judge.on("stuck_at_obstacles").own(told, runs, holds)


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


def _beside_recommended(sizes: Tasks) -> Iterator[SizePair]:
    """Yield (task, size, its condition, that of the recommended size) where either solves it."""
    for task in sizes:
        own = task.by_value.get(RECOMMENDED)
        for value, c in task.by_value.items():
            if own is not None and value != RECOMMENDED and (own.solved or c.solved):
                yield task.name, value, c, own


def _scaled(results: Results, sizes: Tasks) -> Iterator[SizePair]:
    """Yield the same of sizes whose parents and patience change with the size."""
    for task in sizes:
        if own := task.by_value.get(RECOMMENDED):
            for c in results.main:
                scaled = c.planner.ga.num_parents != own.planner.ga.num_parents
                if scaled and measures.scene(c) == measures.scene(own) and own.solved + c.solved:
                    yield task.name, float(c.planner.ga.num_offspring), c, own


def compare_sizes(
    pairs: list[SizePair], metric: str, settings: ReportSettings
) -> list[SizeComparison]:
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


def larger_sizes(judge: Judge, metric: str, ratios: list[SizeComparison]) -> Iterator[Claim]:
    """Judge that nothing larger is faster, on any task, or, weaker, that there are such tasks."""
    rows = [row for row in ratios if row.value > RECOMMENDED]
    says: dict[str, list[int]] = {}
    for row in rows:
        says.setdefault(row.task, []).append(row.says)
    told = {"metric": metric, "less": _ratios(rows, -1), "more": _ratios(rows, 1)}
    seen = {row.says for row in rows}
    hearing = judge.on("larger_no_faster", metric=metric)
    yield hearing.own(told, f"{len(rows)} ratios", _unless(-1 in seen, 1 in seen))
    never = [name for name, own in says.items() if min(own) >= 0]
    slower = [name for name in never if max(says[name]) > 0]
    hearing = judge.on("larger_not_necessarily_faster", metric=metric)
    words: dict[str, object] = {"tasks": len(says), "never": len(never), "slower": len(slower)}
    words |= {"names": ", ".join(never) or "–"}
    yield hearing.own(words, f"{len(says)} tasks", _unless(not never, slower))


def over_proportional(judge: Judge, metric: str, how: str, ratios: list[SizeComparison]) -> Claim:
    """Judge that on every task every smaller population costs over-proportionally more."""
    rows = [row for row in ratios if row.value < RECOMMENDED]
    says = [row.says for row in rows]
    exceeds = "100/λ" if metric == "cycles" else "1 (time goes with evaluations)"
    told: dict[str, object] = {"above": _ratios(rows, 1), "below": _ratios(rows, -1)}
    told |= {"uncertain": says.count(0), "count": len(rows)}
    hearing = judge.on("smaller_over_proportional", metric=metric, how=how, exceeds=exceeds)
    return hearing.own(told, f"{len(rows)} ratios", _unless(-1 in says, says and 0 not in says))


def converges_less(judge: Judge, how: str, size_pairs: list[SizePair]) -> Claim:
    """Judge that smaller populations meet their goals less often."""
    pairs = [pair for pair in size_pairs if pair[1] < RECOMMENDED]
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
    told = {"less": less, "more": more, "pairs": len(pairs), "texts": texts or "–"}
    hearing = judge.on("smaller_converge_less", how=how)
    return hearing.own(told, f"{len(pairs)} pairs", _unless(more, less))


def reasonable(
    judge: Judge, size: float, word: str, where: str, metric: str, sizes: Tasks
) -> Claim:
    """Judge that a size is a reasonable one on every task that can be solved."""
    factors = {}
    for task in sizes:
        efforts = {
            v: inference.expected_effort(METRICS[metric](c), run_measures.solved(c))
            for v, c in task.by_value.items()
        }
        best = min(efforts, key=lambda value: efforts[value])
        if size in efforts and np.isfinite(efforts[best]):
            factors[task.name] = efforts[size] / efforts[best], best
    texts = (f"{name} {_short(factor)} (best: {b:g})" for name, (factor, b) in factors.items())
    most = judge.rules["reasonable"].limits["most"]
    told = f"effort of {size:g} over that of the best size: {', '.join(texts) or '–'}"
    hearing = judge.on("reasonable", size=f"{size:g}", word=word, where=where, metric=metric)
    against = any(factor > most for factor, _ in factors.values())
    return hearing.own(told, f"{len(factors)} tasks", _unless(against, factors))


def size_rows(sizes: Tasks, settings: ReportSettings) -> Iterator[tuple[str, ...]]:
    """Yield success and expected running times with their intervals, a row per task and size."""
    level = settings.confidence
    for task in sizes:
        for value, c in task.by_value.items():
            shares = (
                count(c).with_interval(level) for count in (run_measures.success, measures.refuted)
            )
            efforts = []  # expected running times with their intervals
            for metric, scale in SCALES.items() if c.solved else ():
                runs = METRICS[metric](c), run_measures.solved(c)
                interval = inference.expected_interval(*runs, level, settings.num_resamples)
                expected, low, high = (
                    markdown.number(float(f"{scale * value:.3g}"))
                    for value in (inference.expected_effort(*runs), *interval)
                )
                efforts.append(f"{expected} [{low}, {high}]")
            yield task.name, f"{value:g}", *shares, *(efforts or ["∞"] * len(SCALES))


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # (a task without sub-goals, the same one with them)
    "sub_goal_pairs": lambda obstructed: measures.pairs_but_for("subgoals", obstructed),
    # the paper prints the planning time of this task
    "is_ball": lambda condition: (
        [getattr(phase.goal, "object", "") for phase in condition.scenario.phases] == [BALL]
        and condition.solved
    ),
    "milliseconds": lambda condition: 1e3 * measures.usual_seconds(condition),
    # solved runs of a condition whose planned runs are all done
    "solved_of_planned": lambda condition: condition.solved * (condition.done == condition.planned),
    # the tilts of a grasped object that the task of solved runs limits, each with its limit
    "limited_tilts": lambda condition: [
        (term, limit.limit)
        for term in measures.TILTS
        for limit in (getattr(condition.planner.objective, term),)
        if limit is not None and condition.solved
    ],
    "tilt_at": lambda condition, tilt: measures.tilts_of_solved(condition, tilt),
    "tilt_between": lambda condition, tilt: measures.tilts_of_solved(condition, f"{tilt}_between"),
    "not_tilted": lambda tilt_between, most: tilt_between <= most,
    # which contacts the exact verdict allows
    "may_touch": lambda condition: (
        f"; may touch, {float(condition.scenario.allowed_penetration):g} {condition.length_unit} "
        f"deep at most: {pairs}"
        if (pairs := measures.allowed_contacts(condition))
        else ""
    ),
    "sizes": lambda results: measures.tasks(results, "num_offspring"),
    "num_runs": lambda sizes: sum(c.done for c in sizes.conditions),
    # what else a smaller population changes, with the pairs of sizes
    "paired_sizes": lambda results, sizes: [
        ("all else equal", list(_beside_recommended(sizes))),
        (SCALED, list(_scaled(results, sizes))),
    ],
    "size_ratios": lambda paired_sizes, settings: {
        metric: compare_sizes(paired_sizes[0][1], metric, settings) for metric in METRICS
    },
    # (metric, what else changes, ratios)
    "smaller_sizes": lambda size_ratios, paired_sizes, settings: [
        *((metric, paired_sizes[0][0], ratios) for metric, ratios in size_ratios.items()),
        ("evaluations", SCALED, compare_sizes(paired_sizes[1][1], "evaluations", settings)),
    ],
    "are_compared": lambda size_ratios: any(size_ratios.values()),
}
