"""The page of the hall of fame of Curkovic et al. 2013: is it the hall, or just elitism?"""

import itertools
import textwrap
from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.curkovic import hall_shares, measures, sweep_page
from evoexp.papers.curkovic.hall_shares import EFFORT, Corner, Gain, Share
from evoexp.papers.curkovic.rules import PAPER, RULES
from evoexp.report import kit
from evoexp.report.kit import groups, judging, markdown, marks, style

COLUMNS = ["measure", "corner", "elites", "share", "lower", "upper"]
WRAPPED = 16  # characters of a quantity's name, per line
EDGES = (-0.6, 2.6)  # shares beyond stand at the edge, as arrows
ALL = 1.0  # elites gain as much as the hall does
NOTE = (
    "The gain of the hall is the quantity without hall and elites less that with the hall; the "
    "share is the gain by elites over it, with its bootstrap interval over the seeds: 100 % means "
    "that elites gain as much as the hall does, more that they gain more. “–”: the hall gains "
    "nothing; without an interval: its gain cannot be told from none. n: runs that count, of "
    "nothing, elites and hall."
)
# (reading and rate, quantity, elites, hall) → how much of the hall's gain elites have, too
Shares = Callable[[Corner, Gain, kit.ConditionResults, kit.ConditionResults], Share]


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw one panel per quantity, one row per reading and rate, elites side by side."""
    corners = list(dict.fromkeys(table["corner"]))
    numbers = list(dict.fromkeys(table["elites"]))
    measures = list(dict.fromkeys(table["measure"]))
    figure, panels = style.row_of_panels(0.42 * len(corners) + 1.6, len(measures), sharey=True)
    for axes, measure in zip(panels, measures, strict=True):
        for edge, line in ((0.0, "-"), (ALL, (0, (4, 2)))):
            axes.axvline(edge, color=style.FAINT, linewidth=0.9, linestyle=line, zorder=1)
        for (elites, corner), rows in groups(
            table[table["measure"] == measure], ["elites", "corner"]
        ):
            k = numbers.index(elites)
            y = corners.index(corner) + 0.22 * (k - 0.5 * (len(numbers) - 1))
            row, colour = rows.iloc[0], style.ARM_COLOURS[k]
            ends = np.clip([row["lower"], row["upper"]], *EDGES)
            if np.isfinite(ends).all():
                axes.hlines(y, *ends, color=colour, linewidth=1.4)
            if not np.isfinite(row["share"]):
                axes.annotate("no gain", (0.03, y), fontsize=6, va="center", color=colour)
                continue
            inside = EDGES[0] <= row["share"] <= EDGES[1]
            mark = "o" if inside else (">" if row["share"] > EDGES[1] else "<")
            fill = colour if np.isfinite(row["lower"]) else "white"
            place = float(np.clip(row["share"], *EDGES))
            axes.plot(place, y, mark, color=colour, mfc=fill, ms=5, clip_on=False)
        axes.set(xlim=EDGES, xticks=[0, 1, 2], title=textwrap.fill(measure, WRAPPED))
        axes.set_xticklabels(["0", "100", "200"])
        axes.set_xlabel("share of the gain [%]")
    panels[0].set_yticks(range(len(corners)), corners)
    panels[0].set_ylim(len(corners) - 0.5, -0.5)
    keys = [
        style.key(name, color=style.ARM_COLOURS[k], marker="o", ms=5, linewidth=1.4)
        for k, name in enumerate(numbers)
    ]
    told = "gain of the hall not told from none"
    open_mark = marks.point_key(told, "o", 5, mfc="white", mec=style.NEUTRAL)
    style.keys_below(figure, [*keys, open_mark])
    return figure


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the hall, or that of a sweep if conditions for the question are missing."""
    corners = hall_shares.corners(results.with_data) if measures.fits(results) else ()
    base = sweep_page.page(results, settings)
    if not corners:
        return base
    threshold = settings.threshold_ratio * measures.lower_bound(results.with_data[0])
    gains = hall_shares.gain_measures(threshold, markdown.number(threshold))
    judged = [gain for gain in gains if gain.judged is not None]
    shares = cache(partial(hall_shares.share, settings=settings))
    drawing = PAPER.drawing(
        "elitism",
        (_drawn, draw_shares),
        results.with_data,
        corners,
        gains,
        shares,
        level=100 * settings.confidence,
    )
    families = [kit.Family.of((*corner.halls[:1], *_rivals(corner))) for corner in corners]
    quantities = [gain.judged for gain in judged if gain.judged is not None]
    judge = judging.judge(results, settings, RULES)
    return PAPER.page(
        results,
        "hall",
        base,
        claims=tuple(
            claim
            for gain in judged
            for corner in corners
            for claim in of_corner(judge, corner, gain, shares)
        ),
        tables=(_table(corners, gains, shares), *base.tables),
        comparisons=kit.headed(kit.compare_families(families, quantities, settings)),
        drawings=(drawing, *(each for each in base.drawings if each.stem != "effects")),
    )


