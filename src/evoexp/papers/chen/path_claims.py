"""What Chen & Zalzala 1995 claim of their grid paths (section 4.1, Fig. 2), as verdicts."""

import numpy as np

from evoexp.papers.chen import path_measures as measures
from evoexp.papers.chen.path_measures import MUCH, NEAR, Group
from evoexp.report import claims, markdown
from evoexp.report.claims import Claim, Comparison
from evoexp.report.judging import claim, evidence, not_judged
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

SOURCE = "section 4.1, Fig. 2"
DISTANCE, UNSAFENESS = "term_distance", "term_unsafeness"


def of_paths(
    results: Results, settings: ReportSettings, groups: tuple[Group, ...]
) -> tuple[Claim, ...]:
    """Return the claims of Fig. 2: they need its three weightings, in their order."""
    found = [_nearly_shortest(results, groups), *_compromise(results, settings, groups)]
    found += [_decreases(results, group) for group in groups]
    found += [one for group in groups for one in _better_than_random(results, settings, group)]
    return tuple(found)


def _nearly_shortest(results: Results, groups: tuple[Group, ...]) -> Claim:
    why, first = not_judged(results), groups[0].main
    shortest = measures.shortest(groups)
    excess = 100.0 * (first.column(DISTANCE) / shortest - 1.0)
    near = int(np.count_nonzero(excess <= 100.0 * NEAR))
    told = (
        f"median length {markdown.number(float(np.median(first.column(DISTANCE))))}, "
        f"{np.median(excess):.1f} % above the shortest {markdown.number(shortest)} (Dijkstra); "
        f"{markdown.share(near, first.done)} runs within {100 * NEAR:g} % (reproduced: more than "
        "half of the runs)"
    )
    verdict = (
        claims.NOT_JUDGED
        if why
        else claims.REPRODUCED
        if near > first.done / 2
        else claims.CONTRADICTED
    )
    return claim(
        f"{first.label}: without safety a nearly shortest path is obtained",
        SOURCE,
        told,
        verdict,
        why,
    )


def _compromise(
    results: Results, settings: ReportSettings, groups: tuple[Group, ...]
) -> list[Claim]:
    """Return the claims that compare weightings; none unless there are three."""
    if len(groups) != 3:
        return []
    a, b, c = (group.main for group in groups)
    why, shortest = not_judged(results), measures.shortest(groups)
    safer = _compared(b, a, UNSAFENESS, settings), _compared(c, b, UNSAFENESS, settings)
    shorter = _compared(b, c, DISTANCE, settings)
    both = [one for one in (safer[0], shorter) if one is not None]
    told = "; ".join(
        f"{name}: {evidence(one, word)}"
        for name, word, one in (
            (f"against {a.label}", "safer", safer[0]),
            (f"against {c.label}", "shorter", shorter),
        )
        if one is not None
    )
    verdict = claims.judge_better_than_all(why, claims.adjusted(both), settings.significance)
    text = f"{b.label}: a compromise, safer than {a.label} and shorter than {c.label}"
    found = [claim(text, SOURCE, told, verdict, why)]
    verdict = claims.judge_better(why, safer[1], settings.significance)
    told = evidence(safer[1], "safer") if safer[1] else ""
    found.append(
        claim(f"{c.label}: a very safe path, safer than {b.label}", SOURCE, told, verdict, why)
    )
    excess = 100.0 * (c.column(DISTANCE) / shortest - 1.0)
    longer = int(np.count_nonzero(excess > 100.0 * MUCH))
    told = (
        f"median {np.median(excess):.0f} % longer, {markdown.share(longer, c.done)} runs more "
        f"than {100 * MUCH:g} % (reproduced: more than half of the runs)"
        + _needed(groups[2], shortest)
    )
    verdict = (
        claims.NOT_JUDGED
        if why
        else claims.REPRODUCED
        if longer > c.done / 2
        else claims.CONTRADICTED
    )
    return [
        *found,
        claim(
            f"{c.label}: the safe path is much longer than the shortest", SOURCE, told, verdict, why
        ),
    ]


def _needed(group: Group, shortest: float) -> str:
    """Say how long the best path known is.

    What the search adds to it is not asked for by the cost.
    """
    if group.truth is None:
        return ""
    excess = 100.0 * (float(group.truth.column(DISTANCE)[0]) / shortest - 1.0)
    return f"; the best path known of this weighting is {excess:.0f} % longer, and costs less"


def _decreases(results: Results, group: Group) -> Claim:
    """Return the claim that costs decrease and converge.

    The best so far, and the average toward it.
    """
    why, c = not_judged(results), group.main
    rows = c.generations.sort_values("index").groupby("replicate")
    first, last = rows.first(), rows.last()
    lower = last["best_cost"] < first["best_cost"]
    near = last["mean_cost"] <= 1.05 * last["best_cost_in_generation"]
    holds = int((lower & near).sum())
    told = (
        f"in {markdown.share(holds, c.done)} runs the best cost falls and the last generation's "
        "average is within 5 % of its best (reproduced: all of them)"
    )
    verdict = claims.judge_all(why, holds, c.done, c.planned)
    return claim(
        f"{c.label}: path costs decrease and converge with generations", SOURCE, told, verdict, why
    )


def _better_than_random(results: Results, settings: ReportSettings, group: Group) -> list[Claim]:
    why, found = not_judged(results), []
    for control in (c for c in group.conditions if c.is_control):
        one = _compared(group.main, control, "best_cost", settings)
        verdict = claims.judge_better(why, one, settings.significance)
        text = (
            f"{group.name}: the genetic algorithm is better than random walks at equal evaluations"
        )
        told = evidence(one, "lower cost") if one else "no common seeds"
        found.append(claim(text, "section 5", told, verdict, why))
    return found


def _compared(
    first: ConditionResults, second: ConditionResults, column: str, settings: ReportSettings
) -> Comparison | None:
    values = generic.by_column(column)
    return generic.compare_on_common_seeds(first, second, second.label, True, values, settings)
