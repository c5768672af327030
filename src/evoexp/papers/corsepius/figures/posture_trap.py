"""A local minimum of the search.

Where it gets stuck, the cost around, and the way that a sub-goal opens.
"""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import ScalarFormatter

from evoexp.collision.scene import obstacle_shapes
from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.figures import solids
from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.results import ConditionResults
from evoexp.report.rows import groups, records, rounded
from evoexp.report.statistics import BOOTSTRAP_SEED
from evoexp.robots.poses import frame_pose

TOOL, CELL, ESCAPE, OBSTACLE, GOAL = "tool", "cell", "escape", "obstacle", "goal"
CELLS = 81  # of the landscape, along each joint
AROUND = 3.0  # [scopes] the landscape reaches from the posture that is stuck
BOXES = (
    0.5,
    1.0,
    1.5,
    2.0,
    3.0,
    4.0,
    6.0,
    8.0,
    12.0,
    16.0,
    24.0,
)  # [scopes] half the edges of boxes searched at random
SAMPLES = 20_000  # postures in each box
STUCK, HELPED = "stuck", "helped"


def pair(shown: tuple[ConditionResults, ...]) -> tuple[ConditionResults, ConditionResults] | None:
    """Return a task in which runs get stuck, and the same with sub-goals, solved.

    None without both.
    """
    for helped in shown:
        for stuck in shown:
            different = stuck.solved < stuck.done and helped.solved > 0
            if different and measures.only_subgoals_differ(stuck, helped):
                return stuck, helped
    return None


def trap_table(stuck: ConditionResults, helped: ConditionResults) -> pd.DataFrame:
    """Return ways of the tools, distances to the goal along them.

    And the cost around the median run that is stuck.

    Returns:
        Columns element (tool, cell, escape, obstacle, goal), series (stuck, helped), replicate,
        order, value, those of `solids`, x_end, y_end, scope_deg, joint_x, joint_y, length_unit.
        Tools: places and distances to the last goal. Cells: two joint angles [deg] and the cost
        (NaN: infeasible), with the stuck posture and its scope. Escapes: half the edge of a box
        [scopes], the stuck posture's cost, the least one found in the box.
    """
    problem = stuck.prepared.problem
    stage = problem.last_stage
    rows: list[dict[str, object]] = []
    for series, condition in ((STUCK, stuck), (HELPED, helped)):
        wanted = measures.solved(condition) == (series == HELPED)
        kept = set(condition.summaries.index[wanted])
        for replicate, q in measures.paths(condition).items():
            if replicate in kept:
                rows += _tool(problem, stage, series, int(replicate), q)
    failed = measures.paths(stuck)[measures.median_replicate(stuck, ~measures.solved(stuck))]
    a, b = sorted(int(k) for k in np.argsort(-np.ptp(failed, axis=0), kind="stable")[:2])
    rows += _cells(problem, stage, failed[-1], a, b)
    rows += _escape(problem, stage, failed[-1])
    x, y, z = stage.target_position
    rows.append({"element": GOAL, "order": 0, "x": x, "y": y, "z": z})
    for k, (shape, placement) in enumerate(obstacle_shapes(problem.obstacles_in(stage))):
        found = solids.solid(shape, placement)
        if found is not None:
            rows.append(
                {"element": OBSTACLE, "order": k} | dict(zip(solids.COLUMNS, found, strict=True))
            )
    places = ["x_end", "y_end", "scope_deg"]
    names = ["element", "series", "replicate", "order", "value", *solids.COLUMNS, *places]
    table = rounded(pd.DataFrame(rows).reindex(columns=names))
    return table.assign(joint_x=a + 1, joint_y=b + 1, length_unit=stuck.condition.length_unit)


