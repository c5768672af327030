"""Lavoie & Boudreau 2001: settings side by side, the first condition of an arm against each."""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

from evoexp.papers import run_values
from evoexp.papers.lavoie import measures, sweep_claims
from evoexp.papers.lavoie import page as whole_page
from evoexp.papers.lavoie.figures import stopping
from evoexp.papers.lavoie.measures import RefutedMotions
from evoexp.papers.lavoie.rules import PAPER
from evoexp.report import kit
from evoexp.report.kit import sweep_figures

BOUND = 1.0  # x of P(position error < x) by which the paper's percentages differ most


class Measure(NamedTuple):
    """A quantity that conditions are compared in; lower is better."""

    name: str
    unit: str
    values: kit.Values


class ArmComparison(NamedTuple):
    """The first condition of an arm against its others in one quantity.

    P-values are adjusted over the rows.
    """

    measure: Measure
    first: kit.ConditionResults
    rows: tuple[kit.Comparison, ...]


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of a sweep, or that of the experiment if there is nothing to compare."""
    if not measures.fits(results) or len(results.with_data) < 2:
        return whole_page.page(results, settings)
    refuted = {c.label: measures.refuted(c) for c in results.with_data}
    found = compared_arms(results, settings)
    return PAPER.page(
        results,
        "sweep",
        quantities=whole_page.quantities(results),
        claims=sweep_claims.judge_sweep(results, settings, refuted),
        checks=_checks(results, settings, refuted),
        comparisons=tuple(
            (f"{one.measure.name}: {one.first.label} against …", one.rows)
            for one in found
            if one.rows
        ),
        drawings=_drawings(results, settings, found, refuted),
    )


def arms(results: kit.Results) -> tuple[tuple[kit.ConditionResults, ...], ...]:
    """Return the conditions arm by arm, told by their numbers of joints."""
    return kit.grouped(results.with_data, run_values.num_joints)


def compared_arms(results: kit.Results, settings: kit.ReportSettings) -> tuple[ArmComparison, ...]:
    """Compare the first condition of every arm with its others, quantity by quantity."""
    quantities = (
        Measure("position error", results.with_data[0].condition.length_unit, measures.errors),
        Measure("evaluations to a solution", "–", measures.effort),
    )
    return tuple(
        ArmComparison(
            measure,
            first,
            kit.compared([(first, other) for other in others], measure.values, settings),
        )
        for measure in quantities
        for first, *others in arms(results)
    )


def _checks(
    results: kit.Results, settings: kit.ReportSettings, refuted: dict[str, RefutedMotions]
) -> tuple[tuple[str, str], ...]:
    """Return a row of shares per condition, and rows on the worth of agreement with Fig. 3."""
    rows = []
    for c in results.with_data:
        found = refuted[c.label]
        told = {
            "with a solution": kit.success(c),
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
    others = any(c.is_control or c.planner.collision.blind for c in results.with_data)
    weak = () if others or _paths_differ(results) else _weak_evidence(results, settings)
    return *rows, *weak


def _weak_evidence(results: kit.Results, settings: kit.ReportSettings) -> Iterator[tuple[str, str]]:
    """Count the settings of each arm that agree with a printed percentage.

    The more settings agree, the less agreement says about any of them.
    """
    for own in arms(results):
        for printed in (one for one in measures.printed(own[0]) if one.bound == BOUND):
            intervals = {
                c.label: kit.newcombe(
                    measures.below(c, BOUND), printed.proportion, settings.confidence
                )
                for c in own
            }
            same = [label for label, (low, high) in intervals.items() if low <= 0.0 <= high]
            what = (
                f"{own[0].label} and others: whose errors below {BOUND:g} cannot be told from the "
                f"printed {100 * printed.proportion.share:.1f} %"
            )
            text = (
                f"{len(same)} of {len(own)}{': ' if same else ''}{', '.join(same)} (0 within "
                f"Newcombe's {100 * settings.confidence:g} % interval of the difference; at most "
                f"{max(c.done for c in own)} runs each). Agreement with Fig. 3 is weak evidence "
                "for a setting as long as others agree as well"
            )
            yield (what, text)


def _paths_differ(results: kit.Results) -> bool:
    """Return whether conditions differ in the places at which they test paths for collision."""
    collisions = (c.planner.collision for c in results.with_data)
    return len({(model.num_positions, model.swept) for model in collisions}) > 1


def _drawings(
    results: kit.Results,
    settings: kit.ReportSettings,
    found: tuple[ArmComparison, ...],
    refuted: dict[str, RefutedMotions],
) -> tuple[kit.Drawing, ...]:
    """Return the figures: stopping values where they differ, shares, values, effect sizes."""
    stopping_values = PAPER.drawing(
        "stopping",
        partial(stopping.stopping_table, results, measures.errors, measures.effort),
        stopping.draw_stopping,
        results.with_data,
    )
    differ = len({c.planner.stop_cost_sp2 for c in results.with_data}) > 1
    one_arm = len(arms(results)) == 1
    caption = (
        f"With Wilson's {100 * settings.confidence:g} % interval, counts beside. Motions that "
        "touch an obstacle are counted among the accepted ones. A dashed line: the percentage "
        "that the paper prints, where all conditions are of one arm."
    )
    printed = measures.printed(results.with_data[0]) if one_arm else []
    references = {f"error below {p.bound:g}": p.proportion.share for p in printed}
    shares = _share_rows(results, refuted)
    values = {f"{one.measure.name} [{one.measure.unit}]": one.measure.values for one in found}
    rows: dict[str, tuple[kit.Comparison, ...]] = {}
    for one in found:
        rows[one.measure.name] = (*rows.get(one.measure.name, ()), *one.rows)
    a12 = f"{sweep_figures.A12} the first one is better than the other one; dashed: no difference."
    return (
        *([stopping_values] if differ else []),
        sweep_figures.shares_drawing(results, settings, shares, caption, references),
        sweep_figures.values_drawing(results, values),
        *sweep_figures.effects_drawings(
            results, settings, rows, "the first condition of an arm", a12
        ),
    )


def _share_rows(
    results: kit.Results, refuted: dict[str, RefutedMotions]
) -> list[tuple[str, int, str, kit.Proportion]]:
    """Return the counts that are drawn: by sub-path if conditions differ in how paths are tested.

    Returns:
        (quantity, position, condition, count).
    """
    rows = []
    for position, c in enumerate(results.with_data):
        found = refuted[c.label]
        told = {"touch an obstacle": found.anywhere, "on SP1": found.sp1, "on SP2": found.sp2}
        if not _paths_differ(results):
            told = {
                f"error below {BOUND:g}": measures.below(c, BOUND),
                "with a solution": kit.success(c),
                "touch an obstacle": found.anywhere,
            }
        rows += [(name, position, c.label, proportion) for name, proportion in told.items()]
    return rows
