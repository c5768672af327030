"""Conditions side by side: values and shares of runs, effect sizes, numbers of every reading."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator, NullLocator

from evoexp.records import FloatArray
from evoexp.report.figures import Rows, groups, marks, records, style, table_of
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import Comparison, Values
from evoexp.report.statistics.inference import Proportion, quantile, spread
from evoexp.report.statistics.judging import CONTRADICTED, EQUAL, REPRODUCED

JITTER = 0.16  # [rows] half the width over which points are spread
POINTS = 50  # up to so many finite values every one is shown
FENCE = 1.5  # [interquartile ranges] how far whiskers may reach
POINT: dict[str, Any] = {"ms": 2.6, "mec": "none", "alpha": 0.5}
WRAPPED = 24  # characters of a name in a panel, per line
BEYOND = 0.18  # [-] of the range of finite values: how far beyond it infinity is drawn
DOT: dict[str, Any] = {"color": style.ARM_COLOURS[0], "markersize": 5}
OPEN: dict[str, Any] = {"markerfacecolor": "white"}  # the look of what is not significant


@table_of("quantity position condition replicate value failed")
def values_table(results: Results, quantities: Mapping[str, Values]) -> Rows:
    """Return quantities (name with unit → values (done,), inf: never) of every replicate."""
    for name, values in quantities.items():
        for position, c in enumerate(results.with_data):
            yield name, position, c.label, c.summaries.index, values(c), len(c.failures)


def draw_values(table: pd.DataFrame) -> Figure:
    """Draw Tukey's boxes of all runs, the first condition on top."""
    quantities = list(groups(table, "quantity", in_order=False))
    labels = dict(zip(table["position"], table["condition"], strict=True))
    figure, panels = style.panels(0.32 * len(labels) + 1.1, len(quantities), sharey=True)
    for axes, (quantity, rows) in zip(panels, quantities, strict=True):
        every = rows["value"].to_numpy()
        finite, never = every[np.isfinite(every)], None
        if np.isposinf(every).any():  # infinity is drawn beyond all finite values
            never = 1.0
            if len(finite):
                high, span = float(finite.max()), float(np.ptp(finite))
                never = high + BEYOND * (span or abs(high) or 1.0)
        for position, own in groups(rows, "position"):
            values, colour = own["value"].to_numpy(), style.row_colour(position, len(labels))
            draw_box(axes, position, values, colour, never=never)
            if never is not None:
                marks.beside(axes, position, f"{np.isfinite(values).sum()} of {len(values)}")
        middle = quantile(rows.loc[rows["position"] == 0, "value"].to_numpy(), 0.5)
        if np.isfinite(middle):
            marks.dashed(axes, middle)
        axes.set_xlabel(textwrap.fill(quantity, WRAPPED))
        axes.margins(x=0.06)
        axes.xaxis.set_major_locator(style.few_ticks() if len(finite) else NullLocator())
        style.shorten_thousands(axes.xaxis)
        if never is not None:  # named above, and parted from the finite values by a line
            between = never - 0.5 * BEYOND / (1.0 + BEYOND) * (never - axes.get_xlim()[0])
            axes.axvline(between, color=style.FAINT, linewidth=0.7, linestyle=(0, (1, 2)))
            place: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "fontsize": 6.5}
            axes.annotate("never", (never, 1.0), ha="center", va="bottom", **place)
    counts = quantities[0][1].groupby("position").agg(n=("value", "size"), failed=("failed", "max"))
    names = [  # the caption has the number of runs that all of them have
        f"{labels[k]}  (n = {n}{f', {failed} failed' if failed else ''})"
        if counts.nunique().max() > 1 or failed
        else labels[k]
        for k, n, failed in counts.itertuples()
    ]
    panels[0].set_yticks(list(counts.index), names)
    panels[0].set_ylim(len(labels) - 0.4, -0.6)
    return figure


def draw_box(
    axes: Axes, position: float, values: FloatArray, colour: str, never: float | None = None
) -> None:
    """Draw median, quartiles and whiskers of values (n,), and points, along the horizontal axis.

    Infinite values, of runs that never got there, are drawn at `never`; None: they are left out.
    """
    ordered = np.sort(values[np.isfinite(values) if never is None else values > -np.inf])
    if not len(ordered):
        return
    lower, median, upper = (quantile(ordered, share) for share in (0.25, 0.5, 0.75))
    within = ordered
    if upper < np.inf:
        reach = FENCE * (upper - lower)
        within = ordered[(ordered >= lower - reach) & (ordered <= upper + reach)]
    drawn = np.where(np.isfinite(ordered), ordered, never or 0.0)
    many = np.isfinite(ordered).sum() > POINTS
    low, high = float(within[0]), float(within[-1])
    beyond = (ordered < low) | (ordered > high)
    ends = {"q1": lower, "med": median, "q3": upper, "whislo": low, "whishi": high}
    box = {name: value if value < np.inf else never for name, value in ends.items()}
    axes.bxp(
        [box | {"fliers": drawn[beyond] if many else []}],
        positions=[position],
        orientation="horizontal",
        widths=0.55,
        manage_ticks=False,
        boxprops={"color": colour},
        whiskerprops={"color": colour},
        capprops={"color": colour},
        medianprops={"color": colour, "linewidth": 2.0},
        flierprops={"marker": "o", "mfc": colour, **POINT},
    )
    if not many:
        beside = position + JITTER * (2.0 * ((np.arange(len(drawn)) * 0.618034) % 1.0) - 1.0)
        axes.plot(drawn, beside, "o", color=colour, **POINT)


