"""Arms as chains of links, their motions as trails of postures, and solids, in plane or space.

Links are rows with x, y, x_end, y_end (in space z, z_end, too), in order from the base on. `names`
are the axes that are drawn: "xy" or "xyz".
"""

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import coal
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from evoexp.playback.recording import outline
from evoexp.records import FloatArray
from evoexp.report.figures import groups, motion_scenes, records, style
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults
from evoexp.scenarios.obstacles import obstacle_table

DASHES: Any = (0, (2, 1))
WAY: dict[str, Any] = {"linestyle": ":", "linewidth": 0.9}
WIDE, THIN = 2.4, 0.9  # [pt] of the last posture, and of those before
SIZES = ["size_1", "size_2", "size_3"]  # box: half its edges; else radius and half the length
TURN = [f"r{row}{column}" for row in range(1, 4) for column in range(1, 4)]
COLUMNS = ["shape", "x", "y", "z", *TURN, *SIZES]  # of solids


def draw_chain(
    axes: Any,
    links: pd.DataFrame,
    colour: str,
    names: str = "xy",
    *,
    joints: bool = True,
    **look: Any,
) -> None:
    """Draw one posture, with its joints."""
    points = [[links[name].iloc[0], *links[f"{name}_end"]] for name in names]
    look = {"linewidth": WIDE, "zorder": 4} | look
    axes.plot(*points, color=colour, **look)
    if joints:
        dots: dict[str, Any] = {"color": "white", "markeredgecolor": colour, "markersize": 3.6}
        axes.plot(*points, "o", alpha=look.get("alpha"), zorder=look["zorder"] + 1, **dots)


def draw_trail(
    axes: Any, links: pd.DataFrame, colour: str, names: str = "xy", label: str | None = None
) -> None:
    """Draw postures of an arm: the first dashed, later ones stronger, the last one wide; its tip.

    Links have an instant each.
    """
    first, last = links["instant"].min(), links["instant"].max()
    for instant, posture in groups(links, "instant"):
        if instant == last:
            draw_chain(axes, posture, colour, names, label=label)
        elif instant == first:
            look: dict[str, Any] = {"linewidth": 1.4, "linestyle": DASHES, "zorder": 3}
            draw_chain(axes, posture, colour, names, joints=False, **look)
        else:
            look = {"linewidth": THIN, "alpha": 0.15 + 0.45 * (instant - first) / (last - first)}
            draw_chain(axes, posture, colour, names, joints=False, **look | {"zorder": 2})
    tips = links.groupby("instant").last()
    axes.plot(*(tips[f"{name}_end"] for name in names), color=colour, zorder=3, **WAY)


def draw_base(axes: Any, links: pd.DataFrame, names: str = "xy") -> None:
    """Draw the square of an arm's base."""
    square: dict[str, Any] = {"color": style.NEUTRAL, "markersize": 6, "zorder": 3}
    axes.plot(*(links[name].iloc[:1] for name in names), "s", **square)


def obstacle_edges(condition: ConditionResults, reach: float = 1.0) -> list[tuple[float, ...]]:
    """Return the edges of the outlines of a scene's obstacles: number, x, y, x_end, y_end."""
    table = obstacle_table(condition.scenario.obstacles)
    outlines = motion_geometry.obstacle_outlines(table, reach)
    return [(k, *a, *b) for k, outline in enumerate(outlines) for a, b in pairwise(outline)]


def trail_keys(arms: Iterable[int], name: str = "arm") -> list[Line2D]:
    """Return the entries of a legend for trails of arms, counted from 0."""
    grey = style.NEUTRAL
    return [
        *arm_keys(arms, name),
        style.key("first posture", color=grey, linewidth=1.4, linestyle=DASHES),
        style.key("last posture", color=grey, linewidth=WIDE, marker="o", mfc="white", ms=4),
        style.key("path of the tip", color=grey, **WAY),
    ]


def arm_keys(arms: Iterable[int], name: str = "arm") -> list[Line2D]:
    """Return entries of a legend for arms, counted from 0: "arm 1" in the arm's colour, …."""
    colours = {f"{name} {int(k) + 1}": style.arm_colour(int(k)) for k in sorted(arms)}
    return [style.key(text, color=colour, linewidth=WIDE) for text, colour in colours.items()]


