"""Motions of robots in their plane, drawn as trails (Curkovic et al. 2013, Figs. 8, 10 and 11)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from evoexp.condition import Prepared
from evoexp.papers import trails
from evoexp.papers.curkovic import measures
from evoexp.report.figures import groups, marks, records, rounded, style
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults

POSTURES = 4  # per segment: a stroboscope
POINTS = 20  # of an end-effector's path, per segment
POSTURE, CONFIGURATION, PATH = "posture", "configuration", "path"
CONTACT, OBSTACLE = "contact", "obstacle"
LINK = ["robot", "link", "instant", "x", "y", "x_end", "y_end", "radius"]
TOOL = 2  # number of a robot's third link, which is the body around its end-effector


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
        motion = measures.executed(prepared, solution)
        parts.append(_path(prepared, measures.sampled(motion, POINTS)).assign(replicate=replicate))
        if replicate == best:
            parts += [
                _links(prepared, measures.sampled(motion, samples)).assign(element=element)
                for element, samples in ((POSTURE, POSTURES), (CONFIGURATION, 1))
            ]
    parts.append(pd.DataFrame(contacts, columns=names))
    table = rounded(pd.concat(parts, ignore_index=True)).assign(
        best=best, length_unit=condition.length_unit
    )
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
            ends = (
                [row.x + side * x, row.x_end + side * x],
                [row.y + side * y, row.y_end + side * y],
            )
            trail.plot(*ends, **look)
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


def tools_table(conditions: Sequence[ConditionResults]) -> pd.DataFrame:
    """Return the end-effector paths of conditions that differ in the end-effector's radius."""
    parts = []
    for position, c in enumerate(conditions):
        shown = measures.exemplar(c)
        motion = measures.executed(c.prepared, c.solutions[shown])
        path = _path(c.prepared, measures.sampled(motion, POINTS))
        model = c.planner.collision
        given = path.assign(
            condition=c.label,
            position=position,
            tcp_radius=model.tcp_radius,
            collision_substeps=model.collision_substeps,
            at_configuration=path["instant"] == path["instant"].round(),
            refuted=shown in motion_geometry.refuted(c),
        )
        parts.append(given)
    table = rounded(pd.concat(parts, ignore_index=True)).assign(
        length_unit=conditions[0].length_unit
    )
    return table.drop(columns=["element", "link", "radius"])


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


def _links(prepared: Prepared, sampled: measures.SampledMotion) -> pd.DataFrame:
    """Return the links of all robots at every sample."""
    assembly = prepared.problem.assembly
    places = motion_geometry.joint_positions(assembly, sampled.q)
    rows = [
        (robot, link, instant, *start[k, :2], *end[k, :2], item.radius)
        for item, (robot, link, start, end) in zip(assembly.links, places, strict=True)
        for k, instant in enumerate(sampled.instants)
    ]
    return pd.DataFrame(rows, columns=LINK).assign(replicate=-1)


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
