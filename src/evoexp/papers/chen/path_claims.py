"""The claims of Chen & Zalzala 1995 on their grid paths (section 4.1, Fig. 2), judged."""

import numpy as np

from evoexp.papers.chen import path_measures as measures
from evoexp.papers.chen.path_measures import MUCH, NEAR, Group
from evoexp.records import FloatArray
from evoexp.report.kit import (
    Claim,
    Comparison,
    ConditionResults,
    Judge,
    ReportSettings,
    Results,
    by_column,
    compared,
    evidence,
    judging,
    markdown,
    verdicts,
)

SOURCE = "section 4.1, Fig. 2"
DISTANCE, UNSAFENESS = "term_distance", "term_unsafeness"


def judge_paths(
    results: Results, settings: ReportSettings, groups: tuple[Group, ...]
) -> tuple[Claim, ...]:
    """Judge the claims of Fig. 2: they need its three weightings, in their order."""
    judge = judging.judge(results, settings)
    return (
        _nearly_shortest(judge, groups),
        *(_compromise(judge, settings, groups) if len(groups) == 3 else ()),
        *(_decreases(judge, group.main) for group in groups),
        *(c for group in groups for c in _better_than_random(judge, settings, group)),
    )


def _excess(condition: ConditionResults, groups: tuple[Group, ...]) -> FloatArray:
    """Return the excess of each run's length over the shortest one, (done,) [%]."""
    return np.asarray(100.0 * (condition.column(DISTANCE) / measures.shortest(groups) - 1.0))


def _nearly_shortest(judge: Judge, groups: tuple[Group, ...]) -> Claim:
    first = groups[0].main
    excess = _excess(first, groups)
    near = int(np.count_nonzero(excess <= 100.0 * NEAR))
    return judge.majority(
        text=f"{first.label}: without safety a nearly shortest path is obtained",
        source=SOURCE,
        evidence=(
            f"median length {markdown.number(float(np.median(first.column(DISTANCE))))}, "
            f"{np.median(excess):.1f} % above the shortest "
            f"{markdown.number(measures.shortest(groups))} (Dijkstra); "
            f"{markdown.share(near, first.done)} runs within {100 * NEAR:g} % (reproduced: more "
            "than half of the runs)"
        ),
        holds=near,
        done=first.done,
    )


def _compromise(judge: Judge, settings: ReportSettings, groups: tuple[Group, ...]) -> list[Claim]:
    """Judge the claims that compare the three weightings."""
    a, b, c = (group.main for group in groups)
    safer = _compared(b, a, UNSAFENESS, settings)
    shorter = _compared(b, c, DISTANCE, settings)
    excess = _excess(c, groups)
    longer = int(np.count_nonzero(excess > 100.0 * MUCH))
    much = (
        f"median {np.median(excess):.0f} % longer, {markdown.share(longer, c.done)} runs more "
        f"than {100 * MUCH:g} % (reproduced: more than half of the runs)"
    )
    truth = groups[2].truth
    if truth is not None:  # the weighting itself asks for a longer path
        known = float(_excess(truth, groups)[0])
        much += f"; the best path known of this weighting is {known:.0f} % longer, and costs less"
    return [
        judge.better_than_all(
            text=f"{b.label}: a compromise, safer than {a.label} and shorter than {c.label}",
            source=SOURCE,
            evidence="; ".join(
                f"against {other.label}: {evidence(row, word)}"
                for other, word, rows in ((a, "safer", safer), (c, "shorter", shorter))
                for row in rows
            ),
            rows=verdicts.adjusted([*safer, *shorter]),
        ),
        judge.better(
            f"{c.label}: a very safe path, safer than {b.label}",
            SOURCE,
            next(iter(_compared(c, b, UNSAFENESS, settings)), None),
            "safer",
        ),
        judge.majority(
            f"{c.label}: the safe path is much longer than the shortest",
            SOURCE,
            much,
            longer,
            c.done,
        ),
    ]


def _decreases(judge: Judge, condition: ConditionResults) -> Claim:
    """Judge that the best cost decreases, and that the average cost converges toward it."""
    rows = condition.generations.sort_values("index").groupby("replicate")
    first, last = rows.first(), rows.last()
    lower = last["best_cost"] < first["best_cost"]
    holds = int((lower & (last["mean_cost"] <= 1.05 * last["best_cost_in_generation"])).sum())
    return judge.every(
        text=f"{condition.label}: path costs decrease and converge with generations",
        source=SOURCE,
        evidence=(
            f"in {markdown.share(holds, condition.done)} runs the best cost falls and the last "
            "generation's average is within 5 % of its best (reproduced: all of them)"
        ),
        holds=holds,
        done=condition.done,
        planned=condition.planned,
    )


def _better_than_random(judge: Judge, settings: ReportSettings, group: Group) -> list[Claim]:
    return [
        judge.better(
            text=(
                f"{group.name}: the genetic algorithm is better than random walks at equal "
                "evaluations"
            ),
            source="section 5",
            row=next(iter(rows), None),
            word="lower cost",
        )
        for c in group.conditions
        if c.is_control
        for rows in (_compared(group.main, c, "best_cost", settings),)
    ]


def _compared(
    first: ConditionResults, second: ConditionResults, column: str, settings: ReportSettings
) -> tuple[Comparison, ...]:
    """Compare two conditions in a column; empty if they have no common seed."""
    return compared([(first, second)], by_column(column), settings)
