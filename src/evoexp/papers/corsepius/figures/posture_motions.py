"""Robots and their covers, paths of postures, search scope, a local minimum (Corsépius 2001)."""

from collections.abc import Iterator, Sequence
from typing import Any

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
from evoexp.papers.corsepius.measures import Conditions, ShownPath
from evoexp.planners.posture_es.phases import Problem, Span
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, motion_scenes, records, rounded, style, table_of
from evoexp.report.results import motion_geometry
from evoexp.report.results.run_measures import median_replicate, solved
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.inference import BOOTSTRAP_SEED
from evoexp.robots.kinematics import frame_pose

LINK, OBSTACLE, HELD, TIP, GOAL = "link", "obstacle", "held", "tip", "goal"
PLACE, PATH = ["x", "y", "z"], ["x_end", "y_end", "z_end"]
FEW = 2  # panels up to which each is drawn from above, too
PER_LINE = 3  # panels
POSTURE, REACH, WAY = "posture", "reach", "tool"
FACTORS = (2.0, 1.0, 0.5)  # of the scope, whose reach is drawn
STEPS = 3000  # random ones whose hull is drawn
EQUAL: dict[str, Any] = {"adjustable": "datalim", "aspect": "equal"}
TOOL, CELL, ESCAPE = "tool", "cell", "escape"
CELLS = 81  # of the landscape, along each joint
AROUND = 3.0  # [scopes] the landscape reaches from the posture that is stuck
# [scopes] half the edges of boxes searched at random
BOXES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)
SAMPLES = 20_000  # postures in each box
STUCK, HELPED = "stuck", "helped"
BODY, COVER = "body", "cover"
KINDS = {"sphere": "spheres", "capsule": "capsules"}
END: dict[str, Any] = {"color": style.FORBIDDEN, "markersize": 4, "zorder": 5}


def motions_table(shown: list[ShownPath]) -> pd.DataFrame:
    """Return links at every posture, tips, goals, obstacles, objects that are held."""
    panels: list[list[dict[str, Any]]] = []
    for one in shown:
        problem = one.condition.problem(Problem)
        postures = measures.paths(one.condition)[one.replicate]
        spans, unit = problem.spans(postures), one.condition.length_unit
        for number, span in enumerate(spans) if one.by_phase else [(0, spans[-1])]:
            first = span.first if one.by_phase else 0
            title = f"{number + 1}  {span.stage.phase.name}" if one.by_phase else one.title
            given = {"panel": len(panels), "title": title, "length_unit": unit}
            panels.append([given | row for row in _panel(problem, span, postures, first)])
    rows = [row for panel in panels for row in panel]
    names = ["panel", "title", "element", "instant", "name", *trails.COLUMNS, *PATH, "length_unit"]
    return rounded(pd.DataFrame(rows).reindex(columns=names))


def draw_motions(table: pd.DataFrame, same_scene: bool = False) -> Figure:
    """Draw one panel per path or phase; where there are one or two, each from above, too."""
    panels, unit = list(groups(table, ["panel", "title"])), table["length_unit"].iloc[0]
    above = len(panels) <= FEW
    size = (3.1, 2 * len(panels), 2) if above else (2.6, len(panels), PER_LINE)
    figure, lines, columns = style.grid(*size, 0.3)
    for k, ((_, title), rows) in enumerate(panels):
        place = lines, columns, (2 if above else 1) * k + 1
        points = _points(table if same_scene else rows)
        axes = trails.space(figure, place, points, unit, zoom=0.92)
        axes.set_title(title, fontsize=8)
        _draw(axes, rows, "xyz")
        if above:
            plane = figure.add_subplot(lines, columns, 2 * k + 2)
            style.operational_axes(plane, unit)
            plane.set_title(f"{title.splitlines()[0]}, from above", fontsize=8)
            _draw(plane, rows, "xy")
    goal = style.key("goal", color="none", marker="*", mec=style.NEUTRAL, mfc="white", ms=9)
    tool = style.key("path of the tool", color=style.arm_colour(1), linewidth=1.0)
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
            found, element = trails.solid(shape, placement), HELD if held else OBSTACLE
            rows += [_row(element, instant, name) | found] if found else []
    return rows


def _row(element: str, instant: int, name: str, *places: float) -> dict[str, Any]:
    row = {"element": element, "instant": instant, "name": name}
    return row | dict(zip([*PLACE, *PATH], places, strict=False))