def room(table: pd.DataFrame, share: float = 0.08) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest place of links in the plane, (2,), with room around."""
    ends = np.array([table[[name, f"{name}_end"]] for name in "xy"], dtype=np.float64)
    low, high = np.nanmin(ends, axis=(1, 2)), np.nanmax(ends, axis=(1, 2))
    pad = share * float((high - low).max())
    return low - pad, high + pad


def planes(table: pd.DataFrame, count: int, per_line: int = 2) -> tuple[Figure, list[Axes]]:
    """Return panels in the plane that all hold the links of a table, in one scale."""
    (left, low), (right, high) = room(table)
    width = style.WIDTH / min(count, per_line) - 0.5
    height = min(width * (high - low) / (right - left), 4.4) + 0.6
    figure, panels = style.panels(height, count, per_line, 0.5)
    for axes in panels:
        style.operational_axes(axes, table["length_unit"].iloc[0])
        axes.set(xlim=(left, right), ylim=(low, high))
        axes.label_outer()
    return figure, panels


def space_of_links(figure: Figure, place: tuple[int, int, int], links: pd.DataFrame) -> Any:
    """Return axes in space that hold some links."""
    ends = links[["x", "y", "z", "x_end", "y_end", "z_end"]].to_numpy().reshape(-1, 3)
    return space(figure, place, ends, links["length_unit"].iloc[0])


def space(
    figure: Figure, place: tuple[Any, ...], points: FloatArray, unit: str, zoom: float = 0.9
) -> Any:
    """Return axes in space, with equal scales, that hold some points (points, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    widest = float((high - low).max())
    pad = 0.04 * widest + 0.5 * np.maximum(0.0, 0.35 * widest - (high - low))
    look: dict[str, Any] = {"view": (22.0, -55.0), "ticks": (2, 3)}
    return motion_scenes.space(figure, place, low, high, pad, unit, zoom=zoom, **look)


def solid(shape: Any, placement: Any) -> dict[str, Any]:
    """Return the `COLUMNS` of a coal shape and its placement (`pin.SE3`).

    A mesh, or another shape without a row of its own, is the box around it. A half-space has no
    row: empty.
    """
    where, turn = np.array(placement.translation), np.array(placement.rotation)
    if isinstance(shape, coal.Halfspace | coal.Plane):
        return {}
    if isinstance(shape, coal.Sphere | coal.Capsule | coal.Cylinder | coal.Box):
        drawn, _ = outline(shape)
        name, size = drawn.kind, np.array([*drawn.size, 0.0, 0.0][:3])
        size *= 0.5 if name == "box" else (1.0, 0.5, 0.0)
    else:
        shape.computeLocalAABB()
        box = shape.aabb_local
        name, size, where = "box", 0.5 * (box.max_ - box.min_), where + turn @ box.center()
    return dict(zip(COLUMNS, (name, *where, *turn.ravel(), *size), strict=True))


def triangles(row: Any) -> FloatArray:
    """Return the surface of a row of `COLUMNS` in space, (triangles, 3, 3)."""
    turn, size, place = (
        np.array([getattr(row, name) for name in names], dtype=np.float64)
        for names in (TURN, SIZES, "xyz")
    )
    whole = 2.0 * size if row.shape == "box" else size * (1.0, 2.0, 0.0)  # halves in the table
    return motion_scenes.triangles_of(row.shape, whole, None) @ turn.reshape(3, 3).T + place


def draw_solid(axes: Any, row: Any, colour: str, alpha: float) -> None:
    """Draw a row of `COLUMNS` in axes in space, or as seen along z in plane ones."""
    faces = triangles(row)
    if not hasattr(axes, "zaxis"):
        seen = motion_scenes.outline_from_above(faces)
        axes.fill(*seen.T, facecolor=colour, edgecolor=colour, alpha=alpha, linewidth=0.5)
        return
    shades = motion_scenes.shaded(faces, colour, alpha)
    surface = Poly3DCollection(faces, facecolors=shades, linewidth=0, zorder=1)
    surface.set_rasterized(True)  # hundreds of triangles
    axes.add_collection3d(surface)


def corners(table: pd.DataFrame) -> FloatArray:
    """Return the corners (points, 3) of the surfaces of all solids of a table."""
    return np.vstack([np.empty((0, 3)), *(triangles(row).reshape(-1, 3) for row in records(table))])
