"""A local minimum of the search: where it gets stuck, the cost around, and the way that a sub-goal opens."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.collision.scene import obstacle_shapes
from evoexp.numerics import DEGREE
from evoexp.planners.posture_kernels import COST
from evoexp.planners.posture_stages import Stage, begin, judge, placed_obstacles
from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.figures import solids
from evoexp.report.pages import corsepius_measures as measures
from evoexp.report.results import ConditionResults
from evoexp.report.tables import groups, records, rounded
from evoexp.robots.poses import frame_pose

TOOL, CELL, LINE, OBSTACLE, GOAL, MARK = "tool", "cell", "line", "obstacle", "goal", "mark"
CELLS = 81  # of the landscape, along each joint
STUCK, HELPED = "stuck", "helped"


def pair(shown: tuple[ConditionResults, ...]) -> tuple[ConditionResults, ConditionResults] | None:
    """Return a task in which runs get stuck, and the same with sub-goals, solved; None without both."""
    for helped in shown:
        for stuck in shown:
            different = stuck.solved < stuck.done and helped.solved > 0
            if different and measures.only_subgoals_differ(stuck, helped):
                return stuck, helped
    return None


def trap_table(stuck: ConditionResults, helped: ConditionResults) -> pd.DataFrame:
    """Return ways of the tools, distances to the goal along them, and the cost around the median run that is stuck.

    Returns:
        Columns element (tool, cell, line, obstacle, goal, mark), series (stuck, helped, start), replicate, order,
        x, y, value: of tools places and the distance to the last goal; of cells two joint angles [deg] and the cost
        (NaN: infeasible); of lines the two joint angles of the median helped path; those of `solids`; joint_x, joint_y.
    """
    problem = stuck.prepared.problem
    stage = begin(problem, len(problem.phases) - 1, problem.start, problem.first_situation)
    rows: list[dict[str, object]] = []
    for series, condition in ((STUCK, stuck), (HELPED, helped)):
        wanted = measures.solved(condition) == (series == HELPED)
        kept = set(condition.summaries.index[wanted])
        for replicate, q in measures.paths(condition).items():
            if replicate in kept:
                rows += _tool(problem, stage, series, int(replicate), q)
    end, way, a, b = _plane(stuck, helped)
    rows += _cells(problem, stage, end, way, a, b)
    rows += [
        {"element": LINE, "series": HELPED, "order": n, "x": q[a] / DEGREE, "y": q[b] / DEGREE}
        for n, q in enumerate(way)
    ]
    for series, q in ((STUCK, end), ("start", problem.start)):
        rows.append({"element": MARK, "series": series, "order": 0, "x": q[a] / DEGREE, "y": q[b] / DEGREE})
    x, y, z = stage.judging[3][9:12]
    rows.append({"element": GOAL, "order": 0, "x": x, "y": y, "z": z})
    for k, (shape, placement) in enumerate(obstacle_shapes(placed_obstacles(problem, problem.first_situation))):
        found = solids.solid(shape, placement)
        if found is not None:
            rows.append({"element": OBSTACLE, "order": k} | dict(zip(solids.COLUMNS, found, strict=True)))
    names = ["element", "series", "replicate", "order", "value", *solids.COLUMNS]
    table = rounded(pd.DataFrame(rows).reindex(columns=names))
    return table.assign(joint_x=a + 1, joint_y=b + 1, length_unit=stuck.condition.length_unit)


def draw_trap(table: pd.DataFrame) -> Figure:
    """Draw the ways from above, the landscape, and distances along the paths."""
    figure = style.figure(6.4)
    grid = figure.add_gridspec(2, 2)
    above, land, along = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    unit = table["length_unit"].iloc[0]
    for row in records(table[table["element"] == OBSTACLE]):
        solids.draw_outline(above, row, style.FAINT, 0.35)
    look = {STUCK: (style.arm_colour(1), "without a sub-goal, stuck"), HELPED: (style.arm_colour(0), "with a sub-goal")}
    tools = table[table["element"] == TOOL]
    for series, (colour, name) in look.items():
        for k, (_, rows) in enumerate(groups(tools[tools["series"] == series], "replicate")):
            label = name if k == 0 else None
            above.plot(rows["x"], rows["y"], color=colour, linewidth=0.7, alpha=0.45, label=label)
            along.plot(rows["order"], rows["value"], color=colour, linewidth=0.7, alpha=0.45)
            if series == STUCK:
                above.plot(rows["x"].iloc[-1:], rows["y"].iloc[-1:], "x", color=style.FORBIDDEN, markersize=4, zorder=5)
    goal = table[table["element"] == GOAL]
    above.plot(goal["x"], goal["y"], "*", color="white", markeredgecolor=style.NEUTRAL, markersize=10, zorder=6)
    style.operational_axes(above, unit)
    above.set_title("a  ways of the tools, from above")
    along.set_xlabel("posture of the path")
    along.set_ylabel(f"distance to the goal [{unit}]")
    along.set_title("c  distance along the paths")
    along.set_ylim(bottom=0.0)
    _landscape(figure, land, table)
    style.legend_below(figure, above, 2)
    return figure


def _landscape(figure: Figure, axes, table: pd.DataFrame) -> None:  # type: ignore[no-untyped-def]
    cells = table[table["element"] == CELL]
    wide = cells.pivot(index="y", columns="x", values="value")
    axes.set_facecolor("#c8c8c8")
    shown = axes.pcolormesh(wide.columns, wide.index, wide.to_numpy(), cmap="viridis_r", shading="nearest")
    figure.colorbar(shown, ax=axes, label="cost [-]", shrink=0.9)
    line = table[table["element"] == LINE].sort_values("order")
    axes.plot(line["x"], line["y"], color="white", linewidth=2.4)
    axes.plot(line["x"], line["y"], color=style.arm_colour(0), linewidth=1.4)
    marks = table[table["element"] == MARK].set_index("series")
    axes.plot(marks.loc["start", "x"], marks.loc["start", "y"], "s", color="white", mec=style.NEUTRAL, markersize=6)
    axes.plot(marks.loc[STUCK, "x"], marks.loc[STUCK, "y"], "X", color=style.FORBIDDEN, mec="white", markersize=8)
    axes.grid(visible=False)
    axes.set_xlabel(f"{style.joint_symbol(0, int(table['joint_x'].iloc[0]) - 1)} [deg]")
    axes.set_ylabel(f"{style.joint_symbol(0, int(table['joint_y'].iloc[0]) - 1)} [deg]")
    axes.set_title("b  cost around a stuck posture (×)")


def _tool(problem, stage: Stage, series: str, replicate: int, q: FloatArray) -> list[dict[str, object]]:  # type: ignore[no-untyped-def]
    """Return the places of the tool along a path, and its distances to the goal."""
    distance = np.abs(judge(stage, q.T).rows[0])
    places = [frame_pose(problem.assembly.table, *problem.tool, posture)[9:] for posture in q]
    return [
        {"element": TOOL, "series": series, "replicate": replicate, "order": n, "x": x, "y": y, "z": z, "value": value}
        for n, ((x, y, z), value) in enumerate(zip(places, distance, strict=True))
    ]


def _plane(
    stuck: ConditionResults, helped: ConditionResults
) -> tuple[FloatArray, FloatArray, int, int]:
    """Return the end of the median run that is stuck, the median helped path, and the joints in which they differ."""
    failed = measures.paths(stuck)[measures.median_replicate(stuck, ~measures.solved(stuck))]
    way = measures.paths(helped)[measures.median_replicate(helped, measures.solved(helped))]
    a, b = sorted(int(k) for k in np.argsort(-np.ptp(way, axis=0), kind="stable")[:2])
    return failed[-1], way, a, b


def _cells(problem, stage: Stage, end: FloatArray, way: FloatArray, a: int, b: int) -> list[dict[str, object]]:  # type: ignore[no-untyped-def]
    """Return the cost over two joints, the others as at the end of the run that is stuck."""
    ranges = []
    for k in (a, b):
        values = [*way[:, k], end[k], problem.start[k]]
        pad = 0.15 * (max(values) - min(values)) + 5.0 * DEGREE
        low, high = problem.limits[k]
        ranges.append(np.linspace(max(low, min(values) - pad), min(high, max(values) + pad), CELLS))
    first, second = (axis.ravel() for axis in np.meshgrid(*ranges, indexing="ij"))
    q = np.repeat(end[:, None], len(first), axis=1)
    q[a], q[b] = first, second
    found = judge(stage, q)
    cost = np.where(found.feasible, found.rows[COST], np.nan)
    return [
        {"element": CELL, "order": n, "x": x, "y": y, "value": value}
        for n, (x, y, value) in enumerate(zip(first / DEGREE, second / DEGREE, cost, strict=True))
    ]
