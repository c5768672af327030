"""A local minimum of the search: the stuck runs, the cost around, and the way of a sub-goal."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from evoexp.collision.scene import obstacle_shapes
from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.figures import solids
from evoexp.papers.corsepius.figures.posture_motions import tool_places
from evoexp.papers.corsepius.measures import Conditions
from evoexp.planners.posture_es.phases import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, records, rounded, style
from evoexp.report.results.run_measures import median_replicate, solved
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import BOOTSTRAP_SEED

TOOL, CELL, ESCAPE, OBSTACLE, GOAL = "tool", "cell", "escape", "obstacle", "goal"
CELLS = 81  # of the landscape, along each joint
AROUND = 3.0  # [scopes] the landscape reaches from the posture that is stuck
# [scopes] half the edges of boxes searched at random
BOXES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)
SAMPLES = 20_000  # postures in each box
STUCK, HELPED = "stuck", "helped"
END: dict[str, Any] = {"color": style.FORBIDDEN, "markersize": 4, "zorder": 5}
Rows = list[dict[str, object]]


def stuck_pair(obstructed: Conditions) -> Conditions:
    """Return a task of one phase in which runs get stuck, and with sub-goals, solved; or none."""
    pairs = (
        (stuck, helped)
        for stuck, helped in measures.subgoal_pairs(obstructed)
        if stuck.solved < stuck.done and helped.solved > 0 and len(stuck.scenario.phases) == 1
    )
    return next(pairs, ())


def trap_table(stuck: ConditionResults, helped: ConditionResults) -> pd.DataFrame:
    """Return ways of the tools, and the cost around the end of the median run that is stuck."""
    rows: Rows = []
    planner, problem = stuck.prepared
    for series, condition in ((STUCK, stuck), (HELPED, helped)):
        is_shown, paths = solved(condition) == (series == HELPED), measures.paths(condition)
        for replicate in condition.summaries.index[is_shown]:
            path = paths[replicate]
            judged, places = planner.cost(problem, path.T), tool_places(problem, path)
            of_run = {"element": TOOL, "series": series, "replicate": int(replicate)}
            for n, place in enumerate(places):
                distance = abs(judged.named_terms(n)["goal_distance"])
                at = dict(zip("xyz", place, strict=True))
                rows.append(of_run | {"order": n, "value": distance} | at)
    median = median_replicate(stuck, measures.evaluations(stuck), ~solved(stuck))
    failed = measures.paths(stuck)[median]
    a, b = sorted(int(k) for k in np.argsort(-np.ptp(failed, axis=0), kind="stable")[:2])
    end = failed[-1]
    # the cost over two joints, the others as at the end of the run that is stuck
    low, high = _box(problem, end, AROUND)
    q = np.repeat(end[:, None], CELLS * CELLS, axis=1)
    ranges = [np.linspace(low[k], high[k], CELLS) for k in (a, b)]
    q[a], q[b] = (axis.ravel() for axis in np.meshgrid(*ranges, indexing="ij"))
    same = {"element": CELL, "scope_deg": problem.scope[a] / DEGREE}
    same |= {"x_end": end[a] / DEGREE, "y_end": end[b] / DEGREE}
    cells = zip(q[a] / DEGREE, q[b] / DEGREE, _cost(stuck, q), strict=True)
    rows += [same | {"order": n, "x": x, "y": y, "value": v} for n, (x, y, v) in enumerate(cells)]
    # the least cost of random postures in boxes around that posture, and its own cost
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    (own,) = _cost(stuck, end[:, None])
    for n, half in enumerate(BOXES):
        low, high = _box(problem, end, half)
        q = low[:, None] + (high - low)[:, None] * rng.random((len(end), SAMPLES))
        least_cost = np.fmin.reduce(_cost(stuck, q))  # NaN if none is feasible
        rows.append({"element": ESCAPE, "order": n, "x": half, "y": own, "value": least_cost})
    situation = problem.first_situation
    stage = problem.begin(len(problem.phases) - 1, problem.start, situation)
    goal = dict(zip("xyz", stage.target_position, strict=True))
    rows.append({"element": GOAL, "order": 0} | goal)
    shapes = obstacle_shapes(problem.placed_obstacles(situation))
    standing = [solids.solid(*shape) for shape in shapes]
    rows += [{"element": OBSTACLE, "order": k} | own for k, own in enumerate(standing) if own]
    names = ["element", "series", "replicate", "order", "value", *solids.COLUMNS]
    table = rounded(pd.DataFrame(rows).reindex(columns=[*names, "x_end", "y_end", "scope_deg"]))
    return table.assign(joint_x=a + 1, joint_y=b + 1, length_unit=stuck.length_unit)


def _cost(condition: ConditionResults, q: FloatArray) -> FloatArray:
    """Return the cost of postures q (nq, postures) [rad]; NaN: infeasible."""
    planner, problem = condition.prepared
    cost = planner.cost(problem, q).cost
    return np.where(np.isinf(cost), np.nan, cost)


def _box(problem: Problem, q: FloatArray, scopes: float) -> tuple[FloatArray, FloatArray]:
    """Return the bounds (nq,) of a box of so many scopes around a posture, within the limits."""
    (low, high), half = problem.limits.T, scopes * problem.scope
    return np.maximum(q - half, low), np.minimum(q + half, high)


def draw_trap(table: pd.DataFrame) -> Figure:
    """Draw the ways from above, distances along the paths, the landscape, and ways out."""
    figure = style.figure(6.2)
    (above, along), (land, escape) = figure.subplots(2, 2)
    tools, cells, escapes, obstacles, goal = (
        table[table["element"] == element] for element in (TOOL, CELL, ESCAPE, OBSTACLE, GOAL)
    )
    unit = table["length_unit"].iloc[0]
    # ways of both kinds of runs, crosses where they are stuck
    for row in records(obstacles):
        solids.draw_solid(above, row, style.FAINT, 0.35)
    looks = {
        STUCK: (style.arm_colour(1), "without a sub-goal, stuck"),
        HELPED: (style.arm_colour(0), "with a sub-goal"),
    }
    for series, (colour, _) in looks.items():
        for _, rows in groups(tools[tools["series"] == series], "replicate"):
            for axes, x, y in ((above, "x", "y"), (along, "order", "value")):
                axes.plot(rows[x], rows[y], color=colour, linewidth=0.7, alpha=0.45)
            if series == STUCK:
                above.plot(*rows[["x", "y"]].iloc[-1], "x", **END)
    marks.hollow(above, goal["x"], goal["y"], "*", style.NEUTRAL, 10, zorder=6)
    style.operational_axes(above, unit)
    above.set_title("a  ways of the tools, from above")
    along.set(
        xlabel="posture of the path", ylabel=f"distance to the goal [{unit}]", ylim=(0.0, None)
    )
    along.set_title("b  distance along the paths")
    _draw_landscape(figure, land, cells)
    # the least cost in boxes around the posture that is stuck
    look: dict[str, Any] = {"color": style.FORBIDDEN, "linewidth": 1.0, "linestyle": (0, (4, 2))}
    escape.axhline(escapes["y"].iloc[0], label="stuck", **look)
    escape.plot(escapes["x"], escapes["value"], "o-", color=style.arm_colour(0), markersize=4)
    escape.set_xscale("log", base=2)
    escape.xaxis.set_major_formatter("{x:g}")
    escape.set(xlabel="half the edge of the box [scopes]", ylabel="least cost found in it [-]")
    escape.set(ylim=(0.0, None), title="d  random postures around it")
    keys = [style.key(name, color=colour, linewidth=1.6) for colour, name in looks.values()]
    style.keys_below(figure, keys)
    return figure


def _draw_landscape(figure: Figure, axes: Axes, cells: pd.DataFrame) -> None:
    """Draw the cost over two joints, the stuck posture and its scope."""
    wide = cells.pivot(index="y", columns="x", values="value")
    look: dict[str, Any] = {"cmap": "viridis_r", "shading": "nearest", "rasterized": True}
    shown = axes.pcolormesh(wide.columns, wide.index, wide.to_numpy(), **look)
    figure.colorbar(shown, ax=axes, label="cost [-]", shrink=0.9)
    x, y, scope, *joints = cells[["x_end", "y_end", "scope_deg", "joint_x", "joint_y"]].iloc[0]
    marks.contact(axes, x, y, 8)
    frame: dict[str, Any] = {"fill": False, "edgecolor": style.FORBIDDEN, "linewidth": 1.2}
    axes.add_patch(Rectangle((x - scope, y - scope), 2 * scope, 2 * scope, **frame))
    axes.grid(visible=False)
    first, second = (f"{style.joint_symbol(0, int(joint) - 1)} [deg]" for joint in joints)
    title = "c  cost around a stuck posture (×), its scope"
    axes.set(xlabel=first, ylabel=second, title=title, facecolor="#c8c8c8")
