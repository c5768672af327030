"""Covers out of the cache are those that are found anew, to the bit."""

from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.covers.body_covers import kept_sphere_cover, sphere_cover

PLACE = pin.SE3(
    pin.Quaternion(0.5, 0.1, -0.7, 0.3).normalized().toRotationMatrix(), np.array([0.3, -0.2, 0.1])
)


def hull(scale: float = 1.0) -> coal.ConvexBase:
    rng = np.random.default_rng(1)
    points = coal.StdVec_Vec3s()
    for corner in rng.normal(size=(30, 3)) * (0.1, 0.05, 0.03) * scale:
        points.append(corner)
    return coal.Convex.convexHull(points, True, "Qt")


SHAPES = {
    "ball": coal.Sphere(0.1),
    "box": coal.Box(0.1, 0.25, 0.06),
    "cylinder": coal.Cylinder(0.03, 0.25),
    "ellipsoid": coal.Ellipsoid(0.1, 0.05, 0.07),
    "hull": hull(),
}


@pytest.mark.parametrize("kind", SHAPES)
def test_a_kept_cover_is_the_one_that_was_found(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    item = pin.GeometryObject(kind, 0, 0, PLACE, SHAPES[kind])
    expected = sphere_cover(item, 0.03)

    def check() -> None:
        found = kept_sphere_cover(item, 0.03)
        assert all(np.array_equal(a, b) for a, b in zip(found, expected, strict=True))

    check()
    check()
    files = list((tmp_path / "cache/covers").glob("*"))
    assert len(files) == (0 if kind == "ball" else 1)
    for file in files:
        file.write_bytes(b"damaged")
        check()


def test_whatever_matters_is_in_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    aside = pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0]))
    cases = [
        (PLACE, hull(), 0.03),
        (aside, hull(), 0.03),
        (PLACE, hull(1.01), 0.03),
        (PLACE, hull(), 0.029),
        (PLACE, coal.Box(0.1, 0.25, 0.06), 0.03),
        (PLACE, coal.Ellipsoid(0.1, 0.25, 0.06), 0.03),
    ]
    for count, (place, shape, inflation) in enumerate(cases, 1):
        kept_sphere_cover(pin.GeometryObject("body", 0, 0, place, shape), inflation)
        assert len(list((tmp_path / "cache/covers").glob("*"))) == count
