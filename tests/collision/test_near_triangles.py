"""Far triangles of meshes are left out where they decide nothing: all answers stay bit for bit."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.box_support import coal
from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.collision.certifier.near_triangles import mesh_of, near_triangles, surface_of
from evoexp.collision.certifier.verdict import Verdict, certify
from evoexp.collision.scene import Scene, geometry_scene
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray


def bowl(rng: np.random.Generator, size: int = 24) -> Any:
    """Return a mesh that bulges inwards, with random bumps: 2 (size − 1)² triangles."""
    steps = np.linspace(-1.0, 1.0, size)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    heights = 0.4 * (x * x + y * y) + 0.02 * rng.uniform(-1.0, 1.0, (size, size))
    model = coal.BVHModelOBBRSS()
    points = np.stack([x, y, heights], axis=2)
    model.beginModel(0, 0)
    for i in range(size - 1):
        for j in range(size - 1):
            a, b, c, d = points[i, j], points[i + 1, j], points[i + 1, j + 1], points[i, j + 1]
            model.addTriangle(a, b, c)
            model.addTriangle(a, c, d)
    model.endModel()
    return model


def sphere() -> Any:
    return coal.Sphere(0.1)


def box() -> Any:
    return coal.Box(0.2, 0.1, 0.3)


def capsule() -> Any:
    return coal.Capsule(0.05, 0.3)


def cylinder() -> Any:
    return coal.Cylinder(0.1, 0.2)


def alone(corners: FloatArray) -> Any:
    """Return a mesh of one triangle."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(1, 3)
    model.addTriangle(*corners)
    model.endModel()
    return model


SHAPES = (sphere, box, capsule, cylinder)


def distance(one: Any, place: pin.SE3, two: Any) -> float:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    here = coal.Transform3s(place.rotation, place.translation)
    return float(coal.distance(one, here, two, coal.Transform3s(), request, result))


@pytest.mark.parametrize("make", SHAPES)
def test_no_triangle_within_reach_is_left_out(make: Any) -> None:
    rng = np.random.default_rng(3)
    mesh, other = bowl(rng), make()
    surface = surface_of(mesh)
    for _ in range(4):
        place = pin.SE3(pin.Quaternion(*_turn(rng)).matrix(), rng.uniform(-0.6, 0.6, 3))
        gaps = np.array(
            [
                distance(alone(surface.corners[corners]), place, other)
                for corners in surface.triangles
            ]
        )
        reach = float(max(np.quantile(gaps, 0.1), 0.01)) + 1e-9  # more than rounding
        kept = near_triangles(mesh, other, place, reach)
        assert set(np.flatnonzero(gaps <= reach - 1e-9)) <= set(kept.tolist())
        assert len(kept) < len(gaps)  # and some are left out
        nearer = near_triangles(mesh, other, place, 0.5 * reach, kept)
        assert (
            set(np.flatnonzero(gaps <= 0.5 * reach - 1e-9))
            <= set(nearer.tolist())
            <= set(kept.tolist())
        )


def _turn(rng: np.random.Generator) -> FloatArray:
    found = rng.normal(size=4)
    return np.asarray(found / np.sqrt((found**2).sum()))


def test_a_mesh_of_some_triangles_has_these_triangles() -> None:
    mesh = bowl(np.random.default_rng(0), 8)
    surface = surface_of(mesh)
    kept = np.array([3, 40, 41, 90])
    small = surface_of(mesh_of(mesh, kept))
    np.testing.assert_array_equal(
        small.corners[small.triangles], surface.corners[surface.triangles[kept]]
    )
    assert mesh_of(mesh, np.arange(mesh.num_tris)) is mesh


def flown_over(shape: Any, height: float, rng: np.random.Generator) -> tuple[Scene, Motion]:
    """Return a shape on two slides and a turn, close above a mesh, and a motion of it."""
    model, parent = pin.Model(), 0
    for joint in (pin.JointModelPX(), pin.JointModelPY(), pin.JointModelRX()):
        parent = model.addJoint(parent, joint, pin.SE3.Identity(), f"joint_{parent}")
    geometry = pin.GeometryModel()
    up = pin.SE3(np.eye(3), np.array([0.0, 0.0, height]))
    geometry.addGeometryObject(pin.GeometryObject("moved", parent, 0, up, shape))
    geometry.addGeometryObject(pin.GeometryObject("mesh", 0, 0, pin.SE3.Identity(), bowl(rng)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    q = np.array([[-0.5, -0.3, 0.0], [0.1, 0.05, 0.3], [0.5, 0.3, 0.1]])
    return geometry_scene(model, geometry), Motion(q)


def judged(case: tuple[Scene, Motion]) -> Verdict:
    return certify(*case)


@pytest.mark.parametrize("make", SHAPES)
@pytest.mark.parametrize("height", [0.25, 0.4, 0.9])
def test_verdicts_are_those_of_whole_meshes(
    make: Any, height: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every field, the number of queries included, with no bit that differs."""
    case = flown_over(make(), height, np.random.default_rng(1))
    narrowed = _counted(monkeypatch)
    found = judged(case)
    monkeypatch.setattr(CoalDistance, "narrow", lambda *_: None)
    assert repr(found) == repr(judged(case))
    assert found.status == "refuted" or narrowed


def _counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that grows with every mesh of near triangles that is made."""
    sizes: list[int] = []

    def made(mesh: Any, kept: Any) -> Any:
        sizes.append(len(kept))
        return mesh_of(mesh, kept)

    monkeypatch.setattr("evoexp.collision.certifier.coal_distances.mesh_of", made)
    return sizes


def test_a_distance_is_computed_once_and_counted_each_time() -> None:
    built, motion = flown_over(sphere(), 0.4, np.random.default_rng(1))
    asked = CoalDistance(built, motion, 10)
    assert asked(0, 0.5) == asked(0, 0.5)
    assert asked.queries == 2
