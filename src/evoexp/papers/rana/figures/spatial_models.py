"""Drawings of arms in space: bodies and spheres, named points, stages of a motion, its paths."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.papers.rana import motions
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, records, rounded, style, surfaces
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults

STAGES = 5  # panels that a motion is cut into; the sixth holds all of it
VIEW = (24.0, -35.0)  # [deg] elevation, azimuth
POINT_NAMES = ("p", "q")  # of the arms, as in the paper's Fig. 9
BEST = "best replicate"


def links_table(condition: ConditionResults, q: FloatArray) -> pd.DataFrame:
    """Return all links at every instant of a motion."""
    table = motion_geometry.links_table(motions.problem(condition).assembly, q)
    return rounded(table).assign(length_unit=condition.length_unit)


def arm_table(condition: ConditionResults) -> pd.DataFrame:
    """Return links and spheres of the first arm at its start."""
    problem = motions.problem(condition)
    links = links_table(condition, problem.start[:, None])
    spheres = problem.sphere_centres(problem.start)[0]
    first = links[links["arm"] == 0].assign(element="link", radius=np.nan)
    rows = [(0, 0, -1, *centre, *centre) for centre in spheres]
    added = rounded(pd.DataFrame(rows, columns=["instant", *motion_geometry.LINK]))
    added = added.assign(
        element="sphere", radius=problem.sphere_radius, length_unit=first["length_unit"].iloc[0]
    )
    return pd.concat([first, added], ignore_index=True)


def draw_arm(table: pd.DataFrame) -> Figure:
    """Draw the arm as touching spheres and as line segments with the paper's point names."""
    figure = style.figure(3.9)
    links, spheres = table[table["element"] == "link"], table[table["element"] == "sphere"]
    for k, title in enumerate(
        ("a  touching spheres of the collision model", "b  line segments: the links themselves")
    ):
        axes = _space(figure, (1, 2, k + 1), table)
        axes.set_title(title)
        _arm(axes, 0, links, width=1.2 if k == 0 else 2.6)
        if k == 0:
            around, up = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 17), np.linspace(0.0, np.pi, 9))
            ball = np.cos(around) * np.sin(up), np.sin(around) * np.sin(up), np.cos(up)
            for row in records(spheres):
                grid = (getattr(row, k) + row.radius * x for k, x in zip("xyz", ball, strict=True))
                look: dict[str, Any] = {"color": style.arm_colour(0), "alpha": 0.25}
                axes.plot_surface(*grid, linewidth=0, shade=True, **look)
        else:
            _name_points(axes, 0, links)
    return figure


def two_arms_table(condition: ConditionResults) -> pd.DataFrame:
    """Return links at start (instant 0) and goal (1), and each arm's reach from its shoulder on."""
    problem = motions.problem(condition)
    table = links_table(condition, np.column_stack([problem.start, problem.goal]))
    lengths = np.sqrt(sum((table[f"{axis}_end"] - table[axis]) ** 2 for axis in "xyz"))
    links = problem.assembly.links
    arms = [link.arm for link in links]
    first = np.array([arms.index(arm) for arm in range(problem.assembly.num_arms)])  # links of arms
    moving = np.array([link.joint > 0 for link in links])
    own = moving[table["link"].to_numpy() + first[table["arm"].to_numpy()]]
    counted = table.assign(reach=np.where(own, lengths, 0.0))
    reach = counted[counted["instant"] == 0].groupby("arm")["reach"].sum()
    return table.assign(reach=table["arm"].map(reach).round(9))


