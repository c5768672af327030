"""Paths of postures in space, and the local search scope along them (Corsépius 2001, Fig. 2)."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.spatial import ConvexHull

from evoexp.collision.scene import obstacle_shapes
from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.figures import solids
from evoexp.planners.posture_es.phases import Problem, Span
from evoexp.records import FloatArray
from evoexp.report.figures import groups, records, rounded, style
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import BOOTSTRAP_SEED
from evoexp.robots.poses import frame_pose

LINK, OBSTACLE, HELD, TIP, GOAL = "link", "obstacle", "held", "tip", "goal"
PLACE, PATH = ["x", "y", "z"], ["x_end", "y_end", "z_end"]
VIEW = (22.0, -62.0)  # [deg] elevation, azimuth
FEW = 2  # panels up to which each is drawn from above, too
PER_LINE = 3  # panels
ARM, TOOL = style.arm_colour(0), style.arm_colour(1)
POSTURE, REACH, WAY = "posture", "reach", "tool"
FACTORS = (2.0, 1.0, 0.5)  # of the scope, whose reach is drawn
STEPS = 3000  # random ones whose hull is drawn
EQUAL: dict[str, Any] = {"adjustable": "datalim", "aspect": "equal"}


class ShownPath(NamedTuple):
    """The run of one panel, or of one panel per phase."""

    title: str  # title of the panel
    condition: ConditionResults  # the condition of the run
    replicate: int  # its replicate
    by_phase: bool = False  # whether each phase has a panel of its own


def motions_table(shown: list[ShownPath]) -> pd.DataFrame:
    """Return links at every posture, tips, goals, obstacles, objects that are held."""
    panels: list[list[dict[str, Any]]] = []
    for one in shown:
        problem = measures.problem(one.condition)
        postures = measures.paths(one.condition)[one.replicate]
        spans, unit = problem.spans(postures), one.condition.length_unit
        for number, span in enumerate(spans) if one.by_phase else [(0, spans[-1])]:
            first = span.first if one.by_phase else 0
            title = f"{number + 1}  {span.stage.phase.name}" if one.by_phase else one.title
            given = {"panel": len(panels), "title": title, "length_unit": unit}
            panels.append([given | row for row in _panel(problem, span, postures, first)])
    rows = [row for panel in panels for row in panel]
    names = ["panel", "title", "element", "instant", "name", *solids.COLUMNS, *PATH, "length_unit"]
    return rounded(pd.DataFrame(rows).reindex(columns=names))


def draw_motions(table: pd.DataFrame, same_scene: bool = False) -> Figure:
    """Draw one panel per path or phase; where there are one or two, each from above, too."""
    panels = list(groups(table, ["panel", "title"]))
    above = len(panels) <= FEW
    columns = 2 if above else min(PER_LINE, len(panels))
    lines = len(panels) if above else -(-len(panels) // columns)
    figure = style.figure((3.1 if above else 2.6) * lines + 0.3)
    grid = figure.add_gridspec(lines, columns)
    every = _points(table) if same_scene else None
    for k, ((_, title), rows) in enumerate(panels):
        unit, place = rows["length_unit"].iloc[0], (k, 0) if above else divmod(k, columns)
        points = _points(rows) if every is None else every
        axes = solids.space(figure, grid[place], points, unit, VIEW)
        axes.set_title(title, fontsize=8)
        _draw(axes, rows, "xyz")
        if above:
            plane = figure.add_subplot(grid[k, 1])
            style.operational_axes(plane, unit)
            plane.set_title(f"{title.splitlines()[0]}, from above", fontsize=8)
            _draw(plane, rows, "xy")
    keys = [
        style.key("postures, the later the stronger", color=ARM, linewidth=0.8, alpha=0.4),
        style.key("last posture", color=ARM, linewidth=2.4),
        style.key("way of the tool", color=TOOL, linewidth=1.0),
        style.key("goal", color="none", marker="*", mec=style.NEUTRAL, mfc="white", ms=9),
    ]
    style.keys_below(figure, keys)
    return figure


def tool_places(problem: Problem, postures: FloatArray) -> FloatArray:
    """Return the place of the tool at some postures (postures, nq) [rad], (postures, 3)."""
    table = problem.assembly.table
    return np.array([frame_pose(table, *problem.tool, q)[9:] for q in postures])


def _panel(problem: Problem, span: Span, postures: FloatArray, first: int) -> list[dict[str, Any]]:
    """Return the rows of one panel.

    They are the postures from `first` to the end of the span, and things as they are in it.
    """
    own = postures[first : span.last + 1]
    ends = motion_geometry.joint_positions(problem.assembly, own.T / DEGREE)
    links = [
        _row(LINK, n, str(link), *start[n - first], *end[n - first])
        for _, link, start, end in ends
        for n in range(first, span.last + 1)
    ]
    places = enumerate(tool_places(problem, own), first)
    goal = _row(GOAL, span.last, span.stage.phase.name, *span.stage.target_position)
    rows = [*links, *(_row(TIP, n, "tool", *place) for n, place in places), goal]
    obstacles = problem.placed_obstacles(span.stage.situation)
    for k, (shape, placement) in enumerate(obstacle_shapes(obstacles)):
        name, held = problem.task.names[k], k == span.stage.situation.held
        for instant in [first, span.last] if held else [span.last]:
            if held:
                grasp, posture = span.stage.situation.grasp, postures[instant]
                pose = frame_pose(problem.assembly.table, problem.tool[0], grasp, posture)
                placement = pin.SE3(pose[:9].reshape(3, 3), pose[9:])
            found, element = solids.solid(shape, placement), HELD if held else OBSTACLE
            rows += [_row(element, instant, name) | found] if found else []
    return rows


def _row(element: str, instant: int, name: str, *places: float) -> dict[str, Any]:
    """Return a row with a place, or with the two ends of a link."""
    row = {"element": element, "instant": instant, "name": name}
    return row | dict(zip([*PLACE, *PATH], places, strict=False))


def _points(rows: pd.DataFrame) -> FloatArray:
    """Return points that a panel has to hold."""
    links, goal = (rows[rows["element"] == element] for element in (LINK, GOAL))
    solid = rows[rows["element"].isin([OBSTACLE, HELD])]
    parts = (part.to_numpy(dtype=np.float64) for part in (links[PLACE], links[PATH], goal[PLACE]))
    return np.vstack([*parts, solids.corners(solid)])


def _draw(axes: Any, rows: pd.DataFrame, names: str) -> None:
    """Draw a panel into axes in space (names xyz) or in the plane (xy)."""
    draw = solids.draw_solid if len(names) == 3 else solids.draw_outline
    sticks, obstacles, held, tip, goal = (
        rows[rows["element"] == element] for element in (LINK, OBSTACLE, HELD, TIP, GOAL)
    )
    first, last = sticks["instant"].min(), sticks["instant"].max()
    # obstacles, and the held object: earlier fainter
    for row in records(obstacles):
        draw(axes, row, style.FAINT, 0.22)
    for row in records(held):
        draw(axes, row, style.arm_colour(2), 0.7 if row.instant == last else 0.2)
    # postures: earlier fainter, joints of the last one
    for instant, links in groups(sticks, "instant"):
        points = [[links[name].iloc[0], *links[f"{name}_end"]] for name in names]
        shade = 0.12 + 0.4 * (instant - first) / max(1, last - first)
        newest = instant == last
        look = {"linewidth": 2.4, "alpha": 1.0} if newest else {"linewidth": 0.8, "alpha": shade}
        axes.plot(*points, color=ARM, zorder=5, **look)
        if newest:
            axes.plot(*points, "o", zorder=6, color="white", markeredgecolor=ARM, markersize=2.6)
    # the tool's way and its goal
    way = tip.sort_values("instant")
    axes.plot(*(way[name] for name in names), color=TOOL, linewidth=1.0, zorder=7)
    star: dict[str, Any] = {"color": "white", "markeredgecolor": style.NEUTRAL, "ms": 8}
    axes.plot(*(goal[name] for name in names), "*", zorder=8, **star)


def scope_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the shown path in its two liveliest joints, and hulls of the tool's first steps."""
    replicate = measures.shown_replicate(condition)
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
    parts.append((WAY, tool_places(problem, q)[:, :2], np.nan, np.nan, np.nan))
    rows = [
        (element, n, x, y, *rest)
        for element, points, *rest in parts
        for n, (x, y) in enumerate(points)
    ]
    table = rounded(
        pd.DataFrame(rows, columns=["element", "order", "x", "y", "half_x", "half_y", "factor"])
    )
    return table.assign(joint_x=a + 1, joint_y=b + 1, length_unit=condition.length_unit)


def draw_scope(table: pd.DataFrame) -> Figure:
    """Draw the boxes, and the places that the tool can reach."""
    figure, (left, right) = style.panels(3.4, 2)
    path, reach, tool = (table[table["element"] == element] for element in (POSTURE, REACH, WAY))
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
    style.legend_below(figure, [right], 6)
    return figure


def _draw_ends(axes: Axes, path: pd.DataFrame) -> None:
    """Draw the start and the end of a path."""
    look: dict[str, Any] = {"color": "white", "markeredgecolor": style.NEUTRAL, "linestyle": "none"}
    axes.plot(path["x"].iloc[:1], path["y"].iloc[:1], "s", markersize=6, label="start", **look)
    axes.plot(path["x"].iloc[-1:], path["y"].iloc[-1:], "*", markersize=9, label="end", **look)
