"""Paths of postures in space: stick figures among the obstacles, earlier ones fainter.

Phase by phase.
"""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evoexp.collision.scene import obstacle_shapes
from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius.figures import solids
from evoexp.records import FloatArray
from evoexp.report import motion_geometry, style
from evoexp.report.results import ConditionResults
from evoexp.report.rows import groups, records, rounded
from evoexp.robots.poses import frame_pose

LINK, OBSTACLE, HELD, TIP, GOAL = "link", "obstacle", "held", "tip", "goal"
PATH = ["x_end", "y_end", "z_end"]
VIEW = (22.0, -62.0)  # [deg] elevation, azimuth
FEW = 2  # panels up to which each is drawn from above, too
PER_LINE = 3  # panels


class Shown(NamedTuple):
    """One panel, or one panel per phase.

    Attributes:
        title: Over the panel.
        condition: Whose run.
        replicate: Which.
        by_phase: Whether each phase has a panel of its own.
    """

    title: str
    condition: ConditionResults
    replicate: int
    by_phase: bool = False


def motions_table(shown: list[Shown]) -> pd.DataFrame:
    """Return links at every posture, tips, goals, obstacles where they are, objects that are held.

    Returns:
        Columns panel, title, element (link, tip, goal, obstacle, held), instant (posture of the
        path), name, x, y, z, x_end, y_end, z_end (of a link), those of `solids` (of obstacles and
        objects), length_unit.
    """
    rows: list[dict[str, Any]] = []
    panel = 0
    for one in shown:
        problem = one.condition.prepared.problem
        nq = len(problem.start)
        postures = one.condition.solutions[one.replicate].reshape(-1, nq)
        found = problem.spans(postures)
        parts = found if one.by_phase else [found[-1]]
        for number, span in enumerate(parts):
            first = span.first if one.by_phase else 0
            title = f"{number + 1}  {span.stage.phase.name}" if one.by_phase else one.title
            given = {
                "panel": panel,
                "title": title,
                "length_unit": one.condition.condition.length_unit,
            }
            for row in _panel(problem, span, postures, first):
                rows.append(given | row)
            panel += 1
    order = ["panel", "title", "element", "instant", "name", *solids.COLUMNS, *PATH, "length_unit"]
    return rounded(pd.DataFrame(rows).reindex(columns=order))


