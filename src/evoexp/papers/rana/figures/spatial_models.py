"""Drawings of arms in space: bodies and spheres, named points, stages of a motion, its paths."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from evoexp.papers import trails
from evoexp.papers.rana import measures
from evoexp.papers.rana.figures.planar_motion import STAGES, tables_of_paths
from evoexp.planners.via_point_ga.strings import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, rounded, style, surfaces
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults

POINT_NAMES = ("p", "q")  # of the arms, as in the paper's Fig. 9


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
    ball = surfaces.triangles_of("sphere", size, None)
    for centre in spheres[["x", "y", "z"]].to_numpy():
        shades = surfaces.shaded(ball, colour, 0.25)
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
        colour, look = style.arm_colour(arm), trails.DASHED if instant else {}
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


def snapshots_table(condition: ConditionResults) -> pd.DataFrame:
    """Return all links at every instant of the best replicate's motion, stage by stage."""
    links = links_table(condition, measures.best_motion(condition))
    return motion_geometry.in_stages(links, STAGES)


def _name_points(axes: Any, arm: int, links: pd.DataFrame) -> None:
    """Write the names of the arm's points: p0, p1, … of the first arm."""
    name = POINT_NAMES[arm] if arm < len(POINT_NAMES) else f"r{arm}"
    points = ([links[axis].iloc[0], *links[f"{axis}_end"]] for axis in "xyz")
    look: dict[str, Any] = {"color": style.arm_colour(arm), "fontsize": 8.5, "zorder": 10}
    for k, (x, y, z) in enumerate(zip(*points, strict=True)):
        text = f"{name}{str(k).translate(style.SUBSCRIPTS)}"
        axes.text(x, y, z + 0.11, text, ha="center", path_effects=marks.HALO, **look)


def paths_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the paths of all replicates and the straight line in both spaces."""
    table = rounded(tables_of_paths(condition, _path, "best replicate"))
    return table.assign(length_unit=condition.length_unit)


def _path(condition: ConditionResults, solution: FloatArray) -> pd.DataFrame:
    """Return one solution's joint angles and tips."""
    problem = condition.problem(Problem)
    q = motion_geometry.configurations(condition.prepared, solution)
    places = motion_geometry.joint_positions(problem.assembly, q)
    tips = {arm: end for arm, _, _, end in places}  # the last link's end stays
    frames = []
    for arm, (first, stop) in enumerate(problem.arm_slices):
        columns: dict[str, Any] = {"arm": arm, "instant": np.arange(q.shape[1])}
        columns |= dict(zip("xyz", tips[arm].T, strict=True))
        columns |= {f"joint_{j + 1}_deg": q[first + j] for j in range(stop - first)}
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)
