"""Scenes: which pairs are watched, what bodies are called, and coal's shapes of obstacles."""

from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from coal_shapes import distance_of_point, geometry_of, mesh, placed
from evoexp.collision.body_table import HULL, UnsupportedShape
from evoexp.collision.scene import Scene, geometry_scene, obstacle_shapes, scene
from evoexp.numeric.convex_hull import hull_of
from evoexp.robots.arms import Arms, FloorManipulator, MobileArm, PlanarChain
from evoexp.scenarios.obstacles import obstacle_table
from obstacle_samples import box, capsule, cylinder, ellipse, half_space, sphere
from references import arms_6r

ARM = PlanarChain(link_lengths=(1.0, 1.0, 1.0), base_position=(0.0, 0.0), link_radius=0.1)
OTHER = PlanarChain(link_lengths=(1.0, 1.0), base_position=(5.0, 0.0))
BALL = sphere((2.0, 2.0), 0.5)
LINKS = ("arm_1_link_1", "arm_1_link_2", "arm_1_link_3")


def pairs_of(built: Scene) -> list[tuple[str, str]]:
    return [built.pair_names(k) for k in range(len(built.pairs))]


def test_links_of_different_arms_and_links_with_obstacles_are_watched() -> None:
    built = scene(Arms(arms=(ARM, OTHER)).build(), (BALL, BALL))
    others = ("arm_2_link_1", "arm_2_link_2", "obstacle_1", "obstacle_2")
    assert built.names == (*LINKS, *others)
    expected = {(one, two) for one in LINKS for two in others}
    expected |= {(one, two) for one in others[:2] for two in others[2:]}
    assert set(pairs_of(built)) == expected and len(built.pairs) == len(expected)


def test_links_of_one_arm_are_watched_if_wanted() -> None:
    assert pairs_of(scene(ARM.build(), self_pairs=True)) == [(LINKS[0], LINKS[2])]
    assert pairs_of(scene(ARM.build())) == []


def test_a_platform_is_called_so_and_the_links_on_it_are_counted_as_ever() -> None:
    size = {"link_lengths": (1.0, 1.0, 0.5), "link_radius": 0.05}
    on_a_floor = FloorManipulator(body_radius=0.4, body_height=0.5, **size)
    for robot in (MobileArm(platform_size=(0.8, 0.4), **size), on_a_floor):
        assert scene(robot.build(), (BALL,)).names == ("platform", *LINKS, "obstacle_1")
    assert scene(on_a_floor.platform().build()).names == ("platform",)


@pytest.mark.parametrize(
    "obstacle",
    [
        BALL,
        box((1.0, 2.0, 3.0), (1.0, 0.6, 0.4), (20.0, -30.0, 70.0)),
        capsule((-1.0, 1.0), (-2.0, -2.0, 1.0), 0.3),
        cylinder((-1.0, 1.0), (-2.0, -2.0, 1.0), 0.3),
        half_space((1.0, -1.0, 0.5), (1.0, 2.0, -0.5)),
        ellipse((1.0, 2.0, 3.0), (1.2, 0.7), 35.0),
    ],
    ids=lambda obstacle: obstacle.shape,
)
def test_coals_shape_is_the_obstacle(obstacle: Any) -> None:
    ((shape, place),) = obstacle_shapes(obstacle_table((obstacle,)))
    points = place.translation + np.random.default_rng(0).uniform(-1.5, 1.5, size=(2000, 3))
    away = np.array([distance_of_point(point, placed(shape, place)) for point in points])
    if obstacle.shape == "ellipse":
        turn = pin.rpy.rpyToMatrix(0.0, 0.0, np.deg2rad(obstacle.angle))
        local = (points - obstacle.center) @ turn / np.array([1.2, 0.7, 0.7])
        is_inside = (local**2).sum(axis=1) < 1.0
    else:
        solid = placed(*arms_6r.coal_obstacle(obstacle))
        is_inside = np.array([distance_of_point(point, solid) for point in points]) < 0.0
    assert 10 < is_inside.sum() < 1990
    assert (((away < 0.0) == is_inside) | (np.abs(away) < 1e-5)).all()


def turning() -> pin.Model:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "turn")
    return model


def test_corners_of_a_mesh_are_those_of_its_hull() -> None:
    points = np.random.default_rng(4).uniform(-1.0, 1.0, size=(300, 3))
    corners, _ = hull_of(points) or (np.empty(0), None)
    assert 0 < len(corners) < 200
    geometry = geometry_of(("mesh", 0, None, mesh(points.reshape(-1, 3, 3))))
    bodies = geometry_scene(pin.Model(), geometry).bodies
    assert not bodies.exact[0] and bodies.kind[0] == HULL
    np.testing.assert_allclose(bodies.corner_points + bodies.translation, corners, atol=1e-15)


UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("joint", "shape", "message"),
    [
        (0, coal.Plane(UP, 0.0), "'b' must be a convex shape, a half-space or a mesh, was a Plane"),
        (1, coal.Halfspace(UP, 0.0), "half-space 'b' must stand still, moves with a joint"),
    ],
)
def test_shapes_that_cannot_be_bounded_are_refused(joint: int, shape: Any, message: str) -> None:
    with pytest.raises(UnsupportedShape, match=message):
        geometry_scene(turning(), geometry_of(("b", joint, None, shape)))