def _rivals(corner: Corner) -> tuple[kit.ConditionResults, ...]:
    """Return all else of a reading and rate than the hall of distinct genomes."""
    return (corner.nothing, *corner.elites, *corner.halls[1:], *corner.others)


def _value(gain: Gain, condition: kit.ConditionResults) -> str:
    found = hall_shares.of_all_runs(gain, condition)
    return markdown.number(float(np.rint(np.exp(found))) if gain.short == EFFORT else found)


def _told(share: Share) -> str:
    if np.isnan(share.value):
        return "–"
    text = f"{100 * share.value:.0f} %"
    if np.isfinite(share.interval.low) or np.isfinite(share.interval.high):
        text += f" [{100 * share.interval.low:.0f}, {100 * share.interval.high:.0f}]"
    return text


def _table(corners: Sequence[Corner], gains: Sequence[Gain], shares: Shares) -> kit.Table:
    """Return the table of quantities, of shares by elitism, and of the runs behind them."""
    rows = []
    for corner, gain in itertools.product(corners, gains):
        for hall, kept in zip(corner.halls, ("genome", "index"), strict=False):
            found = [shares(corner, gain, elites, hall) for elites in corner.elites]
            values = (_value(gain, c) for c in (corner.nothing, *corner.elites, hall))
            counts = ", ".join(map(str, found[-1].n))
            rows.append((corner.name, gain.name, kept, *values, *map(_told, found), counts))
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


def _drawn(corners: Sequence[Corner], gains: Sequence[Gain], shares: Shares) -> pd.DataFrame:
    """Return the table of the figure: shares in the gain by a hall of distinct genomes."""
    rows = []
    for corner, gain in itertools.product(corners, gains):
        for elites in corner.elites:
            share = shares(corner, gain, elites, corner.hall)
            rows.append((gain.short, corner.name, _short(elites), share.value, *share.interval))
    return pd.DataFrame(rows, columns=COLUMNS)


def _short(elites: kit.ConditionResults) -> str:
    return elites.label.rpartition(", ")[2]


def of_corner(judge: kit.Judge, corner: Corner, gain: Gain, shares: Shares) -> list[kit.Claim]:
    """Return the claims on one reading of Eq. 9 and one rate, judged by one quantity."""
    assert gain.judged is not None
    name, values, *_ = gain.judged
    who, hall = f"{corner.name}: ", corner.hall
    over_elites = kit.compared([(hall, c) for c in corner.elites], values, judge.settings)
    told = "; ".join(
        f"against {row.quantity} {judging.evidence(row, 'lower')}" for row in over_elites
    )
    explained = ", ".join(
        f"{_told(shares(corner, gain, c, hall))} ({_short(c)})" for c in corner.elites
    )
    elites = " and than ".join(map(_short, corner.elites))
    beyond = judge.on("hall_beyond_elites", who=who, elites=elites, measure=name)
    single = [("hall_helps", corner.nothing)]
    single += [("distinct_genomes", c) for c in corner.halls[1:]]
    single += [("frozen_hall", c) for c in corner.others if c.planner.ga.hall_frozen]
    first, *more = (
        judge.on(rule, who=who, measure=name).better(judge.compared(hall, c, values), "lower")
        for rule, c in single
    )
    told += f"; share of the hall's gain over nothing: {explained}"
    return [first, beyond.better_than_all(told, over_elites), *more]
