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
from evoexp.papers import trails
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
FEW = 2  # panels up to which each is drawn from above, too
PER_LINE = 3  # panels
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
    panels, unit = list(groups(table, ["panel", "title"])), table["length_unit"].iloc[0]
    above = len(panels) <= FEW
    columns = 2 if above else min(PER_LINE, len(panels))
    lines = len(panels) if above else -(-len(panels) // columns)
    figure = style.figure((3.1 if above else 2.6) * lines + 0.3)
    for k, ((_, title), rows) in enumerate(panels):
        place = lines, columns, (2 if above else 1) * k + 1
        points = _points(table if same_scene else rows)
        axes = trails.space(figure, place, points, unit, zoom=0.92)
        axes.set_title(title, fontsize=8)
        _draw(axes, rows, "xyz")
        if above:
            plane = figure.add_subplot(lines, 2, 2 * k + 2)
            style.operational_axes(plane, unit)
            plane.set_title(f"{title.splitlines()[0]}, from above", fontsize=8)
            _draw(plane, rows, "xy")
    goal = style.key("goal", color="none", marker="*", mec=style.NEUTRAL, mfc="white", ms=9)
    tool = style.key("way of the tool", color=style.arm_colour(1), linewidth=1.0)
    style.keys_below(figure, [*trails.trail_keys([])[:-1], tool, goal])
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
    links, goal, *solid = (rows[rows["element"] == e] for e in (LINK, GOAL, OBSTACLE, HELD))
    return np.vstack([links[PLACE], links[PATH], goal[PLACE], *map(solids.corners, solid)])


def _draw(axes: Any, rows: pd.DataFrame, names: str) -> None:
    """Draw a panel into axes in space (names xyz) or in the plane (xy)."""
    last = rows.loc[rows["element"] == LINK, "instant"].max()
    for row in records(rows[rows["element"] == OBSTACLE]):
        solids.draw_solid(axes, row, style.FAINT, 0.22)
    for row in records(rows[rows["element"] == HELD]):  # earlier fainter
        solids.draw_solid(axes, row, style.arm_colour(2), 0.7 if row.instant == last else 0.2)
    trails.draw_trail(axes, rows[rows["element"] == LINK], style.arm_colour(0), names)
    # the tool's way and its goal
    way, goal = (rows[rows["element"] == element] for element in (TIP, GOAL))
    places = (way.sort_values("instant")[name] for name in names)
    axes.plot(*places, color=style.arm_colour(1), linewidth=1.0, zorder=7)
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
