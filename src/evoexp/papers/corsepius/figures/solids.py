"""Solids in space, and robots beside the shapes that cover them (Corsépius 2001, Figs. 3 and 4)."""

from collections.abc import Callable, Sequence
from typing import Any

import coal
import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from scipy.spatial import ConvexHull

from evoexp.papers import marks
from evoexp.papers.corsepius import measures
from evoexp.records import FloatArray
from evoexp.report.kit import ConditionResults, groups, records, rounded, style

BALL, BRICK, ROD, DRUM = "sphere", "box", "capsule", "cylinder"
SIZES = ["size_1", "size_2", "size_3"]  # box: half its edges; else radius and half the length
TURN = [f"r{row}{column}" for row in range(1, 4) for column in range(1, 4)]
COLUMNS = ["shape", "x", "y", "z", *TURN, *SIZES]
BODY, COVER = "body", "cover"
MODEL_VIEW = (18.0, -55.0)  # [deg]
KINDS = {BALL: "spheres", ROD: "capsules"}
AROUND, ALONG = 12, 4  # pieces of a round surface, and of each of its ends


# shapes that have a row of their own: its name, and the function that gives its sizes
SOLIDS: dict[type, tuple[str, Callable[[Any], tuple[float, ...]]]] = {
    coal.Sphere: (BALL, lambda shape: (shape.radius, 0.0, 0.0)),
    coal.Capsule: (ROD, lambda shape: (shape.radius, shape.halfLength, 0.0)),
    coal.Cylinder: (DRUM, lambda shape: (shape.radius, shape.halfLength, 0.0)),
    coal.Box: (BRICK, lambda shape: tuple(shape.halfSide)),
}


def solid(shape: Any, placement: Any) -> dict[str, Any]:
    """Return the `COLUMNS` of a coal shape and its placement (`pin.SE3`).

    A mesh, or another shape without a row of its own, is the box around it. A half-space has no
    row: empty.
    """
    where, turn = np.array(placement.translation), np.array(placement.rotation)
    if isinstance(shape, coal.Halfspace | coal.Plane):
        return {}
    if type(shape) in SOLIDS:
        name, size_of = SOLIDS[type(shape)]
        size = size_of(shape)
    else:
        shape.computeLocalAABB()
        box = shape.aabb_local
        name, size, where = BRICK, 0.5 * (box.max_ - box.min_), where + turn @ box.center()
    return dict(zip(COLUMNS, (name, *where, *turn.ravel(), *size), strict=True))


