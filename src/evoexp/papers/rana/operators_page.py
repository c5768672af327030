"""The page of ablations: the first condition against each other one, on common seeds."""

from functools import partial

from evoexp.report import claims, judging, markdown
from evoexp.report.claims import Comparison
from evoexp.report.figures import convergence, effects
from evoexp.report.page import Drawing, Page
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import Results

COMPARED = (  # name in figures, name, unit, whether lower is better, column of the summaries
    ("best cost", "best cost", "–", True, "best_cost"),
    ("clearance", "clearance of the bodies over the whole motion", "length", False, "clearance"),
    (
        "start",
        "first generation with a collision-free individual",
        "generation",
        True,
        "first_feasible_generation",
    ),
)
DRAWN = 2  # of them
INTRODUCTION = (
    "Each condition changes one part of the first one; all share their seeds. Costs are measured "
    "by the same formula, except that collision substeps look for collisions between via-points, "
    "too. Without elites a generation evaluates as many individuals more as there were elites."
)
PARTS = ("no redistribution", "no relaxation (δ = 0)", "neither")  # what the claim is about


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page."""
    if len(results.with_data) < 2:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    unit = results.with_data[0].condition.length_unit or "–"
    tables = {
        name: _against_first(results, settings, column, lower)
        for _, name, _, lower, column in COMPARED
    }
    units = {name: unit if of == "length" else of for _, name, of, _, _ in COMPARED}
    first = results.with_data[0].label
    quantities = list(base.quantities)
    quantities.insert(
        1, generic.quantity(results, COMPARED[1][1], unit, generic.by_column("clearance"))
    )
    drawn = {
        f"{short} [{units[name]}]": generic.by_column(column)
        for short, name, _, _, column in COMPARED[:DRAWN]
    }
    by_name = {short: tables[name] for short, name, _, _, _ in COMPARED[:DRAWN]}
    return base._replace(
        title=f"{results.experiment or 'stored runs'}: {first} against each other condition",
        introduction=INTRODUCTION,
        quantities=tuple(quantities),
        claims=_claims(results, settings, tables[COMPARED[0][1]]),
        comparisons=tuple(
            (f"{name}: {first} against …", rows) for name, rows in tables.items() if rows
        ),
        drawings=(
            _drawing(
                results,
                "values",
                "Every condition",
                VALUES,
                partial(effects.values_table, results, drawn),
            ),
            _drawing(
                results,
                "effects",
                f"How often {first} is better",
                EFFECTS,
                partial(effects.effects_table, by_name, settings.significance),
            ),
            _drawing(
                results,
                "convergence",
                "Convergence",
                CONVERGENCE,
                partial(convergence.cost_table, results),
            ),
        ),
    )


VALUES = (
    "Boxes: median and quartiles, whiskers to the last value within 1.5 interquartile ranges, "
    "every replicate a point; dashed: median of the first condition."
)
EFFECTS = (
    "Vargha and Delaney's A12 with its bootstrap interval: the share of pairs of runs in which "
    "the first condition is better than the other one; dashed: no difference."
)
CONVERGENCE = "Median of the best cost so far over replicates. Lower is better."
_DRAW = {
    "values": effects.draw_values,
    "effects": effects.draw_effects,
    "convergence": convergence.draw_best,
}


def _drawing(results: Results, stem: str, title: str, caption: str, table: partial) -> Drawing:  # type: ignore[type-arg]
    return Drawing(stem, title, caption, table, _DRAW[stem], results.with_data)


def _against_first(
    results: Results, settings: ReportSettings, column: str, lower_is_better: bool
) -> tuple[Comparison, ...]:
    """Compare one quantity of the first condition with each other one.

    P-values adjusted over them.
    """
    first, *others = results.with_data
    values = generic.by_column(column)
    rows = [
        generic.compare_on_common_seeds(
            first, other, other.label, lower_is_better, values, settings
        )
        for other in others
    ]
    return tuple(claims.adjusted([row for row in rows if row is not None]))


def _claims(
    results: Results, settings: ReportSettings, costs: tuple[Comparison, ...]
) -> tuple[claims.Claim, ...]:
    """Judge the paper's claim about the two operators, part by part."""
    reason = judging.not_judged(results)
    found = []
    for comparison in costs:
        if comparison.quantity not in PARTS:
            continue
        difference = markdown.number(comparison.median_difference)
        told = (
            f"median difference of the best cost {difference}; with it "
            f"{judging.evidence(comparison, 'better')}"
        )
        text = f"Relaxation and redistribution improve the search: against {comparison.quantity}"
        verdict = claims.judge_better(reason, comparison, settings.significance)
        found.append(judging.claim(text, "section 5", told, verdict, reason))
    return tuple(found)
