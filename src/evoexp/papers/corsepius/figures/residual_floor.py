"""How near a search gets before it stagnates, against its local scope (Corsépius 2001, Fig. 2)."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.figures.population_effort import logarithmic_axis
from evoexp.papers.corsepius.measures import Task
from evoexp.report.figures.boxes import JITTER
from evoexp.report.kit import spread, style

RESIDUAL, CYCLES, POINT = "residual", "cycles", "point"
NAMES = ["quantity", "scope", "median", "lower", "upper", "runs"]


def floor_table(task: Task) -> pd.DataFrame:
    """Return residual distances and cycles per scope.

    Returns:
        Columns quantity (residual, cycles, point), scope [rad], median, lower, upper (a point: the
        residual of one run three times), runs, slope (of log residual over log scope, medians),
        length_unit.
    """
    rows: list[tuple[object, ...]] = []
    for scope, c in task.by_value.items():
        for name, values in ((RESIDUAL, measures.residuals(c)), (CYCLES, measures.cycles(c))):
            median, lower, upper, _ = spread(values)
            rows.append((name, scope, median, lower, upper, c.done))
        rows += [(POINT, scope, value, value, value, 1) for value in measures.residuals(c)]
    table = pd.DataFrame(rows, columns=NAMES)
    return table.assign(slope=slope(task), length_unit=task.conditions[0].condition.length_unit)


def slope(task: Task) -> float:
    """Return the slope of the median residual over the scope, both as logarithms.

    It is NaN if there are fewer than two scopes.
    """
    medians = np.array([spread(measures.residuals(c)).median for c in task.conditions])
    if len(medians) < 2 or not (medians > 0.0).all():
        return float("nan")
    x, y = np.log2(np.array(task.values)), np.log2(medians)
    x, y = x - x.mean(), y - y.mean()
    return float((x * y).sum() / (x * x).sum())


def draw_floor(table: pd.DataFrame) -> Figure:
    """Draw residuals with every run, and cycles, against the scope."""
    figure, (left, right) = style.row_of_panels(3.1, 2)
    colour, unit = style.arm_colour(0), table["length_unit"].iloc[0]
    # every run, beside its scope by a low-discrepancy jitter
    points = table[table["quantity"] == POINT]
    beside = np.exp2(JITTER * (2.0 * ((np.arange(len(points)) * 0.618034) % 1.0) - 1.0))
    left.plot(
        points["scope"] * beside,
        points["median"],
        "o",
        color=colour,
        ms=2.2,
        alpha=0.35,
        mec="none",
    )
    # medians and quartiles
    residuals, cycles = (
        table[table["quantity"] == quantity].sort_values("scope") for quantity in (RESIDUAL, CYCLES)
    )
    for axes, own in ((left, residuals), (right, cycles)):
        x = own["scope"]
        axes.plot(x, own["median"], "o-", color=colour, markersize=4.5, linewidth=1.1)
        axes.vlines(x, own["lower"], own["upper"], color=colour, linewidth=1.6)
        logarithmic_axis(axes, list(x))
        axes.set_xlabel("scope of a joint [rad]")
    # a proportional line through the middle
    x, middle = residuals["scope"], len(residuals) // 2
    line = residuals["median"].iloc[middle] * x / x.iloc[middle]
    left.plot(x, line, ":", color=style.NEUTRAL, linewidth=1.1, label="proportional to the scope")
    left.set_yscale("log")
    title = f"a  residual (slope {table['slope'].iloc[0]:.2f})"
    left.set(ylabel=f"distance to the goal at the end [{unit}]", title=title)
    left.legend(loc="upper left")
    right.set(ylabel="cycles until it stagnates [-]", title="b  cycles", ylim=(0, None))
    return figure
