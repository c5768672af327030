"""Drawings of the models of arms: angles, via-points, links as touching circles or spheres."""

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.papers import trails
from evoexp.papers.rana import measures
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, motion_scenes, records, rounded, style, table_of
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults

ANGLES = ["joint_1_deg", "joint_2_deg"]
CLOSEST: dict[str, tuple[str, dict[str, Any]]] = {  # pairs of points: name, look of their line
    "centres": ("circle centres", {"color": "black", "lw": 3}),
    "bodies": ("the links", {"color": style.ARM_COLOURS[3], "ls": ":"}),
}
POINT_NAMES = ("p", "q")  # of the arms, as in the paper's Fig. 9
NUMBERED = 5  # every fifth via-point carries its number


@table_of("posture arm joint x y x_end y_end reference_deg angle_deg length_unit", is_rounded=True)
def arms_table(condition: ConditionResults) -> Iterator[tuple[object, ...]]:
    """Return links and joint angles at start and goal."""
    problem, unit = condition.problem(Problem), condition.length_unit
    for posture, q in (("start", problem.start), ("goal", problem.goal)):
        for arm, joint, start, end in motion_geometry.joint_positions(problem.assembly, q[:, None]):
            angle = q[problem.arm_slices[arm, 0] + joint]
            x, y = (end - start)[0, :2]
            direction = np.degrees(np.arctan2(y, x))
            ends = *start[0, :2], *end[0, :2]
            yield posture, arm, joint, *ends, direction - angle, angle, unit


def draw_arms(table: pd.DataFrame) -> Figure:
    """Draw the arms at the start with their joint angles, and at the goal."""
    figure = style.figure(4.7, 4.2)
    axes = figure.subplots()
    style.operational_axes(axes, table["length_unit"].iloc[0])
    looks: dict[str, dict[str, Any]] = {
        "start": {},
        "goal": {"alpha": 0.35, "linestyle": trails.DASHES},
    }
    for (posture, arm), links in groups(table, ["posture", "arm"]):
        trails.draw_chain(axes, links, style.arm_colour(arm), **looks[posture])
        trails.draw_base(axes, links)
    # joint angles with their reference directions, arcs and values
    for row in records(table[table["posture"] == "start"]):
        x, y, colour = row.x, row.y, style.arm_colour(row.arm)
        reference, angle, radius = row.reference_deg, row.angle_deg, 0.55 if row.joint else 0.75
        s, c = sincos(DEGREE * reference)
        line: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 0.8, "zorder": 1}
        axes.plot([x, x + 1.5 * c], [y, y + 1.5 * s], ":", **line)
        first, last = sorted((reference, reference + angle))
        arc: dict[str, Any] = {"theta1": first, "theta2": last, "linewidth": 1.0}
        axes.add_patch(Arc((x, y), 2 * radius, 2 * radius, color=colour, **arc))
        s, c = sincos(DEGREE * (reference + 0.5 * angle))
        text = f"{style.joint_symbol(row.arm, row.joint)} = {angle:g}°"
        place = (x + (radius + 0.25) * c, y + (radius + 0.25) * s)
        look: dict[str, Any] = {"color": colour, "zorder": 10, "path_effects": marks.HALO}
        axes.annotate(text, place, ha="left" if c >= 0 else "right", va="center", **look)
        if row.joint == 0:
            marks.write(axes, f"arm {row.arm + 1}", (x, y), (0, -22), color=colour)
    keys = [style.key(name, color=style.NEUTRAL, **look) for name, look in looks.items()]
    style.keys_below(figure, keys)
    axes.margins(0.12)
    return figure


def via_points_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the via-points of the best replicate, at the beginning and at the end."""
    solutions = {
        "best of the initial population": condition.first_solution(condition.best_replicate),
        "best at the end": condition.solutions[condition.best_replicate],
    }
    return pd.concat(
        [path_table(condition, each).assign(stage=stage) for stage, each in solutions.items()],
        ignore_index=True,
    )


def draw_via_points(table: pd.DataFrame) -> Figure:
    """Draw via-points in the arms' configuration planes, every fifth numbered by its instant."""
    arms = list(groups(table, "arm"))
    figure, panels = style.panels(3.6, len(arms))
    first, last = dict.fromkeys(table["stage"])
    looks: dict[str, dict[str, Any]] = {
        first: {"color": style.FAINT, "linewidth": 0.9, "marker": "s", "markersize": 3},
        last: {"color": style.NEUTRAL, "linewidth": 0.9, "marker": "o", "markersize": 4},
    }
    for axes, (arm, rows) in zip(panels, arms, strict=True):
        for stage, look in looks.items():
            colour = {"color": style.arm_colour(arm)} if stage == last else {}
            own = rows[rows["stage"] == stage]
            axes.plot(*(own[name] for name in ANGLES), **look | colour)
        for row in records(own[(own["instant"] % NUMBERED == 0) | (own.index == own.index[-1])]):
            number: dict[str, Any] = {"fontsize": 7, "zorder": 6, "path_effects": marks.HALO}
            place = row.joint_1_deg, row.joint_2_deg
            marks.write(axes, str(row.instant), place, (0, 6), **number)
        x, y = (f"{style.joint_symbol(arm, joint)} [deg]" for joint in (0, 1))
        axes.set(xlabel=x, ylabel=y, title=f"arm {arm + 1}")
        axes.set_aspect("equal", adjustable="datalim")  # lengths of paths are Euclidean in degrees
        axes.margins(0.1)
    keys = [
        style.key(first, **looks[first]),
        style.key(f"{last} (numbers: instants)", **looks[last]),
    ]
    style.keys_below(figure, keys)
    return figure


