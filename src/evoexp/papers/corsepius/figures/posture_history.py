"""How a search comes near its goal: best so far against cycles, phase by phase.

Why searches end.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from evoexp.papers.corsepius import measures
from evoexp.report import style
from evoexp.report.proportions import Proportion
from evoexp.report.results import ConditionResults, Results
from evoexp.report.rows import groups, records
from evoexp.report.statistics import quantile

DISTANCE, COST = "distance to the goal", "cost"
PER_LINE = 3  # panels
MANY = 3  # conditions; more have panels of their own
VISIBLE = 1e-6  # [length unit] tolerances below are no line


def history_table(results: Results) -> pd.DataFrame:
    """Return cost and distance of the best so far, per phase and cycle of the phase.

    A search that has ended keeps its last value, so that every cycle counts all runs that began the
    phase.

    Returns:
        Columns position, condition, phase (name), order (of phases), quantity, cycle, median,
        lower, upper, begun (runs that began the phase), running (of them still searching),
        tolerance, length_unit.
    """
    parts = []
    for position, c in enumerate(results.main):
        names = measures.phase_names(c)
        rows = c.generations[
            ["replicate", "index", "term_phase", "term_goal_distance", "term_cost"]
        ]
        for phase, own in groups(rows, "term_phase"):
            cycle = own.groupby("replicate")["index"].rank(method="first").astype(int) - 1
            own = own.assign(cycle=cycle)
            for quantity, column in ((DISTANCE, "term_goal_distance"), (COST, "term_cost")):
                wide = own.pivot(index="cycle", columns="replicate", values=column).abs()
                running = wide.notna().sum(axis=1).to_numpy()
                values = wide.ffill().to_numpy(dtype=np.float64)
                parts.append(
                    pd.DataFrame(
                        {
                            "position": position,
                            "condition": c.label,
                            "phase": names[int(phase) - 1],
                            "order": int(phase) - len(names),
                            "quantity": quantity,
                            "cycle": wide.index,
                            "median": [quantile(row, 0.5) for row in values],
                            "lower": [quantile(row, 0.25) for row in values],
                            "upper": [quantile(row, 0.75) for row in values],
                            "begun": wide.shape[1],
                            "running": running,
                            "tolerance": c.condition.scenario.position_tolerance,  # type: ignore[attr-defined]
                            "length_unit": c.condition.length_unit,
                        }
                    )
                )
    return pd.concat(parts, ignore_index=True)


def draw_history(table: pd.DataFrame) -> Figure:
    """Draw medians with quartiles of the distance, one panel per phase.

    Of one phase alone, the cost beside it.

    Where there are many conditions, each has its own panel, with a line per phase.
    """
    many = table["position"].nunique() > MANY
    phases = _ordered(table)
    if many:
        panels = [(table["position"] == k, name, DISTANCE) for k, name in _conditions(table)]
    elif len(phases) == 1:
        panels = [
            (table["phase"] == phases[0], f"{'ab'[k]}  {what}", what)
            for k, what in enumerate((COST, DISTANCE))
        ]
    else:
        panels = [
            (table["phase"] == name, f"{k + 1}  {name}", DISTANCE) for k, name in enumerate(phases)
        ]
    columns = min(PER_LINE, len(panels))
    lines = -(-len(panels) // columns)
    figure = style.figure((2.1 if many else 2.4) * lines + 0.8)
    names = phases if many else [name for _, name in _conditions(table)]
    for k, (chosen, title, quantity) in enumerate(panels):
        axes = figure.add_subplot(lines, columns, k + 1)
        rows = table[chosen & (table["quantity"] == quantity)]
        _curves(axes, rows, "phase" if many else "condition", names)
        if quantity == DISTANCE and rows["tolerance"].iloc[0] >= VISIBLE:
            axes.axhline(
                rows["tolerance"].iloc[0], color=style.NEUTRAL, linewidth=0.9, linestyle=(0, (4, 2))
            )
        axes.set_title(title, fontsize=8)
        axes.set_xlabel("cycle of the phase")
        unit = rows["length_unit"].iloc[0]
        axes.set_ylabel(
            f"distance [{unit}]" if quantity == DISTANCE else "cost of the best so far [-]"
        )
    handles = [
        Line2D([], [], color=style.condition_colour(k), label=name) for k, name in enumerate(names)
    ]
    handles.append(
        Line2D([], [], color=style.NEUTRAL, linewidth=0.9, linestyle=(0, (4, 2)), label="tolerance")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _curves(axes: Axes, table: pd.DataFrame, by: str, names: list[str]) -> None:
    """Draw one curve per condition or phase, with its number of runs at the end."""
    for name, curve in groups(table, by):
        colour = style.condition_colour(names.index(name))
        axes.fill_between(
            curve["cycle"], curve["lower"], curve["upper"], color=colour, alpha=0.2, linewidth=0
        )
        axes.plot(curve["cycle"], curve["median"], color=colour)
        text, place = (
            f" {curve['begun'].iloc[0]}",
            (curve["cycle"].iloc[-1], curve["median"].iloc[-1]),
        )
        axes.annotate(
            text, place, fontsize=6, color=colour, va="center", ha="left", annotation_clip=False
        )
    axes.set_yscale("log")
    axes.set_xlim(0, max(1, int(table["cycle"].max())))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=4, integer=True))


def _ordered(table: pd.DataFrame) -> list[str]:
    """Return the names of the phases, sub-goals first, those of every condition in its order."""
    found = [row.phase for row in records(table.sort_values(["position", "order"], kind="stable"))]
    names = list(dict.fromkeys(found))
    return sorted(names, key=lambda name: not name.startswith("subgoal"))


def _conditions(table: pd.DataFrame) -> list[tuple[int, str]]:
    return sorted(set(zip(table["position"], table["condition"], strict=True)))


def phases_table(results: Results, confidence: float) -> pd.DataFrame:
    """Return how each phase went, over all conditions with several.

    Returns:
        Columns position, condition, order, phase, begun, reached, share, lower, upper (of those
        that began it), cycles, cycles_lower, cycles_upper (quartiles).
    """
    rows = []
    for position, c in enumerate(results.main):
        for phase, own in groups(measures.phase_cycles(c), "phase"):
            reached = Proportion(int(own["reached"].sum()), len(own))
            values = own["cycles"].to_numpy(dtype=np.float64)
            spread = [quantile(values, share) for share in (0.5, 0.25, 0.75)]
            name = measures.phase_names(c)[int(phase)]
            share = (reached.total, reached.having, reached.share, *reached.interval(confidence))
            rows.append((position, c.label, int(phase), name, *share, *spread))
    ends = ["begun", "reached", "share", "lower", "upper", "cycles", "cycles_lower", "cycles_upper"]
    return pd.DataFrame(rows, columns=["position", "condition", "order", "phase", *ends])


def draw_phases(table: pd.DataFrame) -> Figure:
    """Draw, phase by phase, the share of runs that reach its end, and the cycles they take."""
    one = table[["position", "order"]].drop_duplicates().reset_index(drop=True)
    several = table["position"].nunique() > 1
    figure = style.figure(0.28 * len(one) + 1.1)
    left, right = figure.subplots(1, 2, sharey=True)
    labels = []
    for y, row in enumerate(records(table)):
        colour = style.condition_colour(int(row.position))
        left.hlines(y, 100 * row.lower, 100 * row.upper, color=colour, linewidth=1.6)
        left.plot([100 * row.share], [y], "o", color=colour, markersize=4.5)
        text = f" {row.reached}/{row.begun}"
        left.annotate(
            text,
            (1.0, y),
            xycoords=left.get_yaxis_transform(),
            fontsize=6.5,
            va="center",
            ha="left",
        )
        right.hlines(y, row.cycles_lower, row.cycles_upper, color=colour, linewidth=1.6)
        right.plot([row.cycles], [y], "o", color=colour, markersize=4.5)
        name = f"{row.order + 1}  {row.phase}"
        labels.append(f"{row.condition}: {name}" if several else name)
    left.set_yticks(range(len(labels)), labels)
    left.set_ylim(len(labels) - 0.5, -0.5)
    left.set_xlim(-3, 103)
    left.set_xlabel("share of the runs that began it [%]")
    left.set_title("a  goal of the phase met")
    right.set_xlim(left=0)
    right.set_xlabel("cycles (median, quartiles)")
    right.set_title("b  cycles")
    return figure


def reasons_rows(results: Results) -> list[tuple[str, int, str, Proportion]]:
    """Return how many runs of every condition ended for each reason: rows of `shares_table`."""
    kept: list[tuple[str, ConditionResults]] = [(c.label, c) for c in results.main]
    return [
        (f"ended by {reason}", position, label, proportion)
        for reason in measures.REASONS
        for position, (label, c) in enumerate(kept)
        for proportion in (measures.reasons(c)[reason],)
    ]
