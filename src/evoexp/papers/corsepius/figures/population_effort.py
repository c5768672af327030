"""Searches against cycles, phase by phase, and success and effort against one setting (sec. 5)."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, NullFormatter, NullLocator

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.measures import Task
from evoexp.report.figures import Rows, groups, marks, style, table_of
from evoexp.report.results.run_measures import solved
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics import inference
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import Proportion, quantiles

SHARE, EFFORT, RATIO = "share", "effort", "ratio"
NUMBERS = "abcdef"
APART = 0.035  # [-] of a value, by which neighbouring series are set apart on the logarithmic axis
NAMES = "quantity kind position task value expected lower upper "
RESIDUAL, CYCLES, POINT = "residual", "cycles", "point"
PROPORTIONAL: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 1.1, "linestyle": ":"}
DISTANCE, COST = "distance to the goal", "cost"
PER_LINE = 3  # panels
MANY = 3  # conditions; more have panels of their own
VISIBLE = 1e-6  # [length unit] smaller tolerances are not drawn
TOLERANCE: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 0.9, "linestyle": (0, (4, 2))}


@table_of(NAMES + "having total")
def effort_table(
    found: tuple[Task, ...],
    shares: Mapping[str, Callable[[ConditionResults], Proportion]],
    effort: Mapping[str, Values],
    confidence: float,
    num_resamples: int,
) -> Rows:
    """Return shares of runs with Wilson's intervals, and expected running times, by their names."""
    points = [
        (position, task.name, value, c)
        for position, task in enumerate(found)
        for value, c in task.by_value.items()
    ]
    for name, count in shares.items():
        for *given, c in points:
            met = count(c)
            yield name, SHARE, *given, met.share, *met.interval(confidence), *met
    for name, values in effort.items():
        for *given, c in points:
            runs = values(c), solved(c)
            interval = inference.expected_interval(*runs, confidence, num_resamples)
            expected = inference.expected_effort(*runs), *interval
            yield name, EFFORT, *given, *expected, c.solved, c.done


def draw_effort(table: pd.DataFrame, setting: str, marked: float) -> Figure:
    """Draw one panel per quantity; a value without a success has no point."""
    quantities, keys = list(groups(table, "quantity", in_order=False)), _keys(table)
    figure, panels = style.panels(2.6, len(quantities), 2, 0.7)
    for axes, number, (quantity, own) in zip(panels, NUMBERS, quantities, strict=False):
        _draw_series(axes, own, len(keys), marked)
        share = own["kind"].iloc[0] == SHARE
        title = f"{number}  {quantity.split(' [')[0]}{'' if share else ' per success'}"
        label = "share of runs [%]" if share else quantity
        axes.set(xlabel=setting, ylabel=label, title=title)
    style.keys_below(figure, keys, 4)
    return figure


@table_of(NAMES + "bound reference")
def ratios_table(
    rows: Mapping[str, Sequence[Any]], found: tuple[Task, ...], reference: float
) -> Rows:
    """Return the effort of every value over that of the recommended one."""
    names = [task.name for task in found]
    for metric, own in rows.items():
        for r in own:
            numbers = r.value, r.ratio, *r.interval, r.bound, reference
            yield metric, RATIO, names.index(r.task), r.task, *numbers


def draw_ratios(table: pd.DataFrame, setting: str) -> Figure:
    """Draw one panel per metric; a ratio of 0 or ∞ (one of the two never succeeds) has no point."""
    quantities = list(groups(table, "quantity", in_order=False))
    reference, count = table["reference"].iloc[0], table["position"].nunique()
    keys = _keys(table[(table["expected"] > 0.0) & np.isfinite(table["expected"])])
    figure, panels = style.panels(3.3, len(quantities), sharey=True)
    for axes, number, (quantity, own) in zip(panels, NUMBERS, quantities, strict=False):
        _draw_series(axes, own[own["expected"] > 0.0], count, float(reference))
        axes.axhline(1.0, color=style.NEUTRAL, linewidth=0.9)
        bounds = own[own["bound"] != 1.0].drop_duplicates("value").sort_values("value")
        if len(bounds):
            x, y = [*bounds["value"], reference], [*bounds["bound"], 1.0]
            axes.plot(x, y, color=style.NEUTRAL, linewidth=1.2, linestyle=(0, (1, 1.5)))
        axes.set(xlabel=setting, title=f"{number}  {quantity}")
        axes.tick_params(axis="x", labelsize=6.5)
    panels[0].set_ylabel(f"effort over that of {reference:g} [-]")
    style.keys_below(figure, keys, 4)
    return figure


