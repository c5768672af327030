"""Capsules in special position.

Parallel, touching, crossing, of length or radius 0, inside obstacles.
"""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from collision.built_bodies import built
from evoexp.collision.bodies.packing import Shapes
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    CapsuleObstacle,
    CylinderObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
    obstacle_table,
)
from matrix import num_cases
from references.primitive_distances import along, to_obstacle, to_segment

Point = tuple[float, float, float]

GRID = st.sampled_from([-1.0, -0.5, 0.0, 0.25, 0.5, 1.0])
FINE = st.floats(-1.0, 1.0).map(lambda x: round(x, 9))
POINTS = st.one_of(st.tuples(GRID, GRID, GRID), st.tuples(FINE, FINE, FINE))
RADII = st.sampled_from([0.0, 0.1, 0.5])

OBSTACLES = (
    SphereObstacle(shape="sphere", center=(0.25, 0.0, 0.5), radius=0.25),
    BoxObstacle(shape="box", center=(0.0, 0.0, 0.0), size=(1.0, 0.5, 0.02)),
    BoxObstacle(
        shape="box", center=(0.0, 0.5, 0.0), size=(0.5, 0.5, 0.5), rotation=(45.0, 0.0, 0.0)
    ),
    CapsuleObstacle(shape="capsule", start=(0.0, 0.0, -0.5), end=(0.0, 0.0, 0.5), radius=0.1),
    CylinderObstacle(shape="cylinder", start=(0.0, 0.0, -0.5), end=(0.0, 0.0, 0.5), radius=0.25),
    CylinderObstacle(shape="cylinder", start=(0.0, -0.5, 0.5), end=(0.5, -1.0, 0.5), radius=0.1),
    HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0, -0.5), normal=(0.0, 0.0, 1.0)),
)


def hinge() -> Any:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    return model


def clearance(
    joints: list[int], starts: Any, ends: Any, radii: Any, obstacles: tuple[Any, ...] = ()
) -> Any:
    """Clearances of shapes on a hinge at rest, and on the world beside it."""
    columns = (np.array(column) for column in (joints, starts, ends, radii, joints))
    shapes = Shapes(*columns)
    pairs = [(0, 1)] if len(joints) > 1 else []
    collision = built(hinge(), shapes, obstacle_table(obstacles), pairs)
    return collision.clearance(np.zeros((1, 1)))


