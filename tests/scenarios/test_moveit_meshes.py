"""Meshes and cones of planning scenes: they lie within the hulls that stand for them."""

import itertools
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from test_moveit import document, mesh, random_pose

from evoexp.collision.scene import obstacle_shapes
from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.records import FloatArray, IntArray
from evoexp.scenarios.moveit_scene import read_world
from evoexp.scenarios.obstacles import BOX, HullObstacle, obstacle_hulls, obstacle_table
from moveit_samples import body, scene

CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def read(*objects: dict[str, Any]) -> tuple[Any, ...]:
    return read_world(document(scene(*objects)), None).obstacles


def shapes(obstacles: tuple[Any, ...]) -> list[tuple[Any, Any]]:
    return obstacle_shapes(obstacle_table(obstacles), obstacle_hulls(obstacles))


def surface(corners: FloatArray, triangles: IntArray, placement: pin.SE3) -> Any:
    """Return the mesh itself, for coal."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(triangles), len(corners))
    points = corners @ placement.rotation.T + placement.translation
    faces = coal.StdVec_Triangle()
    for face in triangles.tolist():
        faces.append(coal.Triangle(*face))
    vertices = coal.StdVec_Vec3s()
    for point in points:
        vertices.append(point)
    model.addSubModel(vertices, faces)
    model.endModel()
    return model


def distance(one: Any, at: Any, ball: Any, center: FloatArray) -> float:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    where = coal.Transform3s(np.eye(3), center)
    here = coal.Transform3s() if at is None else coal.Transform3s(at.rotation, at.translation)
    return float(coal.distance(one, here, ball, where, request, result))


@pytest.mark.parametrize("seed", range(5))
def test_a_convex_mesh_is_as_far_away_as_itself(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (own, own_plain), (inner, inner_plain) = random_pose(rng), random_pose(rng)
    corners, triangles = hull_of(rng.normal(size=(30, 3)) * [0.3, 0.1, 0.2]) or (CUBE, CUBE)
    obstacles = read(mesh(corners, triangles, pose=own_plain, mesh_poses=[inner_plain]))
    ((shape, placement),) = shapes(obstacles)
    itself, ball = surface(corners, triangles, own * inner), coal.Sphere(0.01)
    for _ in range(50):
        center = (own * inner).translation + rng.normal(size=3)
        expected = distance(itself, None, ball, center)
        found = distance(shape, placement, ball, center)
        if found > 0.0:  # coal takes the inside of a surface to be outside
            assert found == pytest.approx(expected, abs=1e-6)


def test_searches_take_the_box_around_a_hull() -> None:
    rng = np.random.default_rng(0)
    pose, plain = random_pose(rng)
    corners, triangles = hull_of(rng.normal(size=(20, 3))) or (CUBE, CUBE)
    table = obstacle_table(read(mesh(corners, triangles, mesh_poses=[plain])))
    assert table.kind.tolist() == [BOX]
    points = corners @ pose.rotation.T + pose.translation
    inside = (points - table.center[0]) @ table.rotation[0].reshape(3, 3)
    assert np.abs(inside).max(axis=0) == pytest.approx(table.size[0], abs=1e-9)


def test_parts_that_do_not_hang_together_are_bodies_of_their_own() -> None:
    corners, triangles = hull_of(CUBE) or (CUBE, CUBE)
    split = corners[triangles].reshape(-1, 3)  # every triangle with corners of its own
    both = np.vstack([split, split + np.array([5.0, 0.0, 0.0])])
    obstacles = read(mesh(both, np.arange(len(both)).reshape(-1, 3)))
    assert [each.name for each in obstacles] == ["thing_1", "thing_2"]
    assert [len(each.points) for each in obstacles] == [8, 8]
    table = obstacle_table(obstacles)
    assert np.allclose(np.sort(table.center[:, 0]), [0.0, 5.0]) and np.allclose(table.size, 1.0)


def test_a_cone_lies_within_its_pyramid_and_nearly_fills_it() -> None:
    rng = np.random.default_rng(1)
    pose, plain = random_pose(rng)
    (pyramid,) = shapes(read(body("cone", [0.8, 0.3], [0, 0, 0], primitive_poses=[plain])))
    cone, ball = coal.Cone(0.3, 0.8), coal.Sphere(0.01)
    off = []
    for _ in range(200):
        center = pose.translation + rng.normal(size=3)
        off.append(distance(cone, pose, ball, center) - distance(*pyramid, ball, center))
    assert min(off) > -1e-6 and max(off) < 0.3 * 0.006


def test_points_in_a_plane_are_no_hull() -> None:
    slanted = ((0.0, 0.0, 0.0), (1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 1.0, 1.0))
    level = tuple((x, y, 0.0) for x, y, _ in slanted)
    for points in (slanted, level):
        with pytest.raises(SettingError, match=r"scenario.obstacles\[0\].points: .* no plane"):
            shapes((HullObstacle(shape="hull", points=points),))
