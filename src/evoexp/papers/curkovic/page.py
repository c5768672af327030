"""Curkovic et al. 2013: methods of co-evolution side by side. Fig.

6, effort to a threshold, matched pairs.
"""

from functools import partial

import numpy as np

from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.figures import methods
from evoexp.records import FloatArray
from evoexp.report import claims, judging, markdown
from evoexp.report.claims import Comparison
from evoexp.report.page import Drawing, Page
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

PAIRS = (("V", "I"), ("VI", "II"), ("VII", "III"), ("VIII", "IV"))
INTRODUCTION = (
    "One population of paths per robot; a path's cost is C1 + C2 + C3 + C4, where C1 counts "
    "collisions with all paths of the other populations. The answer is a team: one path per "
    "robot, free of collision with each other; its cost is C2 + C3 + C4 (end-effector paths, "
    "turns of the links, unevenness) summed over the robots, lower is better. Methods I–IV are "
    "generational with a roulette wheel, V–VIII keep a hall of fame of pairs and lower the "
    "mutation rate."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of methods, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    first = results.with_data[0]
    bound = measures.lower_bound(first)
    threshold = settings.threshold_ratio * bound
    compared = {
        name: _matched(results, settings, name, threshold) for name in ("best cost", "generations")
    }
    one_scene = len({(c.condition.robot, c.condition.scenario) for c in results.with_data}) == 1
    drawings = (_methods(results, bound),) if one_scene else (generic.cost_drawing(results),)
    return Page(
        title=f"Curkovic et al. 2013: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=(
            *measures.team_quantities(results, threshold),
            *generic.term_quantities(results),
        ),
        claims=_claims(results, settings, compared, threshold),
        checks=_checks(results, bound),
        comparisons=tuple(
            (f"{title}: matched pairs of methods", rows)
            for title, rows in (
                ("best cost of a team", compared["best cost"]),
                (
                    f"generations to a team below {markdown.number(threshold)}",
                    compared["generations"],
                ),
            )
            if rows
        ),
        drawings=drawings,
    )


def _matched(
    results: Results, settings: ReportSettings, what: str, threshold: float
) -> tuple[Comparison, ...]:
    """Compare each method with a hall of fame with its counterpart.

    P-values adjusted over the pairs.
    """
    by_label = {c.label: c for c in results.with_data}

    def values(condition: ConditionResults) -> FloatArray:
        return (
            condition.column("best_cost")
            if what == "best cost"
            else measures.generations_to(condition, threshold)
        )

    rows = [
        generic.compare_on_common_seeds(
            by_label[a], by_label[b], f"{a} against {b}", True, values, settings
        )
        for a, b in PAIRS
        if a in by_label and b in by_label
    ]
    return tuple(claims.adjusted([row for row in rows if row is not None]))


def _claims(
    results: Results,
    settings: ReportSettings,
    compared: dict[str, tuple[Comparison, ...]],
    threshold: float,
) -> tuple[claims.Claim, ...]:
    reason, found = judging.not_judged(results), []
    for name, title in (
        ("generations", f"a team of cost ≤ {markdown.number(threshold)}"),
        ("best cost", "the end"),
    ):
        for comparison in compared[name]:
            evidence = judging.evidence(comparison, "earlier" if name == "generations" else "lower")
            verdict = claims.judge_better(reason, comparison, settings.significance)
            text = (
                f"Methods with hall of fame and Eq. 10 converge faster, judged by {title}: "
                f"{comparison.quantity}"
            )
            found.append(judging.claim(text, "section 3, Fig. 6", evidence, verdict, reason))
    slowest = max((float(c.column("cpu_s").max()) for c in results.with_data), default=np.nan)
    solved, done = sum(c.solved for c in results.with_data), sum(c.done for c in results.with_data)
    within = claims.judge_all(
        reason, solved if slowest < 10.0 else 0, done, sum(c.planned for c in results.conditions)
    )
    found.append(
        judging.claim(
            "A collision-free solution in less than 10 s",
            "section 3",
            f"{markdown.share(solved, done)} runs found one; the slowest run took "
            f"{markdown.number(slowest)} s of CPU",
            within,
            reason,
        )
    )
    return tuple(found)


def _checks(results: Results, bound: float) -> tuple[tuple[str, str], ...]:
    at_first = "; ".join(
        f"{c.label}: {int((c.column('first_feasible_generation') == 0).sum())} of {c.done}"
        for c in results.with_data
    )
    return (
        (f"Solved motions that fail: {measures.REFUTED}", measures.rates_text(results, 0)),
        (f"Solved motions that fail: {measures.TOO_FAST}", measures.rates_text(results, 2)),
        (
            "Runs whose random initial populations already hold a collision-free pair (so its "
            "first generation says nothing about a method)",
            at_first,
        ),
        (
            "Lower bound of a team's cost: straight end-effector paths, least turns of the links",
            markdown.number(bound),
        ),
    )


def _methods(results: Results, bound: float) -> Drawing:
    return Drawing(
        "fig_6_methods",
        "Fig. 6: convergence of the methods, and their results",
        "The paper shows the cost of 20 runs per method with standard deviation, and a box plot. "
        "Here: the cheapest collision-free team so far (mean and standard deviation over the "
        "runs that have one by then), and its cost at the end of each run (boxes: median and "
        "quartiles, whiskers to the last value within 1.5 interquartile ranges, every run a "
        "point). Methods I–IV dashed.",
        partial(methods.methods_table, results, bound),
        methods.draw_methods,
        results.with_data,
    )
