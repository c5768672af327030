"""The page of sweeps over settings of Curkovic et al. 2013, family by family of conditions."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.curkovic import claims, families, measures
from evoexp.papers.curkovic.families import FamilyComparison
from evoexp.papers.curkovic.figures import cost_boxes, facets
from evoexp.papers.curkovic.rules import PAPER
from evoexp.report import kit
from evoexp.report.kit import generic, markdown, shares, sweep_figures

NAMES = {"quantity": "defect", "having": "failing", "total": "solved"}  # of shares, of defects
SHORT = {
    measures.REFUTED: "collide in between",
    measures.LEAVES: "leave [0, π]",
    measures.TOO_FAST: "too fast (Eq. 2)",
}
EFFECTS = f"{sweep_figures.A12} the first one is better than the other one; dashed: no difference."


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of a sweep, or the generic page if there is nothing to compare."""
    if not measures.fits(results) or len(results.with_data) < 2:
        return generic.page(results, settings)
    bound = measures.lower_bound(results.with_data[0])
    threshold = settings.threshold_ratio * bound
    found = families.tested(results, settings, threshold)
    return PAPER.page(
        results,
        "sweep",
        generic.basis(results, settings),
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


def _quantities(results: kit.Results, threshold: float) -> tuple[kit.Quantity, ...]:
    speed = "greatest speed of a link over what Eq. 2 allows"
    return measures.team_quantities(
        results, threshold, generic.quantity(results, speed, "–", measures.times_over_limit)
    )


def _checks(results: kit.Results, bound: float) -> tuple[tuple[str, str], ...]:
    slowest = "; ".join(
        f"{c.label}: {markdown.number(float(c.column('cpu_s').max()))} s" for c in results.with_data
    )
    return (
        *(measures.rates_check(results, defect) for defect in SHORT),
        ("CPU time of the slowest run (the paper accepts 10 s)", slowest),
        (measures.BOUND, markdown.number(bound)),
    )


def _drawings(
    results: kit.Results,
    settings: kit.ReportSettings,
    found: Sequence[FamilyComparison],
    threshold: float,
) -> tuple[kit.Drawing, ...]:
    names = dict.fromkeys(one.measure.name for one in found if one.measure.converges)
    by_name = {
        name: [row for one in found if one.measure.name == name for row in one.rows]
        for name in names
    }
    told, shown = markdown.number(threshold), results.with_data
    bound = markdown.number(threshold / settings.threshold_ratio)
    table = partial(facets.facet_table, results, threshold)
    return (
        PAPER.drawing(
            "costs",
            partial(cost_boxes.costs_table, results, threshold),
            cost_boxes.draw_costs,
            shown,
            threshold=told,
        ),
        PAPER.drawing("effort", table, facets.draw_effort, shown, threshold=told),
        PAPER.drawing(
            "convergence", table, facets.draw_convergence, shown, threshold=told, bound=bound
        ),
        *sweep_figures.effects_drawings(
            results, settings, by_name, "the first condition of a family", EFFECTS
        ),
        PAPER.drawing(
            "defects",
            partial(rates_table, results, settings.confidence),
            draw_rates,
            results.with_data,
            level=100 * settings.confidence,
        ),
    )


def rates_table(results: kit.Results, confidence: float) -> pd.DataFrame:
    """Return the shares of solved motions that have a defect; without curves only one varies.

    Returns:
        Columns defect, position, condition, failing, solved, lower, upper, share.
    """
    shown = list(SHORT)[: None if families.curved(results) else 1]
    found = [(position, c, measures.rates(c)) for position, c in enumerate(results.with_data)]
    rows = [(SHORT[name], k, c.label, rates[name]) for k, c, rates in found for name in shown]
    table = shares.shares_table(rows, {}, confidence).rename(columns=NAMES)
    order = ["defect", "position", "condition", "failing", "solved", "lower", "upper"]
    return table[order].assign(share=table["share"].fillna(0.0))


def draw_rates(table: pd.DataFrame) -> Figure:
    """Draw one panel per defect, one row per condition."""
    named = table.rename(columns={of_defects: of_shares for of_shares, of_defects in NAMES.items()})
    return shares.draw_shares(named.assign(printed=np.nan), "share of solved motions [%]")
