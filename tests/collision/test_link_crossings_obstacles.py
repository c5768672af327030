"""Planar arms among static obstacles: against coal, as solids of space around the plane."""

from typing import Any

import coal
import numpy as np
import pytest

from collision.test_link_crossings_envelopes import boundaries
from evoexp.collision.planar.link_collision import LinkCollision, LinkCrossings
from evoexp.collision.planar.planar_arms import Arm
from evoexp.errors import SettingError
from evoexp.robots.planar_chain import PlanarChain
from evoexp.scenarios.obstacles import (
    BOX,
    CAPSULE,
    SPHERE,
    BoxObstacle,
    CapsuleObstacle,
    EllipseObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
    obstacle_table,
)

ARM = Arm((0.1, -0.05), (0.3, 0.2))
OBSTACLES: dict[str, Any] = {
    "disc": SphereObstacle(shape="sphere", center=(0.3, 0.2), radius=0.08),
    "box": BoxObstacle(shape="box", center=(0.2, 0.3), size=(0.2, 0.05), rotation=(0.0, 0.0, 35.0)),
    "tall box": BoxObstacle(shape="box", center=(-0.1, 0.1, 0.5), size=(0.1, 0.1, 1.5)),
    "capsule": CapsuleObstacle(shape="capsule", start=(-0.2, 0.3), end=(0.0, 0.45), radius=0.04),
    "wall": HalfSpaceObstacle(shape="half_space", point=(0.4, 0.0), normal=(-1.0, 0.2)),
}


def bound(arm: Arm, *obstacles: Any) -> LinkCollision:
    """Return the collision model of one arm among obstacles."""
    robot = PlanarChain(link_lengths=arm.lengths, base_position=arm.base)
    model = LinkCrossings(
        collision_substeps=1, half_width=arm.half_width, tcp_radius=arm.tcp_radius
    )
    return model.bind(robot.build(), obstacles)


def solid(table: Any, k: int) -> tuple[Any, Any]:
    """Return an obstacle as a coal shape, and its place."""
    turn = table.rotation[k].reshape(3, 3)
    a, b, c = table.size[k]
    place = coal.Transform3s(turn, table.center[k])
    if table.kind[k] == SPHERE:
        return coal.Sphere(a), place
    if table.kind[k] == BOX:
        return coal.Box(2.0 * a, 2.0 * b, 2.0 * c), place
    if table.kind[k] == CAPSULE:
        return coal.Capsule(a, 2.0 * b), place
    return coal.Halfspace(turn[:, 2], float(turn[:, 2] @ table.center[k])), coal.Transform3s()


def rod(ends: Any) -> tuple[Any, Any]:
    """Return a segment of the plane as a coal capsule of radius 0, and its place."""
    start, end = np.array([*ends[:2], 0.0]), np.array([*ends[2:], 0.0])
    length = np.linalg.norm(end - start)
    axis = (end - start) / length
    turn = np.column_stack([np.cross([0.0, 0.0, 1.0], axis), [0.0, 0.0, 1.0], axis])
    return coal.Capsule(0.0, length), coal.Transform3s(turn, 0.5 * (start + end))


def distance(first: Any, second: Any) -> float:
    return float(coal.distance(*first, *second, coal.DistanceRequest(), coal.DistanceResult()))


@pytest.mark.parametrize("names", [*([name] for name in OBSTACLES), list(OBSTACLES)], ids=" ".join)
def test_counts_are_coal_s(names: Any) -> None:
    table = obstacle_table(tuple(OBSTACLES[name] for name in names))
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (4, 2, 60))
    points = ARM.outlines(q)
    found = bound(ARM, *(OBSTACLES[name] for name in names)).with_obstacles(0, q)
    least = np.empty((4, 60))
    for k, n in np.ndindex(4, 60):
        rods = [rod([*ARM.base, *points[k, :2, n]]), rod(points[k, :4, n])]
        least[k, n] = min(
            distance(one, solid(table, o)) for one in rods for o in range(len(table.kind))
        )
    assert not (
        (least > 0.0) & (least < 1e-7)
    ).any()  # a rod has no inside: where it crosses, coal may say 0
    assert np.array_equal(found, (least <= 0.0).sum(axis=0))
    assert 0 < found.sum() < least.size


