"""Chen & Zalzala 1995, Fig. 9: the landscapes of two criteria, and all results on them."""

from functools import partial

from evoexp.papers.chen import cases as case_results
from evoexp.papers.chen import placement_page
from evoexp.papers.chen.cases import Case
from evoexp.papers.chen.figures import landscapes
from evoexp.report.kit import Drawing, Page, ReportSettings, Results, Table, generic, markdown

INTRODUCTION = (
    "E over θ1 and θ2, at the better θ3 of each pair; white: no posture reaches the target. The "
    "paper draws the fitness 250 − E as a surface. The criteria are judged where all methods "
    "stand side by side: `evoexp run experiment=chen_placement`."
)
HEADERS = (
    "criterion",
    "pairs of angles that are feasible",
    "local minima",
    "(θ1, θ2): E",
    "best run of the GA",
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the landscapes, or that of the placements if there are none."""
    if not case_results.fits(results):
        return generic.page(results, settings)
    cases = [case for case in case_results.cases(results) if case.landscape is not None]
    if not cases:
        return placement_page.page(results, settings)
    drawing = Drawing(
        "fig_9_landscapes",
        "Fig. 9: landscapes",
        "Points: the best of every run of the genetic algorithm; stars: the exact optimum and "
        "its mirror image; triangles: the other local minima; cross: the angles that the paper "
        "prints.",
        partial(landscapes.landscape_table, cases),
        landscapes.draw_landscape,
        tuple(c for case in cases for c in case.conditions),
    )
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        tables=(Table("Landscapes", HEADERS, tuple(map(_row, cases))),),
        drawings=(drawing,),
    )


def _row(case: Case) -> tuple[object, ...]:
    """Return a criterion's row of the table."""
    assert case.landscape is not None
    share = 100.0 * float(case.landscape.column("term_share_feasible")[0])
    told = "; ".join(f"({a:.2f}, {b:.2f})°: {e:.5g}" for a, b, e in case.minima).replace("-", "−")
    best = (
        markdown.number(float(case.plain.column("best_cost").min()))
        if case.plain is not None
        else "–"
    )
    return case.name, f"{share:.1f} %", len(case.minima), told or "–", best