@settings(max_examples=num_cases(25, 300), deadline=None)
@given(POINTS, POINTS, POINTS, POINTS, RADII, RADII)
@example((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.25, 0.5, 0.0), (0.5, 0.5, 0.0), 0.1, 0.1)
@example((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, 0.0)
@example((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, 0.0, 0.0), 0.0, 0.0)
@example((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.5, 0.0, 0.0), 0.0, 0.0)
@example((-1.0, 0.0, 0.0), (1.0, 0.0, 1e-7), (-1.0, 0.0, 1e-7), (1.0, 0.0, 0.0), 0.0, 0.0)
@example((-1.0, 0.0, 0.0), (1.0, 1e-9, 0.0), (-1.0, 1e-9, 1e-3), (1.0, 0.0, 1e-3), 0.0, 0.0)
@example((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 1.0, 0.0), 0.1, 0.0)
def test_two_capsules(a: Point, b: Point, c: Point, d: Point, one: float, two: float) -> None:
    expected = along(np.array(a), np.array(b), to_segment(np.array(c), np.array(d))) - one - two
    for joints, order in (([0, 1], 1), ([1, 0], -1)):
        starts, ends, radii = [a, c][::order], [b, d][::order], [one, two][::order]
        found = clearance(joints, starts, ends, radii).to_self[0]
        assert found == pytest.approx(expected, abs=1e-12)


@settings(max_examples=num_cases(25, 300), deadline=None)
@given(POINTS, POINTS, RADII, st.integers(0, len(OBSTACLES) - 1))
@example((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, 1)  # along the middle of a thin box
@example((-1.0, 0.25, 0.01), (1.0, 0.25, 0.01), 0.1, 1)  # along an edge
@example((-1.0, -1.0, 0.05), (1.0, 1.0, 0.05), 0.0, 1)  # parallel to a face
@example((0.25, 0.0, -1.0), (0.25, 0.0, 1.0), 0.0, 4)  # along the mantle
@example((0.5, 0.0, -1.0), (0.5, 0.0, 1.0), 0.0, 4)  # beside it
@example((-1.0, 0.25, 0.5), (1.0, 0.25, 0.5), 0.1, 4)  # touches the rim
@example((-1.0, 0.5, 0.75), (1.0, 0.5, 0.75), 0.1, 4)  # passes the rim
@example((0.0, 0.0, 1.0), (0.0, 0.0, 0.75), 0.1, 4)  # on the axis, above
def test_a_capsule_and_an_obstacle(a: Point, b: Point, radius: float, k: int) -> None:
    expected = along(np.array(a), np.array(b), to_obstacle(obstacle_table(OBSTACLES), k)) - radius
    found = clearance([1], [a], [b], [radius], (OBSTACLES[k],)).to_obstacles[0]
    inside = expected <= -radius and isinstance(OBSTACLES[k], BoxObstacle | CylinderObstacle)
    if inside and a != b:
        assert (
            expected - 1e-12 <= found <= -radius + 1e-12
        )  # the depth of a point inside, perhaps not the deepest
    else:
        assert found == pytest.approx(expected, abs=1e-12)


def test_a_line_through_a_box_or_a_cylinder_collides() -> None:
    for obstacle in (OBSTACLES[1], OBSTACLES[4]):
        for a, b in (
            ((-3.0, 0.1, 0.002), (3.0, 0.12, 0.001)),
            ((0.1, 0.1, -3.0), (0.11, 0.1, 3.0)),
        ):
            assert clearance([1], [a], [b], [0.0], (obstacle,)).to_obstacles[0] < 0.0


def test_centres_inside_obstacles_give_depths() -> None:
    for obstacle, expected in zip(
        OBSTACLES, (-0.25, -0.01, None, None, -0.25, None, -0.5), strict=True
    ):
        point = (0.25, 0.0, 0.5) if isinstance(obstacle, SphereObstacle) else (0.0, 0.0, 0.0)
        if expected is not None:
            point = (0.0, 0.0, -1.0) if isinstance(obstacle, HalfSpaceObstacle) else point
            found = clearance([1], [point], [point], [0.1], (obstacle,)).to_obstacles[0]
            assert found == pytest.approx(expected - 0.1, abs=1e-15)


@pytest.mark.parametrize("length", [1e-300, 1e-160, 1e-101, 1e-99, 1e-30, 1e-12])
def test_very_short_capsules_are_points(length: float) -> None:
    a, b = (0.0, 0.0, 0.0), (length, 0.0, 0.0)
    c, d = (1.0, 0.0, 1.0), (1.0, length, 1.0)
    assert clearance([0, 1], [a, c], [b, d], [0.1, 0.2]).to_self[0] == pytest.approx(
        np.sqrt(2.0) - 0.3, abs=1e-11
    )
    for k, obstacle in enumerate(OBSTACLES):
        expected = (
            float(to_obstacle(obstacle_table(OBSTACLES), k)(np.array(c).astype(np.longdouble)))
            - 0.1
        )
        found = clearance([1], [c], [d], [0.1], (obstacle,)).to_obstacles[0]
        assert found == pytest.approx(expected, abs=1e-11)


def test_touching_is_no_collision_and_less_is() -> None:
    for height, collides in ((1.0, False), (np.nextafter(1.0, 0.0), True)):
        found = clearance(
            [0, 1],
            [(0.0, 0.0, 0.0), (0.0, 0.0, height)],
            [(0.0, 0.0, 0.0), (0.0, 0.0, height)],
            [0.5, 0.5],
        )
        assert bool(found.least[0] < 0.0) is collides
