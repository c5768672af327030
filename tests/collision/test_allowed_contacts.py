"""Pairs that may touch: their depths over whole motions, and what the verdict makes of them."""

import math

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.certifier.allowed_contacts import contact_depths
from evoexp.collision.certifier.certificate import certificate
from evoexp.collision.scene import AllowedContact, Part, Scene, geometry_scene
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

TOP = 0.5  # of the table [m]
RADIUS, HALF = 0.03, 0.125  # of the bottle [m]
ALLOWED = 0.001  # [m]


def held_bottle(depth: float = ALLOWED, shape: object = None) -> Scene:
    """Return a bottle on three slides and two turns, above a table that it may touch."""
    model, axes = pin.Model(), ("PX", "PY", "PZ", "RX", "RY")
    parent = 0
    for axis in axes:
        joint = getattr(pin, f"JointModel{axis}")()
        parent = model.addJoint(parent, joint, pin.SE3.Identity(), axis)
    geometry = pin.GeometryModel()
    table = pin.SE3(np.eye(3), np.array([0.0, 0.0, TOP - 0.02]))
    bottle = coal.Cylinder(RADIUS, 2.0 * HALF) if shape is None else shape
    geometry.addGeometryObject(pin.GeometryObject("table", 0, 0, table, coal.Box(0.6, 1.0, 0.04)))
    geometry.addGeometryObject(pin.GeometryObject("bottle", parent, 0, pin.SE3.Identity(), bottle))
    scene = geometry_scene(model, geometry)
    return scene._replace(contacts=(AllowedContact(0, 1, depth),))


def lowest(q: FloatArray) -> float:
    """Return how deep the lowest point of the bottle lies below the table's top, by its rim."""
    turn = pin.utils.rotate("x", q[3]) @ pin.utils.rotate("y", q[4])
    x, y, z = np.abs(turn[2])
    return float(TOP - (q[2] - HALF * z - RADIUS * np.sqrt(x * x + y * y)))


def random_motion(rng: np.random.Generator, low: float, high: float) -> Motion:
    """Return a motion over the table, whose bottle is between these heights of standing."""
    q = rng.uniform((-0.1, -0.2, low, -0.15, -0.15), (0.1, 0.2, high, 0.15, 0.15), (4, 5))
    q[:, 2] += TOP + HALF
    return Motion(q)


