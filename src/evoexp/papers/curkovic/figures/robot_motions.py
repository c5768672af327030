"""Motions of robots (Curkovic et al. 2013): trails (Figs. 8, 10, 11), curves along them (Fig. 9).

Beside them the test of two links (Fig. 7).
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Circle, Patch
from matplotlib.ticker import MaxNLocator

from evoexp.collision.planar.planar_arms import closed_form
from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.papers import trails
from evoexp.papers.curkovic import measures
from evoexp.planners.coevolution.planner import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import Parts, Rows, groups, marks, records, rounded, style, table_of
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults

POSTURES = 4  # per segment: a stroboscope
POINTS = 20  # of an end-effector's path, per segment
POSTURE, CONFIGURATION, PATH = "posture", "configuration", "path"
CONTACT, OBSTACLE = "contact", "obstacle"
LINK = ["robot", "link", "instant", "x", "y", "x_end", "y_end", "radius"]
TOOL = 2  # number of a robot's third link, which is the body around its end-effector
SAMPLES = 40  # per segment
KINDS: tuple[Any, ...] = ("-", (0, (4, 1.5)))  # of first and second links
LOWEST, HIGHEST, BEST, STRAIGHT = "lowest", "highest", "best replicate", "straight line"
CROSSING_SAMPLES = 200  # configurations per segment of the straight line among which one is chosen
TOP_LINKS = 3  # of the four pairs of links that `closed_form` tells apart
VECTORS = ("a", "b", "c", "d")  # of the paper: links of robot 1, then of robot 2


def motion_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the trail of the best replicate, and end-effector paths and contacts of all.

    The best one is the cheapest that the exact verdict does not refute, if there is one.
    """
    prepared, best = condition.prepared, measures.exemplar(condition)
    edges = [
        (OBSTACLE, -1, -1, k, 0.0, *ends, 0.0) for k, *ends in trails.obstacle_edges(condition)
    ]
    # the first contacts of bodies in the motions that the exact verdict refutes
    contacts = []
    for replicate, (instant, pair) in motion_geometry.refuted(condition).items():
        solution = condition.solutions[replicate]
        place = motion_geometry.contact(prepared, solution, instant, pair)
        contacts.append((CONTACT, replicate, -1, -1, instant, *place, *place, 0.0))
    names = ["element", "replicate", *LINK]
    parts = [pd.DataFrame(edges, columns=names)]
    for replicate, solution in condition.solutions.items():
        path = _path(prepared, measures.sampled(prepared, solution, POINTS))
        parts.append(path.assign(replicate=replicate))
        if replicate == best:
            for element, samples in ((POSTURE, POSTURES), (CONFIGURATION, 1)):
                links = _links(prepared, measures.sampled(prepared, solution, samples))
                parts.append(links.assign(element=element))
    parts.append(pd.DataFrame(contacts, columns=names))
    table = rounded(pd.concat(parts, ignore_index=True))
    table = table.assign(best=best, length_unit=condition.length_unit)
    return table[[*names, "best", "length_unit"]]


