"""Solids in space, and robots beside the shapes that cover them (Corsépius 2001, Figs. 3 and 4)."""

from collections.abc import Sequence
from typing import Any

import coal
import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from evoexp.papers import trails
from evoexp.planners.posture_es.phases import Problem
from evoexp.playback.recording import outline
from evoexp.records import FloatArray
from evoexp.report.figures import groups, motion_scenes, records, rounded, style
from evoexp.report.results.stored_results import ConditionResults

SIZES = ["size_1", "size_2", "size_3"]  # box: half its edges; else radius and half the length
TURN = [f"r{row}{column}" for row in range(1, 4) for column in range(1, 4)]
COLUMNS = ["shape", "x", "y", "z", *TURN, *SIZES]
BODY, COVER = "body", "cover"
KINDS = {"sphere": "spheres", "capsule": "capsules"}


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


def models_table(shown: Sequence[tuple[str, ConditionResults]]) -> pd.DataFrame:
    """Return bodies and covers of robots at their start, of (title, a condition of the robot)."""
    rows: list[tuple[Any, ...]] = []
    for position, (title, c) in enumerate(shown):
        problem = c.problem(Problem)
        bodies, model, geometry = problem.bodies, problem.assembly.model, problem.assembly.geometry
        data, placements = model.createData(), geometry.createData()
        pin.updateGeometryPlacements(model, data, geometry, placements, problem.start)
        own = [
            (BODY, item.name, *solid(item.geometry, place).values())
            for item, place in zip(geometry.geometryObjects, placements.oMg, strict=True)
        ]
        joints = (data.oMi[item.parentJoint] for item in geometry.geometryObjects)
        for name, joint, cover in zip(bodies.names, joints, bodies.covers, strict=True):
            for start, end, radius in zip(cover.start, cover.end, cover.radius, strict=True):
                pose, length = motion_scenes.capsule(start, end)
                middle, turn = joint.act(pose.translation), (joint.rotation @ pose.rotation).ravel()
                sizes = radius, 0.5 * length, 0.0
                kind = "capsule" if length else "sphere"
                own.append((COVER, name, kind, *middle, *turn, *sizes))
        rows += [(position, title, *row, bodies.inflation, c.length_unit) for row in own]
    names = ["position", "robot", "element", "name", *COLUMNS, "inflation", "length_unit"]
    return rounded(pd.DataFrame(rows, columns=names))


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
            axes = trails.space(figure, (grid[position, k],), points, unit)
            for row in records(own):
                draw_solid(axes, row, style.arm_colour(k), alpha)
            axes.set_title(title)
    return figure
