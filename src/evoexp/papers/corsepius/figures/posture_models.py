"""Robots beside the spheres or capsules that cover them (Corsépius 2001, Figs. 3 and 4)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.figures import solids
from evoexp.records import FloatArray
from evoexp.report.kit import ConditionResults, groups, records, rounded, style

BODY, COVER = "body", "cover"
VIEW = (18.0, -55.0)  # [deg]
KINDS = {solids.BALL: "spheres", solids.ROD: "capsules"}
NAMES = ["position", "robot", "element", "name", *solids.COLUMNS, "inflation", "length_unit"]


def models_table(shown: Sequence[tuple[str, ConditionResults]]) -> pd.DataFrame:
    """Return bodies and covers of robots at their start.

    Args:
        shown: (title, a condition of the robot).

    Returns:
        Columns position, robot, element (body, cover), name (of the body), those of `solids`,
        inflation (of all its covers), length_unit.
    """
    rows: list[tuple[Any, ...]] = []
    for position, (title, c) in enumerate(shown):
        problem = measures.problem(c)
        bodies, model, geometry = problem.bodies, problem.assembly.model, problem.assembly.geometry
        data, placements = model.createData(), geometry.createData()
        pin.updateGeometryPlacements(model, data, geometry, placements, problem.start)
        own = [
            (BODY, item.name, *solids.solid(item.geometry, place).values())
            for item, place in zip(geometry.geometryObjects, placements.oMg, strict=True)
        ]
        joints = (data.oMi[item.parentJoint] for item in geometry.geometryObjects)
        for name, joint, cover in zip(bodies.names, joints, bodies.covers, strict=True):
            capsules = zip(cover.start, cover.end, cover.radius, strict=True)
            own += [(COVER, name, *_capsule(joint, *capsule)) for capsule in capsules]
        unit = c.condition.length_unit
        rows += [(position, title, *row, bodies.inflation, unit) for row in own]
    return rounded(pd.DataFrame(rows, columns=NAMES))


def draw_models(table: pd.DataFrame) -> Figure:
    """Draw one row per robot: its bodies, and their covers."""
    robots = list(groups(table, ["position", "robot"]))
    heights = [_height(solids.corners(rows)) for _, rows in robots]
    figure = style.figure(sum(heights))
    grid = figure.add_gridspec(len(robots), 2, height_ratios=heights)
    for (position, robot), rows in robots:
        points, (inflation, unit) = solids.corners(rows), rows[["inflation", "length_unit"]].iloc[0]
        bodies, covers = (rows[rows["element"] == element] for element in (BODY, COVER))
        counts = covers["shape"].value_counts()
        kinds = ", ".join(f"{counts[kind]} {KINDS[kind]}" for kind in KINDS if kind in counts)
        shown = (
            (bodies, 0.85, f"{robot}: {len(bodies)} bodies"),
            (covers, 0.35, f"{kinds}, at most {inflation:.3g} {unit} beyond"),
        )
        for k, (own, alpha, title) in enumerate(shown):
            axes = solids.space(figure, grid[position, k], points, unit, VIEW)
            for row in records(own):
                solids.draw_solid(axes, row, style.arm_colour(k), alpha)
            axes.set_title(title)
    return figure


def _height(points: FloatArray) -> float:
    """Return how high a panel that holds some points should be [inch]."""
    x, y, z = np.ptp(points, axis=0)
    return float(np.clip(2.0 + 1.6 * z / max(x, y), 2.3, 3.3))


def _capsule(joint: Any, start: FloatArray, stop: FloatArray, radius: float) -> tuple[Any, ...]:
    """Return a sphere, or a capsule between two points, given in a joint's frame."""
    along, middle = np.asarray(stop) - np.asarray(start), 0.5 * (np.asarray(start) + stop)
    half = 0.5 * float(np.sqrt((along**2).sum()))
    shape, turn = solids.BALL, np.eye(3)
    if half > 0.0:
        axis = np.array([0.0, 0.0, 1.0])
        shape, turn = solids.ROD, pin.Quaternion.FromTwoVectors(axis, along).matrix()
    return (shape, *joint.act(middle), *(joint.rotation @ turn).ravel(), radius, half, 0.0)