def draw_motion(table: pd.DataFrame) -> Figure:
    """Draw the best replicate's motion as a trail of postures, beside it all end-effectors."""
    figure, (trail, paths) = trails.planes(table, 2)
    best, rows_of = table["best"].iloc[0], dict(groups(table, "element"))
    for axes in (trail, paths):
        for _, outline in groups(table[table["element"] == OBSTACLE], "link"):
            axes.fill(outline["x"], outline["y"], color=style.FAINT, linewidth=0)
    postures, path = rows_of[POSTURE], rows_of[PATH]
    for robot, links in groups(postures[postures["link"] < TOOL], "robot"):
        trails.draw_trail(trail, links, style.arm_colour(int(robot)))
        trails.draw_base(trail, links)
    # at configurations the boundaries of thick links, and tools
    at = rows_of[CONFIGURATION]
    for row in records(at[at["radius"] > 0.0]):
        look: dict[str, Any] = {"color": style.arm_colour(row.robot), "lw": 0.6, "alpha": 0.6}
        if row.link == TOOL:
            trail.add_patch(Circle((row.x, row.y), row.radius, fill=False, **look))
            continue
        along = np.array([row.x_end - row.x, row.y_end - row.y])
        x, y = row.radius * np.array([-along[1], along[0]]) / float(np.hypot(*along))
        for side in (-1.0, 1.0):
            ends = np.array([row.x, row.x_end]), np.array([row.y, row.y_end])
            trail.plot(ends[0] + side * x, ends[1] + side * y, **look)
    for (robot, replicate), rows in groups(path, ["robot", "replicate"]):
        colour = style.arm_colour(int(robot))
        if replicate == best:
            trail.plot(rows["x_end"], rows["y_end"], ".", color=colour, markersize=2.6, zorder=4)
        paths.plot(rows["x_end"], rows["y_end"], color=colour, linewidth=0.8, alpha=0.5)
        for axes in (trail, paths):
            _ends(axes, rows)
    contacts = table[table["element"] == CONTACT]
    for axes, rows in ((trail, contacts[contacts["replicate"] == best]), (paths, contacts)):
        marks.contact(axes, rows["x"], rows["y"], 8, zorder=7)
    trail.set_title(f"a  motion of replicate {best}")
    paths.set_title(f"b  end-effectors, all replicates (n = {path['replicate'].nunique()})")
    keys = [*trails.trail_keys(set(path["robot"]), "robot"), *_end_keys()]
    if len(contacts):
        text, look = f"first contact of bodies (refuted: {len(contacts)})", {"mec": "white"}
        keys.append(marks.point_key(text, "X", 8, color=style.FORBIDDEN, **look))
    style.keys_below(figure, keys, 4)
    return figure


@table_of(is_rounded=True)
def tools_table(conditions: Sequence[ConditionResults]) -> Parts:
    """Return the end-effector paths of conditions that differ in the end-effector's radius."""
    for position, c in enumerate(conditions):
        shown = measures.exemplar(c)
        path = _path(c.prepared, measures.sampled(c.prepared, c.solutions[shown], POINTS))
        model = c.planner.collision
        yield {
            **path.drop(columns=["element", "link", "radius"]),
            "condition": c.label,
            "position": position,
            "tcp_radius": model.tcp_radius,
            "collision_substeps": model.collision_substeps,
            "at_configuration": path["instant"] == path["instant"].round(),
            "refuted": shown in motion_geometry.refuted(c),
            "length_unit": c.length_unit,
        }


def draw_tools(table: pd.DataFrame) -> Figure:
    """Draw the paths with circles at the configurations, a panel per collision substeps."""
    tests, unit = list(groups(table, "collision_substeps"))[::-1], table["length_unit"].iloc[0]
    looks: dict[float, dict[str, Any]] = {
        radius: {"color": style.condition_colour(k)}
        for k, radius in enumerate(sorted(table["tcp_radius"].unique()))
    }
    figure, panels = trails.planes(table, len(tests))
    for axes, (substeps, tested) in zip(panels, tests, strict=True):
        for (radius, _), rows in groups(tested, ["tcp_radius", "robot"]):
            kind = trails.DASHES if rows["refuted"].any() else "-"
            axes.plot(rows["x_end"], rows["y_end"], linestyle=kind, **looks[radius])
            for row in records(rows[rows["at_configuration"]]):
                circle = Circle((row.x_end, row.y_end), radius, fill=False, lw=0.7, **looks[radius])
                axes.add_patch(circle)
            _ends(axes, rows)
        for robot, rows in groups(tested, "robot"):
            look: dict[str, Any] = {"fontsize": 7.5, "zorder": 7, "path_effects": marks.HALO}
            start = rows["x_end"].iloc[0], rows["y_end"].iloc[0]
            marks.write(axes, f"robot {int(robot) + 1}", start, (0, -13), **look)
        where = "the configurations" if substeps == 1 else f"{substeps} substeps"
        axes.set_title(f"tested at {where}")
    keys = [style.key(f"radius {radius:g} {unit}", **look) for radius, look in looks.items()]
    if table["refuted"].any():
        keys.append(style.key("refuted", color=style.NEUTRAL, linestyle=trails.DASHES))
    style.keys_below(figure, [*keys, *_end_keys()])
    return figure


@table_of(" ".join([*LINK, "replicate"]))
def _links(prepared: Prepared, sampled: measures.SampledMotion) -> Rows:
    assembly = prepared.problem.assembly
    places = motion_geometry.joint_positions(assembly, sampled.q)
    for item, (robot, link, start, end) in zip(assembly.links, places, strict=True):
        for k, instant in enumerate(sampled.instants):
            yield robot, link, instant, *start[k, :2], *end[k, :2], item.radius, -1


