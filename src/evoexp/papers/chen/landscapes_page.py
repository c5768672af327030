"""Chen & Zalzala 1995, Fig. 9: the landscapes of two criteria, with everybody's results on them."""

from functools import partial

import numpy as np

from evoexp.papers.chen import cases as case_results
from evoexp.papers.chen import placement_page
from evoexp.papers.chen.figures import landscapes
from evoexp.report import markdown
from evoexp.report.page import Drawing, Page, Table
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

INTRODUCTION = (
    "E over θ1 and θ2, at the better θ3 of each pair; white: no posture reaches the target. The "
    "paper draws the fitness 250 − E as a surface. The criteria are judged where all methods "
    "stand side by side: `evoexp run experiment=chen_placement`."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; that of the placements where there is no landscape."""
    if not results.with_data or not case_results.fits(results):
        return generic.page(results, settings)
    cases = [case for case in case_results.cases(results) if case.landscape is not None]
    if not cases:
        return placement_page.page(results, settings)
    rows = []
    for case in cases:
        assert case.landscape is not None
        share = 100.0 * float(case.landscape.column("term_share_feasible")[0])
        minima = case.optimum.array("minima") if case.optimum is not None else np.empty((0, 3))
        told = "; ".join(f"({a:.2f}, {b:.2f})°: {e:.5g}" for a, b, e in minima).replace("-", "−")
        costs = case.plain.column("best_cost") if case.plain is not None else np.empty(0)
        best = markdown.number(float(costs.min())) if len(costs) else "–"
        rows.append((case.name, f"{share:.1f} %", len(minima), told or "–", best))
    headers = (
        "criterion",
        "pairs of angles that are feasible",
        "local minima",
        "(θ1, θ2): E",
        "best run of the GA",
    )
    shown = tuple(c for case in cases for c in case[1:] if isinstance(c, ConditionResults))
    drawing = Drawing(
        "fig_9_landscapes",
        "Fig. 9: landscapes",
        "Points: the best of every run of the genetic algorithm; stars: the exact optimum and "
        "its mirror image; triangles: the other local minima; cross: the angles that the paper "
        "prints.",
        partial(landscapes.landscape_table, cases),
        landscapes.draw_landscape,
        shown,
    )
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        tables=(Table("Landscapes", headers, tuple(rows)),),
        drawings=(drawing,),
    )
