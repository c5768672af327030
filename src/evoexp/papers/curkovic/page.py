"""The page of Curkovic et al. 2013, Fig. 6: methods of co-evolution side by side."""

from functools import partial

import numpy as np

from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.figures import methods
from evoexp.papers.curkovic.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown

PAIRS = (("V", "I"), ("VI", "II"), ("VII", "III"), ("VIII", "IV"))


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of methods, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    bound = measures.lower_bound(results.with_data[0])
    threshold = settings.threshold_ratio * bound
    by_label = {c.label: c for c in results.with_data}
    pairs = [(by_label[a], by_label[b]) for a, b in PAIRS if {a, b} <= set(by_label)]
    matched = partial(
        kit.compared, pairs, settings=settings, named=lambda a, b: f"{a.label} against {b.label}"
    )
    costs = matched(kit.by_column("best_cost"))
    generations = matched(partial(measures.generations_to, threshold=threshold))
    certified = matched(measures.certified_cost)
    one_scene = len({(c.condition.robot, c.condition.scenario) for c in results.with_data}) == 1
    return PAPER.page(
        results,
        "methods",
        quantities=(
            *measures.team_quantities(results, threshold),
            *generic.term_quantities(results),
        ),
        claims=_claims(results, settings, generations, costs, certified, threshold),
        checks=_checks(results, bound),
        comparisons=tuple(
            (f"{title}: matched pairs of methods", rows)
            for title, rows in (
                ("best cost of a team", costs),
                (f"generations to a team below {markdown.number(threshold)}", generations),
                (measures.CERTIFIED, certified),
            )
            if rows
        ),
        drawings=(
            _methods(results, bound, threshold) if one_scene else generic.cost_drawing(results),
        ),
    )


def _claims(
    results: kit.Results,
    settings: kit.ReportSettings,
    generations: tuple[kit.Comparison, ...],
    costs: tuple[kit.Comparison, ...],
    certified: tuple[kit.Comparison, ...],
    threshold: float,
) -> tuple[kit.Claim, ...]:
    judge = judging.judge(results, settings, RULES)
    found = [
        judge.on("faster", who="", measure=title, pair=f": {row.quantity}").better(row, word)
        for rows, title, word in (
            (generations, f"a team of cost ≤ {markdown.number(threshold)}", "earlier"),
            (costs, "the best cost at the end", "lower"),
            (certified, measures.CERTIFIED, "lower"),
        )
        for row in rows
    ]
    slowest = max((float(c.column("cpu_s").max()) for c in results.with_data), default=np.nan)
    solved, done = sum(c.solved for c in results.with_data), sum(c.done for c in results.with_data)
    planned = sum(c.planned for c in results.conditions)
    told = (
        f"{markdown.share(solved, done)} runs found one; the slowest run took "
        f"{markdown.number(slowest)} s of CPU"
    )
    in_time = solved if slowest < RULES["in_time"].limits["seconds"] else 0
    return (*found, judge.on("in_time").every(told, in_time, done, planned))


def _checks(results: kit.Results, bound: float) -> tuple[tuple[str, str], ...]:
    at_first = "; ".join(
        f"{c.label}: {int((c.column('first_feasible_generation') == 0).sum())} of {c.done}"
        for c in results.with_data
    )
    return (
        measures.rates_check(results, measures.REFUTED),
        measures.rates_check(results, measures.TOO_FAST),
        (
            "Runs whose random initial populations already hold a collision-free pair (so its "
            "first generation says nothing about a method)",
            at_first,
        ),
        (measures.BOUND, markdown.number(bound)),
    )


def _methods(results: kit.Results, bound: float, threshold: float) -> kit.Drawing:
    return PAPER.drawing(
        "fig_6_methods",
        partial(methods.methods_table, results, PAIRS, bound, threshold),
        methods.draw_methods,
        results.with_data,
    )
