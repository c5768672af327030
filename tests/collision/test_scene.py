"""Scenes: which pairs are watched, what bodies are called.

And that coal's shapes are the obstacles'.
"""

import coal
import numpy as np
import pinocchio as pin
import pytest

from collision.certifier_scenes import hull
from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.scene import geometry_scene, obstacle_shapes, scene
from evoexp.robots.arms import Arms
from evoexp.robots.floor_manipulator import FloorManipulator
from evoexp.robots.mobile_arm import MobileArm
from evoexp.robots.planar_chain import PlanarChain
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    CapsuleObstacle,
    CylinderObstacle,
    EllipseObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
    obstacle_table,
)

ARM = PlanarChain(link_lengths=(1.0, 1.0, 1.0), base_position=(0.0, 0.0), link_radius=0.1)
OTHER = PlanarChain(link_lengths=(1.0, 1.0), base_position=(5.0, 0.0))
BALL = SphereObstacle(shape="sphere", center=(2.0, 2.0), radius=0.5)


def test_links_of_different_arms_and_links_with_obstacles_are_watched() -> None:
    built = scene(Arms(arms=(ARM, OTHER)).build(), (BALL, BALL))
    assert built.names == (
        *("arm_1_link_1", "arm_1_link_2", "arm_1_link_3", "arm_2_link_1", "arm_2_link_2"),
        *("obstacle_1", "obstacle_2"),
    )
    assert len(built.pairs) == 3 * 2 + 5 * 2
    named = {built.pair_names(k) for k in range(len(built.pairs))}
    assert ("arm_1_link_3", "arm_2_link_2") in named and ("arm_2_link_1", "obstacle_2") in named
    assert not any(one[:5] == two[:5] for one, two in named)


def test_a_platform_is_called_so_and_the_links_on_it_are_counted_as_ever() -> None:
    arm = ("arm_1_link_1", "arm_1_link_2", "arm_1_link_3")
    size = {"link_lengths": (1.0, 1.0, 0.5), "link_radius": 0.05}
    on_a_line = MobileArm(platform_size=(0.8, 0.4), **size)
    on_a_floor = FloorManipulator(body_radius=0.4, body_height=0.5, **size)
    for robot in (on_a_line, on_a_floor):
        assert scene(robot.build(), (BALL,)).names == ("platform", *arm, "obstacle_1")
    assert scene(on_a_floor.platform().build()).names == ("platform",)


def test_links_of_one_arm_are_watched_if_wanted() -> None:
    built = scene(ARM.build(), self_pairs=True)
    assert [built.pair_names(k) for k in range(len(built.pairs))] == [
        ("arm_1_link_1", "arm_1_link_3")
    ]
    assert len(scene(ARM.build()).pairs) == 0


OBSTACLES = [
    BALL,
    BoxObstacle(
        shape="box", center=(1.0, 2.0, 3.0), size=(1.0, 0.6, 0.4), rotation=(20.0, -30.0, 70.0)
    ),
    CapsuleObstacle(shape="capsule", start=(-1.0, 1.0), end=(-2.0, -2.0, 1.0), radius=0.3),
    CylinderObstacle(shape="cylinder", start=(-1.0, 1.0), end=(-2.0, -2.0, 1.0), radius=0.3),
    HalfSpaceObstacle(shape="half_space", point=(1.0, -1.0, 0.5), normal=(1.0, 2.0, -0.5)),
    EllipseObstacle(shape="ellipse", center=(1.0, 2.0, 3.0), semi_axes=(1.2, 0.7), angle=35.0),
]


def inside(obstacle: object, points: np.ndarray) -> np.ndarray:
    """Which points (n, 3) lie in an obstacle, from its settings."""
    if isinstance(obstacle, SphereObstacle):
        return ((points - np.array([*obstacle.center, 0.0])) ** 2).sum(axis=1) < obstacle.radius**2
    if isinstance(obstacle, BoxObstacle):
        turn = pin.rpy.rpyToMatrix(*np.deg2rad(obstacle.rotation))
        return np.all(
            np.abs((points - obstacle.center) @ turn) < 0.5 * np.array(obstacle.size), axis=1
        )
    if isinstance(obstacle, EllipseObstacle):
        turn = pin.rpy.rpyToMatrix(0.0, 0.0, np.deg2rad(obstacle.angle))
        return (((points - obstacle.center) @ turn / np.array([1.2, 0.7, 0.7])) ** 2).sum(
            axis=1
        ) < 1.0
    if isinstance(obstacle, HalfSpaceObstacle):
        return (points - obstacle.point) @ np.array(obstacle.normal) < 0.0
    start, end = (np.array([*p, 0.0][:3]) for p in (obstacle.start, obstacle.end))
    axis = end - start
    along = (points - start) @ axis / (axis @ axis)
    on = np.clip(along, 0.0, 1.0) if isinstance(obstacle, CapsuleObstacle) else along
    near = ((points - start - on[:, None] * axis) ** 2).sum(axis=1) < obstacle.radius**2
    return near & (isinstance(obstacle, CapsuleObstacle) | ((along > 0.0) & (along < 1.0)))


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=lambda o: o.shape)
def test_coals_shape_is_the_obstacle(obstacle: object) -> None:
    ((shape, placement),) = obstacle_shapes(obstacle_table((obstacle,)))
    rng = np.random.default_rng(0)
    points = placement.translation + rng.uniform(-1.5, 1.5, size=(2000, 3))
    expected = inside(obstacle, points)
    assert 10 < expected.sum() < 1990
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    where = coal.Transform3s(placement.rotation, placement.translation)
    for point, within in zip(points, expected, strict=True):
        result.clear()
        ball = coal.Sphere(1e-9)
        distance = coal.distance(
            ball, coal.Transform3s(np.eye(3), point), shape, where, request, result
        )
        assert (distance < 0.0) == within or abs(distance) < 1e-5


def test_a_scene_of_any_geometry() -> None:
    model, geometry = pin.Model(), pin.GeometryModel()
    joint = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "turn")
    for name, shape in (
        ("egg", coal.Ellipsoid(0.3, 0.2, 0.1)),
        ("rock", hull(0.5)),
        ("ice", coal.Cone(0.2, 0.4)),
    ):
        placement = pin.SE3(np.eye(3), np.array([1.0, 0.0, 2.0]))
        geometry.addGeometryObject(
            pin.GeometryObject(name, joint if name == "egg" else 0, 0, placement, shape)
        )
    geometry.addCollisionPair(pin.CollisionPair(0, 2))
    built = geometry_scene(model, geometry)
    assert built.names == ("egg", "rock", "ice")
    assert [built.pair_names(k) for k in range(len(built.pairs))] == [("egg", "ice")]
    assert built.bodies.exact.all()


def test_shapes_that_cannot_be_bounded_are_refused() -> None:
    model, geometry = pin.Model(), pin.GeometryModel()
    joint = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "turn")
    plane = pin.GeometryObject(
        "glass", 0, 0, pin.SE3.Identity(), coal.Plane(np.array([0.0, 0.0, 1.0]), 0.0)
    )
    geometry.addGeometryObject(plane)
    with pytest.raises(
        UnsupportedShape,
        match=r"'glass' must be a convex shape, a half-space or a mesh, was a Plane",
    ):
        geometry_scene(model, geometry)
    geometry = pin.GeometryModel()
    ground = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    geometry.addGeometryObject(pin.GeometryObject("ground", joint, 0, pin.SE3.Identity(), ground))
    with pytest.raises(
        UnsupportedShape, match=r"half-space 'ground' must stand still, moves with a joint"
    ):
        geometry_scene(model, geometry)
