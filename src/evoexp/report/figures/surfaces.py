"""Surfaces of drawn bodies as triangles, shaded, for figures in space and in the plane."""

import itertools
from typing import Any

import numpy as np
import pinocchio as pin
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from evoexp.numeric.convex_hull import hull_of
from evoexp.playback.recording import Outline
from evoexp.records import FloatArray

AROUND, ALONG = 14, 4  # pieces of a round surface around its axis, and of each of its ends
MOST_CORNERS = 150  # of a mesh, which is drawn by the hull of the corners farthest out
LIGHT = np.array([-0.35, -0.55, 0.76])  # direction to the light, length 1
NARROW = 0.6  # [-] of the longest side of a box, below which a side has few ticks
PALE = (0.97, 0.97, 0.97, 1.0)  # behind shaded bodies
DARKEST = 0.45  # [-] of a colour's brightness, where a surface is turned from the light


def corners_of(outline: Outline) -> FloatArray | None:
    """Return the corners (corners, 3) by which a mesh is drawn; None for another body.

    Of a mesh of more than `MOST_CORNERS` those are taken that lie farthest out in as many
    directions, evenly spread.
    """
    if outline.points is None:
        return None
    points = np.unique(outline.points, axis=0)
    if len(points) <= MOST_CORNERS:
        return points
    k = np.arange(MOST_CORNERS) + 0.5
    height, turn = 1.0 - 2.0 * k / MOST_CORNERS, np.pi * (1.0 + np.sqrt(5.0)) * k
    wide = np.sqrt(1.0 - height**2)
    directions = np.column_stack([wide * np.cos(turn), wide * np.sin(turn), height])
    return np.asarray(points[np.unique((points @ directions.T).argmax(axis=0))])


def triangles_of(kind: str, size: FloatArray, corners: FloatArray | None) -> FloatArray:
    """Return the triangles of a body of some size (3,) in its own frame, (triangles, 3, 3)."""
    if kind == "mesh" and corners is not None:
        return _hull(corners)
    if kind == "box":
        return _hull(0.5 * size * np.array(list(itertools.product((-1.0, 1.0), repeat=3))))
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    rise = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2 * ALONG + 1)[:, None]
    around = np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise) + 0.0 * turn
    ball = np.stack(around, axis=-1).reshape(-1, 3)
    if kind in ("sphere", "ellipsoid"):
        return _hull(ball * (size if kind == "ellipsoid" else size[0]))
    up = np.array([0.0, 0.0, 0.5 * float(size[1])])
    if kind == "capsule":
        return _hull(np.vstack([size[0] * ball - up, size[0] * ball + up]))
    circle = size[0] * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(AROUND)])
    return _hull(np.vstack([circle - up, circle * (kind == "cylinder") + up]))


def capsule(start: FloatArray, end: FloatArray) -> tuple[pin.SE3, float]:
    """Return pose and length of a capsule between two points (3,); of a sphere it is 0."""
    along = np.asarray(end) - np.asarray(start)
    length = float(np.sqrt((along**2).sum()))
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along) if length else None
    middle = 0.5 * (np.asarray(start) + end)
    return pin.SE3(np.eye(3) if turn is None else turn.matrix(), middle), length


def placed(triangles: FloatArray, pose: FloatArray) -> FloatArray:
    """Return triangles moved by a pose: position, quaternion x, y, z, w, (7,)."""
    return np.asarray(
        Rotation.from_quat(pose[3:]).apply(triangles.reshape(-1, 3)) + pose[:3]
    ).reshape(triangles.shape)


def shaded(triangles: FloatArray, colour: Any, alpha: float) -> FloatArray:
    """Return the colours of triangles as the light falls on them, (triangles, 4)."""
    a, b, c = triangles.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    lengths = np.sqrt((normals**2).sum(axis=1))
    facing = (normals @ LIGHT) / np.where(lengths > 0.0, lengths, 1.0)
    brightness = DARKEST + (1.0 - DARKEST) * 0.5 * (1.0 + facing)
    rgb = np.array(to_rgb(colour))[None] * brightness[:, None]
    return np.column_stack([np.clip(rgb, 0.0, 1.0), np.full(len(rgb), alpha)])


def outline_from_above(triangles: FloatArray) -> FloatArray:
    """Return the closed outline (points, 2) of a convex body as seen along z."""
    points = triangles.reshape(-1, 3)[:, :2]
    try:
        around = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):  # it is seen as a line
        spread = np.ptp(points, axis=0)
        order = np.argsort(points[:, int(np.argmax(spread))], kind="stable")
        around = points[order[[0, -1]]]
    return np.vstack([around, around[:1]])


def _hull(points: FloatArray) -> FloatArray:
    """Return the hull's triangles, each counter-clockwise as seen from outside; none if flat."""
    hull = hull_of(points)
    if hull is None:
        return np.empty((0, 3, 3))
    corners, triangles = hull
    return np.asarray(corners[triangles])


def space(
    figure: Figure,
    place: tuple[Any, ...],
    low: FloatArray,
    high: FloatArray,
    pad: FloatArray,
    unit: str,
    *,
    view: tuple[float, float],
    zoom: float,
    label_pads: tuple[float, float, float],
    ticks: tuple[int, int],
) -> Any:
    """Return axes in space with equal scales that hold a box (3,) and room beyond it (3,).

    The view is elevation and azimuth [deg]; labels stand so far from the numbers along x, y and z
    [pt]; ticks are those of a narrow side and of a wide one, at most.
    """
    axes: Any = figure.add_subplot(*place, projection="3d")
    sides = high - low + 2.0 * pad
    for name, least, greatest, label_pad in zip(
        "xyz", low - pad, high + pad, label_pads, strict=True
    ):
        getattr(axes, f"set_{name}lim")(least, greatest)
        getattr(axes, f"set_{name}label")(f"{name} [{unit}]", labelpad=label_pad, fontsize=7)
    axes.set_box_aspect(sides, zoom=zoom)
    axes.patch.set_visible(False)  # else it hides the labels of the panel beside it
    axes.tick_params(labelsize=6, pad=-2)
    for axis, is_narrow in zip(
        (axes.xaxis, axes.yaxis, axes.zaxis), sides < NARROW * sides.max(), strict=True
    ):
        axis.set_major_locator(MaxNLocator(nbins=ticks[0] if is_narrow else ticks[1]))
        axis.set_pane_color(PALE)
    axes.view_init(elev=view[0], azim=view[1])
    return axes