def draw_two_arms(table: pd.DataFrame) -> Figure:
    """Draw the arms at start and goal, and from above the part of the workspace they share."""
    figure = style.figure(4.3)
    unit = table["length_unit"].iloc[0]
    axes = _space(figure, (1, 2, 1), table)
    axes.set_title("a  start (full) and goal (dashed)")
    above = figure.add_subplot(1, 2, 2)
    above.set_title("b  from above, with each arm's reach")
    for (arm, instant), rows in groups(table, ["arm", "instant"]):
        _arm(axes, arm, rows, dashed=instant == 1)
        x, y = [rows["x"].iloc[0], *rows["x_end"]], [rows["y"].iloc[0], *rows["y_end"]]
        colour, dashes = style.arm_colour(arm), (0, (2, 1)) if instant else "-"
        above.plot(x, y, color=colour, linestyle=dashes, marker="o", ms=3)
        if instant == 0:
            _name_points(axes, arm, rows)
            marks.base(above, x[0], y[0], 7)
            turn = np.linspace(0.0, 360.0, 121)
            circle = np.array([sincos(DEGREE * angle) for angle in turn]) * rows["reach"].iloc[0]
            reach: dict[str, Any] = {"color": colour, "alpha": 0.12, "linewidth": 0}
            above.fill(x[0] + circle[:, 1], y[0] + circle[:, 0], **reach)
    style.operational_axes(above, unit)
    _legend(figure, table, style.key("goal", color=style.NEUTRAL, linestyle=(0, (2, 1))))
    return figure


def snapshots_table(condition: ConditionResults) -> pd.DataFrame:
    """Return all links at every instant of the best replicate's motion, stage by stage."""
    links = links_table(condition, motions.best_motion(condition))
    return motion_geometry.in_stages(links, STAGES)


