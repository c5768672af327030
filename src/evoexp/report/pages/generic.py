"""The page of any experiment: results, convergence, all conditions compared with each other."""

from evoexp.report.figures import convergence
from evoexp.report.pages import motion_pictures, pairwise, sweep_figures
from evoexp.report.pages.page_parts import Drawing, Page, Quantity
from evoexp.report.pages.page_words import WORDS, quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.run_measures import first_feasible, search_seconds
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import by_column, compared_with_controls
from evoexp.store.messages import TERM

FEW = 4  # conditions whose average costs can be drawn beside the best ones
SCENES = (
    "The conditions differ in robot or scenario: their costs are compared as numbers, whatever "
    "they measure."
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of any experiment, whatever its planners are.

    All conditions are compared with each other in best cost, effort and shares of runs; see
    `pairwise`.
    """
    base = basis(results, settings)
    if not results.with_data:
        return base
    scenes = {(c.condition.robot, c.condition.scenario) for c in results.with_data}
    drawn = [cost_drawing(results)] if len(results.evolved) <= FEW else [best_drawing(results)]
    boxes = {one.name: one.values for one in pairwise.differing(results)}
    if boxes:
        drawn.append(sweep_figures.values_drawing(results, boxes))
    shown = motion_pictures.best_motions(results)
    return base._replace(
        introduction=SCENES if len(scenes) > 1 else "",
        quantities=(
            *base.quantities,
            quantity(results, "CPU time of the search", "s", search_seconds),
        ),
        checks=motion_pictures.notes(shown),
        tables=pairwise.share_tables(results, settings),
        comparisons=pairwise.comparisons(results, settings),
        drawings=(
            *drawn,
            *pairwise.matrix_drawing(results, settings),
            *motion_pictures.drawings(shown),
        ),
    )


def basis(results: Results, settings: ReportSettings) -> Page:
    """Build the beginning of a paper's page: quantities, controls and convergence."""
    return Page(
        title=results.experiment or "stored runs",
        introduction="",
        quantities=(*quantities(results), *term_quantities(results)),
        comparisons=compared_with_controls(
            results, settings, (("best cost", True, by_column("best_cost")),)
        ),
        drawings=(cost_drawing(results),) if results.with_data else (),
    )


def quantities(results: Results) -> tuple[Quantity, ...]:
    """Return the rows of the quantities that every planner records."""
    first = "first generation with a feasible individual (∞: none in the whole run)"
    return (
        quantity(results, "best cost", "–", by_column("best_cost")),
        quantity(results, first, "generation", first_feasible),
        quantity(results, "evaluations", "–", by_column("evaluations")),
        quantity(
            results, "configurations judged for collision", "–", by_column("collision_queries")
        ),
    )


def term_quantities(results: Results) -> tuple[Quantity, ...]:
    """Return the rows of the planner's own terms, those of the best solutions."""
    rows = []
    for term in results.terms:
        name, unit = term.replace("_", " "), "–"
        if term.endswith(("_deg", "_rad")):
            name, _, unit = name.rpartition(" ")
        elif "distance" in term or "clearance" in term:
            unit = results.with_data[0].condition.length_unit or "–"
        rows.append(quantity(results, name, unit, by_column(TERM + term)))
    return tuple(rows)


def cost_drawing(results: Results) -> Drawing:
    """Return the figure of convergence."""
    return WORDS.drawing("convergence", convergence.COST, results.with_data, results)


def best_drawing(results: Results) -> Drawing:
    """Return the figure of the best costs only, where averages would hide them."""
    return WORDS.drawing("best", convergence.BEST, results.with_data, results)
