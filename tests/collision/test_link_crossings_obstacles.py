"""Planar arms among static obstacles: against coal, as solids of space around the plane."""

from typing import Any

import coal
import numpy as np
import pytest

from collision.test_link_crossings_envelopes import boundaries
from evoexp.collision.planar.arm_obstacles import count_obstacle_collisions, planar_obstacles
from evoexp.collision.planar.planar_arms import Arm
from evoexp.scenarios.obstacles import (
    BOX,
    CAPSULE,
    SPHERE,
    BoxObstacle,
    CapsuleObstacle,
    CylinderObstacle,
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
    found = count_obstacle_collisions(ARM, points, planar_obstacles(table))
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
    drawn = arm.outlines(np.random.default_rng(7).uniform(-np.pi, np.pi, (4, 2, 60)))
    found = count_obstacle_collisions(arm, drawn, planar_obstacles(table))
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
    obstacles = planar_obstacles(obstacle_table((obstacle,)))
    for height, expected in ((touches, 1), (misses, 0)):
        arm = Arm((0.0, height), (0.5, 0.5))
        assert (
            count_obstacle_collisions(arm, arm.outlines(np.zeros((1, 2, 1))), obstacles)[0]
            == expected
        )


def test_a_link_inside_collides_and_nothing_collides_with_nothing() -> None:
    points = ARM.outlines(np.random.default_rng(1).uniform(0.0, np.pi, (4, 2, 9)))
    for name, obstacle in {
        "disc": SphereObstacle(shape="sphere", center=(0.0, 0.0), radius=3.0),
        "box": BoxObstacle(
            shape="box", center=(0.0, 0.0), size=(5.0, 5.0), rotation=(0.0, 0.0, 20.0)
        ),
        "capsule": CapsuleObstacle(shape="capsule", start=(0.0, -1.0), end=(0.0, 1.0), radius=3.0),
    }.items():
        found = count_obstacle_collisions(
            ARM, points, planar_obstacles(obstacle_table((obstacle,)))
        )
        assert (found == 4).all(), name
    assert not count_obstacle_collisions(ARM, points, planar_obstacles(obstacle_table(()))).any()


@pytest.mark.parametrize(
    "obstacle",
    [
        SphereObstacle(shape="sphere", center=(0.0, 0.0, 0.1), radius=1.0),
        BoxObstacle(shape="box", center=(0.0, 0.0), size=(1.0, 1.0), rotation=(10.0, 0.0, 0.0)),
        BoxObstacle(shape="box", center=(0.0, 0.0, 2.0), size=(1.0, 1.0, 1.0)),
        CapsuleObstacle(shape="capsule", start=(0.0, 0.0), end=(0.0, 0.0, 1.0), radius=1.0),
        HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0), normal=(0.0, 0.0, 1.0)),
        CylinderObstacle(shape="cylinder", start=(0.0, 0.0), end=(1.0, 0.0), radius=1.0),
    ],
)
def test_obstacles_out_of_the_plane_are_refused(obstacle: Any) -> None:
    table = obstacle_table((OBSTACLES["disc"], obstacle))
    with pytest.raises(ValueError, match=r"obstacles\[1\] must be a sphere, box"):
        planar_obstacles(table)


def test_points_of_another_shape_are_refused() -> None:
    nothing = planar_obstacles(obstacle_table(()))
    with pytest.raises(ValueError, match=r"outlines must have shape .* was \(4, 3\)"):
        count_obstacle_collisions(ARM, np.zeros((4, 3)), nothing)
