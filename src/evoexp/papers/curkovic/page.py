"""The page of Curkovic et al. 2013, Fig. 6: methods of co-evolution side by side."""

from functools import partial

import numpy as np

from evoexp.papers.curkovic import measures
from evoexp.papers.curkovic.figures import methods
from evoexp.papers.curkovic.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown

Rows = tuple[kit.Comparison, ...]
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
    certified, to = matched(measures.certified_cost), markdown.number(threshold)
    judged = {  # measure → the word of the better one, comparisons
        f"a team of cost ≤ {to}": ("earlier", generations),
        "the best cost at the end": ("lower", costs),
        measures.CERTIFIED: ("lower", certified),
    }
    one_scene = len({(c.condition.robot, c.condition.scenario) for c in results.with_data}) == 1
    drawing = PAPER.drawing(
        "fig_6_methods", methods.METHODS, results.with_data, results, PAIRS, bound, threshold
    )
    return PAPER.page(
        results,
        "methods",
        quantities=(
            *measures.team_quantities(results, "methods", threshold),
            *generic.term_quantities(results),
        ),
        claims=_claims(judging.judge(results, settings, RULES), results, judged),
        checks=_checks(results, bound),
        comparisons=tuple(
            (f"{title}: matched pairs of methods", rows)
            for title, rows in (
                ("best cost of a team", costs),
                (f"generations to a team below {to}", generations),
                (measures.CERTIFIED, certified),
            )
            if rows
        ),
        drawings=(drawing if one_scene else generic.cost_drawing(results),),
    )


def _claims(
    judge: kit.Judge,
    results: kit.Results,
    judged: dict[str, tuple[str, Rows]],
) -> tuple[kit.Claim, ...]:
    found = [
        judge.on("faster", who="", measure=title, pair=f": {row.quantity}").better(row, word)
        for title, (word, rows) in judged.items()
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
        *PAPER.checks("methods", at_first=at_first),
        (measures.BOUND, markdown.number(bound)),
    )