def _points(rows: pd.DataFrame) -> FloatArray:
    links, goal, *solid = (rows[rows["element"] == e] for e in (LINK, GOAL, OBSTACLE, HELD))
    return np.vstack([links[PLACE], links[PATH], goal[PLACE], *map(trails.corners, solid)])


def _draw(axes: Any, rows: pd.DataFrame, names: str) -> None:
    """Draw a panel into axes in space (names xyz) or in the plane (xy)."""
    last = rows.loc[rows["element"] == LINK, "instant"].max()
    for row in records(rows[rows["element"] == OBSTACLE]):
        trails.draw_solid(axes, row, style.FAINT, 0.22)
    for row in records(rows[rows["element"] == HELD]):  # earlier fainter
        trails.draw_solid(axes, row, style.arm_colour(2), 0.7 if row.instant == last else 0.2)
    trails.draw_trail(axes, rows[rows["element"] == LINK], style.arm_colour(0), names)
    # the tool's way and its goal
    way, goal = (rows[rows["element"] == element] for element in (TIP, GOAL))
    places = (way.sort_values("instant")[name] for name in names)
    axes.plot(*places, color=style.arm_colour(1), linewidth=1.0, zorder=7)
    star: dict[str, Any] = {"color": "white", "markeredgecolor": style.NEUTRAL, "ms": 8}
    axes.plot(*(goal[name] for name in names), "*", zorder=8, **star)


@table_of("element order x y half_x half_y factor joint_x joint_y length_unit", is_rounded=True)
def scope_table(condition: ConditionResults) -> Iterator[tuple[object, ...]]:
    """Return the shown path in its two liveliest joints, and hulls of the tool's first steps."""
    replicate = measures.shown_replicate(condition)
    problem, q = condition.problem(Problem), measures.paths(condition)[replicate]
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
    for element, points, *rest in parts:
        for n, (x, y) in enumerate(points):
            yield element, n, x, y, *rest, a + 1, b + 1, condition.length_unit


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
    right.plot(tool["x"], tool["y"], color=style.NEUTRAL, linewidth=1.0, label="path of the tool")
    _draw_ends(right, tool)
    style.operational_axes(right, table["length_unit"].iloc[0])
    right.set(title="b  the tool, one step from the start", **EQUAL)
    style.legend_below(figure, [right], 6)
    return figure


def _draw_ends(axes: Axes, path: pd.DataFrame) -> None:
    look: dict[str, Any] = {"color": "white", "markeredgecolor": style.NEUTRAL, "linestyle": "none"}
    axes.plot(path["x"].iloc[:1], path["y"].iloc[:1], "s", markersize=6, label="start", **look)
    axes.plot(path["x"].iloc[-1:], path["y"].iloc[-1:], "*", markersize=9, label="end", **look)


def stuck_pair(obstructed: Conditions) -> Conditions:
    """Return a task of one phase in which runs get stuck, and with sub-goals, solved; or none."""
    pairs = (
        (stuck, helped)
        for stuck, helped in measures.pairs_but_for("subgoals", obstructed)
        if stuck.solved < stuck.done and helped.solved > 0 and len(stuck.scenario.phases) == 1
    )
    return next(pairs, ())