def _draw_series(axes: Axes, table: pd.DataFrame, count: int, marked: float) -> None:
    marks.dashed(axes, marked)
    share = table["kind"].iloc[0] == SHARE
    scale = 100.0 if share else 1.0
    known = table.replace(np.inf, np.nan).dropna(subset="expected").sort_values("value")
    for position, rows in groups(known, "position"):
        x = rows["value"] * (1.0 + APART * (position - 0.5 * (count - 1)))
        look, most = _look(int(position)), rows["upper"].fillna(rows["expected"])
        axes.plot(x, scale * rows["expected"], linewidth=1.1, **look)
        bars = {"color": look["color"], "linewidth": 1.0, "alpha": 0.7}
        axes.vlines(x, scale * rows["lower"], scale * most, **bars)
    logarithmic_axis(axes, sorted({*table["value"], marked}))
    if share:
        axes.set_ylim(-4, 104)
    else:
        axes.set_yscale("log")
        axes.yaxis.set_minor_formatter(NullFormatter())


def logarithmic_axis(axes: Axes, values: Collection[float]) -> None:
    """Make the horizontal axis logarithmic, with these values of a setting as its only ticks."""
    axes.set_xscale("log")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticks(list(values), [f"{value:g}" for value in values])


def _look(position: int) -> dict[str, Any]:
    return {
        "color": style.condition_colour(position),
        "linestyle": (0, (4, 1.5)) if position % 2 else "-",
        "marker": "o",
        "markersize": 3.2,
    }


def _keys(table: pd.DataFrame) -> list[Line2D]:
    tasks = sorted(set(zip(table["position"], table["task"], strict=True)))
    return [style.key(name, **_look(position)) for position, name in tasks]


@table_of("position task quantity scope median lower upper runs slope length_unit")
def floor_table(found: Sequence[Task]) -> Rows:
    """Return residual distances and cycles per kind of goal and scope."""
    for position, task in enumerate(found):
        for scope, c in task.by_value.items():
            given, same = (position, task.name), (slope(task), c.length_unit)
            for name, values in ((RESIDUAL, measures.residuals(c)), (CYCLES, measures.cycles(c))):
                median, lower, upper, _ = inference.spread(values)
                yield *given, name, scope, median, lower, upper, c.done, *same
            for value in measures.residuals(c):
                yield *given, POINT, scope, value, value, value, 1, *same


def slope(task: Task) -> float:
    """Return the slope of the median residual over the scope, both as logarithms.

    It is NaN if there are fewer than two scopes.
    """
    medians = np.array(
        [inference.spread(measures.residuals(c)).median for c in task.by_value.values()]
    )
    if len(medians) < 2 or not (medians > 0.0).all():
        return float("nan")
    x, y = np.log2(list(task.by_value)), np.log2(medians)
    x, y = x - x.mean(), y - y.mean()
    return float((x * y).sum() / (x * x).sum())


def draw_floor(table: pd.DataFrame) -> Figure:
    """Draw residuals with every run, and cycles, against the scope, a colour per kind of goal."""
    figure, (left, right) = style.panels(3.4, 2)
    for (position, task), own in groups(table, ["position", "task"]):
        colour = style.arm_colour(int(position))
        points = own[own["quantity"] == POINT]
        dots: dict[str, Any] = {"color": colour, "ms": 2.2, "alpha": 0.35, "mec": "none"}
        left.plot(points["scope"], points["median"], "o", **dots)
        for axes, quantity in ((right, CYCLES), (left, RESIDUAL)):
            rows = own[own["quantity"] == quantity].sort_values("scope")
            x, medians = rows["scope"], rows["median"]
            bars = medians - rows["lower"], rows["upper"] - medians
            look: dict[str, Any] = {"color": colour, "markersize": 4.5, "elinewidth": 1.6}
            name = f"{task} (slope {own['slope'].iloc[0]:.2f})"
            axes.errorbar(x, medians, yerr=bars, fmt="o-", label=name, **look)
        # a line proportional to the scope through the middle of the residuals
        middle = len(rows) // 2
        line = medians.iloc[middle] * x / x.iloc[middle]
        left.plot(x, line, label="proportional to the scope", **PROPORTIONAL)
    for axes in (left, right):
        logarithmic_axis(axes, sorted(set(table["scope"])))
        axes.set_xlabel("scope of a joint [rad]")
    unit = table["length_unit"].iloc[0]
    left.set(yscale="log", ylabel=f"distance to the goal at the end [{unit}]", title="a  residual")
    right.set(ylabel="cycles until it stagnates [-]", title="b  cycles", ylim=(0, None))
    style.legend_below(figure, [left], 4)
    return figure


