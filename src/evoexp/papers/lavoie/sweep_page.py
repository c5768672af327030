"""Lavoie & Boudreau 2001: settings side by side.

Per arm the first condition against each other one.
"""

from functools import partial
from typing import NamedTuple

import pandas as pd

from evoexp.papers.lavoie import measures, sweep_claims
from evoexp.papers.lavoie import page as whole_page
from evoexp.papers.lavoie.figures import stopping
from evoexp.papers.lavoie.measures import PRINTED, Refuted
from evoexp.report import claims
from evoexp.report.claims import Comparison
from evoexp.report.figures import effects, shares
from evoexp.report.page import Drawing, Page
from evoexp.report.pages import generic
from evoexp.report.pages.generic import Values
from evoexp.report.proportions import Proportion, newcombe
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import ConditionResults, Results

INTRODUCTION = (
    "Each condition changes one part of the first one of its arm; all share their seeds. A run "
    "has a solution if both searches were successful (`planner.success`); one without counts as "
    "an infinite error and infinite effort. Searches differ in length and one follows the other, "
    "so there is no common axis to draw convergence on."
)
BOUND = 1.0  # x of P(position error < x) that the paper's percentages tell most by


class Measure(NamedTuple):
    """A quantity that conditions are compared in; lower is better."""

    name: str
    unit: str
    values: Values


class Tested(NamedTuple):
    """Conditions of one arm compared with the first one in one quantity.

    P-values adjusted over the rows.
    """

    measure: Measure
    first: ConditionResults
    rows: tuple[Comparison, ...]


def page(results: Results, settings: ReportSettings) -> Page:
    """Return the page; that of the experiment itself where there is nothing to compare."""
    if not measures.fits(results) or len(results.with_data) < 2:
        return whole_page.page(results, settings)
    refuted = {c.label: measures.refuted(c) for c in results.with_data}
    found = tested(results, settings)
    return Page(
        title=f"Lavoie & Boudreau 2001: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=whole_page.quantities(results),
        claims=sweep_claims.of_sweep(results, settings, refuted),
        checks=_checks(results, settings, refuted),
        comparisons=tuple(
            (f"{one.measure.name}: {one.first.label} against …", one.rows)
            for one in found
            if one.rows
        ),
        drawings=_drawings(results, settings, found, refuted),
    )


def arms(results: Results) -> tuple[tuple[ConditionResults, ...], ...]:
    """Return the conditions arm by arm, told by their numbers of joints."""
    found: dict[int, list[ConditionResults]] = {}
    for c in results.with_data:
        found.setdefault(measures.num_joints(c), []).append(c)
    return tuple(tuple(one) for one in found.values())


def tested(results: Results, settings: ReportSettings) -> tuple[Tested, ...]:
    """Return the comparisons of a sweep."""
    unit, found = results.with_data[0].condition.length_unit, []
    compared = (
        Measure("position error", unit, measures.errors),
        Measure("evaluations to a solution", "–", measures.effort),
    )
    for measure in compared:
        for first, *others in arms(results):
            rows = [
                generic.compare_on_common_seeds(
                    first, other, other.label, True, measure.values, settings
                )
                for other in others
            ]
            found.append(
                Tested(
                    measure, first, tuple(claims.adjusted([row for row in rows if row is not None]))
                )
            )
    return tuple(found)


def _checks(
    results: Results, settings: ReportSettings, refuted: dict[str, Refuted]
) -> tuple[tuple[str, str], ...]:
    """Return one row of shares per condition, and what agreement with Fig. 3 is worth."""
    rows = []
    for c in results.with_data:
        found = refuted[c.label]
        told = {
            "with a solution": Proportion(c.solved, c.done),
            f"error below {BOUND:g}": measures.below(c, BOUND),
            "accepted and in contact": found.anywhere,
            "on SP1": found.sp1,
            "on SP2": found.sp2,
        }
        texts = [
            f"{name}: {measures.text(p, settings.confidence)}"
            for name, p in told.items()
            if p.total
        ]
        if not c.is_control:
            texts.append(f"mean attempts: {c.column('term_attempts').mean():.2f}")
        rows.append((f"{c.label}: shares of runs", "; ".join(texts)))
    return (*rows, *([] if _paths_differ(results) else _weak_evidence(results, settings)))


