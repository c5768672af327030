"""Bodies and obstacles in space: a row of a table for each, and their surfaces drawn."""

from typing import Any

import coal
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from scipy.spatial import ConvexHull

from evoexp.records import FloatArray

BALL, BRICK, ROD, DRUM = "sphere", "box", "capsule", "cylinder"
SIZES = ["size_1", "size_2", "size_3"]  # box: half its edges; else radius and half the length
TURN = [f"r{row}{column}" for row in range(1, 4) for column in range(1, 4)]
COLUMNS = ["shape", "x", "y", "z", *TURN, *SIZES]
AROUND, ALONG = 12, 4  # pieces of a round surface, and of each of its ends


def solid(shape: Any, placement: Any) -> tuple[Any, ...] | None:
    """Return one row of `COLUMNS` for a coal shape and its placement (`pin.SE3`).

    A mesh, or another shape without a row of its own, is the box around it. A half-space has no
    row: None.
    """
    where = np.asarray(placement.translation, dtype=np.float64)
    turn = np.asarray(placement.rotation, dtype=np.float64)
    if isinstance(shape, coal.Halfspace | coal.Plane):
        return None
    if isinstance(shape, coal.Sphere):
        name, size = BALL, (shape.radius, 0.0, 0.0)
    elif isinstance(shape, coal.Capsule | coal.Cylinder):
        name = ROD if isinstance(shape, coal.Capsule) else DRUM
        size = (shape.radius, shape.halfLength, 0.0)
    elif isinstance(shape, coal.Box):
        name, size = BRICK, tuple(shape.halfSide)
    else:
        shape.computeLocalAABB()
        name, size = BRICK, tuple(0.5 * (shape.aabb_local.max_ - shape.aabb_local.min_))
        where = where + turn @ shape.aabb_local.center()
    return (name, *where, *turn.ravel(), *size)


def _read(row: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rotation (3, 3), size (3,) and place (3,) of a row of `COLUMNS`."""
    turn, size, place = (
        np.array([getattr(row, name) for name in names], dtype=np.float64)
        for names in (TURN, SIZES, "xyz")
    )
    return turn.reshape(3, 3), size, place


def draw_solid(axes: Any, row: Any, colour: str, alpha: float) -> None:
    """Draw a row of `COLUMNS`."""
    turn, size, place = _read(row)
    if row.shape == BRICK:
        faces = [corners * size @ turn.T + place for corners in _FACES]
        axes.add_collection3d(
            Poly3DCollection(
                faces, zorder=1, facecolor=colour, edgecolor=colour, alpha=alpha, linewidth=0.5
            )
        )
        return
    surface = np.einsum("ij,jkl->ikl", turn, _grid(row.shape, size)) + place[:, None, None]
    axes.plot_surface(
        *surface, color=colour, alpha=alpha, linewidth=0, shade=True, antialiased=False
    )


def draw_outline(axes: Any, row: Any, colour: str, alpha: float) -> None:
    """Draw a row of `COLUMNS` as seen along z, in plane axes."""
    turn, size, place = _read(row)
    brick = row.shape == BRICK
    points = np.vstack(_FACES) * size if brick else _grid(row.shape, size).reshape(3, -1).T
    seen = (points @ turn.T)[:, :2] + place[:2]
    axes.fill(
        *seen[ConvexHull(seen).vertices].T,
        facecolor=colour,
        edgecolor=colour,
        alpha=alpha,
        linewidth=0.5,
    )


def corners(table: pd.DataFrame) -> FloatArray:
    """Return points (points, 3) that reach as far along x, y and z as all solids of a table."""
    found = [np.empty((0, 3))]
    for row in table.itertuples(index=False):
        turn, size, place = _read(row)
        reach = size[0] + np.abs(turn[:, 2]) * size[1]
        if row.shape == BRICK:
            reach = np.abs(turn) @ size
        found += [place[None] - reach, place[None] + reach]
    return np.vstack(found)


def space(
    figure: Figure, place: Any, points: FloatArray, unit: str, view: tuple[float, float]
) -> Any:
    """Return axes in space, with equal scales, that hold some points.

    Args:
        figure: The figure that they are put into.
        place: As `add_subplot` takes it.
        points: (points, 3).
        unit: Of lengths.
        view: Elevation and azimuth [deg].
    """
    axes: Any = figure.add_subplot(place, projection="3d")
    low, high = points.min(axis=0), points.max(axis=0)
    widest = float((high - low).max())
    pad = 0.04 * widest + 0.5 * np.maximum(0.0, 0.35 * widest - (high - low))
    for name, least, greatest in zip("xyz", low - pad, high + pad, strict=True):
        getattr(axes, f"set_{name}lim")(least, greatest)
        getattr(axes, f"set_{name}label")(f"{name} [{unit}]", labelpad=-7, fontsize=7)
    spans = high - low + 2.0 * pad
    axes.set_box_aspect(spans, zoom=0.92)
    axes.patch.set_visible(False)
    axes.tick_params(labelsize=6, pad=-2)
    for axis, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), spans, strict=True):
        axis.set_major_locator(MaxNLocator(nbins=2 if span < 0.6 * spans.max() else 4))
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
    axes.view_init(elev=view[0], azim=view[1])
    return axes


def _grid(shape: str, size: FloatArray) -> FloatArray:
    """Return the surface of a round solid, (3, along, around)."""
    radius, height = _profile(shape, size[0], size[1])
    turned = np.linspace(0.0, 2.0 * np.pi, AROUND + 1)
    circle = np.cos(turned), np.sin(turned), np.ones_like(turned)
    profiles = zip((radius, radius, height), circle, strict=True)
    return np.array([np.outer(profile, around) for profile, around in profiles])


def _profile(shape: str, radius: float, half: float) -> tuple[FloatArray, FloatArray]:
    """Return radii and heights along the axis of a round solid."""
    if shape == DRUM:
        return np.array([0.0, radius, radius, 0.0]), np.array([-half, -half, half, half])
    rise = np.linspace(0.0, 0.5 * np.pi, ALONG)
    end = radius * np.cos(rise)
    height = half + radius * np.sin(rise)
    return np.concatenate([end[::-1], end]), np.concatenate([-height[::-1], height])


_SQUARE = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
_FACES = [
    np.array([np.insert(np.array(pair, dtype=np.float64), axis, side) for pair in _SQUARE])
    for axis in range(3)
    for side in (-1.0, 1.0)
]
