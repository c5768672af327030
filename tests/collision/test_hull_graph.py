"""Climbs along the edges of hulls, against a look at every corner; verdicts, against coal."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.body_table import HULL, BodyTable
from evoexp.collision.certifier.convex_distance import _farthest_corner
from evoexp.collision.certifier.verdict import certify
from evoexp.collision.hull_graph import FEWEST, hull_graph
from evoexp.collision.scene import Scene, geometry_scene
from evoexp.numeric.compilation import kernel
from evoexp.numeric.convex_hull import hull_of
from evoexp.paths.motion import Motion


def cloud(rng: np.random.Generator, kind: str, count: int) -> np.ndarray:
    points = rng.normal(size=(count, 3))
    if kind == "ball":
        return np.asarray(points / np.sqrt((points**2).sum(axis=1))[:, None])
    if kind == "plate":  # flat, with many corners in one plane
        points[:, 2] = 0.01 * np.round(rng.random(count))
    if kind == "cylinder":
        turns = 2.0 * np.pi * np.arange(count) / count
        points = np.column_stack([np.cos(turns), np.sin(turns), np.arange(count) % 2])
    if kind == "grid":  # all corners but eight lie within faces or edges
        axes = np.linspace(-1.0, 1.0, 5)
        points = np.array(np.meshgrid(axes, axes, axes)).reshape(3, -1).T
    return np.asarray(points)


def convex(points: np.ndarray) -> coal.Convex:
    found = hull_of(points)
    assert found is not None
    corners, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in found[0]:
        corners.append(corner)
    for face in found[1].tolist():
        faces.append(coal.Triangle(*face))
    return coal.Convex(corners, faces)


def hull_scene(points: np.ndarray, others: list[tuple[coal.CollisionGeometry, pin.SE3]]) -> Scene:
    """A hull that slides along x past other bodies."""
    model, geometry = pin.Model(), pin.GeometryModel()
    model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "x")
    turned = pin.SE3(pin.exp3(np.array([0.3, -0.2, 0.5])), np.array([0.0, 0.7, -0.1]))
    geometry.addGeometryObject(pin.GeometryObject("hull", 1, 0, turned, convex(points)))
    for k, (shape, place) in enumerate(others):
        geometry.addGeometryObject(pin.GeometryObject(f"other_{k}", 0, 0, place, shape))
        geometry.addCollisionPair(pin.CollisionPair(0, k + 1))
    return geometry_scene(model, geometry)


@kernel
def climb(bodies: BodyTable, directions: np.ndarray, out: np.ndarray) -> None:
    for k in range(len(directions)):
        x, y, z = directions[k]
        out[k] = _farthest_corner(bodies, 0, x, y, z)


@pytest.mark.parametrize("kind", ["ball", "cloud", "plate", "cylinder", "grid"])
def test_a_climb_ends_at_the_farthest_corner(kind: str) -> None:
    rng = np.random.default_rng(3)
    bodies = hull_scene(cloud(rng, kind, 400), []).bodies
    corners = bodies.corner_points
    assert bodies.kind[0] == HULL
    assert (bodies.starts[0].max() >= 0) == (len(corners) >= FEWEST)
    directions = np.vstack([rng.normal(size=(5000, 3)), np.eye(3), -np.eye(3), [[1.0, 1.0, 0.0]]])
    chosen = np.empty(len(directions), dtype=np.int64)
    climb(bodies, directions, chosen)
    heights = (directions[:, None] * corners).sum(axis=2)
    reached = heights[np.arange(len(directions)), chosen]
    assert np.abs(reached - heights.max(axis=1)).max() < 1e-14


def test_corners_of_a_hull_hold_all_points() -> None:
    points = np.random.default_rng(4).uniform(-1.0, 1.0, size=(300, 3))
    graph = hull_graph(points)
    assert FEWEST <= len(graph.corners) < 200
    directions = np.random.default_rng(5).normal(size=(500, 3))
    most = (points[:, None] * directions).sum(axis=2).max(axis=0)
    assert (graph.corners[:, None] * directions).sum(axis=2).max(axis=0) == pytest.approx(most)
    edges = {(k, int(n)) for k, others in enumerate(graph.neighbours) for n in others}
    assert edges == {(n, k) for k, n in edges}


def test_points_in_a_plane_have_no_edges() -> None:
    flat = np.random.default_rng(6).normal(size=(100, 3)) * [1.0, 1.0, 0.0]
    graph = hull_graph(flat)
    assert np.array_equal(graph.corners, flat) and graph.starts.max() == -1


@pytest.mark.parametrize("kind", ["ball", "cloud", "cylinder"])
def test_verdicts_on_hulls_are_those_of_coal(kind: str) -> None:
    rng = np.random.default_rng(7)
    motion, seen = Motion(np.array([[-3.0], [0.5], [3.0]])), set()
    for _ in range(12):
        place = pin.SE3(
            pin.Quaternion(rng.normal(size=4)).normalized().toRotationMatrix(),
            rng.uniform(0.3, 3.0, size=3) * rng.choice([-1.0, 1.0], size=3),
        )
        others = [(coal.Box(0.4, 0.5, 0.6), place), (coal.Cylinder(0.2, 0.9), place.inverse())]
        points = 0.4 * cloud(rng, kind, 200)
        built = hull_scene(points, others)
        verdict = certify(built, motion)
        data, placed = built.model.createData(), built.geometry.createData()
        least = np.inf
        for t in np.linspace(0.0, 2.0, 801):
            pin.computeDistances(built.model, data, built.geometry, placed, motion.at(t))
            least = min(least, *(found.min_distance for found in placed.distanceResults))
        if verdict.status == "refuted":
            assert least < 0.01
        else:
            # samples stand 2.5e-3 of a segment apart, which is at most 9 mm
            assert verdict.clearance - 1e-9 <= least <= verdict.clearance + 0.0045
        seen.add(verdict.status)
    assert seen == {"certified", "refuted"}
