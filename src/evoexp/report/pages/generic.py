"""The page of whatever has no page of its own.

Results, convergence, and comparisons with the controls.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial

import numpy as np

from evoexp.condition import Condition
from evoexp.records import FloatArray
from evoexp.report.claims import Comparison, adjusted, compare
from evoexp.report.figures import convergence
from evoexp.report.page import Drawing, Page, Quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import WRAPPED, ConditionResults, Results
from evoexp.report.statistics import spread
from evoexp.store.messages import TERM

Values = Callable[[ConditionResults], FloatArray]


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page."""
    return Page(
        title=results.experiment or "stored runs",
        introduction="",
        quantities=(*quantities(results), *term_quantities(results)),
        comparisons=comparisons(results, settings, (("best cost", True, by_column("best_cost")),)),
        drawings=(cost_drawing(results),) if results.with_data else (),
    )


def by_column(name: str) -> Values:
    """Return the function that gives a condition's column of this name."""
    return lambda condition: condition.column(name)


def quantity(results: Results, name: str, unit: str, values: Values) -> Quantity:
    """Return a row of the table of results."""
    return Quantity(name, unit, {c.label: spread(values(c)) for c in results.with_data})


def quantities(results: Results) -> tuple[Quantity, ...]:
    """Return what every planner records."""
    first = "first generation with a feasible individual (over the runs that have one)"
    return (
        quantity(results, "best cost", "–", by_column("best_cost")),
        quantity(results, first, "generation", by_column("first_feasible_generation")),
        quantity(results, "evaluations", "–", by_column("evaluations")),
        quantity(
            results, "configurations judged for collision", "–", by_column("collision_queries")
        ),
    )


def term_quantities(results: Results) -> tuple[Quantity, ...]:
    """Return the planner's own terms of the best solutions."""
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
    return Drawing(
        stem="convergence",
        title="Convergence",
        caption="Best cost so far (full) and average cost of the finite individuals of a "
        "generation "
        "(dashed): median and quartiles over replicates; dash-dotted: references. Lower is "
        "better.",
        table=partial(convergence.cost_table, results),
        draw=convergence.draw_cost,
        conditions=results.with_data,
    )


def comparisons(
    results: Results, settings: ReportSettings, compared: Sequence[tuple[str, bool, Values]]
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare every condition with the controls that stand beside it, on their common seeds.

    Args:
        results: Of the experiment.
        settings: Levels and resamples.
        compared: (quantity, whether lower is better, its values).

    Returns:
        (heading, one comparison per quantity), p-values adjusted over the quantities.
    """
    found = []
    for first in results.evolved:
        for second in results.evolved:
            if (
                first.is_control
                or not second.is_control
                or not _beside(first.condition, second.condition)
            ):
                continue
            rows = [compare_on_common_seeds(first, second, *what, settings) for what in compared]
            kept = [row for row in rows if row is not None]
            if kept:
                found.append((f"{first.label} against {second.label}", tuple(adjusted(kept))))
    return tuple(found)


def _beside(first: Condition, control: Condition) -> bool:
    """Whether a control wraps this very planner in the same scene.

    Equal evaluations and common seeds.
    """
    return control._replace(planner=getattr(control.planner, WRAPPED)) == first


def compared(
    pairs: Iterable[tuple[ConditionResults, ConditionResults]],
    values: Values,
    settings: ReportSettings,
    *,
    lower_is_better: bool = True,
    named: Callable[[ConditionResults, ConditionResults], str] = lambda first, second: second.label,
) -> tuple[Comparison, ...]:
    """Compare pairs of conditions in one quantity on their common seeds.

    Args:
        pairs: (first, second); pairs without a common seed are left out.
        values: The quantity of a condition, (done,).
        settings: Levels and resamples.
        lower_is_better: Which of two values is better.
        named: Gives the name of a pair's row; by default the label of the second condition.

    Returns:
        One comparison per pair, p-values adjusted over the pairs.
    """
    rows = [
        compare_on_common_seeds(a, b, named(a, b), lower_is_better, values, settings)
        for a, b in pairs
    ]
    return tuple(adjusted([row for row in rows if row is not None]))


def compare_on_common_seeds(
    first: ConditionResults,
    second: ConditionResults,
    quantity: str,
    lower_is_better: bool,
    values: Values,
    settings: ReportSettings,
) -> Comparison | None:
    """Compare one quantity over the replicates that both have; None where there is none."""
    common = first.summaries.index.intersection(second.summaries.index)
    x = values(first)[first.summaries.index.get_indexer(common)]
    y = values(second)[second.summaries.index.get_indexer(common)]
    known = ~(np.isnan(x) | np.isnan(y))
    if not known.any():
        return None
    return compare(
        quantity, x[known], y[known], lower_is_better, settings.confidence, settings.num_resamples
    )
