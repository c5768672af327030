"""Covers of bodies: they contain the body and reach no farther than they say."""

import itertools
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from coal_shapes import distance_of_point, placed
from evoexp.collision.bodies.body_models import BodyCapsules
from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.covers import body_covers as covers
from evoexp.collision.covers import solid_balls
from evoexp.numeric.convex_hull import hull_of
from evoexp.records import FloatArray
from evoexp.robots.meshes import convex_shape

TURN = pin.Quaternion(0.5, 0.1, -0.7, 0.3).normalized().toRotationMatrix()
PLACE = pin.SE3(TURN, np.array([0.3, -0.2, 0.1]))
SHAPES = {
    "sphere": coal.Sphere(0.1),
    "capsule": coal.Capsule(0.05, 0.4),
    "box": coal.Box(0.1, 0.25, 0.06),
    "cube": coal.Box(0.1, 0.1, 0.1),
    "rod": coal.Cylinder(0.03, 0.25),
    "disc": coal.Cylinder(0.1, 0.04),
    "cone": coal.Cone(0.05, 0.2),
    "ellipsoid": coal.Ellipsoid(0.1, 0.05, 0.07),
}
SIZES = {"ball": 0.1, "cloud": 0.04, "plate": 0.03, "cylinder": 0.07}


def body(shape: object, place: pin.SE3 = PLACE) -> pin.GeometryObject:
    return pin.GeometryObject("body", 0, 0, place, shape)


def cloud(rng: np.random.Generator, kind: str, count: int) -> np.ndarray:
    points = rng.normal(size=(count, 3))
    if kind == "ball":
        return np.asarray(points / np.sqrt((points**2).sum(axis=1))[:, None])
    if kind == "plate":  # flat, with many corners in one plane
        points[:, 2] = 0.01 * np.round(rng.random(count))
    if kind == "cylinder":
        turns = 2.0 * np.pi * np.arange(count) / count
        points = np.column_stack([np.cos(turns), np.sin(turns), np.arange(count) % 2])
    return np.asarray(points)


def hull(kind: str, scale: float = 1.0) -> coal.Convex:
    points = cloud(np.random.default_rng(8), kind, 150) * SIZES[kind] * np.array([1.0, 1.3, 0.8])
    return convex_shape(*(hull_of(points * scale) or ()))


def points_of(shape: Any) -> np.ndarray:
    """Return corners of a shape in the world, and mixtures of few: on edges, on faces, inside."""
    rng = np.random.default_rng(0)
    u = rng.normal(size=(2000, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    ends = np.sign(u[:, 2:]) * getattr(shape, "halfLength", 0.0)
    rim = u[:, :2] / np.linalg.norm(u[:, :2], axis=1)[:, None]
    if isinstance(shape, coal.Convex):
        corners = np.array([shape.point(k) for k in range(shape.num_points)])
    elif isinstance(shape, coal.Box):
        corners = np.sign(u) * shape.halfSide
    elif isinstance(shape, coal.Ellipsoid):
        corners = u * shape.radii
    elif isinstance(shape, coal.Sphere | coal.Capsule):
        corners = u * shape.radius + np.array([0.0, 0.0, 1.0]) * ends
    else:
        apex = isinstance(shape, coal.Cone) & (ends > 0.0)
        corners = np.hstack([np.where(apex, 0.0, shape.radius * rim), ends])
    chosen = corners[rng.integers(0, len(corners), (6000, 4))]
    local = np.vstack([corners, (rng.dirichlet(np.full(4, 0.3), 6000)[..., None] * chosen).sum(1)])
    return local @ PLACE.rotation.T + PLACE.translation


def distance_to(cover: covers.Cover, points: np.ndarray) -> np.ndarray:
    """Return distances of points from a cover, negative inside."""
    along = cover.end - cover.start
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - cover.start) * along).sum(axis=2) / square, 0.0, 1.0)
    nearest = cover.start + share[..., None] * along
    away = np.linalg.norm(points[:, None] - nearest, axis=2) - cover.radius
    return np.asarray(away.min(axis=1))


