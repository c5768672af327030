"""Balls of different radii around hulls: they contain them, and reach no farther than they say."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from collision.test_hulls import cloud, convex
from evoexp.collision.covers import body_covers
from evoexp.collision.covers.body_covers import MOST_VARIED, sphere_cover

SIZES = {"ball": 0.1, "cloud": 0.04, "plate": 0.03, "cylinder": 0.07}


def hull(kind: str) -> pin.GeometryObject:
    rng = np.random.default_rng(8)
    place = pin.SE3(pin.exp3(np.array([0.2, 0.4, -0.3])), np.array([0.1, 0.2, 0.3]))
    points = cloud(rng, kind, 150) * SIZES[kind] * np.array([1.0, 1.3, 0.8])
    return pin.GeometryObject("hull", 0, 0, place, convex(points))


@pytest.mark.parametrize("kind", SIZES)
def test_they_contain_the_hull_and_reach_as_far_as_asked(kind: str) -> None:
    item, rng = hull(kind), np.random.default_rng(9)
    cover = sphere_cover(item, 0.01)
    assert cover.inflation == 0.01
    assert 0 < len(cover.radius) <= MOST_VARIED
    # points of the hull: mixtures of few corners, many of them on edges and faces
    corners = np.array([item.geometry.point(k) for k in range(item.geometry.num_points)])
    shares = rng.dirichlet(np.full(len(corners), 0.02), 20_000)
    points = shares @ corners @ item.placement.rotation.T + item.placement.translation
    off = np.sqrt(((points[:, None] - cover.start) ** 2).sum(axis=2)) - cover.radius
    assert off.min(axis=1).max() <= 0.0
    # points of the balls' surfaces
    ways = rng.normal(size=(300, 3))
    ways /= np.sqrt((ways**2).sum(axis=1))[:, None]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    place = coal.Transform3s(item.placement.rotation, item.placement.translation)
    worst = 0.0
    for center, radius in zip(cover.start, cover.radius, strict=True):
        for point in (center + radius * ways)[:: max(1, len(cover.radius) // 20)]:
            there = coal.Transform3s(np.eye(3), point)
            result.clear()
            away = coal.distance(coal.Sphere(1e-9), there, item.geometry, place, request, result)
            worst = max(worst, away)
    assert 0.005 < worst <= 0.01 + 1e-6


def test_where_they_do_not_suffice_they_reach_farther_and_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(body_covers, "MOST_VARIED", 20)
    cover = sphere_cover(hull("cylinder"), 0.002)
    assert len(cover.radius) <= 20
    assert 0.002 < cover.inflation < 0.05


def test_they_take_fewer_than_equal_spheres() -> None:
    item = hull("ball")
    mesh = coal.BVHModelOBBRSS()
    triangles = [item.geometry.polygons(k) for k in range(item.geometry.num_polygons)]
    mesh.beginModel(len(triangles), 3 * len(triangles))
    for face in triangles:
        mesh.addTriangle(*(item.geometry.point(face[k]) for k in range(3)))
    mesh.endModel()
    equal = sphere_cover(pin.GeometryObject("mesh", 0, 0, item.placement, mesh), 0.08)
    varied = sphere_cover(item, 0.08)
    assert len(varied.radius) < len(equal.radius)