def _read(row: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rotation (3, 3), size (3,) and place (3,) of a row of `COLUMNS`."""
    turn, size, place = (
        np.array([getattr(row, name) for name in names], dtype=np.float64)
        for names in (TURN, SIZES, "xyz")
    )
    return turn.reshape(3, 3), size, place


def draw_solid(axes: Any, row: Any, colour: str, alpha: float) -> None:
    """Draw a row of `COLUMNS` in axes in space."""
    turn, size, place = _read(row)
    if row.shape == BRICK:
        faces = [corners * size @ turn.T + place for corners in _FACES]
        look = {"facecolor": colour, "edgecolor": colour, "alpha": alpha, "linewidth": 0.5}
        axes.add_collection3d(Poly3DCollection(faces, zorder=1, **look))
    else:
        surface = np.einsum("ij,jkl->ikl", turn, _grid(row.shape, size)) + place[:, None, None]
        smooth = {"linewidth": 0, "shade": True, "antialiased": False}
        axes.plot_surface(*surface, color=colour, alpha=alpha, **smooth)


def draw_outline(axes: Any, row: Any, colour: str, alpha: float) -> None:
    """Draw a row of `COLUMNS` as seen along z, in plane axes."""
    turn, size, place = _read(row)
    brick = row.shape == BRICK
    points = np.vstack(_FACES) * size if brick else _grid(row.shape, size).reshape(3, -1).T
    seen = (points @ turn.T)[:, :2] + place[:2]
    look = {"facecolor": colour, "edgecolor": colour, "alpha": alpha, "linewidth": 0.5}
    axes.fill(*seen[ConvexHull(seen).vertices].T, **look)


def corners(table: pd.DataFrame) -> FloatArray:
    """Return points (points, 3) that reach as far along x, y and z as all solids of a table."""
    found = [np.empty((0, 3))]
    for row in table.itertuples(index=False):
        turn, size, place = _read(row)
        round_reach = size[0] + np.abs(turn[:, 2]) * size[1]
        reach = np.abs(turn) @ size if row.shape == BRICK else round_reach
        found += [place[None] - reach, place[None] + reach]
    return np.vstack(found)


def space(
    figure: Figure, place: Any, points: FloatArray, unit: str, view: tuple[float, float]
) -> Any:
    """Return axes in space, with equal scales, that hold some points."""
    low, high = points.min(axis=0), points.max(axis=0)
    widest = float((high - low).max())
    pad = 0.04 * widest + 0.5 * np.maximum(0.0, 0.35 * widest - (high - low))
    look: dict[str, Any] = {"zoom": 0.92, "label_pads": (-7, -7, -7), "ticks": (2, 4)}
    axes = marks.space(figure, (place,), low, high, pad, unit, view=view, **look)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
    return axes


def _grid(shape: str, size: FloatArray) -> FloatArray:
    """Return the surface of a round solid, (3, along, around)."""
    radius, half = size[:2]
    rise = np.linspace(0.0, 0.5 * np.pi, ALONG)
    if shape == DRUM:
        wide, high = np.array([radius, 0.0]), np.array([half, half])
    else:
        wide, high = radius * np.cos(rise), half + radius * np.sin(rise)
    # radii and heights along the axis, each once around it
    turned = np.linspace(0.0, 2.0 * np.pi, AROUND + 1)
    radii, heights = np.append(wide[::-1], wide), np.append(-high[::-1], high)
    sides = (radii, np.cos(turned)), (radii, np.sin(turned)), (heights, np.ones_like(turned))
    return np.array([np.outer(along, around) for along, around in sides])


def models_table(shown: Sequence[tuple[str, ConditionResults]]) -> pd.DataFrame:
    """Return bodies and covers of robots at their start.

    Args:
        shown: (title, a condition of the robot).

    Returns:
        Columns position, robot, element (body, cover), name (of the body), `COLUMNS`,
        inflation (of all its covers), length_unit.
    """
    rows: list[tuple[Any, ...]] = []
    for position, (title, c) in enumerate(shown):
        problem = measures.problem(c)
        bodies, model, geometry = problem.bodies, problem.assembly.model, problem.assembly.geometry
        data, placements = model.createData(), geometry.createData()
        pin.updateGeometryPlacements(model, data, geometry, placements, problem.start)
        own = [
            (BODY, item.name, *solid(item.geometry, place).values())
            for item, place in zip(geometry.geometryObjects, placements.oMg, strict=True)
        ]
        joints = (data.oMi[item.parentJoint] for item in geometry.geometryObjects)
        for name, joint, cover in zip(bodies.names, joints, bodies.covers, strict=True):
            capsules = zip(cover.start, cover.end, cover.radius, strict=True)
            own += [(COVER, name, *_capsule(joint, *capsule)) for capsule in capsules]
        unit = c.condition.length_unit
        rows += [(position, title, *row, bodies.inflation, unit) for row in own]
    return rounded(
        pd.DataFrame(
            rows,
            columns=["position", "robot", "element", "name", *COLUMNS, "inflation", "length_unit"],
        )
    )


def draw_models(table: pd.DataFrame) -> Figure:
    """Draw one row per robot: its bodies, and their covers."""
    robots = list(groups(table, ["position", "robot"]))
    spans = [np.ptp(corners(rows), axis=0) for _, rows in robots]
    heights = [float(np.clip(2.0 + 1.6 * z / max(x, y), 2.3, 3.3)) for x, y, z in spans]  # [inch]
    figure = style.figure(sum(heights))
    grid = figure.add_gridspec(len(robots), 2, height_ratios=heights)
    for (position, robot), rows in robots:
        points, (inflation, unit) = corners(rows), rows[["inflation", "length_unit"]].iloc[0]
        bodies, covers = (rows[rows["element"] == element] for element in (BODY, COVER))
        counts = covers["shape"].value_counts()
        kinds = ", ".join(f"{counts[kind]} {KINDS[kind]}" for kind in KINDS if kind in counts)
        shown = (
            (bodies, 0.85, f"{robot}: {len(bodies)} bodies"),
            (covers, 0.35, f"{kinds}, at most {inflation:.3g} {unit} beyond"),
        )
        for k, (own, alpha, title) in enumerate(shown):
            axes = space(figure, grid[position, k], points, unit, MODEL_VIEW)
            for row in records(own):
                draw_solid(axes, row, style.arm_colour(k), alpha)
            axes.set_title(title)
    return figure


def _capsule(joint: Any, start: FloatArray, stop: FloatArray, radius: float) -> tuple[Any, ...]:
    """Return a sphere, or a capsule between two points, given in a joint's frame."""
    along, middle = np.asarray(stop) - np.asarray(start), 0.5 * (np.asarray(start) + stop)
    half = 0.5 * float(np.sqrt((along**2).sum()))
    shape, turn = BALL, np.eye(3)
    if half > 0.0:
        axis = np.array([0.0, 0.0, 1.0])
        shape, turn = ROD, pin.Quaternion.FromTwoVectors(axis, along).matrix()
    return (shape, *joint.act(middle), *(joint.rotation @ turn).ravel(), radius, half, 0.0)


_SQUARE = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
_FACES = [
    np.array([np.insert(np.array(pair, dtype=np.float64), axis, side) for pair in _SQUARE])
    for axis in range(3)
    for side in (-1.0, 1.0)
]