@pytest.mark.examples(2)
@pytest.mark.parametrize("names", [*([name] for name in OBSTACLES), list(OBSTACLES)], ids=" ".join)
def test_envelopes_are_coal_s(names: Any) -> None:
    table = obstacle_table(tuple(OBSTACLES[name] for name in names))
    arm = ARM._replace(half_width=0.03, tcp_radius=0.07)
    q = np.random.default_rng(7).uniform(-np.pi, np.pi, (4, 2, 60))
    drawn = arm.outlines(q)
    found = bound(arm, *(OBSTACLES[name] for name in names)).with_obstacles(0, q)
    lines = boundaries(arm, drawn)
    least = np.empty((4, 60))
    for k, n in np.ndindex(4, 60):
        ball = coal.Sphere(arm.tcp_radius), coal.Transform3s(np.array([*drawn[k, 2:4, n], 0.0]))
        parts = [ball, *(rod(line[:, k, n]) for line in lines)]
        least[k, n] = min(
            distance(one, solid(table, o)) for one in parts for o in range(len(table.kind))
        )
    assert not (
        (least > 0.0) & (least < 1e-7)
    ).any()  # a rod has no inside: where it crosses, coal may say 0
    assert np.array_equal(found, (least <= 0.0).sum(axis=0))
    assert 0 < found.sum() < least.size


@pytest.mark.parametrize(
    ("obstacle", "touches", "misses"),
    [
        (SphereObstacle(shape="sphere", center=(0.5, 0.25), radius=0.25), 0.0, -0.001),
        (BoxObstacle(shape="box", center=(0.5, 0.25), size=(0.5, 0.5)), 0.0, -0.001),
        (
            CapsuleObstacle(shape="capsule", start=(0.25, 0.25), end=(0.75, 0.25), radius=0.25),
            0.0,
            -0.001,
        ),
        (
            CapsuleObstacle(shape="capsule", start=(0.5, 0.5), end=(0.5, -0.5), radius=0.001),
            -0.2,
            -0.502,
        ),
        (HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0), normal=(0.0, -1.0)), 0.0, -0.001),
    ],
)
def test_touching_counts(obstacle: Any, touches: float, misses: float) -> None:
    for height, expected in ((touches, 1), (misses, 0)):
        arm = Arm((0.0, height), (0.5, 0.5))
        assert bound(arm, obstacle).with_obstacles(0, np.zeros((1, 2, 1)))[0] == expected


def test_a_link_inside_collides_and_nothing_collides_with_nothing() -> None:
    q = np.random.default_rng(1).uniform(0.0, np.pi, (4, 2, 9))
    for name, obstacle in {
        "disc": SphereObstacle(shape="sphere", center=(0.0, 0.0), radius=3.0),
        "box": BoxObstacle(
            shape="box", center=(0.0, 0.0), size=(5.0, 5.0), rotation=(0.0, 0.0, 20.0)
        ),
        "capsule": CapsuleObstacle(shape="capsule", start=(0.0, -1.0), end=(0.0, 1.0), radius=3.0),
    }.items():
        assert (bound(ARM, obstacle).with_obstacles(0, q) == 4).all(), name
    assert not bound(ARM).with_obstacles(0, q).any()


def test_an_ellipse_is_refused() -> None:
    ellipse = EllipseObstacle(shape="ellipse", center=(0.0, 0.0), semi_axes=(1.0, 2.0))
    with pytest.raises(SettingError, match=r"scenario.obstacles\[1\].shape: must be any but"):
        bound(ARM, OBSTACLES["disc"], ellipse)