@table_of(
    "element arm x y x_end y_end radius distance safety_distance instant length_unit",
    is_rounded=True,
)
def circles_table(condition: ConditionResults) -> Iterator[tuple[object, ...]]:
    """Return links and circles of the best replicate at its via-point of least centre distance."""
    problem = condition.problem(Problem)
    q = measures.best_motion(condition)
    instant = int(np.argmin(problem.centre_distances(q)))
    at, same = q[:, instant], (problem.security_margin, instant, condition.length_unit)
    for arm, _, start, end in motion_geometry.joint_positions(problem.assembly, at[:, None]):
        yield "link", arm, *start[0, :2], *end[0, :2], np.nan, np.nan, *same
    centres = problem.sphere_centres(at)
    for arm, points in enumerate(centres):
        for p in points:
            yield "circle", arm, *p[:2], *p[:2], problem.sphere_radius, np.nan, *same
    # the two closest centres of different arms
    couples = (
        couple
        for first, second in itertools.combinations(centres, 2)
        for couple in itertools.product(first, second)
    )
    a, b = min(couples, key=lambda ab: float(np.linalg.norm(ab[0] - ab[1])))
    yield "centres", -1, *a[:2], *b[:2], np.nan, float(np.linalg.norm(a - b)), *same
    between, _ = measures.kinds_of_pairs(condition)[measures.BETWEEN_ARMS]
    exact = motion_geometry.BodyDistance(problem.scene.of_pairs(between))
    least, (a, b) = exact.nearest(DEGREE * at)
    yield "bodies", -1, *a[:2], *b[:2], np.nan, least, *same


def draw_circles(table: pd.DataFrame) -> Figure:
    """Draw links as lines, their circles, and the least distances of centres and of links."""
    figure = style.figure(5.6, 4.4)
    axes = figure.subplots()
    unit, radius = table["length_unit"].iloc[0], table["radius"].max()
    style.operational_axes(axes, unit)
    for row in records(table[table["element"] == "circle"]):
        colour = style.arm_colour(row.arm)
        axes.add_patch(Circle((row.x, row.y), row.radius, fc=colour, alpha=0.14, lw=0))
        axes.add_patch(Circle((row.x, row.y), row.radius, fill=False, ec=colour, lw=0.8))
        axes.plot(row.x, row.y, ".", color=colour, markersize=3)
    for arm, links in groups(table[table["element"] == "link"], "arm"):
        trails.draw_chain(axes, links, style.arm_colour(arm))
        trails.draw_base(axes, links)
    for row in records(table[table["distance"].notna()]):
        what, line = CLOSEST[row.element]
        label = f"least distance of {what}: {row.distance:.3f} {unit}"
        axes.plot([row.x, row.x_end], [row.y, row.y_end], zorder=6, label=label, **line)
    circles = f"circles of radius r = {radius:g} {unit}"
    axes.plot([], [], "o", color=style.FAINT, fillstyle="none", label=circles)
    safety = f"safety distance {table['safety_distance'].iloc[0]:g} {unit}"
    axes.plot([], [], " ", label=f"collision below 2r = {2 * radius:g} {unit}; {safety}")
    axes.set_title(f"instant {int(table['instant'].iloc[0])}")
    axes.margins(0.08)
    style.legend_below(figure, [axes], 1)
    return figure


@table_of()
def path_table(condition: ConditionResults, solution: FloatArray) -> Iterator[dict[str, Any]]:
    """Return a solution's via-points per arm: columns arm, instant, joint_1_deg, joint_2_deg."""
    shape = condition.planner.shape(condition.problem(Problem))
    parts = np.split(solution, np.cumsum([rows * joints for rows, joints in shape])[:-1])
    for arm, (values, (rows, joints)) in enumerate(zip(parts, shape, strict=True)):
        angles = zip(ANGLES, values.reshape(rows, joints).T, strict=True)
        yield {"arm": arm, "instant": range(rows), **dict(angles)}