def draw_motions(table: pd.DataFrame) -> Figure:
    """Draw one panel per path or phase; where there are one or two, each from above, too."""
    panels = list(groups(table, ["panel", "title"]))
    above = len(panels) <= FEW
    columns = 2 if above else min(PER_LINE, len(panels))
    lines = len(panels) if above else -(-len(panels) // columns)
    figure = style.figure((3.1 if above else 2.6) * lines + 0.3)
    grid = figure.add_gridspec(lines, columns)
    for k, ((_, title), rows) in enumerate(panels):
        unit = rows["length_unit"].iloc[0]
        place = (k, 0) if above else divmod(k, columns)
        axes = solids.space(figure, grid[place], _points(rows), unit, VIEW)
        axes.set_title(title, fontsize=8)
        _draw(axes, rows, "xyz")
        if above:
            plane = figure.add_subplot(grid[k, 1])
            style.operational_axes(plane, unit)
            plane.set_title(f"{title.splitlines()[0]}, from above", fontsize=8)
            _draw(plane, rows, "xy")
    grey = style.NEUTRAL
    handles = [
        Line2D(
            [],
            [],
            color=style.arm_colour(0),
            linewidth=0.8,
            alpha=0.4,
            label="postures, the later the stronger",
        ),
        Line2D([], [], color=style.arm_colour(0), linewidth=2.4, label="last posture"),
        Line2D([], [], color=style.arm_colour(1), linewidth=1.0, label="way of the tool"),
        Line2D([], [], color="none", marker="*", mec=grey, mfc="white", ms=9, label="goal"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _panel(problem: Any, span: Any, postures: FloatArray, first: int) -> list[dict[str, Any]]:
    """Return the rows of one panel.

    Postures from `first` to the end of the span, things as they are in it.
    """
    own = postures[first : span.last + 1]
    rows: list[dict[str, Any]] = []
    for _, link, start, end in motion_geometry.joint_positions(problem.assembly, own.T / DEGREE):
        for n in range(len(own)):
            where = dict(zip(("x", "y", "z", *PATH), (*start[n], *end[n]), strict=True))
            rows.append({"element": LINK, "instant": first + n, "name": str(link)} | where)
    joint, local = problem.tool
    for n, q in enumerate(own):
        tip = frame_pose(problem.assembly.table, joint, local, q)[9:]
        rows.append(
            {"element": TIP, "instant": first + n, "name": "tool"}
            | dict(zip("xyz", tip, strict=True))
        )
    rows.append(
        {"element": GOAL, "instant": span.last, "name": span.stage.phase.name}
        | dict(zip("xyz", span.stage.target_position, strict=True))
    )
    situation = span.stage.situation
    table = problem.obstacles_in(span.stage)
    for k, (shape, placement) in enumerate(obstacle_shapes(table)):
        instants, element = [span.last], OBSTACLE
        if k == situation.held:
            instants, element = [first, span.last], HELD
        for instant in instants:
            where = placement
            if element == HELD:
                pose = frame_pose(problem.assembly.table, joint, situation.grasp, postures[instant])
                where = pin.SE3(pose[:9].reshape(3, 3), pose[9:])
            found = solids.solid(shape, where)
            if found is not None:
                given = dict(zip(solids.COLUMNS, found, strict=True))
                rows.append(
                    {"element": element, "instant": instant, "name": problem.task.names[k]} | given
                )
    return rows


def _points(rows: pd.DataFrame) -> FloatArray:
    """Return points that a panel has to hold."""
    links = rows[rows["element"] == LINK]
    solid = rows[rows["element"].isin([OBSTACLE, HELD])]
    goal = rows[rows["element"] == GOAL]
    parts = [
        links[["x", "y", "z"]],
        links[PATH],
        goal[["x", "y", "z"]],
        pd.DataFrame(solids.corners(solid)),
    ]
    return np.vstack([part.to_numpy(dtype=np.float64) for part in parts])


def _draw(axes: Any, rows: pd.DataFrame, names: str) -> None:
    """Draw a panel into axes in space (names xyz) or in the plane (xy)."""
    draw = solids.draw_solid if len(names) == 3 else solids.draw_outline
    for row in records(rows[rows["element"] == OBSTACLE]):
        draw(axes, row, style.FAINT, 0.22)
    sticks = rows[rows["element"] == LINK]
    first, last = sticks["instant"].min(), sticks["instant"].max()
    for row in records(rows[rows["element"] == HELD]):
        draw(axes, row, style.arm_colour(2), 0.7 if row.instant == last else 0.2)
    for instant, links in groups(sticks, "instant"):
        points = [[links[name].iloc[0], *links[f"{name}_end"]] for name in names]
        newest = instant == last
        shade = 1.0 if newest else 0.12 + 0.4 * (instant - first) / max(1, last - first)
        axes.plot(
            *points,
            color=style.arm_colour(0),
            linewidth=2.4 if newest else 0.8,
            alpha=shade,
            zorder=5,
        )
        if newest:
            axes.plot(
                *points,
                "o",
                color="white",
                markeredgecolor=style.arm_colour(0),
                markersize=2.6,
                zorder=6,
            )
    tip = rows[rows["element"] == TIP].sort_values("instant")
    axes.plot(*(tip[name] for name in names), color=style.arm_colour(1), linewidth=1.0, zorder=7)
    goal = rows[rows["element"] == GOAL]
    axes.plot(
        *(goal[name] for name in names),
        "*",
        color="white",
        markeredgecolor=style.NEUTRAL,
        ms=8,
        zorder=8,
    )
