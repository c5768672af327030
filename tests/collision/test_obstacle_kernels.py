"""Touching spheres among cylinders and half-spaces, against coal on the same shapes."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.bodies.touching_spheres import SphereCollision, TouchingSpheres
from evoexp.robots.arms import Arms
from evoexp.robots.planar_chain import PlanarChain
from evoexp.scenarios.obstacles import CylinderObstacle, HalfSpaceObstacle
from references.arms_6r import coal_obstacle

MODEL = TouchingSpheres(spheres_per_link=5, sphere_radius=0.5, collision_substeps=1)
ROBOT = Arms(
    arms=(
        PlanarChain(link_lengths=(4.0, 4.0), base_position=(0.0, 0.0)),
        PlanarChain(link_lengths=(3.0, 2.0, 2.0), base_position=(9.0, 4.0)),
    )
)
CYLINDERS = (
    CylinderObstacle(shape="cylinder", start=(3.0, 5.0, -1.0), end=(3.5, 5.0, 2.0), radius=0.8),
    CylinderObstacle(shape="cylinder", start=(-5.0, 0.0), end=(-4.0, -3.0), radius=0.4),
    CylinderObstacle(shape="cylinder", start=(0.0, 9.0, 0.8), end=(2.0, 8.0, 1.4), radius=0.9),
)
HALF_SPACES = (
    HalfSpaceObstacle(shape="half_space", point=(0.0, -6.0), normal=(0.1, 1.0)),
    HalfSpaceObstacle(shape="half_space", point=(12.0, 0.0, -1.0), normal=(-3.0, 0.2, 0.5)),
)


def coal_distances(
    collision: SphereCollision, obstacles: tuple[object, ...], q_deg: np.ndarray
) -> np.ndarray:
    """All distances of spheres and obstacles, (spheres, obstacles)."""
    model, shapes = collision.assembly.model, collision.shapes
    data = model.createData()
    pin.forwardKinematics(model, data, np.deg2rad(q_deg))
    found = []
    for joint, center, radius in zip(shapes.joint, shapes.start, shapes.radius, strict=True):
        place = data.oMi[int(joint)].act(center)
        sphere = coal.CollisionObject(coal.Sphere(radius), np.eye(3), place)
        for obstacle in obstacles:
            shape, at = coal_obstacle(obstacle)
            result = coal.DistanceResult()
            found.append(
                coal.distance(
                    sphere,
                    coal.CollisionObject(shape, at.rotation, at.translation),
                    coal.DistanceRequest(),
                    result,
                )
            )
    return np.array(found).reshape(len(shapes.joint), len(obstacles))


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    "obstacles", [*((o,) for o in CYLINDERS + HALF_SPACES), CYLINDERS + HALF_SPACES]
)
def test_spheres_among_cylinders_and_half_spaces_agree_with_coal(
    obstacles: tuple[object, ...],
) -> None:
    assembly = ROBOT.build()
    collision = MODEL.bind(assembly, obstacles)
    q = np.random.default_rng(0).uniform(-180.0, 180.0, size=(assembly.model.nq, 130))
    found = collision.clearance(q).to_obstacles
    for sample in range(q.shape[1]):
        expected = coal_distances(collision, obstacles, q[:, sample]).min()
        if expected > 0.0 or all(isinstance(o, HalfSpaceObstacle) for o in obstacles):
            assert found[sample] == pytest.approx(expected, abs=1e-12 if expected > 0.0 else 1e-11)
        else:
            assert found[sample] < 1e-9


@pytest.mark.parametrize(
    ("x", "z", "expected"),
    [
        (0.0, 0.0, -0.5),  # on the axis: the mantle is nearer than the ends
        (0.0, 0.9, -0.1),
        (0.4, 0.0, -0.1),
        (0.0, 1.5, 0.5),
        (1.0, 0.0, 0.5),
        (0.8, 1.4, 0.5),  # beside the rim
        (0.5, 1.0, 0.0),
    ],
)
def test_signed_distance_of_a_point_from_a_cylinder(x: float, z: float, expected: float) -> None:
    robot = PlanarChain(link_lengths=(1.0,), base_position=(x, 0.0))
    cylinder = CylinderObstacle(
        shape="cylinder", start=(0.5, 0.0, -1.0 - z), end=(0.5, 0.0, 1.0 - z), radius=0.5
    )
    one = TouchingSpheres(
        spheres_per_link=1, sphere_radius=0.25, collision_substeps=1
    )  # at half the link
    collision = one.bind(robot.build(), (cylinder,))
    assert collision.clearance(np.zeros((1, 1))).to_obstacles[0] == pytest.approx(
        expected - 0.25, abs=1e-15
    )
