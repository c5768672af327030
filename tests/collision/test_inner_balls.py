"""Shapes inside bodies, which bound how deep bodies overlap that may touch."""

from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.covers.body_covers import inner_balls
from evoexp.records import FloatArray

DEPTH = 0.001


def lowest_of(shape: Any, n: FloatArray) -> float:
    """Return the greatest reach of a shape against direction n, by its corners or closed form."""
    if isinstance(shape, coal.Box):
        return float(np.abs(n) @ shape.halfSide)
    if isinstance(shape, coal.Cylinder):
        return float(shape.radius * np.hypot(n[0], n[1]) + shape.halfLength * abs(n[2]))
    half = getattr(shape, "halfLength", 0.0)
    return float(shape.radius + half * abs(n[2]))


@pytest.mark.parametrize(
    "shape",
    [
        coal.Cylinder(0.03, 0.25),
        coal.Cylinder(0.2, 0.01),
        coal.Box(0.13, 0.04, 0.05),
        coal.Box(0.5, 0.5, 0.001),
        coal.Capsule(0.01, 0.06),
        coal.Sphere(0.04),
    ],
)
def test_free_inner_shapes_mean_no_deeper_than_allowed_on_any_tilted_plane(shape: Any) -> None:
    """And what does not reach half as deep is never refused."""
    place = pin.SE3(pin.utils.rotate("y", 0.4), np.array([0.1, -0.2, 0.3]))
    item = pin.GeometryObject("body", 0, 0, place, shape)
    found = inner_balls(item, DEPTH)
    assert found is not None
    rng = np.random.default_rng(1)
    for _ in range(200):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        reach = lowest_of(shape, place.rotation.T @ n)
        inner = max(
            float((-(points - place.translation) @ n + found.radius).max())
            for points in (found.start, found.end)
        )
        # cylinders: 24 points on a rim miss its lowest point by r (1 − cos 7.5°)
        missed = shape.radius * 0.0086 if isinstance(shape, coal.Cylinder) else 0.0
        assert inner <= reach + 1e-12
        assert reach - inner <= DEPTH + missed + 1e-12
        assert reach - inner >= min(0.5 * DEPTH, reach) - 1e-12


def test_other_shapes_are_left_to_the_exact_verdict() -> None:
    item = pin.GeometryObject("body", 0, 0, pin.SE3.Identity(), coal.Ellipsoid(0.1, 0.09, 0.08))
    assert inner_balls(item, DEPTH) is None