def draw_trap(table: pd.DataFrame) -> Figure:
    """Draw the ways from above, the landscape, and distances along the paths."""
    figure = style.figure(6.2)
    (above, along), (land, escape) = figure.subplots(2, 2)
    unit = table["length_unit"].iloc[0]
    for row in records(table[table["element"] == OBSTACLE]):
        solids.draw_outline(above, row, style.FAINT, 0.35)
    look = {
        STUCK: (style.arm_colour(1), "without a sub-goal, stuck"),
        HELPED: (style.arm_colour(0), "with a sub-goal"),
    }
    tools = table[table["element"] == TOOL]
    for series, (colour, _) in look.items():
        for _, rows in groups(tools[tools["series"] == series], "replicate"):
            above.plot(rows["x"], rows["y"], color=colour, linewidth=0.7, alpha=0.45)
            along.plot(rows["order"], rows["value"], color=colour, linewidth=0.7, alpha=0.45)
            if series == STUCK:
                above.plot(
                    rows["x"].iloc[-1:],
                    rows["y"].iloc[-1:],
                    "x",
                    color=style.FORBIDDEN,
                    markersize=4,
                    zorder=5,
                )
    goal = table[table["element"] == GOAL]
    above.plot(
        goal["x"],
        goal["y"],
        "*",
        color="white",
        markeredgecolor=style.NEUTRAL,
        markersize=10,
        zorder=6,
    )
    style.operational_axes(above, unit)
    above.set_title("a  ways of the tools, from above")
    along.set_xlabel("posture of the path")
    along.set_ylabel(f"distance to the goal [{unit}]")
    along.set_title("b  distance along the paths")
    along.set_ylim(bottom=0.0)
    _landscape(figure, land, table)
    _way_out(escape, table[table["element"] == ESCAPE])
    handles = [
        Line2D([], [], color=colour, linewidth=1.6, label=name) for colour, name in look.values()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _landscape(figure: Figure, axes, table: pd.DataFrame) -> None:  # type: ignore[no-untyped-def]
    cells = table[table["element"] == CELL]
    wide = cells.pivot(index="y", columns="x", values="value")
    axes.set_facecolor("#c8c8c8")
    shown = axes.pcolormesh(
        wide.columns,
        wide.index,
        wide.to_numpy(),
        cmap="viridis_r",
        shading="nearest",
        rasterized=True,
    )
    figure.colorbar(shown, ax=axes, label="cost [-]", shrink=0.9)
    x, y = cells["x_end"].iloc[0], cells["y_end"].iloc[0]
    axes.plot(x, y, "X", color=style.FORBIDDEN, mec="white", markersize=8)
    scope = cells["scope_deg"].iloc[0]
    corner = x - scope, y - scope
    axes.add_patch(
        Rectangle(
            corner, 2 * scope, 2 * scope, fill=False, edgecolor=style.FORBIDDEN, linewidth=1.2
        )
    )
    axes.grid(visible=False)
    axes.set_xlabel(f"{style.joint_symbol(0, int(table['joint_x'].iloc[0]) - 1)} [deg]")
    axes.set_ylabel(f"{style.joint_symbol(0, int(table['joint_y'].iloc[0]) - 1)} [deg]")
    axes.set_title("c  cost around a stuck posture (×), its scope")


def _tool(
    problem: Any, stage: Any, series: str, replicate: int, q: FloatArray
) -> list[dict[str, object]]:
    """Return the places of the tool along a path, and its distances to the goal."""
    distance = problem.judge(stage, q.T).distance
    joint, local = problem.tool
    places = [frame_pose(problem.assembly.table, joint, local, posture)[9:] for posture in q]
    return [
        {
            "element": TOOL,
            "series": series,
            "replicate": replicate,
            "order": n,
            "x": x,
            "y": y,
            "z": z,
            "value": value,
        }
        for n, ((x, y, z), value) in enumerate(zip(places, distance, strict=True))
    ]


def _way_out(axes, table: pd.DataFrame) -> None:  # type: ignore[no-untyped-def]
    """Draw the least cost in boxes around the posture that is stuck."""
    axes.axhline(
        table["y"].iloc[0],
        color=style.FORBIDDEN,
        linewidth=1.0,
        linestyle=(0, (4, 2)),
        label="stuck",
    )
    axes.plot(table["x"], table["value"], "o-", color=style.arm_colour(0), markersize=4)
    axes.set_xscale("log", base=2)
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.set_xlabel("half the edge of the box [scopes]")
    axes.set_ylabel("least cost found in it [-]")
    axes.set_title("d  random postures around it")
    axes.set_ylim(bottom=0.0)


def _cells(problem, stage: Any, end: FloatArray, a: int, b: int) -> list[dict[str, object]]:  # type: ignore[no-untyped-def]
    """Return the cost over two joints, the others as at the end of the run that is stuck."""
    ranges = []
    for k in (a, b):
        low, high = problem.limits[k]
        reach = AROUND * problem.scope[k]
        ranges.append(np.linspace(max(low, end[k] - reach), min(high, end[k] + reach), CELLS))
    first, second = (axis.ravel() for axis in np.meshgrid(*ranges, indexing="ij"))
    q = np.repeat(end[:, None], len(first), axis=1)
    q[a], q[b] = first, second
    found = problem.judge(stage, q)
    cost = np.where(found.feasible, found.cost, np.nan)
    same = {
        "x_end": end[a] / DEGREE,
        "y_end": end[b] / DEGREE,
        "scope_deg": problem.scope[a] / DEGREE,
    }
    return [
        {"element": CELL, "order": n, "x": x, "y": y, "value": value} | same
        for n, (x, y, value) in enumerate(zip(first / DEGREE, second / DEGREE, cost, strict=True))
    ]


def _escape(problem, stage: Any, end: FloatArray) -> list[dict[str, object]]:  # type: ignore[no-untyped-def]
    """Return the least feasible cost of random postures in boxes around a posture.

    And that posture's own.
    """
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    low, high = problem.limits.T
    own = float(problem.judge(stage, end[:, None]).cost[0])
    rows: list[dict[str, object]] = []
    for n, half in enumerate(BOXES):
        least = np.maximum(end - half * problem.scope, low)
        most = np.minimum(end + half * problem.scope, high)
        q = least[:, None] + (most - least)[:, None] * rng.random((len(end), SAMPLES))
        found = problem.judge(stage, q)
        costs = found.cost[found.feasible]
        rows.append(
            {
                "element": ESCAPE,
                "order": n,
                "x": half,
                "y": own,
                "value": costs.min() if len(costs) else np.nan,
            }
        )
    return rows