def _weak_evidence(results: Results, settings: ReportSettings) -> list[tuple[str, str]]:
    """Say how many settings agree with a printed percentage.

    The more do, the less it says about any of them.
    """
    found = []
    for own in arms(results):
        printed = next(
            (p for p in PRINTED if (p.joints, p.bound) == (measures.num_joints(own[0]), BOUND)),
            None,
        )
        if printed is None:
            continue
        intervals = {
            c.label: newcombe(measures.below(c, BOUND), printed.proportion, settings.confidence)
            for c in own
        }
        same = [label for label, (low, high) in intervals.items() if low <= 0.0 <= high]
        text = (
            f"{len(same)} of {len(own)}{': ' if same else ''}{', '.join(same)} (0 within "
            f"Newcombe's {100 * settings.confidence:g} % interval of the difference; at most "
            f"{max(c.done for c in own)} runs each). Agreement with Fig. 3 is weak evidence for a "
            "setting as long as others agree as well"
        )
        share = 100 * printed.proportion.share
        found.append(
            (
                f"{own[0].label} and others: whose errors below {BOUND:g} cannot be told from the "
                f"printed {share:.1f} %",
                text,
            )
        )
    return found


def _paths_differ(results: Results) -> bool:
    """Whether conditions differ in how paths are tested for collision."""
    return len({c.planner.collision for c in results.with_data}) > 1


def _drawings(
    results: Results,
    settings: ReportSettings,
    found: tuple[Tested, ...],
    refuted: dict[str, Refuted],
) -> tuple[Drawing, ...]:
    shown, level = results.with_data, f"{100 * settings.confidence:g} %"
    values = {f"{one.measure.name} [{one.measure.unit}]": one.measure.values for one in found}
    by_name = {
        name: tuple(r for one in found if one.measure.name == name for r in one.rows)
        for name in dict.fromkeys(one.measure.name for one in found)
    }
    drawings = [
        Drawing(
            "shares",
            "Shares of runs",
            f"With Wilson's {level} interval, counts beside. Motions that touch an obstacle are "
            "counted among the accepted ones. A dashed line: the percentage that the paper "
            "prints, where all conditions are of one arm.",
            partial(_shares, results, refuted, settings.confidence),
            shares.draw_shares,
            shown,
        ),
        Drawing(
            "values",
            "Every condition",
            "Boxes: median and quartiles of the runs with a solution, whiskers to the last value "
            "within 1.5 interquartile ranges; points: runs beyond, or all where there are few; "
            "dashed: median of the first condition.",
            partial(effects.values_table, results, values),
            effects.draw_values,
            shown,
        ),
        Drawing(
            "effects",
            "How often the first condition of an arm is better",
            "Vargha and Delaney's A12 with its bootstrap interval: the share of pairs of runs in "
            "which the first one is better than the other one; dashed: no difference.",
            partial(effects.effects_table, by_name, settings.significance),
            effects.draw_effects,
            shown,
        ),
    ]
    if len({c.planner.stop_cost_sp2 for c in shown}) > 1:
        drawings.insert(
            0,
            Drawing(
                "stopping",
                "Precision against the stopping value",
                "Medians with quartiles over all runs; one without a solution counts as "
                "infinite. To the right searches stop at smaller values.",
                partial(stopping.stopping_table, results, measures.errors, measures.effort),
                stopping.draw_stopping,
                shown,
            ),
        )
    return tuple(drawings)


def _shares(results: Results, refuted: dict[str, Refuted], confidence: float) -> pd.DataFrame:
    """Return the table of shares: by sub-path where conditions differ in how paths are tested."""
    rows: list[tuple[str, int, str, Proportion]] = []
    references: dict[str, float] = {}
    for position, c in enumerate(results.with_data):
        found = refuted[c.label]
        if _paths_differ(results):
            told = {"touch an obstacle": found.anywhere, "on SP1": found.sp1, "on SP2": found.sp2}
        else:
            below = f"error below {BOUND:g}"
            told = {
                below: measures.below(c, BOUND),
                "with a solution": Proportion(c.solved, c.done),
            }
            told["touch an obstacle"] = found.anywhere
        rows += [(name, position, c.label, proportion) for name, proportion in told.items()]
    if len(arms(results)) == 1:
        own = measures.num_joints(results.with_data[0])
        references = {
            f"error below {p.bound:g}": p.proportion.share for p in PRINTED if p.joints == own
        }
    return shares.shares_table(rows, references, confidence)
