"""The page of ablations: the first condition against each of the others, on common seeds."""

from evoexp.report.kit import (
    Claim,
    Comparison,
    Page,
    ReportSettings,
    Results,
    Values,
    by_column,
    compared,
    generic,
    judging,
    markdown,
    sweep_figures,
)

COMPARED = (  # name in figures, name, unit, column, whether lower is better
    ("best cost", "best cost", "–", "best_cost", True),
    ("clearance", "clearance of the bodies over the whole motion", "length", "clearance", False),
    (
        "start",
        "first generation with a collision-free individual",
        "generation",
        "first_feasible_generation",
        True,
    ),
)
DRAWN = 2  # of them
INTRODUCTION = (
    "Each condition changes one part of the first one; all share their seeds. Costs are measured "
    "by the same formula, except that collision substeps look for collisions between via-points, "
    "too. Without elites a generation evaluates as many individuals more as there were elites."
)
PARTS = (
    "no redistribution",
    "no relaxation (δ = 0)",
    "neither",
)  # of the claim


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of ablations, or the generic page if there is nothing to compare."""
    if len(results.with_data) < 2:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    unit = results.with_data[0].condition.length_unit or "–"
    first, *others = results.with_data
    pairs = [(first, other) for other in others]
    tables, by_name, drawn = {}, {}, dict[str, Values]()
    for short, name, of, column, lower in COMPARED:
        values = by_column(column)
        tables[name] = compared(pairs, values, settings, lower_is_better=lower)
        if len(drawn) < DRAWN:
            drawn[f"{short} [{unit if of == 'length' else of}]"] = values
            by_name[short] = tables[name]
    cost, *quantities = base.quantities
    clearance = generic.quantity(results, COMPARED[1][1], unit, by_column("clearance"))
    return base._replace(
        title=f"{results.experiment or 'stored runs'}: {first.label} against each other condition",
        introduction=INTRODUCTION,
        quantities=(cost, clearance, *quantities),
        claims=_claims(results, settings, tables[COMPARED[0][1]]),
        comparisons=tuple(
            (f"{name}: {first.label} against …", rows) for name, rows in tables.items() if rows
        ),
        drawings=(
            sweep_figures.values_drawing(results, drawn),
            sweep_figures.effects_drawing(results, settings, by_name, first.label),
            generic.best_drawing(results),
        ),
    )


def _claims(
    results: Results, settings: ReportSettings, costs: tuple[Comparison, ...]
) -> tuple[Claim, ...]:
    """Judge the paper's claim about the two operators, part by part."""
    judge = judging.judge(results, settings)
    found = []
    for row in (row for row in costs if row.quantity in PARTS):
        difference = markdown.number(row.median_difference)
        text = f"Relaxation and redistribution improve the search: against {row.quantity}"
        told = f"median difference of the best cost {difference}; with it {{}}"
        found.append(judge.better(text, "section 5", row, "better", told))
    return tuple(found)
