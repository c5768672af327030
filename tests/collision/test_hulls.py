"""Hulls as bodies: their corners, and verdicts against coal."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.body_table import HULL
from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import Scene, geometry_scene
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


def test_corners_of_a_mesh_are_those_of_its_hull() -> None:
    points = np.random.default_rng(4).uniform(-1.0, 1.0, size=(300, 3))
    found = hull_of(points)
    assert found is not None and len(found[0]) < 200
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(found[1]), len(points))
    mesh.addVertices(points)
    mesh.addTriangles(np.arange(300).reshape(-1, 3))
    mesh.endModel()
    model, geometry = pin.Model(), pin.GeometryModel()
    geometry.addGeometryObject(pin.GeometryObject("mesh", 0, 0, pin.SE3.Identity(), mesh))
    bodies = geometry_scene(model, geometry).bodies
    assert not bodies.exact[0] and bodies.kind[0] == HULL
    np.testing.assert_allclose(bodies.corner_points + bodies.translation, found[0], atol=1e-15)


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
