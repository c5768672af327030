"""Motions of robots in their plane, drawn as trails (Curkovic et al. 2013, Figs. 8, 10 and 11)."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from evoexp.condition import Prepared
from evoexp.papers.curkovic import link_motions, measures
from evoexp.report.figures import groups, marks, records, rounded, style
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults
from evoexp.scenarios.obstacles import obstacle_table

POSTURES = 4  # per segment: a stroboscope
POINTS = 20  # of an end-effector's path, per segment
POSTURE, CONFIGURATION, PATH = "posture", "configuration", "path"
CONTACT, OBSTACLE = "contact", "obstacle"
LINK = ["robot", "link", "instant", "x", "y", "x_end", "y_end", "radius"]
TOOL = 2  # number of a robot's third link, which is the body around its end-effector
DASHES: Any = (0, (2, 1))


def motion_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the trail of the best replicate, and end-effector paths and contacts of all.

    The best one is the cheapest that the exact verdict does not refute, if there is one.
    """
    prepared, best = condition.prepared, measures.exemplar(condition)
    outlines = motion_geometry.obstacle_outlines(obstacle_table(condition.scenario.obstacles))
    edges = [
        (OBSTACLE, -1, -1, k, 0.0, *a, *b, 0.0)
        for k, outline in enumerate(outlines)
        for a, b in itertools.pairwise(outline)
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
        motion = link_motions.executed(prepared, solution)
        parts.append(
            _path(prepared, link_motions.sampled(motion, POINTS)).assign(replicate=replicate)
        )
        if replicate == best:
            parts += [
                _links(prepared, link_motions.sampled(motion, samples)).assign(element=element)
                for element, samples in ((POSTURE, POSTURES), (CONFIGURATION, 1))
            ]
    parts.append(pd.DataFrame(contacts, columns=names))
    table = rounded(pd.concat(parts, ignore_index=True)).assign(
        best=best, length_unit=condition.length_unit
    )
    return table[[*names, "best", "length_unit"]]


def draw_motion(table: pd.DataFrame) -> Figure:
    """Draw the best replicate's motion as a trail of postures, beside it all end-effectors."""
    limits = []
    for name in "xy":
        values = table[[name, f"{name}_end"]].to_numpy()
        pad = 0.05 * float(np.ptp(values)) + float(table["radius"].max())
        limits.append((float(values.min()) - pad, float(values.max()) + pad))
    (left, right), (low, high) = limits
    figure = style.figure(min(4.6, 3.3 * (high - low) / (right - left)) + 1.0)
    trail, paths = figure.subplots(1, 2, sharex=True, sharey=True)
    best, unit = table["best"].iloc[0], table["length_unit"].iloc[0]
    path, contacts = table[table["element"] == PATH], table[table["element"] == CONTACT]
    for axes in (trail, paths):
        for _, outline in groups(table[table["element"] == OBSTACLE], "link"):
            axes.fill(outline["x"], outline["y"], color=style.FAINT, linewidth=0)
        style.operational_axes(axes, unit)
    _trail(trail, table)
    for (robot, replicate), rows in groups(path, ["robot", "replicate"]):
        colour = style.arm_colour(int(robot))
        if replicate == best:
            trail.plot(rows["x_end"], rows["y_end"], ".", color=colour, markersize=2.6, zorder=4)
        paths.plot(rows["x_end"], rows["y_end"], color=colour, linewidth=0.8, alpha=0.5)
        for axes in (trail, paths):
            _ends(axes, rows)
    for axes, rows in ((trail, contacts[contacts["replicate"] == best]), (paths, contacts)):
        marks.contact(axes, rows["x"], rows["y"], 8, zorder=7)
    trail.set_title(f"a  motion of replicate {best}")
    paths.set_title(f"b  end-effectors, all replicates (n = {path['replicate'].nunique()})")
    trail.set(xlim=(left, right), ylim=(low, high))
    grey, red = style.NEUTRAL, style.FORBIDDEN
    robots = sorted(path["robot"].unique())
    keys = [
        *style.arm_keys(robots, "robot", linewidth=3),
        style.key("start posture", color=grey, linewidth=2, linestyle=DASHES),
        style.key("goal posture", color=grey, linewidth=3, marker="o", ms=4),
        *_end_keys(),
    ]
    if len(contacts):
        told = f"first contact of bodies (refuted: {len(contacts)})"
        keys.append(marks.point_key(told, "X", 8, color=red, mec="white"))
    style.keys_below(figure, keys, 4)
    return figure


def tools_table(conditions: Sequence[ConditionResults]) -> pd.DataFrame:
    """Return the end-effector paths of conditions that differ in the end-effector's radius."""
    parts = []
    for position, c in enumerate(conditions):
        shown = measures.exemplar(c)
        motion = link_motions.executed(c.prepared, c.solutions[shown])
        path = _path(c.prepared, link_motions.sampled(motion, POINTS))
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
    radii = sorted(table["tcp_radius"].unique())
    tests = sorted(table["collision_substeps"].unique(), reverse=True)
    unit = table["length_unit"].iloc[0]
    x, y = (table[f"{name}_end"].to_numpy() for name in "xy")
    figure = style.figure(min(4.6, 3.6 * float(np.ptp(y) / np.ptp(x))) + 1.1)
    panels = figure.subplots(1, len(tests), sharex=True, sharey=True, squeeze=False)[0]
    for axes, substeps in zip(panels, tests, strict=True):
        style.operational_axes(axes, unit)
        for (radius, _), rows in groups(
            table[table["collision_substeps"] == substeps], ["tcp_radius", "robot"]
        ):
            colour = style.condition_colour(radii.index(radius))
            kind = DASHES if rows["refuted"].any() else "-"
            axes.plot(rows["x_end"], rows["y_end"], color=colour, linestyle=kind)
            for row in records(rows[rows["at_configuration"]]):
                tip = row.x_end, row.y_end
                axes.add_patch(Circle(tip, radius, fill=False, edgecolor=colour, lw=0.7, alpha=0.7))
            _ends(axes, rows)
        for robot, rows in groups(table, "robot"):
            look: dict[str, Any] = {"fontsize": 7.5, "zorder": 7, "path_effects": marks.HALO}
            start = rows["x_end"].iloc[0], rows["y_end"].iloc[0]
            marks.write(axes, f"robot {int(robot) + 1}", start, (0, -13), **look)
        where = "the configurations" if substeps == 1 else f"{substeps} substeps"
        axes.set_title(f"tested at {where}")
        axes.margins(0.1)
    keys = [
        style.key(f"radius {radius:g} {unit}", color=style.condition_colour(k))
        for k, radius in enumerate(radii)
    ]
    if table["refuted"].any():
        keys.append(style.key("refuted", color=style.NEUTRAL, linestyle=DASHES))
    style.keys_below(figure, [*keys, *_end_keys()])
    return figure


def _links(prepared: Prepared, sampled: link_motions.SampledMotion) -> pd.DataFrame:
    """Return the links of all robots at every sample."""
    assembly = prepared.problem.assembly
    places = motion_geometry.joint_positions(assembly, sampled.q)
    rows = [
        (robot, link, instant, *start[k, :2], *end[k, :2], item.radius)
        for item, (robot, link, start, end) in zip(assembly.links, places, strict=True)
        for k, instant in enumerate(sampled.instants)
    ]
    return pd.DataFrame(rows, columns=LINK).assign(replicate=-1)


def _path(prepared: Prepared, sampled: link_motions.SampledMotion) -> pd.DataFrame:
    """Return the path of each end-effector, one row from each sample to the next."""
    links = _links(prepared, sampled)
    tips = links[links["link"] == 1].drop(columns=["x", "y"])
    before = tips.groupby("robot")[["x_end", "y_end"]].shift().fillna(tips[["x_end", "y_end"]])
    return tips.assign(element=PATH, x=before["x_end"], y=before["y_end"])


def _trail(axes: Axes, table: pd.DataFrame) -> None:
    """Draw postures, and at configurations the boundaries of thick links and tools."""
    postures, at = table[table["element"] == POSTURE], table[table["element"] == CONFIGURATION]
    last = postures["instant"].max()
    for (robot, instant), rows in groups(postures, ["robot", "instant"]):
        links = rows[rows["link"] < TOOL]
        if instant in (0.0, last):
            style.draw_arm(axes, int(robot), links, dashed=instant == 0.0)
        else:
            x, y = ([*links[name], links[f"{name}_end"].iloc[-1]] for name in "xy")
            axes.plot(x, y, color=style.arm_colour(int(robot)), linewidth=0.9, alpha=0.3, zorder=2)
        marks.base(axes, links["x"].iloc[0], links["y"].iloc[0], 6, zorder=2)
    for row in records(at[at["radius"] > 0.0]):
        look: dict[str, Any] = {"linewidth": 0.6, "alpha": 0.6, "zorder": 2}
        look["color"] = style.arm_colour(row.robot)
        if row.link == TOOL:
            axes.add_patch(Circle((row.x, row.y), row.radius, fill=False, **look))
            continue
        along = np.array([row.x_end - row.x, row.y_end - row.y])
        x, y = row.radius * np.array([-along[1], along[0]]) / float(np.hypot(*along))
        for side in (-1.0, 1.0):
            ends = np.array([[row.x, row.x_end], [row.y, row.y_end]]) + side * np.array([[x], [y]])
            axes.plot(*ends, **look)


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
