"""The claims of Chen & Zalzala 1995 on their grid paths (section 4.1, Fig. 2), judged."""

from collections.abc import Iterator

import numpy as np

from evoexp.papers.chen import path_measures as measures
from evoexp.papers.chen.path_measures import Group
from evoexp.papers.chen.rules import RULES
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import judging, markdown

DISTANCE, UNSAFENESS, COST = "term_distance", "term_unsafeness", "best_cost"


def judge_paths(
    results: kit.Results, settings: kit.ReportSettings, groups: tuple[Group, ...]
) -> tuple[kit.Claim, ...]:
    """Judge the claims of Fig. 2: they need its three weightings, in their order."""
    judge = judging.judge(results, settings, RULES)
    return (
        nearly_shortest(judge, groups[0].main, groups[0].main.label, measures.shortest(groups)),
        *(_compromise(judge, settings, groups) if len(groups) == 3 else ()),
        *(_converges(judge, group.main) for group in groups),
        *(
            nearly_best(judge, group.main, group.main.label, group.optimum, group.bound)
            for group in groups
            if group.truth is not None
        ),
        *(claim for group in groups for claim in _evolution_of(judge, settings, group)),
    )


def excess_of(condition: kit.ConditionResults, shortest: float) -> FloatArray:
    """Return the excess of each run's length over the shortest one, (done,) [%]."""
    return np.asarray(100.0 * (condition.column(DISTANCE) / shortest - 1.0))


def nearly_shortest(
    judge: kit.Judge, condition: kit.ConditionResults, label: str, shortest: float
) -> kit.Claim:
    """Judge that paths are nearly shortest without safety."""
    excess, limit = excess_of(condition, shortest), RULES["nearly_shortest"].limits["near_percent"]
    near = int(np.count_nonzero(excess <= limit))
    return judge.on("nearly_shortest", condition=label).majority(
        f"median length {markdown.number(float(np.median(condition.column(DISTANCE))))}, "
        f"{np.median(excess):.1f} % above the shortest {markdown.number(shortest)} (Dijkstra); "
        f"{markdown.share(near, condition.done)} runs",
        near,
        condition.done,
    )


def nearly_best(
    judge: kit.Judge, condition: kit.ConditionResults, label: str, known: float, bound: float
) -> kit.Claim:
    """Judge that costs are near that of the best path known."""
    gaps, limit = measures.gaps(condition, known), RULES["nearly_best"].limits["near_percent"]
    near = int(np.count_nonzero(gaps <= limit))
    return judge.on("nearly_best", condition=label).majority(
        f"median {markdown.number(float(np.median(condition.column(COST))))}, "
        f"{np.median(gaps):.1f} % above the best path known "
        f"({markdown.number(known)}; no path costs less than {markdown.number(bound)}); "
        f"{markdown.share(near, condition.done)} runs",
        near,
        condition.done,
    )


def much_longer(
    judge: kit.Judge,
    condition: kit.ConditionResults,
    label: str,
    shortest: float,
    truth: kit.ConditionResults | None,
) -> kit.Claim:
    """Judge that the safe path is much longer, and tell how long the best path known is."""
    excess, limit = excess_of(condition, shortest), RULES["much_longer"].limits["much_percent"]
    longer = int(np.count_nonzero(excess > limit))
    told = f"median {np.median(excess):.0f} % longer, {markdown.share(longer, condition.done)} runs"
    if truth is not None:
        known = float(excess_of(truth, shortest)[0])
        told += f"; the best path known of this weighting is {known:.0f} % longer, and costs less"
    return judge.on("much_longer", condition=label).majority(told, longer, condition.done)


def _compromise(
    judge: kit.Judge, settings: kit.ReportSettings, groups: tuple[Group, ...]
) -> tuple[kit.Claim, ...]:
    """Judge the claims that compare the three weightings."""
    a, b, c = (group.main for group in groups)
    safer = _compared(b, a, UNSAFENESS, settings)
    shorter = _compared(b, c, DISTANCE, settings)
    told = "; ".join(
        f"against {other.label}: {kit.evidence(row, word)}"
        for other, word, rows in ((a, "safer", safer), (c, "shorter", shorter))
        for row in rows
    )
    rows = kit.adjusted([*safer, *shorter])
    safest = next(iter(_compared(c, b, UNSAFENESS, settings)), None)
    return (
        judge.on("compromise", condition=b.label, first=a.label, last=c.label).better_than_all(
            told, rows
        ),
        judge.on("safest", condition=c.label, other=b.label).better(safest, "safer"),
        much_longer(judge, c, c.label, measures.shortest(groups), groups[2].truth),
    )


def _converges(judge: kit.Judge, condition: kit.ConditionResults) -> kit.Claim:
    """Judge that the best cost decreases, and that the average cost converges toward it."""
    rows = condition.generations.sort_values("index").groupby("replicate")
    first, last = rows.first(), rows.last()
    lower = last["best_cost"] < first["best_cost"]
    most = 1.0 + RULES["converges"].limits["spread_percent"] / 100.0
    holds = int((lower & (last["mean_cost"] <= most * last["best_cost_in_generation"])).sum())
    complete = 0 < condition.planned <= condition.done
    return judge.on("converges", condition=condition.label).own(
        f"{markdown.share(holds, condition.done)} runs",
        condition.done,
        False if holds < condition.done else True if complete else None,
    )


def _evolution_of(
    judge: kit.Judge, settings: kit.ReportSettings, group: Group
) -> Iterator[kit.Claim]:
    """Judge the genetic algorithm, without and with elitism, against all controls."""
    controls = tuple(c for c in group.conditions if c.is_control)
    if controls:
        for own in group.conditions:
            if not own.is_control:
                yield evolution(judge, settings, own, own.label, controls)


def evolution(
    judge: kit.Judge,
    settings: kit.ReportSettings,
    own: kit.ConditionResults,
    label: str,
    controls: tuple[kit.ConditionResults, ...],
) -> kit.Claim:
    """Judge that evolution helps, and tell its gain over the best control."""
    rows = kit.compared([(own, c) for c in controls], kit.by_column(COST), settings)
    medians = {control_name(c): float(np.median(c.column(COST))) for c in controls}
    best, median = min(medians, key=lambda name: medians[name]), float(np.median(own.column(COST)))
    gain = medians[best] - median
    told = "; ".join(
        f"against {control_name(c)} (median {markdown.number(medians[control_name(c)])}): "
        f"{kit.evidence(row, 'lower cost')}"
        for c in controls
        for row in rows
        if row.quantity == c.label
    )
    verb = "saves" if gain >= 0.0 else "loses"
    return judge.on(
        "path_evolution", condition=label, controls=" and ".join(medians)
    ).better_than_all(
        f"median {markdown.number(median)}: beside the best control, {best}, evolution {verb} "
        f"{abs(gain):.3g} ({100.0 * abs(gain) / medians[best]:.0f} %); {told}",
        rows,
    )


def control_name(condition: kit.ConditionResults) -> str:
    """Return the name of a control in sentences."""
    component = str(condition.condition.planner.component)
    return {"random_search": "random walks"}.get(component, component.replace("_", " "))


def _compared(
    first: kit.ConditionResults,
    second: kit.ConditionResults,
    column: str,
    settings: kit.ReportSettings,
) -> tuple[kit.Comparison, ...]:
    """Compare two conditions in a column; empty if they have no common seed."""
    return kit.compared([(first, second)], kit.by_column(column), settings)