def _path(prepared: Prepared, sampled: measures.SampledMotion) -> pd.DataFrame:
    """Return the path of each end-effector, one row from each sample to the next."""
    links = _links(prepared, sampled)
    tips = links[links["link"] == 1].drop(columns=["x", "y"])
    before = tips.groupby("robot")[["x_end", "y_end"]].shift().fillna(tips[["x_end", "y_end"]])
    return tips.assign(element=PATH, x=before["x_end"], y=before["y_end"])


def _ends(axes: Axes, path: pd.DataFrame) -> None:
    """Mark start and goal of an end-effector: circle and cross, as the paper does."""
    (x, y), (x_end, y_end) = path[["x_end", "y_end"]].to_numpy()[[0, -1]]
    marks.hollow(axes, x, y, "o", style.NEUTRAL, 6, zorder=6)
    axes.plot(x_end, y_end, "x", color=style.NEUTRAL, markersize=7, markeredgewidth=1.8, zorder=6)


def _end_keys() -> list[Line2D]:
    grey = style.NEUTRAL
    return [
        style.key("start of an end-effector", marker="o", mec=grey, mfc="white", linestyle="none"),
        marks.point_key("its goal", "x", 7, color=grey, mew=1.8),
    ]


@table_of(is_rounded=True)
def joints_table(condition: ConditionResults) -> Parts:
    """Return link angles and their speeds along the best replicate's motion."""
    prepared, best = condition.prepared, condition.solutions[measures.exemplar(condition)]
    found, limits = measures.sampled(prepared, best, SAMPLES), measures.speed_limits(prepared)
    for (robot, link), limit in np.ndenumerate(limits):
        columns: dict[str, Any] = {"robot": robot, "link": link, "instant": found.instants}
        columns |= {"at_configuration": found.instants == found.instants.round()}
        columns |= {"angle_deg": found.links[:, robot, link]}
        yield columns | {"turn_deg": np.abs(found.speeds[:, robot, link]), "limit_deg": limit}


def draw_joints(table: pd.DataFrame) -> Figure:
    """Draw link angles in their range, and beside them turns per sampling step with limits."""
    red: dict[str, Any] = {"color": style.FORBIDDEN, "linewidth": 0.9, "zorder": 1}
    limit_look = red | {"linestyle": ":", "linewidth": 1.2}
    figure, panels = style.panels(1.9, 2 * table["robot"].nunique(), 2, 1.0)
    for (robot, own), angles, turns in zip(
        groups(table, "robot"), panels[::2], panels[1::2], strict=True
    ):
        colour = style.arm_colour(int(robot))
        for edge in (0.0, 180.0):
            angles.axhline(edge, **red)
        for link, rows in groups(own, "link"):
            kind, x = KINDS[int(link)], rows["instant"]
            angles.plot(x, rows["angle_deg"], color=colour, linestyle=kind)
            turns.plot(x, rows["turn_deg"], color=colour, linestyle=kind)
            at = rows[rows["at_configuration"]]
            angles.plot(at["instant"], at["angle_deg"], "o", color=colour, **style.DOTS)
            limit = float(rows["limit_deg"].iloc[0])
            turns.axhline(limit, **limit_look)
            text = f"link {int(link) + 1}: {limit:.1f}°"
            marks.beside(turns, limit, text, va="bottom" if link else "top")  # they may be close
        turns.set_ylim(bottom=0.0)
        angles.set(yticks=[0, 60, 120, 180], ylabel=f"robot {robot + 1}: link angle [deg]")
        turns.set_ylabel("turn per step [deg]")
    panels[0].set_title("a  link angles from +x")
    panels[1].set_title("b  turns per sampling step")
    for axes in panels[-2:]:
        axes.set_xlabel("sampling step (whole numbers: configurations)")
    grey = style.NEUTRAL
    keys = [
        *(style.key(f"link {k + 1}", color=grey, linestyle=kind) for k, kind in enumerate(KINDS)),
        style.key("configurations", color=grey, marker="o", mec="white", linestyle="none", ms=5),
        style.key("range [0, 180°]", **red),
        style.key("limit of a link, Eq. 2", **limit_look),
    ]
    style.keys_below(figure, keys)
    return figure


