"""A 6R arm of a PUMA's proportions, as capsules and as spheres, among ten turned obstacles."""

from typing import Any

import coal
import numpy as np
import pinocchio as pin

import obstacle_samples as samples
from evoexp.collision.bodies.body_collision import Shapes
from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
    rotation_matrix,
)

FLOOR = 0  # index of the obstacle that the first link stands on: those two are no pair
# joints; the links around the wrist always touch
SELF_PAIRS = ((1, 3), (1, 4), (1, 5), (1, 6), (2, 4), (2, 5), (2, 6))


OBSTACLES = (
    samples.half_space((0.0, 0.0, 0.0), (0.02, -0.03, 1.0)),
    samples.box((0.75, 0.1, 0.25), (0.5, 0.9, 0.06), (3.0, -4.0, 20.0)),
    samples.box((-0.45, 0.75, 0.55), (0.25, 0.3, 0.5), (15.0, 10.0, -30.0)),
    samples.box((0.35, -0.85, 0.9), (0.3, 0.12, 0.4), (40.0, 25.0, 60.0)),
    samples.cylinder((-0.75, -0.35, 0.0), (-0.7, -0.3, 1.1), 0.08),
    samples.cylinder((0.7, -0.45, 0.5), (0.9, -0.35, 0.75), 0.12),
    samples.sphere((0.6, 0.65, 0.95), 0.15),
    samples.sphere((-0.6, 0.05, 1.25), 0.12),
    samples.capsule((-0.3, 0.9, 1.2), (0.4, 0.85, 1.35), 0.05),
    samples.capsule((-0.2, -0.8, 0.3), (-0.4, -0.7, 0.8), 0.07),
)

# joint, start, end, radius [m], spheres along it: 11 capsules, 59 spheres
CAPSULES = (
    (1, (0.0, 0.0, -0.40), (0.0, 0.0, 0.02), 0.09, 6),
    (1, (0.0, 0.0, 0.0), (0.0, 0.18, 0.0), 0.08, 4),
    (2, (0.0, 0.0, 0.0), (0.0, 0.0, 0.43), 0.075, 11),
    (2, (0.0, 0.03, 0.33), (0.0, 0.03, 0.45), 0.065, 5),
    (3, (0.0, 0.0, 0.0), (0.0, -0.09, 0.0), 0.065, 4),
    (3, (0.0, -0.09, -0.03), (0.0, -0.09, 0.12), 0.06, 5),
    (4, (0.0, 0.0, -0.26), (0.0, 0.0, -0.04), 0.05, 8),
    (4, (0.0, 0.0, -0.04), (0.0, 0.0, 0.03), 0.045, 4),
    (5, (0.0, 0.0, 0.0), (0.0, 0.0, 0.06), 0.045, 3),
    (6, (0.0, -0.05, 0.05), (0.0, 0.05, 0.05), 0.035, 4),
    (6, (0.0, 0.0, 0.03), (0.0, 0.0, 0.16), 0.03, 5),
)


def model() -> Any:
    """Return the `pin.Model`: z upwards, both arms 0.43 m, a spherical wrist."""
    arm = pin.Model()
    y, z = pin.JointModelRY, pin.JointModelRZ
    for joint, (axis, place) in enumerate(
        (
            (z(), (0.0, 0.0, 0.65)),
            (y(), (0.0, 0.22, 0.0)),
            (y(), (0.0, 0.0, 0.43)),
            (z(), (0.0, -0.09, 0.43)),
            (y(), (0.0, 0.0, 0.0)),
            (z(), (0.0, 0.0, 0.06)),
        )
    ):
        arm.addJoint(joint, axis, pin.SE3(np.eye(3), np.array(place)), f"joint_{joint + 1}")
    return arm


def add(geometry: Any, joint: int, placement: Any, shape: Any) -> None:
    """Add a shape of a joint to a `pin.GeometryModel`."""
    name = f"shape_{geometry.ngeoms}"
    geometry.addGeometryObject(pin.GeometryObject(name, joint, 0, placement, shape))


def capsules(arm: Any) -> Any:
    """Return the links as a `pin.GeometryModel` of 11 coal capsules."""
    geometry = pin.GeometryModel()
    for joint, start, end, radius, _ in CAPSULES:
        shape, placement = capsule(np.array(start), np.array(end), radius)
        add(geometry, joint, placement, shape)
    return geometry


