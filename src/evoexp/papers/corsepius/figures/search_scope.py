"""The local search scope: boxes along a path, and the tool's reach (Corsépius 2001, Fig. 2)."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.spatial import ConvexHull

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.figures.posture_motions import tool_places
from evoexp.report.kit import BOOTSTRAP_SEED, ConditionResults, groups, records, rounded, style

POSTURE, REACH, TOOL = "posture", "reach", "tool"
FACTORS = (2.0, 1.0, 0.5)  # of the scope, whose reach is drawn
STEPS = 3000  # random ones whose hull is drawn
EQUAL: dict[str, Any] = {"adjustable": "datalim", "aspect": "equal"}
NAMES = ["element", "order", "x", "y", "half_x", "half_y", "factor"]


def scope_table(condition: ConditionResults, replicate: int) -> pd.DataFrame:
    """Return a path in the plane of its two liveliest joints, and the tool's reach at the start.

    The reach is told by hulls of the tool's places after one random step.

    Returns:
        Columns element (posture, reach, tool), order, x, y (joint angles [deg] of postures, places
        of the others), half_x, half_y (scope [deg] of the two joints), factor (of the scope),
        joint_x, joint_y (from 1), length_unit.
    """
    problem, q = measures.problem(condition), measures.paths(condition)[replicate]
    moved = np.abs(np.diff(q, axis=0)).sum(axis=0)
    a, b = sorted(int(k) for k in np.argsort(-moved, kind="stable")[:2])
    half = problem.scope[[a, b]] / DEGREE
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    steps = 2.0 * rng.random((STEPS, len(problem.start))) - 1.0
    parts = [(POSTURE, q[:, [a, b]] / DEGREE, *half, np.nan)]
    for factor in FACTORS:
        reached = problem.start + factor * problem.scope * steps
        places = tool_places(problem, np.clip(reached, *problem.limits.T))[:, :2]
        parts.append((REACH, places[ConvexHull(places).vertices], np.nan, np.nan, factor))
    parts.append((TOOL, tool_places(problem, q)[:, :2], np.nan, np.nan, np.nan))
    rows = [
        (element, n, x, y, *rest)
        for element, points, *rest in parts
        for n, (x, y) in enumerate(points)
    ]
    table = rounded(pd.DataFrame(rows, columns=NAMES))
    return table.assign(joint_x=a + 1, joint_y=b + 1, length_unit=condition.condition.length_unit)


def draw_scope(table: pd.DataFrame) -> Figure:
    """Draw the boxes, and the places that the tool can reach."""
    figure, (left, right) = style.row_of_panels(3.4, 2)
    path, reach, tool = (table[table["element"] == element] for element in (POSTURE, REACH, TOOL))
    blue, last = style.arm_colour(0), max(1, len(path) - 1)
    for row in records(path):
        corner, shade = (row.x - row.half_x, row.y - row.half_y), 0.10 + 0.12 * row.order / last
        look: dict[str, Any] = {"linewidth": 0, "facecolor": blue, "alpha": shade}
        left.add_patch(Rectangle(corner, 2 * row.half_x, 2 * row.half_y, **look))
    left.plot(path["x"], path["y"], "o-", color=blue, markersize=2.8, linewidth=1.0)
    _draw_ends(left, path)
    joints = (int(table[name].iloc[0]) - 1 for name in ("joint_x", "joint_y"))
    x, y = (f"{style.joint_symbol(0, joint)} [deg]" for joint in joints)
    left.set(xlabel=x, ylabel=y, title="a  boxes of offspring along a path", **EQUAL)
    for k, (factor, rows) in enumerate(sorted(groups(reach, "factor"), reverse=True)):
        colour, hull = style.ARM_COLOURS[(1, 0, 2)[k]], rows.sort_values("order")
        look = {"facecolor": colour, "edgecolor": colour, "alpha": 0.25}
        right.fill(hull["x"], hull["y"], label=f"{factor:g} × scope", **look)
    right.plot(tool["x"], tool["y"], color=style.NEUTRAL, linewidth=1.0, label="way of the tool")
    _draw_ends(right, tool)
    style.operational_axes(right, table["length_unit"].iloc[0])
    right.set(title="b  the tool, one step from the start", **EQUAL)
    style.legend_below(figure, right, 6)
    return figure


def _draw_ends(axes: Axes, path: pd.DataFrame) -> None:
    """Draw the start and the end of a path."""
    look: dict[str, Any] = {"color": "white", "markeredgecolor": style.NEUTRAL, "linestyle": "none"}
    axes.plot(path["x"].iloc[:1], path["y"].iloc[:1], "s", markersize=6, label="start", **look)
    axes.plot(path["x"].iloc[-1:], path["y"].iloc[-1:], "*", markersize=9, label="end", **look)