@pytest.mark.parametrize("seed", range(12))
def test_depths_agree_with_many_samples(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion = random_motion(rng, -0.002, 0.02)
    (found,), queries = contact_depths(held_bottle(), motion)
    t = np.linspace(0.0, motion.num_segments, 30001)
    depths = np.array([lowest(motion.at(float(one))) for one in t])
    deep = np.flatnonzero(depths > ALLOWED + 3e-6)
    assert 0 < queries < 5000
    assert found.decided
    if len(deep) and deep[0] == 0:
        assert found.too_deep_at == 0.0
    elif len(deep):
        assert found.too_deep_at == pytest.approx(t[deep[0]], abs=2e-3)
        assert lowest(motion.at(found.too_deep_at or 0.0)) == pytest.approx(ALLOWED, abs=1e-5)
    else:
        assert found.too_deep_at is None
        assert found.greatest == pytest.approx(max(depths.max(), 0.0), abs=0.03 * ALLOWED)


def test_some_samples_are_too_deep_and_some_are_not() -> None:
    motions = [random_motion(np.random.default_rng(seed), -0.002, 0.02) for seed in range(12)]
    found = [contact_depths(held_bottle(), motion)[0][0].too_deep_at for motion in motions]
    assert None in found
    assert any(at is not None for at in found)


def slow_depth(one: FloatArray, two: FloatArray) -> float:
    """Return the signed distance of two clouds' hulls: the widest gap over very many directions."""
    rng = np.random.default_rng(0)
    best, at, spread = -np.inf, np.array([0.0, 0.0, 1.0]), 1.0
    for _ in range(40):
        n = at + spread * rng.normal(size=(400, 3))
        n = np.vstack([at, n / np.linalg.norm(n, axis=1)[:, None]])
        gaps = (one @ n.T).min(axis=0) - (two @ n.T).max(axis=0)
        if gaps.max() > best:
            best, at = float(gaps.max()), n[int(np.argmax(gaps))]
        spread *= 0.75
    return best


@pytest.mark.parametrize("seed", range(8))
def test_coals_depths_are_the_widest_gaps_between_support_planes(seed: int) -> None:
    """A box pushed into the table's edge, from any side, tilted at random."""
    half = np.array([0.05, 0.03, 0.08])
    scene = held_bottle(shape=coal.Box(*(2.0 * half)))
    rng = np.random.default_rng(seed)
    q = np.array([0.3, rng.uniform(-0.3, 0.3), TOP, *rng.uniform(-0.6, 0.6, 2)])
    q[0] += rng.uniform(0.0, 0.05)
    (found,), _ = contact_depths(
        scene._replace(contacts=(AllowedContact(0, 1, 1.0),)), Motion(q[None])
    )
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    turn = pin.utils.rotate("x", q[3]) @ pin.utils.rotate("y", q[4])
    table = signs * (0.3, 0.5, 0.02) + (0.0, 0.0, TOP - 0.02)
    box = signs * half @ turn.T + q[:3]
    assert found.greatest == pytest.approx(max(-slow_depth(box, table), 0.0), abs=2e-5)
    assert found.greatest > 0.0


def test_a_pair_that_may_touch_is_named_and_its_depth_told() -> None:
    scene = held_bottle()
    stands = np.array([0.0, 0.0, TOP + HALF, 0.0, 0.0])
    in_table = stands + np.array([0.0, 0.0, -0.0005, 0.0, 0.0])
    lifted = stands + np.array([0.0, 0.0, 0.1, 0.0, 0.0])
    motion = Motion(np.array([lifted, in_table, lifted]))
    found = certificate([Part(scene, 0, 2)], motion, 0.0)
    assert found.certified is True
    assert found.refuted_at is None
    assert found.allowed_contacts == "table – bottle"
    assert found.penetration == pytest.approx(0.0005, abs=0.03 * ALLOWED)
    assert found.penetration_pair == "table – bottle"
    assert math.isinf(found.clearance), "pairs that may touch are no clearance"


def test_a_pair_that_overlaps_too_deep_refutes_where_it_begins_to() -> None:
    scene = held_bottle()
    lifted, pressed = (np.array([0.0, 0.0, TOP + HALF + z, 0.0, 0.0]) for z in (0.009, -0.006))
    found = certificate([Part(scene, 0, 1)], Motion(np.array([lifted, pressed])), 0.0)
    assert found.certified is False
    assert found.certified_margin is False
    assert found.refuted_pair == found.clearance_pair == "table – bottle"
    assert found.refuted_at == pytest.approx(10.0 / 15.0, abs=1e-3), "1 mm of 15 mm below 9 mm"
    assert found.clearance == 0.0


def test_parts_without_allowed_contacts_say_nothing_of_them() -> None:
    scene = held_bottle()._replace(contacts=())
    q = np.array([[0.0, 0.0, TOP, 0.0, 0.0]] * 2)
    found = certificate([Part(scene, 0, 1)], Motion(q), 0.0)
    assert found.allowed_contacts == found.penetration_pair == ""
    assert found.penetration is None


def test_whole_motions_name_the_pairs_of_all_parts() -> None:
    deep, free = held_bottle(), held_bottle()._replace(contacts=())
    q = np.array([[0.0, 0.0, TOP + HALF + z, 0.0, 0.0] for z in (0.01, -0.0003, 0.01)])
    parts = [Part(free, 0, 0), Part(deep, 0, 1), Part(deep, 1, 2)]
    found = certificate(parts, Motion(q), 0.0)
    assert found.allowed_contacts == "table – bottle"
    assert found.penetration == pytest.approx(0.0003, abs=0.03 * ALLOWED)