@table_of(
    "position condition phase order quantity cycle median lower upper begun running tolerance "
    "length_unit"
)
def history_table(results: Results) -> Rows:
    """Return cost and distance of the best so far, per phase and cycle of the phase."""
    for position, c in enumerate(results.main):
        names = measures.phase_names(c)
        for phase, own in groups(c.generations, "term_phase"):
            cycle = own.groupby("replicate")["index"].rank(method="first").astype(int) - 1
            numbered = own.assign(cycle=cycle)
            for quantity, column in ((DISTANCE, "term_goal_distance"), (COST, "term_cost")):
                wide = numbered.pivot(index="cycle", columns="replicate", values=column)
                values = wide.abs().ffill().to_numpy(dtype=np.float64)
                curve = wide.index, *quantiles(values, (0.5, 0.25, 0.75))
                runs = wide.shape[1], wide.notna().sum(axis=1).to_numpy()
                of = position, c.label, names[int(phase) - 1], int(phase) - len(names), quantity
                yield *of, *curve, *runs, measures.tolerances(c)[int(phase) - 1], c.length_unit


def draw_history(table: pd.DataFrame) -> Figure:
    """Draw medians with quartiles of the distance, one panel per phase.

    If there is one phase alone, its cost is drawn beside it. If there are many conditions, each has
    its own panel, with a line per phase.
    """
    conditions = sorted(set(zip(table["position"], table["condition"], strict=True)))
    in_order = table.sort_values(["position", "order"], kind="stable")["phase"]
    phases = sorted(dict.fromkeys(in_order), key=lambda name: not name.startswith("subgoal"))
    by, names, height = "condition", [name for _, name in conditions], 2.4
    if len(conditions) > MANY:
        by, names, height = "phase", phases, 2.1
        panels = [(table["position"] == k, name, DISTANCE) for k, name in conditions]
    elif len(phases) == 1:
        both = (("a", COST), ("b", DISTANCE))
        panels = [(table["phase"] == phases[0], f"{k}  {name}", name) for k, name in both]
    else:
        numbered = enumerate(phases, 1)
        panels = [(table["phase"] == name, f"{k}  {name}", DISTANCE) for k, name in numbered]
    figure, places = style.panels(height, len(panels), PER_LINE, 0.8)
    far = table.loc[table["quantity"] == DISTANCE, ["lower", "upper", "tolerance"]].to_numpy()
    far = far[far > VISIBLE]
    for axes, (chosen, title, quantity) in zip(places, panels, strict=True):
        rows = table[chosen & (table["quantity"] == quantity)]
        _draw_curves(axes, rows, by, names)
        label = "cost of the best so far [-]"
        if quantity == DISTANCE:  # distances on one scale
            label = f"distance [{rows['length_unit'].iloc[0]}]"
            if len(far):
                axes.set_ylim(0.7 * far.min(), 1.4 * far.max())
            for tolerance in sorted(set(rows["tolerance"][rows["tolerance"] >= VISIBLE])):
                axes.axhline(tolerance, **TOLERANCE)
        axes.set_title(title, fontsize=8)
        axes.set_ylabel(label)
        if style.ends_column(axes, places):
            axes.set_xlabel("cycle of the phase")
    colours = {name: style.condition_colour(k) for k, name in enumerate(names)}
    keys = [style.key(name.replace("_", " "), color=c) for name, c in colours.items()]
    if (table["tolerance"] >= VISIBLE).any():
        keys.append(style.key("tolerance", **TOLERANCE))
    style.keys_below(figure, keys, 4)
    return figure


def _draw_curves(axes: Axes, table: pd.DataFrame, by: str, names: list[str]) -> None:
    """Draw one curve per condition or phase; numbers of runs at the ends, equal ones once."""
    by_length = sorted(groups(table, by), key=lambda curve: int(curve[1]["cycle"].max()))
    longest = {rows["begun"].iloc[0]: name for name, rows in by_length}
    for name, curve in groups(table, by):
        x, median = curve["cycle"], curve["median"]
        colour = style.condition_colour(names.index(name))
        marks.band(axes, x, curve["lower"], curve["upper"], colour, alpha=0.2)
        axes.plot(x, median, color=colour)
        begun = curve["begun"].iloc[0]
        if longest[begun] == name:
            at = x.iloc[-1], median.iloc[-1]
            look: dict[str, Any] = {"color": colour, "fontsize": 6, "va": "center", "ha": "left"}
            axes.annotate(f" {begun}", at, annotation_clip=False, **look)
    axes.set(yscale="log", xlim=(0, max(1, int(table["cycle"].max()))))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=4, integer=True))