@table_of(is_rounded=True)
def distances_table(conditions: tuple[ConditionResults, ...], samples: int) -> Parts:
    """Return the bodies' least distance: range over all motions, best replicate, straight line."""
    for position, c in enumerate(conditions):
        scene = c.problem(Problem).scene
        distance = motion_geometry.BodyDistance(scene)
        quick = motion_geometry.distance_measure(scene)
        sampled = partial(_sampled, c, samples=samples)
        lowest, highest = motion_geometry.extremes(list(c.solutions), sampled, quick)
        series = {LOWEST: lowest, HIGHEST: highest}
        series |= {BEST: sampled(measures.exemplar(c)), STRAIGHT: sampled(None)}
        for name, q in series.items():
            columns: dict[str, Any] = {"condition": c.label, "position": position, "series": name}
            columns |= {"instant": np.arange(q.shape[1]) / samples, "distance": distance(q)}
            columns |= {"replicates": c.done, "refuted": len(motion_geometry.refuted(c))}
            yield columns | {"length_unit": c.length_unit}


def _sampled(condition: ConditionResults, replicate: int | None, samples: int) -> FloatArray:
    """Return a replicate's motion, or the straight one, (nq, instants) [rad]."""
    c = condition
    solution = measures.straight(c.prepared) if replicate is None else c.solutions[replicate]
    return DEGREE * measures.sampled(c.prepared, solution, samples).q


def draw_distances(table: pd.DataFrame) -> Figure:
    """Draw the distance at each instant: best replicate, range over all, straight line."""
    by_position = list(groups(table, "position"))
    figure, panels = style.panels(1.9, len(by_position), 2, 0.9, sharey=True)
    for axes, (position, rows) in zip(panels, by_position, strict=True):
        colour = style.condition_colour(int(position))
        own = dict(groups(rows, "series"))
        low, high, best, straight = (own[name] for name in (LOWEST, HIGHEST, BEST, STRAIGHT))
        marks.band(axes, low["instant"], low["distance"], high["distance"], colour)
        axes.plot(straight["instant"], straight["distance"], ":", color=style.FAINT)
        axes.plot(best["instant"], best["distance"], color=colour)
        at = best[best["instant"] == best["instant"].round()]
        axes.plot(at["instant"], at["distance"], "o", color=colour, **style.DOTS)
        condition, refuted, runs = rows[["condition", "refuted", "replicates"]].iloc[0]
        axes.set_title(f"{condition}: {refuted} of {runs} refuted", fontsize=7.5)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlim(0.0, table["instant"].max())
        if style.begins_line(axes):
            axes.set_ylabel(f"least distance [{table['length_unit'].iloc[0]}]")
        if style.ends_column(axes, panels):
            axes.set_xlabel("sampling step (whole: configurations)")
    panels[0].set_ylim(bottom=-0.02 * float(table["distance"].max()))
    grey = style.NEUTRAL
    keys = [
        style.key(f"{BEST}, dots: configurations", color=grey, marker="o", mec="white", ms=5),
        Patch(color=grey, alpha=0.18, linewidth=0, label="range over replicates"),
        style.key("straight line in link angles", linestyle=":", color=style.FAINT),
    ]
    style.keys_below(figure, keys)
    return figure


@table_of("element x y x_end y_end angle_deg mu nu share crossing length_unit", is_rounded=True)
def intersection_table(condition: ConditionResults) -> Rows:
    """Return links and intersection of two robots that go straight, where their top links cross."""
    problem = condition.problem(Problem)
    one, two = measures.arms(condition.prepared)
    steps = np.linspace(0.0, 1.0, CROSSING_SAMPLES + 1)[:, None, None]
    links = (1.0 - steps) * problem.start + steps * problem.goal  # (samples, robots, 2)
    found = closed_form(one, links[:, 0].T, two, links[:, 1].T)
    mu, nu = found.mu[TOP_LINKS], found.nu[TOP_LINKS]
    off = np.nan_to_num(np.maximum(np.abs(mu - 0.5), np.abs(nu - 0.5)), nan=np.inf)
    k = int(np.argmin(off))
    numbers = round(float(mu[k]), 9), round(float(nu[k]), 9), float(steps[k, 0, 0])
    same = *numbers, bool(found.crossing[TOP_LINKS, k]), condition.length_unit
    for robot, arm in enumerate((one, two)):
        elbow_x, elbow_y, tip_x, tip_y = arm.outlines(links[k, robot].reshape(1, 2, 1))[0, :4, 0]
        angles = links[k, robot] / DEGREE
        yield VECTORS[2 * robot], *arm.base, elbow_x, elbow_y, angles[0], *same
        yield VECTORS[2 * robot + 1], elbow_x, elbow_y, tip_x, tip_y, angles[1], *same
        if robot == 0:
            at = elbow_x + mu[k] * (tip_x - elbow_x), elbow_y + mu[k] * (tip_y - elbow_y)
    yield "base", *one.base, *two.base, np.nan, *same
    yield "point", *at, *at, np.nan, *same


