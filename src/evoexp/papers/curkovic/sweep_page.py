"""Curkovic et al. 2013: settings of a method side by side.

The first of a family against each other one of it.
"""

from collections.abc import Sequence
from functools import partial

import pandas as pd

from evoexp.papers.curkovic import claims, families, measures
from evoexp.papers.curkovic.families import Tested
from evoexp.papers.curkovic.figures import defect_rates
from evoexp.report import markdown
from evoexp.report.figures import effects
from evoexp.report.page import Drawing, Page, Quantity
from evoexp.report.pages import generic
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import Results

INTRODUCTION = (
    "Each condition changes one part of a method; all share their seeds. The cost of a team is "
    "C2 + C3 + C4 (end-effector paths, turns of the links, unevenness) summed over the robots, "
    "free of collision, lower is better. Generations and evaluations are those until a team's "
    "cost is at or below a threshold; a run that never gets there counts as infinite."
)
SHORT = {
    measures.REFUTED: "collide in between",
    measures.LEAVES: "leave [0, π]",
    measures.TOO_FAST: "too fast (Eq. 2)",
}


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of a sweep, or the generic page if there is nothing to compare."""
    if not measures.fits(results) or len(results.with_data) < 2:
        return generic.page(results, settings)
    bound = measures.lower_bound(results.with_data[0])
    threshold = settings.threshold_ratio * bound
    found = families.tested(results, settings, threshold)
    return generic.basis(results, settings)._replace(
        title=f"Curkovic et al. 2013: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=_quantities(results, threshold),
        claims=claims.of_sweep(results, settings, found),
        checks=_checks(results, bound),
        comparisons=tuple(
            (f"{one.measure.name}: {one.family.name} against …", one.rows)
            for one in found
            if one.rows
        ),
        drawings=_drawings(results, settings, found, threshold),
    )


def _quantities(results: Results, threshold: float) -> tuple[Quantity, ...]:
    speed = "greatest speed of a link over what Eq. 2 allows"
    return measures.team_quantities(
        results, threshold, generic.quantity(results, speed, "–", measures.times_over_limit)
    )


def _checks(results: Results, bound: float) -> tuple[tuple[str, str], ...]:
    names = [rate.defect for rate in measures.rates(results.with_data[0])]
    defects = [
        (f"Solved motions that fail: {n}", measures.rates_text(results, k))
        for k, n in enumerate(names)
    ]
    slowest = "; ".join(
        f"{c.label}: {markdown.number(float(c.column('cpu_s').max()))} s" for c in results.with_data
    )
    return (
        *defects,
        ("CPU time of the slowest run (the paper accepts 10 s)", slowest),
        (
            "Lower bound of a team's cost: straight end-effector paths, least turns of the links",
            markdown.number(bound),
        ),
    )


def _drawings(
    results: Results, settings: ReportSettings, found: Sequence[Tested], threshold: float
) -> tuple[Drawing, ...]:
    values = {one.measure.name: one.measure.values for one in found if one.measure.converges}
    by_name = {
        name: tuple(row for one in found if one.measure.name == name for row in one.rows)
        for name in values
    }
    shown = results.with_data
    return (
        Drawing(
            "values",
            "Every condition",
            "Boxes: median and quartiles of the runs that get there, whiskers to the last value "
            "within 1.5 interquartile ranges, every replicate a point; dashed: median of the "
            "first condition, where it has one.",
            partial(effects.values_table, results, values),
            effects.draw_values,
            shown,
        ),
        Drawing(
            "effects",
            "How often the first condition of a family is better",
            "Vargha and Delaney's A12 with its bootstrap interval: the share of pairs of runs in "
            "which the first one is better than the other one; dashed: no difference.",
            partial(effects.effects_table, by_name, settings.significance),
            effects.draw_effects,
            shown,
        ),
        measures.convergence_drawing(
            results,
            f" Threshold {markdown.number(threshold)}, lower bound "
            f"{markdown.number(threshold / settings.threshold_ratio)}.",
        ),
        Drawing(
            "defects",
            "Motions that the paper's model accepts and that fail",
            f"Share of the solved motions, with Wilson's {100 * settings.confidence:g} % interval.",
            partial(_rates, results, settings.confidence),
            defect_rates.draw_rates,
            shown,
        ),
    )


def _rates(results: Results, confidence: float) -> pd.DataFrame:
    """Return the table of defects; without curves only the first of them varies."""
    rows = [
        (
            SHORT[rate.defect],
            position,
            c.label,
            rate.failing,
            rate.solved,
            *rate.interval(confidence),
        )
        for position, c in enumerate(results.with_data)
        for rate in measures.rates(c)[: None if families.curved(results) else 1]
    ]
    return defect_rates.rates_table(rows)