def farthest(cover: covers.Cover, shape: object) -> float:
    """Return the greatest distance from a shape of points on balls around the ends of axes."""
    ways = np.random.default_rng(9).normal(size=(300, 3))
    ways /= np.sqrt((ways**2).sum(axis=1))[:, None]
    balls = zip((*cover.start, *cover.end), np.tile(cover.radius, 2), strict=True)
    return max(
        distance_of_point(point, placed(shape, PLACE))
        for center, radius in balls
        for point in (center + radius * ways)[:: max(1, len(cover.radius) // 20)]
    )


@pytest.mark.parametrize(
    ("name", "inflation"),
    [*itertools.product(SHAPES, (0.01, 0.02, 0.05)), *((kind, 0.01) for kind in SIZES)],
)
def test_spheres_cover_a_body_and_reach_as_far_as_they_say(name: str, inflation: float) -> None:
    is_hull = name in SIZES
    shape = hull(name) if is_hull else SHAPES[name]
    cover = covers.sphere_cover(body(shape), inflation)
    assert distance_to(cover, points_of(shape)).max() <= 1e-12
    most = solid_balls.MOST_VARIED if is_hull else covers.MOST_SPHERES
    assert 0 < len(cover.radius) <= most or name == "capsule"
    is_round = name in ("rod", "disc", "cone", "ellipsoid")
    if len(cover.radius) < covers.MOST_SPHERES // 2 and not is_round:
        assert cover.inflation <= inflation + 1e-12
    worst = farthest(cover, shape)
    assert worst <= cover.inflation + 1e-5
    assert not is_hull or (cover.inflation == 0.01 and worst > 0.005)


def test_where_balls_do_not_suffice_they_reach_farther_and_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(solid_balls, "MOST_VARIED", 20)
    cover = covers.sphere_cover(body(hull("cylinder")), 0.002)
    assert len(cover.radius) <= 20
    assert 0.002 < cover.inflation < 0.05


@pytest.mark.parametrize("name", SHAPES)
def test_one_capsule_covers_a_body(name: str) -> None:
    cover = covers.capsule_cover(body(SHAPES[name]))
    assert len(cover.radius) == 1
    assert distance_to(cover, points_of(SHAPES[name])).max() <= 1e-12
    assert cover.inflation == 0.0 or name not in ("sphere", "capsule")
    assert farthest(cover, SHAPES[name]) <= cover.inflation + 1e-5


@pytest.mark.parametrize("shape", [coal.Cylinder(0.5, 0.2), coal.Cylinder(0.1, 2.0)])
def test_a_capsule_around_a_cylinder_is_as_thick_as_it(shape: coal.Cylinder) -> None:
    cover = BodyCapsules(padding=0.0, around_cylinders=True).cover(body(shape))
    assert distance_to(cover, points_of(shape)).max() <= 1e-12
    assert cover.radius == pytest.approx([shape.radius])
    assert cover.inflation == pytest.approx(shape.radius)  # beyond the faces
    assert np.linalg.norm(cover.end - cover.start) == pytest.approx(2.0 * shape.halfLength)


def test_a_half_space_cannot_be_covered() -> None:
    floor = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    with pytest.raises(UnsupportedShape, match="body 'body' must be a solid, was a Halfspace"):
        covers.sphere_cover(body(floor), 0.1)


@pytest.mark.parametrize("name", ["sphere", "box", "rod", "ellipsoid", "hull"])
def test_a_cover_out_of_the_cache_is_the_one_that_is_found_anew(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path))
    item = body(hull("cloud") if name == "hull" else SHAPES[name])
    expected = covers.sphere_cover(item, 0.03)
    for time in ("first", "second", "damaged"):
        cover = covers.kept_sphere_cover(item, 0.03)
        assert all(np.array_equal(a, b) for a, b in zip(cover, expected, strict=True)), time
        files = list((tmp_path / "covers").glob("*"))
        assert len(files) == (0 if name == "sphere" else 1)
        for file in files if time == "second" else ():
            file.write_bytes(b"damaged")


def test_whatever_matters_is_in_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path))
    aside = pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0]))
    cases = [
        (PLACE, hull("cloud"), 0.03),
        (aside, hull("cloud"), 0.03),
        (PLACE, hull("cloud", 1.01), 0.03),
        (PLACE, hull("cloud"), 0.029),
        (PLACE, SHAPES["box"], 0.03),
        (PLACE, coal.Ellipsoid(0.1, 0.25, 0.06), 0.03),
    ]
    for count, (place, shape, inflation) in enumerate(cases, 1):
        covers.kept_sphere_cover(body(shape, place), inflation)
        assert len(list((tmp_path / "covers").glob("*"))) == count


DEPTH = 0.001


def reach_of(shape: object, n: FloatArray) -> float:
    """Return the greatest reach of a shape against direction n, by its corners or closed form."""
    if isinstance(shape, coal.Box):
        return float(np.abs(n) @ shape.halfSide)
    if isinstance(shape, coal.Cylinder):
        return float(shape.radius * np.hypot(n[0], n[1]) + shape.halfLength * abs(n[2]))
    return float(shape.radius + getattr(shape, "halfLength", 0.0) * abs(n[2]))


@pytest.mark.parametrize(
    "shape",
    [
        *(coal.Cylinder(0.03, 0.25), coal.Cylinder(0.2, 0.01), coal.Box(0.13, 0.04, 0.05)),
        *(coal.Box(0.5, 0.5, 0.001), coal.Capsule(0.01, 0.06), coal.Sphere(0.04)),
    ],
)
def test_free_inner_shapes_mean_no_deeper_than_allowed_on_any_tilted_plane(shape: object) -> None:
    """And what does not reach half as deep is never refused."""
    inner = covers.inner_balls(body(shape), DEPTH)
    # cylinders: 24 points on a rim miss its lowest point by r (1 − cos 7.5°)
    missed = shape.radius * 0.0086 if isinstance(shape, coal.Cylinder) else 0.0
    for n in np.random.default_rng(1).normal(size=(200, 3)):
        n /= np.linalg.norm(n)
        local = np.concatenate([inner.start, inner.end]) - PLACE.translation
        inner_reach = float((np.tile(inner.radius, 2) - local @ n).max())
        deeper = reach_of(shape, PLACE.rotation.T @ n) - inner_reach
        assert -1e-12 <= deeper <= DEPTH + missed + 1e-12
        assert deeper >= min(0.5 * DEPTH, deeper + inner_reach) - 1e-12


def test_other_inner_shapes_are_left_to_the_exact_verdict() -> None:
    assert covers.inner_balls(body(SHAPES["ellipsoid"]), DEPTH) is None
