"""How near a search gets before it stagnates, and what that costs, against its local scope.

Corsépius 2001, Fig. 2.
"""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.measures import Task
from evoexp.report import style
from evoexp.report.figures.boxes import JITTER
from evoexp.report.rows import records
from evoexp.report.statistics import spread

RESIDUAL, CYCLES, POINT = "residual", "cycles", "point"


def floor_table(task: Task) -> pd.DataFrame:
    """Return residual distances and cycles per scope.

    Returns:
        Columns quantity (residual, cycles, point), scope [rad], median, lower, upper (a point: the
        residual of one run three times), runs, slope (of log residual over log scope, medians),
        length_unit.
    """
    rows: list[tuple[object, ...]] = []
    for scope, c in zip(task.values, task.conditions, strict=True):
        for name, values in ((RESIDUAL, measures.residuals(c)), (CYCLES, measures.cycles(c))):
            found = spread(values)
            rows.append((name, scope, found.median, found.lower, found.upper, c.done))
        rows += [(POINT, scope, value, value, value, 1) for value in measures.residuals(c)]
    table = pd.DataFrame(rows, columns=["quantity", "scope", "median", "lower", "upper", "runs"])
    return table.assign(slope=slope(task), length_unit=task.conditions[0].condition.length_unit)


def slope(task: Task) -> float:
    """Return the slope of the median residual over the scope, both as logarithms.

    NaN of fewer than two scopes.
    """
    medians = np.array([spread(measures.residuals(c)).median for c in task.conditions])
    if len(medians) < 2 or not (medians > 0.0).all():
        return float("nan")
    x, y = np.log2(np.array(task.values)), np.log2(medians)
    x, y = x - x.mean(), y - y.mean()
    return float((x * y).sum() / (x * x).sum())


def draw_floor(table: pd.DataFrame) -> Figure:
    """Draw residuals with every run, and cycles, against the scope."""
    figure = style.figure(3.1)
    left, right = figure.subplots(1, 2)
    unit = table["length_unit"].iloc[0]
    points = table[table["quantity"] == POINT]
    beside = np.exp2(JITTER * (2.0 * ((np.arange(len(points)) * 0.618034) % 1.0) - 1.0))
    left.plot(
        points["scope"] * beside,
        points["median"],
        "o",
        color=style.arm_colour(0),
        ms=2.2,
        alpha=0.35,
        mec="none",
    )
    for axes, quantity in ((left, RESIDUAL), (right, CYCLES)):
        own = table[table["quantity"] == quantity].sort_values("scope")
        axes.plot(
            own["scope"],
            own["median"],
            "o-",
            color=style.arm_colour(0),
            markersize=4.5,
            linewidth=1.1,
        )
        for row in records(own):
            axes.vlines(row.scope, row.lower, row.upper, color=style.arm_colour(0), linewidth=1.6)
        axes.set_xscale("log")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xticks(list(own["scope"]), [f"{scope:g}" for scope in own["scope"]])
        axes.set_xlabel("scope of a joint [rad]")
    own = table[table["quantity"] == RESIDUAL].sort_values("scope")
    middle = len(own) // 2
    line = own["median"].iloc[middle] * own["scope"] / own["scope"].iloc[middle]
    left.plot(
        own["scope"],
        line,
        ":",
        color=style.NEUTRAL,
        linewidth=1.1,
        label="proportional to the scope",
    )
    left.set_yscale("log")
    left.set_ylabel(f"distance to the goal at the end [{unit}]")
    left.set_title(f"a  residual (slope {table['slope'].iloc[0]:.2f})")
    left.legend(loc="upper left")
    right.set_ylabel("cycles until it stagnates [-]")
    right.set_ylim(bottom=0)
    right.set_title("b  cycles")
    return figure
