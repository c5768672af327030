import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.bodies.body_models import BodyCapsules
from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.covers.body_covers import MOST_SPHERES, Cover, capsule_cover, sphere_cover

PLACE = pin.SE3(
    pin.Quaternion(0.5, 0.1, -0.7, 0.3).normalized().toRotationMatrix(), np.array([0.3, -0.2, 0.1])
)


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


def points_of(shape: object, count: int = 4000) -> np.ndarray:
    """Return points of a shape, most of them on its surface, in its own frame."""
    rng = np.random.default_rng(0)
    u = rng.normal(size=(count, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    inside = np.where(rng.random(count) < 0.7, 1.0, rng.random(count))[:, None]
    if isinstance(shape, coal.Sphere):
        return u * shape.radius * inside
    if isinstance(shape, coal.Ellipsoid):
        return u * shape.radii * inside
    if isinstance(shape, coal.Capsule):
        return (
            u * shape.radius * inside
            + [0, 0, 1] * rng.uniform(-1, 1, (count, 1)) * shape.halfLength
        )
    if isinstance(shape, coal.Box):
        cube = rng.uniform(-1, 1, (count, 3))
        cube[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-1, 1], count)
        return cube * shape.halfSide * inside
    angle, height = rng.uniform(0, 2 * np.pi, count), rng.uniform(-1, 1, count)
    flat = rng.random(count) < 0.5
    share = np.where(flat, np.sqrt(rng.random(count)), 1.0)
    height = np.where(flat, np.sign(height), height)
    if isinstance(shape, coal.Cone):
        share = share * 0.5 * (1.0 - height)
    radius = shape.radius * share
    return np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), height * shape.halfLength]
    )


def distance_to(cover: Cover, points: np.ndarray) -> np.ndarray:
    """Return distances of points from a cover, negative inside."""
    along = cover.end - cover.start
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - cover.start) * along).sum(axis=2) / square, 0.0, 1.0)
    nearest = cover.start + share[..., None] * along
    return np.asarray(
        (np.linalg.norm(points[:, None] - nearest, axis=2) - cover.radius).min(axis=1)
    )


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("inflation", [0.01, 0.02, 0.05])
def test_spheres_cover_a_body_and_reach_no_farther_than_they_say(
    name: str, inflation: float
) -> None:
    item = pin.GeometryObject(name, 0, 0, PLACE, SHAPES[name])
    cover = sphere_cover(item, inflation)
    points = points_of(SHAPES[name]) @ PLACE.rotation.T + PLACE.translation
    assert distance_to(cover, points).max() <= 1e-12
    assert len(cover.radius) <= MOST_SPHERES or name == "capsule"
    if len(cover.radius) < MOST_SPHERES // 2 and name not in ("rod", "disc", "cone", "ellipsoid"):
        assert cover.inflation <= inflation + 1e-12
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    for center, radius in zip(cover.start, cover.radius, strict=True):
        result.clear()
        ball = coal.Transform3s(np.eye(3), center)
        body = coal.Transform3s(PLACE.rotation, PLACE.translation)
        away = coal.distance(coal.Sphere(1e-6), ball, SHAPES[name], body, request, result)
        assert away + radius <= cover.inflation + 1e-5 or away <= 0.0


@pytest.mark.parametrize("name", SHAPES)
def test_one_capsule_covers_a_body(name: str) -> None:
    cover = capsule_cover(pin.GeometryObject(name, 0, 0, PLACE, SHAPES[name]))
    points = points_of(SHAPES[name]) @ PLACE.rotation.T + PLACE.translation
    assert len(cover.radius) == 1
    assert distance_to(cover, points).max() <= 1e-12
    if name in ("sphere", "capsule"):
        assert cover.inflation == 0.0


def test_a_capsule_around_a_cylinder_is_as_thick_as_it() -> None:
    for shape in (coal.Cylinder(0.5, 0.2), coal.Cylinder(0.1, 2.0)):
        item = pin.GeometryObject("cylinder", 0, 0, PLACE, shape)
        cover = BodyCapsules(padding=0.0, around_cylinders=True).cover(item)
        points = points_of(shape) @ PLACE.rotation.T + PLACE.translation
        assert distance_to(cover, points).max() <= 1e-12
        assert cover.radius == pytest.approx([shape.radius])
        assert cover.inflation == pytest.approx(shape.radius)  # beyond the faces
        assert np.linalg.norm(cover.end - cover.start) == pytest.approx(2.0 * shape.halfLength)
    item = pin.GeometryObject("box", 0, 0, PLACE, SHAPES["box"])
    one, other = (
        BodyCapsules(padding=0.1, around_cylinders=around).cover(item) for around in (True, False)
    )
    assert repr(one) == repr(other)


def test_less_inflation_takes_more_spheres() -> None:
    item = pin.GeometryObject("box", 0, 0, PLACE, SHAPES["box"])
    sizes = [len(sphere_cover(item, inflation).radius) for inflation in (0.05, 0.03, 0.02)]
    assert sizes == sorted(sizes) and sizes[0] < sizes[-1]


def test_a_half_space_cannot_be_covered() -> None:
    with pytest.raises(UnsupportedShape, match="body 'floor' must be a solid, was a Halfspace"):
        sphere_cover(
            pin.GeometryObject(
                "floor", 0, 0, PLACE, coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
            ),
            0.1,
        )
