"""The page of the hall of fame of Curkovic et al. 2013: is it the hall, or just elitism?"""

from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd

from evoexp.papers.curkovic import hall_shares, measures, sweep_page
from evoexp.papers.curkovic.figures import elitism_shares
from evoexp.papers.curkovic.hall_shares import EFFORT, Corner, Measure, Share
from evoexp.papers.curkovic.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import judging, markdown

NOTE = (
    "The gain of the hall is the quantity without hall and elites less that with the hall; the "
    "share is the gain by elites over it, with its bootstrap interval over the seeds: 100 % means "
    "that elites gain as much as the hall does, more that they gain more. “–”: the hall gains "
    "nothing; without an interval: its gain cannot be told from none. n: runs that count, of "
    "nothing, elites and hall."
)


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the hall, or that of a sweep if conditions for the question are missing."""
    corners = hall_shares.corners(results.with_data) if measures.fits(results) else ()
    base = sweep_page.page(results, settings)
    if not corners:
        return base
    threshold = settings.threshold_ratio * measures.lower_bound(results.with_data[0])
    gained = hall_shares.gain_measures(threshold, markdown.number(threshold))
    shared = {
        (corner.name, measure.name, elites.label, hall.label): hall_shares.share(
            corner, measure, elites, hall, settings
        )
        for corner in corners
        for measure in gained
        for elites in corner.elites
        for hall in _halls(corner)
    }
    drawing = PAPER.drawing(
        "elitism",
        partial(_drawn, corners, gained, shared),
        elitism_shares.draw_shares,
        results.with_data,
        level=100 * settings.confidence,
    )
    return PAPER.page(
        results,
        "hall",
        base,
        claims=_claims(results, settings, corners, threshold, shared, gained),
        tables=(_table(corners, gained, shared), *base.tables),
        comparisons=_comparisons(settings, corners, threshold, gained),
        drawings=(drawing, *(each for each in base.drawings if each.stem != "effects")),
    )


Shared = dict[tuple[str, str, str, str], Share]


def _halls(corner: Corner) -> tuple[kit.ConditionResults, ...]:
    return (corner.hall,) if corner.by_index is None else (corner.hall, corner.by_index)


def _comparisons(
    settings: kit.ReportSettings,
    corners: Sequence[Corner],
    threshold: float,
    gained: Sequence[Measure],
) -> tuple[tuple[str, tuple[kit.Comparison, ...]], ...]:
    """Compare the hall of distinct genomes with all else of its reading and rate."""
    found = []
    for name, values, _ in judged_by(threshold, gained):
        for corner in corners:
            others = (corner.nothing, *corner.elites, *_halls(corner)[1:], *corner.others)
            rows = kit.compared([(corner.hall, other) for other in others], values, settings)
            found.append((f"{name}: {corner.hall.label} against …", rows))
    return tuple(found)


def _value(measure: Measure, condition: kit.ConditionResults) -> str:
    found = hall_shares.of_all_runs(measure, condition)
    return markdown.number(float(np.rint(np.exp(found))) if measure.short == EFFORT else found)


def _told(share: Share) -> str:
    if np.isnan(share.value):
        return "–"
    text = f"{100 * share.value:.0f} %"
    if np.isfinite(share.interval.low) or np.isfinite(share.interval.high):
        text += f" [{100 * share.interval.low:.0f}, {100 * share.interval.high:.0f}]"
    return text


def _table(corners: Sequence[Corner], gained: Sequence[Measure], shared: Shared) -> kit.Table:
    """Return the table of quantities, of shares by elitism, and of the runs behind them."""
    rows = []
    for corner in corners:
        for measure in gained:
            for hall in _halls(corner):
                kept = "genome" if hall is corner.hall else "index"
                found = [
                    shared[corner.name, measure.name, elites.label, hall.label]
                    for elites in corner.elites
                ]
                rows.append(
                    (
                        corner.name,
                        measure.name,
                        kept,
                        _value(measure, corner.nothing),
                        *(_value(measure, elites) for elites in corner.elites),
                        _value(measure, hall),
                        *(_told(share) for share in found),
                        "; ".join(", ".join(map(str, share.n)) for share in found[-1:]),
                    )
                )
    elites = [
        f"{c.planner.ga.num_elites} elite" + "s" * (k > 0) for k, c in enumerate(corners[0].elites)
    ]
    headers = (
        "Eq. 9 and rate",
        "quantity (median of the runs)",
        "hall distinct by",
        "nothing",
        *elites,
        "hall",
        *(f"share of {name}" for name in elites),
        f"n (nothing, {elites[-1]}, hall)",
    )
    note = f"{NOTE} Effort: gains are differences of logarithms, since efforts differ by factors."
    return kit.Table("What elitism explains of the hall's gain", headers, tuple(rows), note)


def _drawn(corners: Sequence[Corner], gained: Sequence[Measure], shared: Shared) -> pd.DataFrame:
    """Return the table of the figure: shares in the gain by a hall of distinct genomes."""
    rows = []
    for corner in corners:
        for measure in gained:
            for elites in corner.elites:
                share = shared[corner.name, measure.name, elites.label, corner.hall.label]
                name = elites.label.rpartition(", ")[2]
                rows.append((measure.short, corner.name, name, share.value, *share.interval))
    return pd.DataFrame(rows, columns=elitism_shares.COLUMNS)


def _claims(
    results: kit.Results,
    settings: kit.ReportSettings,
    corners: Sequence[Corner],
    threshold: float,
    shared: Shared,
    gained: Sequence[Measure],
) -> tuple[kit.Claim, ...]:
    judge, found = judging.judge(results, settings, RULES), list[kit.Claim]()
    for name, values, measure in judged_by(threshold, gained):
        for corner in corners:
            shares = []
            for c in corner.elites:
                share = shared[corner.name, measure.name, c.label, corner.hall.label]
                shares.append(f"{_told(share)} ({c.label.rpartition(', ')[2]})")
            told = f"; share of the hall's gain over nothing: {', '.join(shares)}"
            found += of_corner(judge, settings, corner, name, values, told)
    return tuple(found)


def judged_by(
    threshold: float, gained: Sequence[Measure]
) -> tuple[tuple[str, kit.Values, Measure], ...]:
    """Return name and values of the quantities that claims are judged by, and their gains."""
    effort = partial(measures.evaluations_to, threshold=threshold)
    to = f"evaluations to a team of cost ≤ {markdown.number(threshold)}"
    return (
        ("best cost", kit.by_column("best_cost"), gained[0]),
        (to, effort, gained[1]),
        (measures.CERTIFIED, measures.certified_cost, gained[2]),
    )


def of_corner(
    judge: kit.Judge,
    settings: kit.ReportSettings,
    corner: Corner,
    name: str,
    values: kit.Values,
    shares: str,
) -> list[kit.Claim]:
    """Return the claims on one reading of Eq. 9 and one rate, judged by one quantity."""
    who, hall = f"{corner.name}: ", corner.hall
    elites = " and than ".join(c.label.rpartition(", ")[2] for c in corner.elites)
    over_nothing = kit.compared([(hall, corner.nothing)], values, settings)
    over_elites = kit.compared([(hall, c) for c in corner.elites], values, settings)
    told = "; ".join(
        f"against {row.quantity} {judging.evidence(row, 'lower')}" for row in over_elites
    )
    found = [
        judge.on("hall_helps", who=who, measure=name).better(
            next(iter(over_nothing), None), "lower"
        ),
        judge.on("hall_beyond_elites", who=who, elites=elites, measure=name).better_than_all(
            told + shares, over_elites
        ),
    ]
    if corner.by_index is not None:
        row = next(iter(kit.compared([(hall, corner.by_index)], values, settings)), None)
        found.append(judge.on("distinct_genomes", who=who, measure=name).better(row, "lower"))
    for other in corner.others:
        if other.planner.ga.hall_frozen:
            row = next(iter(kit.compared([(hall, other)], values, settings)), None)
            found.append(judge.on("frozen_hall", who=who, measure=name).better(row, "lower"))
    return found
