"""Robots as they are and as they are tested.

Coal's geometry beside the spheres (Corsépius 2001, Figs. 3 and 4).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pinocchio as pin
from matplotlib.figure import Figure

from evoexp.papers.corsepius.figures import solids
from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.results import ConditionResults
from evoexp.report.rows import groups, records, rounded

BODY, COVER = "body", "cover"
VIEW = (18.0, -55.0)  # [deg]


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
        problem = c.prepared.problem
        bodies = problem.bodies
        model, geometry = problem.assembly.model, problem.assembly.geometry
        data, placements = model.createData(), geometry.createData()
        pin.updateGeometryPlacements(model, data, geometry, placements, problem.start)
        joints = [item.parentJoint for item in geometry.geometryObjects]
        end = bodies.inflation, c.condition.length_unit
        for item, place in zip(geometry.geometryObjects, placements.oMg, strict=True):
            rows.append((position, title, BODY, item.name, *_row(item.geometry, place), *end))
        for name, joint, cover in zip(bodies.names, joints, bodies.covers, strict=True):
            for start, stop, radius in zip(cover.start, cover.end, cover.radius, strict=True):
                rows.append(
                    (
                        position,
                        title,
                        COVER,
                        name,
                        *_capsule(data.oMi[joint], start, stop, radius),
                        *end,
                    )
                )
    names = ["position", "robot", "element", "name", *solids.COLUMNS, "inflation", "length_unit"]
    return rounded(pd.DataFrame(rows, columns=names))


def draw_models(table: pd.DataFrame) -> Figure:
    """Draw one row per robot: its bodies, and what covers them."""
    robots = list(groups(table, ["position", "robot"]))
    heights = [_height(solids.corners(rows)) for _, rows in robots]
    figure = style.figure(sum(heights))
    grid = figure.add_gridspec(len(robots), 2, height_ratios=heights)
    for (position, robot), rows in robots:
        points = solids.corners(rows)
        unit = rows["length_unit"].iloc[0]
        for k, element in enumerate((BODY, COVER)):
            own = rows[rows["element"] == element]
            axes = solids.space(figure, grid[position, k], points, unit, VIEW)
            for row in records(own):
                colour = style.arm_colour(0) if element == BODY else style.arm_colour(1)
                solids.draw_solid(axes, row, colour, 0.85 if element == BODY else 0.35)
            if element == BODY:
                axes.set_title(f"{robot}: {len(own)} bodies")
            else:
                kinds = {solids.BALL: "spheres", solids.ROD: "capsules"}
                counts = own["shape"].value_counts()
                what = ", ".join(
                    f"{counts[kind]} {name}" for kind, name in kinds.items() if kind in counts
                )
                axes.set_title(f"{what}, at most {rows['inflation'].iloc[0]:.3g} {unit} beyond")
    return figure


def _height(points: FloatArray) -> float:
    """Return how high a panel that holds some points should be [inch]."""
    x, y, z = np.ptp(points, axis=0)
    return float(np.clip(2.0 + 1.6 * z / max(x, y), 2.3, 3.3))


def _row(shape: Any, placement: Any) -> tuple[Any, ...]:
    found = solids.solid(shape, placement)
    assert found is not None  # a robot has no half-space
    return found


def _capsule(joint: Any, start: Any, stop: Any, radius: float) -> tuple[Any, ...]:
    """Return a sphere, or a capsule between two points, given in a joint's frame."""
    along = np.asarray(stop) - np.asarray(start)
    half = 0.5 * float(np.sqrt((along**2).sum()))
    turn = (
        np.eye(3)
        if half == 0.0
        else pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along).matrix()
    )
    where = joint.act(0.5 * (np.asarray(start) + np.asarray(stop)))
    shape = solids.BALL if half == 0.0 else solids.ROD
    return (shape, *where, *(joint.rotation @ turn).ravel(), radius, half, 0.0)