def links_table(condition: ConditionResults, q: FloatArray) -> pd.DataFrame:
    """Return all links at every instant of a motion."""
    table = motion_geometry.links_table(condition.problem(Problem).assembly, q)
    return rounded(table).assign(length_unit=condition.length_unit)


def arm_table(condition: ConditionResults) -> pd.DataFrame:
    """Return links and spheres of the first arm at its start."""
    problem = condition.problem(Problem)
    links = links_table(condition, problem.start[:, None])
    spheres = problem.sphere_centres(problem.start)[0]
    first = links[links["arm"] == 0].assign(element="link", radius=np.nan)
    rows = [(0, 0, -1, *centre, *centre) for centre in spheres]
    added = rounded(pd.DataFrame(rows, columns=["instant", *motion_geometry.LINK]))
    look: dict[str, Any] = {"radius": problem.sphere_radius, "length_unit": condition.length_unit}
    added = added.assign(element="sphere", **look)
    return pd.concat([first, added], ignore_index=True)


def draw_arm(table: pd.DataFrame) -> Figure:
    """Draw the arm as touching spheres and as line segments with the paper's point names."""
    figure, colour = style.figure(3.9), style.arm_colour(0)
    links, spheres = table[table["element"] == "link"], table[table["element"] == "sphere"]
    for k, title in enumerate(
        ("a  touching spheres of the collision model", "b  line segments: the links themselves")
    ):
        axes = trails.space_of_links(figure, (1, 2, k + 1), table)
        axes.set_title(title)
        trails.draw_chain(axes, links, colour, "xyz")
        trails.draw_base(axes, links, "xyz")
    _name_points(axes, 0, links)
    size = np.array([table["radius"].max(), 0.0, 0.0])
    ball = motion_scenes.triangles_of("sphere", size, None)
    for centre in spheres[["x", "y", "z"]].to_numpy():
        shades = motion_scenes.shaded(ball, colour, 0.25)
        figure.axes[0].add_collection(Poly3DCollection(ball + centre, facecolors=shades, lw=0))
    return figure


def two_arms_table(condition: ConditionResults) -> pd.DataFrame:
    """Return links at start (instant 0) and goal (1), and each arm's reach from its shoulder on."""
    problem = condition.problem(Problem)
    table = links_table(condition, np.column_stack([problem.start, problem.goal]))
    starts = table[table["instant"] == 0]  # link by link
    lengths = np.sqrt(sum((starts[f"{axis}_end"] - starts[axis]) ** 2 for axis in "xyz"))
    moving = np.array([link.joint > 0 for link in problem.assembly.links])
    reach = lengths[moving].groupby(starts["arm"]).sum()
    return table.assign(reach=table["arm"].map(reach).round(9))


def draw_two_arms(table: pd.DataFrame) -> Figure:
    """Draw the arms at start and goal, and from above the part of the workspace they share."""
    figure = style.figure(4.3)
    axes = trails.space_of_links(figure, (1, 2, 1), table)
    axes.set_title("a  start (full) and goal (dashed)")
    above = figure.add_subplot(1, 2, 2)
    above.set_title("b  from above, with each arm's reach")
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    for (arm, instant), links in groups(table, ["arm", "instant"]):
        colour, look = style.arm_colour(arm), {"linestyle": trails.DASHES} if instant else {}
        for place, names in ((axes, "xyz"), (above, "xy")):
            trails.draw_chain(place, links, colour, names, **look)
            trails.draw_base(place, links, names)
        if instant == 0:
            _name_points(axes, arm, links)
            x, y, reach = links[["x", "y", "reach"]].iloc[0]
            area: dict[str, Any] = {"color": colour, "alpha": 0.12, "linewidth": 0}
            above.fill(x + reach * np.cos(turn), y + reach * np.sin(turn), **area)
    style.operational_axes(above, table["length_unit"].iloc[0])
    goal = style.key("goal", color=style.NEUTRAL, linestyle=trails.DASHES)
    style.keys_below(figure, [*trails.arm_keys(set(table["arm"])), goal])
    return figure


def _name_points(axes: Any, arm: int, links: pd.DataFrame) -> None:
    """Write the names of the arm's points: p0, p1, … of the first arm."""
    name = POINT_NAMES[arm] if arm < len(POINT_NAMES) else f"r{arm}"
    points = ([links[axis].iloc[0], *links[f"{axis}_end"]] for axis in "xyz")
    look: dict[str, Any] = {"color": style.arm_colour(arm), "fontsize": 8.5, "zorder": 10}
    for k, (x, y, z) in enumerate(zip(*points, strict=True)):
        text = f"{name}{str(k).translate(style.SUBSCRIPTS)}"
        axes.text(x, y, z + 0.11, text, ha="center", path_effects=marks.HALO, **look)
