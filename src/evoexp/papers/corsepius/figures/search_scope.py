"""The local search scope: boxes of offspring along a path, the tool's places one step away.

Corsépius 2001, Fig. 2.
"""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.spatial import ConvexHull

from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.results import ConditionResults
from evoexp.report.rows import groups, records, rounded
from evoexp.report.statistics import BOOTSTRAP_SEED
from evoexp.robots.poses import frame_pose

POSTURE, REACH, TOOL = "posture", "reach", "tool"
FACTORS = (2.0, 1.0, 0.5)  # of the scope, whose reach is drawn
STEPS = 3000  # random ones whose hull is drawn


def scope_table(condition: ConditionResults, replicate: int) -> pd.DataFrame:
    """Return a path in the plane of its two liveliest joints.

    And hulls of the tool's places one step from the start.

    Returns:
        Columns element (posture, reach, tool), order, x, y (joint angles [deg] of postures, places
        of the others), half_x, half_y (scope [deg] of the two joints), factor (of the scope),
        joint_x, joint_y (from 1), length_unit.
    """
    problem = condition.prepared.problem
    q = condition.solutions[replicate].reshape(-1, len(problem.start))
    moved = np.abs(np.diff(q, axis=0)).sum(axis=0)
    a, b = sorted(int(k) for k in np.argsort(-moved, kind="stable")[:2])
    half_x, half_y = problem.scope[[a, b]] / DEGREE
    rows: list[dict[str, object]] = [
        {"element": POSTURE, "order": n, "x": x, "y": y, "half_x": half_x, "half_y": half_y}
        for n, (x, y) in enumerate(q[:, [a, b]] / DEGREE)
    ]

    joint, local = problem.tool

    def tool(posture: FloatArray) -> FloatArray:
        return frame_pose(problem.assembly.table, joint, local, posture)[9:11]

    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    steps = 2.0 * rng.random((STEPS, len(problem.start))) - 1.0
    for factor in FACTORS:
        reached = problem.start + factor * problem.scope * steps
        places = np.array([tool(p) for p in np.clip(reached, *problem.limits.T)])
        hull = ConvexHull(places).vertices
        rows += [
            {"element": REACH, "order": n, "x": x, "y": y, "factor": factor}
            for n, (x, y) in enumerate(places[hull])
        ]
    rows += [
        {"element": TOOL, "order": n, "x": x, "y": y} for n, (x, y) in enumerate(tool(p) for p in q)
    ]
    names = ["element", "order", "x", "y", "half_x", "half_y", "factor"]
    table = pd.DataFrame(rows).reindex(columns=names)
    return rounded(table).assign(
        joint_x=a + 1, joint_y=b + 1, length_unit=condition.condition.length_unit
    )


def draw_scope(table: pd.DataFrame) -> Figure:
    """Draw the boxes, and the places that the tool can reach."""
    figure = style.figure(3.4)
    left, right = figure.subplots(1, 2)
    path = table[table["element"] == POSTURE]
    last = max(1, len(path) - 1)
    for row in records(path):
        corner = row.x - row.half_x, row.y - row.half_y
        shade = 0.10 + 0.12 * row.order / last
        box = Rectangle(
            corner,
            2 * row.half_x,
            2 * row.half_y,
            facecolor=style.arm_colour(0),
            alpha=shade,
            linewidth=0,
        )
        left.add_patch(box)
    left.plot(path["x"], path["y"], "o-", color=style.arm_colour(0), markersize=2.8, linewidth=1.0)
    _ends(left, path)
    left.set_xlabel(f"{style.joint_symbol(0, int(table['joint_x'].iloc[0]) - 1)} [deg]")
    left.set_ylabel(f"{style.joint_symbol(0, int(table['joint_y'].iloc[0]) - 1)} [deg]")
    left.set_title("a  boxes of offspring along a path")
    left.set_aspect("equal", adjustable="datalim")
    for k, (factor, rows) in enumerate(
        sorted(groups(table[table["element"] == REACH], "factor"), reverse=True)
    ):
        colour = style.ARM_COLOURS[(1, 0, 2)[k]]
        rows = rows.sort_values("order")
        right.fill(
            rows["x"],
            rows["y"],
            facecolor=colour,
            edgecolor=colour,
            alpha=0.25,
            label=f"{factor:g} × scope",
        )
    tool = table[table["element"] == TOOL]
    right.plot(tool["x"], tool["y"], color=style.NEUTRAL, linewidth=1.0, label="way of the tool")
    _ends(right, tool)
    style.operational_axes(right, table["length_unit"].iloc[0])
    right.set_aspect("equal", adjustable="datalim")
    right.set_title("b  the tool, one step from the start")
    style.legend_below(figure, right, 6)
    return figure


def _ends(axes, path: pd.DataFrame) -> None:  # type: ignore[no-untyped-def]
    look = {"color": "white", "markeredgecolor": style.NEUTRAL, "linestyle": "none"}
    axes.plot(path["x"].iloc[:1], path["y"].iloc[:1], "s", markersize=6, label="start", **look)
    axes.plot(path["x"].iloc[-1:], path["y"].iloc[-1:], "*", markersize=9, label="end", **look)