@table_of("quantity condition a12 lower upper p_adjusted runs runs_other significance")
def effects_table(comparisons: Mapping[str, Sequence[Comparison]], significance: float) -> Rows:
    """Return how often the first condition is better than each other one, by quantity."""
    for name, found in comparisons.items():
        for c in found:
            better = c.better.a12, *c.better.interval, c.p_adjusted
            yield name, c.quantity, *better, *c.sizes, significance


def draw_effects(table: pd.DataFrame) -> Figure:
    """Draw A12 with its interval, one row per other condition, one panel per quantity."""
    quantities = list(groups(table, "quantity", in_order=False))
    labels = list(dict.fromkeys(table["condition"]))
    figure, panels = style.panels(0.3 * len(labels) + 1.2, len(quantities), sharey=True)
    for axes, (quantity, rows) in zip(panels, quantities, strict=True):
        y = np.array([labels.index(label) for label in rows["condition"]])
        a12, low, high = (rows[name].to_numpy(np.float64) for name in ("a12", "lower", "upper"))
        marks.dashed(axes, 0.5)
        axes.hlines(y, low, high, color=style.ARM_COLOURS[0], linewidth=1.4)
        clear = (rows["p_adjusted"] < rows["significance"]).to_numpy()
        axes.plot(a12[~clear], y[~clear], "o", **DOT, **OPEN)
        axes.plot(a12[clear], y[clear], "o", **DOT)
        axes.set_xlim(-0.03, 1.03)
        axes.set_title(textwrap.fill(quantity, WRAPPED), fontsize=7.5)
        axes.set_xlabel("A12: the first is better")
        axes.xaxis.set_major_locator(MultipleLocator(0.25))
    panels[0].set_yticks(range(len(labels)), [f"against {label}" for label in labels])
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    level = float(table["significance"].iloc[0])
    dot: dict[str, Any] = {"marker": "o", "linestyle": "none", **DOT}
    keys = style.key(f"adjusted p < {level:g}", **dot), style.key(f"p ≥ {level:g}", **dot, **OPEN)
    is_clear = table["p_adjusted"] < level
    style.keys_below(figure, [keys[k] for k in (0, 1) if (is_clear == (k == 0)).any()])
    return figure


MARGIN = 0.08  # [-] of the panels' span, beyond the intervals
NEARLY_ALL = 60.0  # [%] a span from which on the axis has a number at every quarter