def spheres(arm: Any) -> Any:
    """Return the links as a `pin.GeometryModel` of 59 coal spheres along the capsules' axes."""
    geometry = pin.GeometryModel()
    for joint, start, end, radius, count in CAPSULES:
        for f in np.linspace(0.0, 1.0, count):
            center = (1.0 - f) * np.array(start) + f * np.array(end)
            add(geometry, joint, pin.SE3(np.eye(3), center), coal.Sphere(radius))
    return geometry


def capsule(start: FloatArray, end: FloatArray, radius: float) -> tuple[Any, Any]:
    """Return a coal capsule, and its placement: coal draws it along z, centred."""
    length = float(np.linalg.norm(end - start))
    return coal.Capsule(radius, length), pin.SE3(along(end - start), 0.5 * (start + end))


def along(axis: FloatArray) -> FloatArray:
    """Return a rotation whose z axis has a vector's direction; the identity for the zero vector."""
    length = np.linalg.norm(axis)
    if length == 0.0:
        return np.eye(3)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis / length)
    return np.asarray(turn.normalized().toRotationMatrix())


def coal_obstacle(obstacle: Any) -> tuple[Any, Any]:
    """Return an obstacle as a coal shape, and its placement."""
    if isinstance(obstacle, SphereObstacle):
        return coal.Sphere(obstacle.radius), pin.SE3(np.eye(3), point(obstacle.center))
    if isinstance(obstacle, BoxObstacle):
        turn = rotation_matrix(obstacle.rotation)
        return coal.Box(*[*obstacle.size, 1.0][:3]), pin.SE3(turn, point(obstacle.center))
    if isinstance(obstacle, HalfSpaceObstacle):
        return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0), pin.SE3(
            along(point(obstacle.normal)), point(obstacle.point)
        )
    start, end = point(obstacle.start), point(obstacle.end)
    if obstacle.shape == "capsule":
        return capsule(start, end, obstacle.radius)
    length = float(np.linalg.norm(end - start))
    return coal.Cylinder(obstacle.radius, length), pin.SE3(along(end - start), 0.5 * (start + end))


def point(coordinates: tuple[float, ...]) -> FloatArray:
    """Return a point of the plane or of space as (3,)."""
    return np.array([*coordinates, 0.0][:3])


def with_obstacles(
    geometry: Any, obstacles: tuple[Any, ...], joint_pairs: Any, ignored: Any = ()
) -> Any:
    """Return a robot's geometry with the obstacles behind it, and the pairs to be checked.

    Those are the shapes of `joint_pairs`, and all obstacles but for `ignored` (joint, obstacle).
    """
    scene = geometry.copy()
    for obstacle in obstacles:
        shape, placement = coal_obstacle(obstacle)
        add(scene, 0, placement, shape)
    joints = [one.parentJoint for one in geometry.geometryObjects]
    chosen = {frozenset(pair) for pair in joint_pairs}
    for a, joint in enumerate(joints):
        for b in range(a + 1, len(joints)):
            if frozenset((joint, joints[b])) in chosen and joint != joints[b]:
                scene.addCollisionPair(pin.CollisionPair(a, b))
        for k in range(len(obstacles)):
            if joint > 0 and (joint, k) not in ignored:
                scene.addCollisionPair(pin.CollisionPair(a, len(joints) + k))
    return scene


def random_configurations(count: int) -> FloatArray:
    """Return configurations drawn uniformly from ±180°, (6, count) [rad]."""
    return np.random.default_rng(0).uniform(-np.pi, np.pi, size=(6, count))


def population(count: int) -> FloatArray:
    """Return configurations within some 6° of one that is free, (6, count) [rad]."""
    center = np.array([0.3, 0.4, 0.9, 0.2, 0.5, 0.0])
    return np.asarray(center[:, None] + 0.1 * np.random.default_rng(0).normal(size=(6, count)))


def shapes_of(geometry: Any) -> Shapes:
    """Return a geometry model of coal spheres and capsules as the shapes of the kernels."""
    rows = []
    for item in geometry.geometryObjects:
        half = item.geometry.halfLength if isinstance(item.geometry, coal.Capsule) else 0.0
        center, along = item.placement.translation, half * item.placement.rotation[:, 2]
        joint, ends = item.parentJoint, (center - along, center + along)
        rows.append((joint, *ends, item.geometry.radius, joint))
    return Shapes(*(np.array(column) for column in zip(*rows, strict=True)))
