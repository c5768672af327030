"""The page of ablations: the first condition against each of the others, on common seeds."""

from typing import NamedTuple

import numpy as np

from evoexp.papers.rana import crossover_checks, measures
from evoexp.papers.rana.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import generic, judging, markdown, run_measures, sweep_figures


class ComparedQuantity(NamedTuple):
    """A quantity in which the first condition is compared with the others."""

    short: str  # name in figures; empty: in none
    name: str
    unit: str
    values: kit.Values
    lower_is_better: bool = True


COST, EVENNESS = "best cost", "unevenness of the best, C3 + C4"
COMPARED = (
    ComparedQuantity("best cost", COST, "–", kit.by_column("best_cost")),
    ComparedQuantity("unevenness C3 + C4", EVENNESS, "deg", measures.unevenness),
    ComparedQuantity(
        "clearance",
        "clearance of the bodies over the whole motion",
        "length",
        kit.by_column("clearance"),
        lower_is_better=False,
    ),
    ComparedQuantity("", measures.FIRST_FREE, "generation", run_measures.first_feasible),
)
PARTS = ("no redistribution", "no relaxation (δ = 0)", "neither")  # of the claim


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of ablations, or the generic page if there is nothing to compare."""
    if len(results.with_data) < 2:
        return generic.page(results, settings)
    base = generic.basis(results, settings)
    unit = results.with_data[0].condition.length_unit or "–"
    first, *others = results.with_data
    pairs = [(first, other) for other in others]
    tables = {
        one.name: kit.compared(pairs, one.values, settings, lower_is_better=one.lower_is_better)
        for one in COMPARED
    }
    shown = [one for one in COMPARED if one.short and tables[one.name]]
    units = {one.name: unit if one.unit == "length" else one.unit for one in COMPARED}
    cost, _, *effort = base.quantities
    own = [generic.quantity(results, one.name, units[one.name], one.values) for one in COMPARED[1:]]
    return PAPER.page(
        results,
        "operators",
        base,
        title=f"{results.experiment or 'stored runs'}: {first.label} against each other condition",
        quantities=(cost, *own, *effort),
        claims=tuple(operator_claims(results, settings, judging.judge(results, settings, RULES))),
        checks=tuple(crossover_checks.checks(results, tables[COST], tables[EVENNESS])),
        comparisons=tuple(
            (f"{name}: {first.label} against …", rows) for name, rows in tables.items() if rows
        ),
        drawings=(
            sweep_figures.values_drawing(
                results, {f"{one.short} [{units[one.name]}]": one.values for one in shown}
            ),
            *sweep_figures.effects_drawings(
                results, settings, {one.short: tables[one.name] for one in shown}, first.label
            ),
            generic.best_drawing(results),
        ),
    )


def operator_claims(
    results: kit.Results,
    settings: kit.ReportSettings,
    judge: kit.Judge,
    who: str = "",
    first: str = "",
) -> list[kit.Claim]:
    """Judge the paper's claim about relaxation and redistribution, part by part.

    Args:
        results: Of an experiment of ablations; conditions that were not run are missing.
        settings: Levels and resamples.
        judge: With the rules of the paper.
        who: Begins each claim.
        first: Label of the printed setting; empty: the first condition with data.

    Returns:
        One claim per part that was run beside the printed setting.
    """
    named = {condition.label: condition for condition in results.with_data}
    printed = named.get(first or next(iter(named), ""))
    if printed is None:
        return []
    pairs = [(printed, other) for other in named.values() if other is not printed]
    rows = {
        one.name: {row.quantity: row for row in kit.compared(pairs, one.values, settings)}
        for one in COMPARED[:2]
    }
    parts = [other for _, other in pairs if other.label in PARTS]
    counts = {c.label: refuted(c) for c in (printed, *parts)}
    own = counts[printed.label]
    p_values = kit.holm([kit.fisher_exact(own, counts[part.label]) for part in parts])
    claims = []
    for part, p_value in zip(parts, p_values, strict=True):
        other = counts[part.label]
        compared_rows = [rows[name].get(part.label) for name in rows]
        found = [row for row in compared_rows if row is not None]
        says = [row.says(settings.significance) for row in found]
        says.append(judging.greater(other, own, p_value, settings.significance))
        told = (
            f"{_told(rows[COST].get(part.label), COST, '–')}; "
            f"{_told(rows[EVENNESS].get(part.label), EVENNESS, 'deg', (printed, part))}; "
            f"refuted motions {markdown.share(own.having, own.total)} with, "
            f"{markdown.share(other.having, other.total)} without, p = {markdown.p_value(p_value)}"
        )
        hearing = judge.on("operators_improve", who=who, without=part.label)
        claims.append(hearing.own(told, printed.done, improves(says)))
    return claims


def improves(says: list[int]) -> bool | None:
    """Return whether a part improves the search; None: nobody can say, or it is a trade.

    Args:
        says: Of each quantity: 1 if it is significantly better with the part, −1 if worse, else 0.
    """
    better, worse = 1 in says, -1 in says
    return None if better == worse else better


def refuted(condition: kit.ConditionResults) -> kit.Proportion:
    """Count the motions whose bodies touch."""
    counts = condition.verdicts
    return kit.Proportion(counts.refuted, counts.judged)


def _told(
    row: kit.Comparison | None,
    name: str,
    unit: str,
    pair: tuple[kit.ConditionResults, kit.ConditionResults] | None = None,
) -> str:
    """Return a comparison in words, with the medians of both where the pair is given."""
    if row is None:
        return f"{name}: nothing to compare"
    shown = "" if unit == "–" else f" {unit}"
    medians = ""
    if pair is not None:
        with_it, without = (markdown.number(float(np.median(measures.unevenness(c)))) for c in pair)
        medians = f"{with_it}{shown} with, {without}{shown} without, "
    difference = markdown.number(row.median_difference)
    return f"{name}: {medians}median difference {difference}{shown}, {kit.evidence(row, 'lower')}"
