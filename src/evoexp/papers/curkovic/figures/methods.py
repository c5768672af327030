"""Methods side by side (Curkovic et al. 2013, Fig. 6): convergence above, boxes below."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.records import FloatArray
from evoexp.report.kit import Results, draw_box, groups, style

CURVE, FINAL, BOUND = "best so far", "final", "lower bound"


def methods_table(results: Results, bound: float) -> pd.DataFrame:
    """Return best costs so far per generation, and at the end.

    Args:
        results: With data.
        bound: Lower bound of the cost.

    Returns:
        Columns series (best so far: one row per method and generation; final: one per replicate;
        lower bound), position, method, generation, replicate, value (the mean over the replicates
        that have a solution by then, or the replicate's own), deviation (standard), replicates
        (that have a solution).
    """
    parts = []
    for position, c in enumerate(results.with_data):
        costs = c.generations.pivot(index="index", columns="replicate", values="best_cost")
        finite = costs.replace([np.inf], np.nan)
        curve = pd.DataFrame(
            {
                "series": CURVE,
                "generation": finite.index.to_numpy(),
                "value": finite.mean(axis=1).to_numpy(),
                "deviation": finite.std(axis=1, ddof=1).to_numpy(),
                "replicates": finite.notna().sum(axis=1).to_numpy(),
            }
        )
        final = pd.DataFrame(
            {"series": FINAL, "replicate": c.summaries.index, "value": c.column("best_cost")}
        )
        parts += [part.assign(position=position, method=c.label) for part in (curve, final)]
    table = pd.concat(
        [*parts, pd.DataFrame({"series": [BOUND], "value": [bound]})], ignore_index=True
    )
    order = [
        "series",
        "position",
        "method",
        "generation",
        "replicate",
        "value",
        "deviation",
        "replicates",
    ]
    return table[order].astype({"value": "float64", "deviation": "float64"})


def draw_methods(table: pd.DataFrame) -> Figure:
    """Draw mean and standard deviation against generations, and the final values as boxes."""
    figure = style.figure(7.0)
    above, below = figure.subplots(2, 1, height_ratios=(3, 2))
    bound = float(table.loc[table["series"] == BOUND, "value"].iloc[0])
    names = _curves(above, table[table["series"] == CURVE])
    final = table[table["series"] == FINAL]
    labels = []
    for position, rows in groups(final, "position"):
        values: FloatArray = rows["value"].to_numpy()
        draw_box(below, position, values, style.condition_colour(int(position)), "vertical")
        failed = int(np.count_nonzero(~np.isfinite(values)))
        labels.append(
            f"{names[position]}\nn = {len(values)}{f', {failed} without' if failed else ''}"
        )
    for axes in (above, below):
        axes.axhline(
            bound, color=style.NEUTRAL, linewidth=1.0, linestyle=(0, (1, 2)), label="lower bound"
        )
        axes.set_ylabel("best C₂ + C₃ + C₄ of a team")
    above.set_title("a  mean ± standard deviation of the best collision-free team so far")
    below.set_title("b  at the end of each run")
    below.set(xlim=(-0.6, len(labels) - 0.4))
    below.set_xticks(range(len(labels)), labels)
    style.legend_below(figure, above, 5)
    return figure


def _curves(axes: Axes, table: pd.DataFrame) -> dict[float, str]:
    """Draw a curve per method and return the names of the methods by position."""
    names = {}
    for (position, method), rows in groups(table, ["position", "method"]):
        colour = style.condition_colour(int(position))
        names[position] = str(method)
        x, mean, deviation = (
            rows[name].to_numpy(np.float64) for name in ("generation", "value", "deviation")
        )
        kind = "-" if position * 2 > table["position"].max() else (0, (4, 1.5))
        axes.fill_between(
            x, mean - deviation, mean + deviation, color=colour, alpha=0.10, linewidth=0
        )
        axes.plot(x, mean, color=colour, linestyle=kind, label=str(method))
    axes.set_xlim(0, max(1.0, float(table["generation"].max())))
    axes.set_xlabel("generation")
    return names
