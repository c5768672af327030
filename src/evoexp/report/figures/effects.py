"""Sweeps: quantities of all conditions side by side, and effect sizes of the first condition."""

import textwrap
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.figures.boxes import draw_box
from evoexp.report.results import ConditionResults, Results
from evoexp.report.rows import groups
from evoexp.report.statistics import quantile
from evoexp.report.verdicts import Comparison

WRAPPED = 24  # characters of a name in a panel, per line
THOUSANDS = 10_000  # from here on numbers along an axis are written with k and M
Values = Callable[[ConditionResults], FloatArray]


def values_table(results: Results, quantities: Mapping[str, Values]) -> pd.DataFrame:
    """Return quantities of every finished replicate.

    Args:
        results: With data.
        quantities: Name with unit → its values of a condition, (done,); inf: never.

    Returns:
        Columns quantity, position, condition, replicate, value, failed (replicates of the
        condition).
    """
    parts = [
        pd.DataFrame(
            {
                "quantity": name,
                "position": position,
                "condition": c.label,
                "replicate": c.summaries.index,
                "value": values(c),
                "failed": c.failed,
            }
        )
        for name, values in quantities.items()
        for position, c in enumerate(results.with_data)
    ]
    return pd.concat(parts, ignore_index=True)


def draw_values(table: pd.DataFrame) -> Figure:
    """Draw Tukey's boxes with every replicate's point, the first condition on top."""
    quantities = list(dict.fromkeys(table["quantity"]))
    labels = dict(zip(table["position"], table["condition"], strict=True))
    figure, panels = style.row_of_panels(0.32 * len(labels) + 1.1, len(quantities), sharey=True)
    for axes, quantity in zip(panels, quantities, strict=True):
        rows = table[table["quantity"] == quantity]
        for position, own in groups(rows, "position"):
            draw_box(axes, position, own["value"].to_numpy(), style.condition_colour(position))
            never = int(np.isinf(own["value"]).sum())
            if never:
                place = (1.01, position)
                axes.annotate(
                    f"{never} never",
                    place,
                    xycoords=axes.get_yaxis_transform(),
                    fontsize=6.5,
                    va="center",
                )
        middle = quantile(rows.loc[rows["position"] == 0, "value"].to_numpy(), 0.5)
        if np.isfinite(middle):
            axes.axvline(middle, color=style.FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)
        axes.set_xlabel(textwrap.fill(quantity, WRAPPED))
        axes.margins(x=0.06)
        axes.xaxis.set_major_locator(style.few_ticks())
        if axes.get_xlim()[1] >= THOUSANDS:
            axes.xaxis.set_major_formatter(EngFormatter())  # 200 k
    counts = (
        table[table["quantity"] == quantities[0]]
        .groupby("position")
        .agg(n=("value", "size"), failed=("failed", "max"))
    )
    names = [
        f"{labels[k]}  (n = {n}{f', {failed} failed' if failed else ''})"
        for k, n, failed in counts.itertuples()
    ]
    panels[0].set_yticks(list(counts.index), names)
    panels[0].set_ylim(len(labels) - 0.4, -0.6)
    return figure


def effects_table(
    comparisons: Mapping[str, Sequence[Comparison]], significance: float
) -> pd.DataFrame:
    """Return how often the first condition is better.

    Args:
        comparisons: Name of a quantity → the first condition against each other one.
        significance: Below this adjusted p-value a difference counts.

    Returns:
        Columns quantity, condition (the other one), a12, lower, upper, p_adjusted, seeds,
        significance.
    """
    rows = [
        (quantity, c.quantity, c.better.a12, *c.better.interval, c.p_adjusted, c.num_seeds)
        for quantity, found in comparisons.items()
        for c in found
    ]
    return pd.DataFrame(
        rows, columns=["quantity", "condition", "a12", "lower", "upper", "p_adjusted", "seeds"]
    ).assign(significance=significance)


def draw_effects(table: pd.DataFrame) -> Figure:
    """Draw A12 with its interval, one row per other condition, one panel per quantity."""
    quantities = list(dict.fromkeys(table["quantity"]))
    labels = list(dict.fromkeys(table["condition"]))
    figure, panels = style.row_of_panels(0.3 * len(labels) + 1.2, len(quantities), sharey=True)
    for axes, quantity in zip(panels, quantities, strict=True):
        rows = table[table["quantity"] == quantity]
        y = np.array([labels.index(label) for label in rows["condition"]])
        a12, low, high = (rows[name].to_numpy(np.float64) for name in ("a12", "lower", "upper"))
        axes.axvline(0.5, color=style.FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)
        axes.hlines(y, low, high, color=style.ARM_COLOURS[0], linewidth=1.4)
        level = float(rows["significance"].iloc[0])
        clear = rows["p_adjusted"].to_numpy(np.float64) < level
        for shown, fill, sign in ((clear, style.ARM_COLOURS[0], "<"), (~clear, "white", "≥")):
            label, colour = f"adjusted p {sign} {level:g}", style.ARM_COLOURS[0]
            axes.plot(a12[shown], y[shown], "o", color=colour, mfc=fill, ms=5, label=label)
        label = "A12: the first condition is better"
        axes.set(xlim=(-0.03, 1.03), title=textwrap.fill(quantity, WRAPPED), xlabel=label)
    panels[0].set_yticks(range(len(labels)), [f"against {label}" for label in labels])
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    style.legend_below(figure, panels[0], 2)
    return figure
