"""Settles how coal treats boxes in this process, so that no distance depends on what ran before.

The support function of coal's `Box` keeps a factor for the whole process: 1 if the direction of its
very first call has no zero component, else 1 + 1e-10, by which it then inflates every box (coal's
issue 894). Modules that ask for distances take `coal` from here: a capsule and a turned box are
asked about once, and boxes are exact from then on.
"""

import warnings

import coal
import numpy as np

from evoexp.records import FloatArray

__all__ = ["EXACT", "coal", "corners_of", "distance", "settle"]

TURNED = np.array(  # a rotation about (1, 2, 3) by 1 rad: no component of any direction is zero
    [
        [0.5731379, -0.6090066, 0.5482918],
        [0.7403488, 0.6716445, -0.0278793],
        [-0.3512785, 0.4219059, 0.8358222],
    ]
)
_GAP = 0.75  # of two boxes side by side, exact in binary


def settle() -> bool:
    """Ask coal about a turned box, and return whether boxes are exact now.

    They are not if another program asked coal about a box before, in this process.
    """
    capsule, box = coal.Capsule(0.125, 1.0), coal.Box(0.5, 0.5, 0.5)
    here, turned = coal.Transform3s(), coal.Transform3s(TURNED, np.array([1.0, 2.0, 3.0]))
    distance(capsule, coal.Transform3s(TURNED.T, np.zeros(3)), box, turned)
    aside = coal.Transform3s(np.eye(3), np.array([0.5 + _GAP, 0.0, 0.0]))
    return distance(box, here, box, aside) == _GAP


def distance(one: coal.ShapeBase, first: object, two: coal.ShapeBase, second: object) -> float:
    """Return coal's signed distance of two shapes at their places, `coal.Transform3s`."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(one, first, two, second, request, result))


def corners_of(shape: coal.ConvexBase | coal.BVHModelBase) -> FloatArray:
    """Return the corners (corners, 3) of a convex shape or a mesh."""
    if isinstance(shape, coal.ConvexBase):
        return np.array([shape.point(k) for k in range(shape.num_points)])
    return np.array([shape.vertex(k) for k in range(shape.num_vertices)])


EXACT = settle()
if not EXACT:
    warnings.warn(
        "coal was asked about a box before evoexp was imported: distances to boxes differ in the "
        "tenth digit from those of other processes",
        stacklevel=2,
    )