def draw_snapshots(table: pd.DataFrame) -> Figure:
    """Draw the motion stage by stage, older instants fainter, and all of it in the last panel."""
    stages = sorted(table["stage"].unique())
    lines = -(-len(stages) // 3)
    figure = style.figure(2.1 * lines + 0.4)
    for k, stage in enumerate(stages):
        axes = _space(figure, (lines, 3, k + 1), table, zoom=1.08, label_pad=-7.0)
        rows = table[table["stage"] == stage]
        first, last = rows["first"].iloc[0], rows["last"].iloc[0]
        axes.set_title(motions.stage_title(rows, whole=k == len(stages) - 1))
        for (arm, instant), links in groups(rows, ["arm", "instant"]):
            newest = instant == last
            shade = 1.0 if newest else 0.15 + 0.45 * (instant - first) / max(1, last - first)
            _arm(axes, arm, links, width=2.4 if newest else 0.9, alpha=shade, joints=newest)
        for arm, links in groups(rows[rows["link"] == rows["link"].max()], "arm"):
            tips = (links[f"{name}_end"] for name in "xyz")
            axes.plot(*tips, ":", color=style.arm_colour(arm), linewidth=1.0)
    _legend(figure, table, style.key("trace of the tip", color=style.NEUTRAL, lw=1.0, ls=":"))
    return figure


def _space(
    figure: Figure,
    place: tuple[int, int, int],
    table: pd.DataFrame,
    zoom: float = 1.0,
    label_pad: float = -3.0,
) -> Any:
    """Return axes in space with equal scales that hold all links of a table."""
    values = [table[[name, f"{name}_end"]].to_numpy() for name in "xyz"]
    low, high = np.array([v.min() for v in values]), np.array([v.max() for v in values])
    pad = 0.05 + 0.5 * np.maximum(0.0, 0.5 - (high - low))
    pads = label_pad, label_pad, label_pad - 4.0  # else z's meets the panel beside it
    unit, ticks = table["length_unit"].iloc[0], (2, 3)
    return surfaces.space(
        figure, place, low, high, pad, unit, view=VIEW, zoom=zoom, label_pads=pads, ticks=ticks
    )


def _arm(
    axes: Any,
    arm: int,
    rows: pd.DataFrame,
    *,
    width: float = 2.4,
    alpha: float = 1.0,
    dashed: bool = False,
    joints: bool = True,
) -> None:
    """Draw an arm's links, given by rows in order."""
    points = [[rows[name].iloc[0], *rows[f"{name}_end"]] for name in "xyz"]
    kind: Any = (0, (2, 1)) if dashed else "-"
    axes.plot(*points, linestyle=kind, color=style.arm_colour(arm), linewidth=width, alpha=alpha)
    if joints:
        edge: dict[str, Any] = {"color": "white", "markeredgecolor": style.arm_colour(arm)}
        axes.plot(*points, "o", markersize=3.2, alpha=alpha, **edge)
        axes.plot(*(values[:1] for values in points), "s", color=style.NEUTRAL, markersize=5)


def _name_points(axes: Any, arm: int, rows: pd.DataFrame) -> None:
    name = POINT_NAMES[arm] if arm < len(POINT_NAMES) else f"r{arm}"
    points = ([rows[axis].iloc[0], *rows[f"{axis}_end"]] for axis in "xyz")
    for k, (x, y, z) in enumerate(zip(*points, strict=True)):
        text = f"{name}{str(k).translate(style.SUBSCRIPTS)}"
        look = {"color": style.arm_colour(arm), "fontsize": 8.5, "zorder": 10, "ha": "center"}
        if k == 0:  # beside the square of the base
            axes.text(x, y, z, f"{text}    ", **look | {"ha": "right", "va": "center"})
        else:
            axes.text(x, y, z + 0.11, text, path_effects=marks.HALO, **look)


def _legend(figure: Figure, table: pd.DataFrame, more: Line2D) -> None:
    """Put a legend of the arms and of a further entry below the figure."""
    arms = style.arm_keys(sorted(table["arm"].unique()), linewidth=2.4)
    style.keys_below(figure, [*arms, more])


def paths_table(condition: ConditionResults) -> pd.DataFrame:
    """Return the paths of all replicates and the straight line in both spaces."""
    table = rounded(motions.paths_table(condition, _path, BEST))
    return table.assign(length_unit=condition.length_unit)


def draw_configuration_space(table: pd.DataFrame) -> Figure:
    """Draw the paths through the first three joint angles of every arm."""
    arms = sorted(table["arm"].unique())
    figure = style.figure(4.0)
    for k, arm in enumerate(arms):
        axes: Any = figure.add_subplot(1, len(arms), k + 1, projection="3d")
        rows = table[table["arm"] == arm]
        columns = [f"joint_{j}_deg" for j in (1, 2, 3)]
        motions.draw_paths(axes, rows, columns, BEST, style.arm_colour(arm))
        labels = [f"{style.joint_symbol(arm, j)} [deg]" for j in range(3)]
        _label(axes, labels, f"arm {arm + 1}")
    style.keys_below(figure, motions.path_keys(table))
    return figure


def draw_operational_space(table: pd.DataFrame) -> Figure:
    """Draw the paths of the tips of all arms."""
    unit = table["length_unit"].iloc[0]
    figure = style.figure(4.2, 5.6)
    axes: Any = figure.add_subplot(projection="3d")
    for arm, rows in groups(table, "arm"):
        motions.draw_paths(axes, rows, ["x", "y", "z"], BEST, style.arm_colour(arm))
    _label(axes, [f"{name} [{unit}]" for name in "xyz"], "")
    spans = [float(np.ptp(table[name])) for name in "xyz"]
    axes.set_box_aspect([max(span, 0.15 * max(spans)) for span in spans], zoom=1.1)
    arms = style.arm_keys(sorted(table["arm"].unique()), lw=2.2)
    style.keys_below(figure, [*arms, *motions.path_keys(table)], 4)
    return figure


def _path(condition: ConditionResults, solution: FloatArray) -> pd.DataFrame:
    """Return one solution's joint angles and tips."""
    problem = motions.problem(condition)
    q = motion_geometry.configurations(condition.prepared, solution)
    places = motion_geometry.joint_positions(problem.assembly, q)
    tips = {arm: end for arm, _, _, end in places}  # the last link's end stays
    frames = []
    for arm, (first, stop) in enumerate(problem.arm_slices):
        columns = {
            "arm": arm,
            "instant": np.arange(q.shape[1]),
            **dict(zip("xyz", tips[arm].T, strict=True)),
            **{f"joint_{j + 1}_deg": q[first + j] for j in range(stop - first)},
        }
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def _label(axes: Any, labels: list[str], title: str) -> None:
    axes.set_title(title)
    axes.tick_params(labelsize=6, pad=-1)
    for axis, label in zip((axes.xaxis, axes.yaxis, axes.zaxis), labels, strict=True):
        axis.set_label_text(label)
        axis.labelpad = -2
        axis.set_major_locator(style.few_ticks())
    axes.view_init(elev=24.0, azim=-50.0)
    axes.set_box_aspect(None, zoom=0.82)