def draw_intersection(table: pd.DataFrame) -> Figure:
    """Draw the links as the paper's vectors, their angles, the bases' distance, the crossing."""
    figure = style.figure(4.3, 5.4)
    axes = figure.subplots()
    style.operational_axes(axes, table["length_unit"].iloc[0])
    rows = {row.element: row for row in records(table)}
    links = [rows[name] for name in VECTORS]
    size = max(float(np.hypot(row.x_end - row.x, row.y_end - row.y)) for row in links)
    arrow: dict[str, Any] = {"shrinkA": 0, "shrinkB": 0}
    for k, row in enumerate(links):
        colour = style.arm_colour(k // 2)
        look: dict[str, Any] = {"arrowstyle": "-|>", "color": colour, "linewidth": 2.2}
        axes.annotate("", (row.x_end, row.y_end), (row.x, row.y), arrowprops=look | arrow)
        # a line for the limits of the axes
        axes.plot([row.x, row.x_end], [row.y, row.y_end], color=colour, linewidth=0.1)
        away = np.array([-(row.y_end - row.y), row.x_end - row.x]) / size * 10.0
        name: dict[str, Any] = {"va": "center", "color": colour, "weight": "bold"}
        marks.write(axes, row.element, _middle(row), tuple(away), **name)
        # the angle from +x
        radius, half = 0.2 * size, np.radians(0.5 * row.angle_deg)
        faint: dict[str, Any] = {"color": style.FAINT, "linewidth": 0.9, "zorder": 1}
        axes.plot([row.x, row.x + 1.5 * radius], [row.y, row.y], ":", **faint)
        arc: dict[str, Any] = {"theta1": 0.0, "theta2": row.angle_deg, "color": colour, "lw": 0.9}
        axes.add_patch(Arc((row.x, row.y), 2 * radius, 2 * radius, **arc))
        text = f"φ{str(k + 1).translate(style.SUBSCRIPTS)} = {row.angle_deg:.0f}°"
        place = row.x + 1.45 * radius * np.cos(half), row.y + 1.45 * radius * np.sin(half)
        axes.annotate(text, place, ha="left", va="center", color=colour, fontsize=7)
    # the distance of the bases, the first joints, and the crossing
    base, point = rows["base"], rows["point"]
    both = {"arrowstyle": "<->"} | arrow
    axes.annotate("", (base.x_end, base.y_end), (base.x, base.y), arrowprops=both)
    marks.write(axes, "d·i", _middle(base), (0, -12))
    for k, text, side in ((1, "O₁", -11), (3, "O₂", 11)):
        joint = links[k].x, links[k].y
        marks.hollow(axes, *joint, "o", style.arm_colour(k // 2), 6, zorder=4)
        marks.write(axes, text, joint, (side, 4))
    marks.contact(axes, point.x, point.y, 9, zorder=6)
    marks.write(axes, "P", (point.x, point.y), (0, 9), color=style.FORBIDDEN, weight="bold")
    word = "the links cross" if base.crossing else "the links do not cross"
    axes.set_title(f"μ = {base.mu:.3f}, ν = {base.nu:.3f}: {word}")
    axes.margins(0.12)
    figure.supxlabel("O₁P = μ b,  O₂P = ν d;  they cross where both lie in [0, 1]", fontsize=8)
    return figure


def _middle(row: Any) -> tuple[float, float]:
    return 0.5 * (row.x + row.x_end), 0.5 * (row.y + row.y_end)
