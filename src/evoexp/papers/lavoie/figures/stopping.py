"""Precision against the value at which a search stops (Lavoie & Boudreau 2001, section 6)."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.kit import Results, Values, groups, spread, style

ERROR, EFFORT = "position error", "evaluations"
BESIDE = 0.012  # [-] of the axis by which series are set apart
NAMES = [
    *("quantity", "num_generations", "stop_cost", "condition"),
    *("median", "lower", "upper", "solved", "done"),
]


def stopping_table(results: Results, errors: Values, effort: Values) -> pd.DataFrame:
    """Return precision and effort of every condition by its stopping value and its generations.

    Returns:
        Columns quantity (position error, evaluations), num_generations, stop_cost, condition,
        median, lower, upper (quartiles over all runs), solved, done, length_unit.
    """
    rows = [
        (
            *(name, c.planner.ga.num_generations, c.planner.stop_cost_sp2, c.label),
            *(*spread(values(c))[:3], c.solved, c.done),
        )
        for name, values in ((ERROR, errors), (EFFORT, effort))
        for c in results.with_data
    ]
    unit = results.with_data[0].condition.length_unit
    return pd.DataFrame(rows, columns=NAMES).assign(length_unit=unit)


def draw_stopping(table: pd.DataFrame) -> Figure:
    """Draw medians with quartiles of error and effort, one series per limit of generations."""
    figure = style.figure(3.2)
    panels = figure.subplots(1, 2, sharex=True)
    count = table["num_generations"].nunique()
    apart = BESIDE * float(np.ptp(table["stop_cost"]) or 1.0)
    labels = {
        ERROR: ("a  precision", f"position error [{table['length_unit'].iloc[0]}]"),
        EFFORT: ("b  effort", "evaluations to a solution [-]"),
    }
    for axes, (quantity, (title, label)) in zip(panels, labels.items(), strict=True):
        own = table[table["quantity"] == quantity].replace(np.inf, np.nan)
        for k, (generations, rows) in enumerate(groups(own, "num_generations")):
            rows = rows.sort_values("stop_cost")
            x = rows["stop_cost"] + apart * (2 * k - count + 1)
            solved, done = rows[["solved", "done"]].sum()
            runs, colour = f"({solved} of {done} runs with a solution)", style.condition_colour(k)
            name = f"at most {int(generations)} generations {runs}"
            without_end = rows["upper"].isna() & rows["lower"].notna()
            axes.vlines(x, rows["lower"], rows["upper"], color=colour, linewidth=1.2)
            axes.plot(x[without_end], rows["lower"][without_end], "^", color=colour, ms=6)
            axes.plot(x, rows["median"], "o-", label=name, color=colour, ms=4.5, lw=1.0)
        axes.set(
            ylim=(0.0, None),
            xlabel="stopping value of SP2 (objective) [-]",
            ylabel=label,
            title=title,
        )
        axes.set_xticks(sorted(table["stop_cost"].unique()))
        style.shorten_thousands(axes.yaxis)
    panels[0].invert_xaxis()
    style.legend_below(figure, panels[0], 2)
    return figure