def trap_table(stuck: ConditionResults, helped: ConditionResults) -> pd.DataFrame:
    """Return ways of the tools, and the cost around the end of the median run that is stuck."""
    rows = list[dict[str, object]]()
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
    standing = [trails.solid(*shape) for shape in shapes]
    rows += [{"element": OBSTACLE, "order": k} | own for k, own in enumerate(standing) if own]
    names = ["element", "series", "replicate", "order", "value", *trails.COLUMNS]
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
    figure, (above, along, land, escape) = style.panels(3.1, 4, 2)
    tools, cells, escapes, obstacles, goal = (
        table[table["element"] == element] for element in (TOOL, CELL, ESCAPE, OBSTACLE, GOAL)
    )
    unit = table["length_unit"].iloc[0]
    # ways of both kinds of runs, crosses where they are stuck
    for row in records(obstacles):
        trails.draw_solid(above, row, style.FAINT, 0.35)
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
    # the cost around the posture that is stuck, and its scope
    wide = cells.pivot(index="y", columns="x", values="value")
    look: dict[str, Any] = {"cmap": "viridis_r", "shading": "nearest", "rasterized": True}
    shown = land.pcolormesh(wide.columns, wide.index, wide.to_numpy(), **look)
    figure.colorbar(shown, ax=land, label="cost [-]", shrink=0.9)
    x, y, scope, *joints = cells[["x_end", "y_end", "scope_deg", "joint_x", "joint_y"]].iloc[0]
    marks.contact(land, x, y, 8)
    frame: dict[str, Any] = {"fill": False, "edgecolor": style.FORBIDDEN, "linewidth": 1.2}
    land.add_patch(Rectangle((x - scope, y - scope), 2 * scope, 2 * scope, **frame))
    land.grid(visible=False)
    first, second = (f"{style.joint_symbol(0, int(joint) - 1)} [deg]" for joint in joints)
    title = "c  cost around a stuck posture (×), its scope"
    land.set(xlabel=first, ylabel=second, title=title, facecolor="#c8c8c8")
    # the least cost in boxes around the posture that is stuck
    look = {"color": style.FORBIDDEN, "linewidth": 1.0, "linestyle": (0, (4, 2))}
    escape.axhline(escapes["y"].iloc[0], label="stuck", **look)
    escape.plot(escapes["x"], escapes["value"], "o-", color=style.arm_colour(0), markersize=4)
    escape.set_xscale("log", base=2)
    escape.xaxis.set_major_formatter("{x:g}")
    escape.set(xlabel="half the edge of the box [scopes]", ylabel="least cost found in it [-]")
    escape.set(ylim=(0.0, None), title="d  random postures around it")
    keys = [style.key(name, color=colour, linewidth=1.6) for colour, name in looks.values()]
    style.keys_below(figure, keys)
    return figure


@table_of(
    f"position robot element name {' '.join(trails.COLUMNS)} inflation length_unit", is_rounded=True
)
def models_table(shown: Sequence[tuple[str, ConditionResults]]) -> Iterator[tuple[object, ...]]:
    """Return bodies and covers of robots at their start, of (title, a condition of the robot)."""
    for position, (title, c) in enumerate(shown):
        problem = c.problem(Problem)
        bodies, model, geometry = problem.bodies, problem.assembly.model, problem.assembly.geometry
        data, placements = model.createData(), geometry.createData()
        pin.updateGeometryPlacements(model, data, geometry, placements, problem.start)
        own = [
            (BODY, item.name, *trails.solid(item.geometry, place).values())
            for item, place in zip(geometry.geometryObjects, placements.oMg, strict=True)
        ]
        joints = (data.oMi[item.parentJoint] for item in geometry.geometryObjects)
        for name, joint, cover in zip(bodies.names, joints, bodies.covers, strict=True):
            for start, end, radius in zip(cover.start, cover.end, cover.radius, strict=True):
                pose, length = motion_scenes.capsule(start, end)
                middle, turn = joint.act(pose.translation), (joint.rotation @ pose.rotation).ravel()
                sizes = radius, 0.5 * length, 0.0
                kind = "capsule" if length else "sphere"
                own.append((COVER, name, kind, *middle, *turn, *sizes))
        yield from ((position, title, *row, bodies.inflation, c.length_unit) for row in own)


def draw_models(table: pd.DataFrame) -> Figure:
    """Draw one row per robot: its bodies, and their covers."""
    robots = list(groups(table, ["position", "robot"]))
    spans = [np.ptp(trails.corners(rows), axis=0) for _, rows in robots]
    heights = [float(np.clip(2.0 + 1.6 * z / max(x, y), 2.3, 3.3)) for x, y, z in spans]  # [inch]
    figure = style.figure(sum(heights))
    grid = figure.add_gridspec(len(robots), 2, height_ratios=heights)
    for (position, robot), rows in robots:
        points, (inflation, unit) = trails.corners(rows), rows[["inflation", "length_unit"]].iloc[0]
        bodies, covers = (rows[rows["element"] == element] for element in (BODY, COVER))
        counts = covers["shape"].value_counts()
        kinds = ", ".join(f"{counts[kind]} {KINDS[kind]}" for kind in KINDS if kind in counts)
        shown = (
            (bodies, 0.85, f"{robot}: {len(bodies)} bodies"),
            (covers, 0.35, f"{kinds}, at most {inflation:.3g} {unit} beyond"),
        )
        for k, (own, alpha, title) in enumerate(shown):
            axes = trails.space(figure, (grid[position, k],), points, unit)
            for row in records(own):
                trails.draw_solid(axes, row, style.arm_colour(k), alpha)
            axes.set_title(title)
    return figure