@table_of("quantity position condition having total share lower upper printed")
def shares_table(
    rows: Sequence[tuple[str, int, str, Proportion]],
    printed: Mapping[str, float],
    confidence: float,
) -> Rows:
    """Return shares of runs with Wilson's intervals, and the printed shares, by quantity.

    The rows are (quantity, position, condition, how many).
    """
    for name, position, label, p in rows:
        shares = p.share, *p.interval(confidence), printed.get(name, np.nan)
        yield name, position, label, *p, *shares


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw one panel per quantity, one row per condition, in one scale [%]."""
    quantities = list(groups(table, "quantity", in_order=False))
    labels = dict(zip(table["position"], table["condition"], strict=True))
    rows_of = {position: row for row, position in enumerate(sorted(labels))}
    figure, panels = style.panels(0.26 * len(labels) + 1.1, len(quantities), sharey=True)
    known = 100 * table.loc[table["total"] > 0, ["lower", "upper", "printed"]].to_numpy(np.float64)
    low, high = (np.nanmin(known), np.nanmax(known)) if known.size else (0.0, 100.0)
    beyond = MARGIN * max(high - low, 1.0)
    for axes, (quantity, every) in zip(panels, quantities, strict=True):
        for position, rows in groups(every, "position"):
            colour, y = style.row_colour(int(position), len(labels)), rows_of[position]
            if rows["total"].iloc[0]:
                ends = 100 * rows["lower"], 100 * rows["upper"]
                axes.hlines(y, *ends, color=colour, linewidth=1.6)
                axes.plot(100 * rows["share"], [y], "o", color=colour, markersize=4.5)
            counts = f" {rows['having'].iloc[0]}/{rows['total'].iloc[0]}"
            marks.beside(axes, y, counts, 1.0)
        for printed in every.loc[every["total"] > 0, "printed"].dropna().unique():
            marks.dashed(axes, 100 * printed)
        axes.set_xlim(low - beyond, high + beyond)
        is_wide = high - low >= NEARLY_ALL
        axes.xaxis.set_major_locator(MultipleLocator(25.0) if is_wide else style.few_ticks())
        axes.set_xlabel("share of runs [%]")
        axes.set_title(quantity, fontsize=7.5)
    panels[0].set_yticks(list(rows_of.values()), [labels[position] for position in rows_of])
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    return figure


OTHERWISE = "undecided or not judged"
MARKS: dict[str, dict[str, Any]] = {
    REPRODUCED: {"marker": "o", "mfc": style.ARM_COLOURS[0], "mec": style.ARM_COLOURS[0]},
    EQUAL: {"marker": "s", "mfc": "white", "mec": style.ARM_COLOURS[0]},
    CONTRADICTED: {"marker": "X", "mfc": style.ARM_COLOURS[1], "mec": style.ARM_COLOURS[1]},
    OTHERWISE: {"marker": "o", "mfc": "white", "mec": style.FAINT},
}


@table_of("family reading default quantity value low high neutral verdict")
def specification_table(judged: Sequence[Any], headline: Any) -> Rows:
    """Return one row per reading of a headline claim, of `judged_claims.Judged`.

    Where a rule has no number that decides, the row holds median and quartiles of the quantity.
    """
    for one in judged:
        if one.headline is headline:
            size, name = one.claim.size, headline.quantity
            numbers: tuple[float, ...] = (*spread(headline.values(one.condition))[:3], np.nan)
            if size is not None:
                name, numbers = size.name, (size.value, size.low, size.high, size.neutral)
            shipped, reading = one.family.shipped, one.family.reading(one.condition)
            given = shipped.label, reading, one.condition is shipped, name
            yield *given, *numbers, one.claim.verdict


def draw_specification(table: pd.DataFrame) -> Figure:
    """Draw readings sorted by the number that decides, families one below the other.

    Args:
        table: Of `specification_table`; infinite values stand at the right edge, as "never".
    """
    numbers = table[["value", "low", "high", "neutral"]].to_numpy(np.float64)
    finite = numbers[np.isfinite(numbers)]
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 1.0)
    room = 0.08 * (high - low) or 0.5
    edge, families = high + room, list(dict.fromkeys(table["family"]))
    labels = dict[float, tuple[str, bool]]()  # place of a line → its label, whether it is bold
    place = 0.0
    figure, (axes,) = style.panels(0.2 * (len(table) + 1.5 * len(families)) + 1.2)
    for family in families:
        rows = table[table["family"] == family].sort_values(["value", "reading"], kind="stable")
        if len(families) > 1:
            labels[place] = f"{family}:", False
            place += 1.0
        first = place
        for row in records(rows):
            labels[place] = row.reading, row.default
            mark = MARKS.get(row.verdict, MARKS[OTHERWISE])
            ends = [min(end, edge) for end in (row.low, row.high)]
            axes.hlines(place, *ends, color=mark["mec"], linewidth=1.4)
            axes.plot(min(row.value, edge), place, zorder=3, ms=5, **mark)
            if not np.isfinite(row.value):
                beside: dict[str, Any] = {"xytext": (5, 0), "textcoords": "offset points"}
                axes.annotate("never", (edge, place), va="center", fontsize=6.5, **beside)
            place += 1.0
        neutral = rows["neutral"].iloc[0]
        if np.isfinite(neutral):
            lines: dict[str, Any] = {"color": style.FAINT, "ls": (0, (4, 2)), "lw": 0.9}
            axes.vlines(neutral, first - 0.5, place - 0.5, **lines)
        place += 0.5
    axes.set_xlim(low - room, edge + (0.25 * (edge - low) if np.isinf(numbers).any() else 0))
    axes.xaxis.set_major_locator(style.few_ticks())
    style.shorten_thousands(axes.xaxis)
    axes.set_xlabel(", ".join(dict.fromkeys(table["quantity"])))
    axes.set_yticks(list(labels), [label for label, _ in labels.values()])
    for tick, (_, is_bold) in zip(axes.get_yticklabels(), labels.values(), strict=True):
        tick.set_fontweight("bold" if is_bold else "normal")
    axes.set_ylim(place - 1.0, -0.6)
    entries = [style.key(label, ls="", ms=5, **look) for label, look in MARKS.items()]
    style.keys_below(figure, entries)
    return figure
