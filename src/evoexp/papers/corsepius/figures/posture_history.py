"""The approach of searches to their goals, phase by phase."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from evoexp.papers.corsepius import measures
from evoexp.report.figures import groups, marks, records, style
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.inference import quantile, quantiles

DISTANCE, COST = "distance to the goal", "cost"
PER_LINE = 3  # panels
MANY = 3  # conditions; more have panels of their own
VISIBLE = 1e-6  # [length unit] smaller tolerances are not drawn
QUARTILES = (0.5, 0.25, 0.75)
TOLERANCE: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 0.9, "linestyle": (0, (4, 2))}


def history_table(results: Results) -> pd.DataFrame:
    """Return cost and distance of the best so far, per phase and cycle of the phase."""
    parts = []
    for position, c in enumerate(results.main):
        names = measures.phase_names(c)
        for phase, own in groups(c.generations, "term_phase"):
            cycle = own.groupby("replicate")["index"].rank(method="first").astype(int) - 1
            numbered = own.assign(cycle=cycle)
            for quantity, column in ((DISTANCE, "term_goal_distance"), (COST, "term_cost")):
                wide = numbered.pivot(index="cycle", columns="replicate", values=column)
                values = wide.abs().ffill().to_numpy(dtype=np.float64)
                quartiles = quantiles(values, QUARTILES)
                columns: dict[str, Any] = {"position": position, "condition": c.label}
                columns |= {"phase": names[int(phase) - 1], "order": int(phase) - len(names)}
                columns |= {"quantity": quantity, "cycle": wide.index}
                columns |= dict(zip(("median", "lower", "upper"), quartiles, strict=True))
                columns |= {"begun": wide.shape[1], "running": wide.notna().sum(axis=1).to_numpy()}
                columns |= {"tolerance": measures.tolerances(c)[int(phase) - 1]}
                parts.append(pd.DataFrame(columns).assign(length_unit=c.length_unit))
    return pd.concat(parts, ignore_index=True)


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
        axes.set(xlabel="cycle of the phase", ylabel=label)
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


def phases_table(results: Results, confidence: float) -> pd.DataFrame:
    """Return success and cycles of each phase, over all conditions with several."""
    rows = []
    for position, c in enumerate(results.main):
        for phase, own in groups(measures.phase_cycles(c), "phase"):
            reached = counted(own["reached"])
            cycles = own["cycles"].to_numpy(dtype=np.float64)
            given = position, c.label, int(phase), measures.phase_names(c)[int(phase)]
            share = (reached.total, reached.having, reached.share, *reached.interval(confidence))
            rows.append((*given, *share, *(quantile(cycles, share) for share in QUARTILES)))
    names = ["position", "condition", "order", "phase", "begun", "reached"]
    spreads = ["share", "lower", "upper", "cycles", "cycles_lower", "cycles_upper"]
    return pd.DataFrame(rows, columns=names + spreads)


def draw_phases(table: pd.DataFrame) -> Figure:
    """Draw, phase by phase, the share of runs that reach its end, and the cycles they take."""
    figure, (left, right) = style.panels(0.28 * len(table) + 1.1, 2, sharey=True)
    labels = []
    for y, row in enumerate(records(table)):
        colour, percents = style.condition_colour(int(row.position)), 100 * row.share
        left.hlines(y, 100 * row.lower, 100 * row.upper, color=colour, linewidth=1.6)
        right.hlines(y, row.cycles_lower, row.cycles_upper, color=colour, linewidth=1.6)
        for axes, middle in ((left, percents), (right, row.cycles)):
            axes.plot([middle], [y], "o", color=colour, markersize=4.5)
        marks.beside(left, y, f"{row.reached}/{row.begun}")
        who = f"{row.condition}: " if table["position"].nunique() > 1 else ""
        labels.append(f"{who}{row.order + 1}  {row.phase.replace('_', ' ')}")
    left.set_yticks(range(len(labels)), labels)
    left.set(ylim=(len(labels) - 0.5, -0.5), xlim=(-3, 103), title="a  goal of the phase met")
    left.set_xlabel("share of the runs that began it [%]")
    right.set(xlim=(0, None), xlabel="cycles (median, quartiles)", title="b  cycles")
    return figure
