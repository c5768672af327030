"""Pairs that may touch: their depths over whole motions, and what the verdict makes of them."""

import itertools
import math

import coal
import numpy as np
import pinocchio as pin
import pytest

from coal_shapes import geometry_of
from evoexp.collision.certifier.certificate import (
    Certificate,
    certificate,
    combined,
    contact_depths,
)
from evoexp.collision.scene import AllowedContact, Part, Scene, geometry_scene
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

TOP = 0.5  # of the table [m]
RADIUS, HALF = 0.03, 0.125  # of the bottle [m]
ALLOWED = 0.001  # [m]
STANDS = np.array([0.0, 0.0, TOP + HALF, 0.0, 0.0])
Z = np.array([0.0, 0.0, 1.0, 0.0, 0.0])


def held_bottle(depth: float = ALLOWED, shape: object = None) -> Scene:
    """Return a bottle on three slides and two turns, above a table that it may touch."""
    model, parent = pin.Model(), 0
    for axis in ("PX", "PY", "PZ", "RX", "RY"):
        joint = getattr(pin, f"JointModel{axis}")()
        parent = model.addJoint(parent, joint, pin.SE3.Identity(), axis)
    table = ("table", 0, [0.0, 0.0, TOP - 0.02], coal.Box(0.6, 1.0, 0.04))
    bottle = coal.Cylinder(RADIUS, 2.0 * HALF) if shape is None else shape
    scene = geometry_scene(model, geometry_of(table, ("bottle", parent, None, bottle)))
    return scene._replace(contacts=(AllowedContact(0, 1, depth),))


def turned(q: FloatArray) -> FloatArray:
    return pin.utils.rotate("x", q[3]) @ pin.utils.rotate("y", q[4])


def lowest(q: FloatArray) -> float:
    """Return how deep the lowest point of the bottle lies below the table's top, by its rim."""
    x, y, z = np.abs(turned(q)[2])
    return float(TOP - (q[2] - HALF * z - RADIUS * np.sqrt(x * x + y * y)))


def test_depths_agree_with_many_samples() -> None:
    outcomes = set()
    for seed in range(12):
        rng = np.random.default_rng(seed)
        q = rng.uniform((-0.1, -0.2, -0.002, -0.15, -0.15), (0.1, 0.2, 0.02, 0.15, 0.15), (4, 5))
        motion = Motion(q + (TOP + HALF) * Z)
        (depth,), queries = contact_depths(held_bottle(), motion)
        t = np.linspace(0.0, motion.num_segments, 30001)
        depths = np.array([lowest(motion.at(float(instant))) for instant in t])
        deep = np.flatnonzero(depths > ALLOWED + 3e-6)
        assert 0 < queries < 5000
        assert depth.decided
        if not len(deep):
            assert depth.too_deep_at is None
            assert depth.greatest == pytest.approx(max(depths.max(), 0.0), abs=0.03 * ALLOWED)
        elif deep[0] == 0:
            assert depth.too_deep_at == 0.0
        else:
            assert depth.too_deep_at == pytest.approx(t[deep[0]], abs=2e-3)
            assert lowest(motion.at(depth.too_deep_at)) == pytest.approx(ALLOWED, abs=1e-5)
        outcomes.add(len(deep) > 0)
    assert outcomes == {True, False}


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
    half, rng = np.array([0.05, 0.03, 0.08]), np.random.default_rng(seed)
    q = np.array([0.3, rng.uniform(-0.3, 0.3), TOP, *rng.uniform(-0.6, 0.6, 2)])
    q[0] += rng.uniform(0.0, 0.05)
    (depth,), _ = contact_depths(held_bottle(1.0, coal.Box(*(2.0 * half))), Motion(q[None]))
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    table = signs * (0.3, 0.5, 0.02) + (0.0, 0.0, TOP - 0.02)
    box = signs * half @ turned(q).T + q[:3]
    assert depth.greatest == pytest.approx(max(-slow_depth(box, table), 0.0), abs=2e-5)
    assert depth.greatest > 0.0


def test_a_pair_that_may_touch_is_named_with_its_depth_over_all_parts() -> None:
    deep, free = held_bottle(), held_bottle()._replace(contacts=())
    motion = Motion(np.array([STANDS + z * Z for z in (0.1, -0.0005, 0.1)]))
    for parts in ([Part(deep, 0, 2)], [Part(free, 0, 0), Part(deep, 0, 1), Part(deep, 1, 2)]):
        verdict = certificate(parts, motion, 0.0)
        assert verdict.certified is True and verdict.refuted_at is None
        assert verdict.allowed_contacts == verdict.penetration_pair == "table – bottle"
        assert verdict.penetration == pytest.approx(0.0005, abs=0.03 * ALLOWED)
        assert math.isinf(verdict.clearance), "pairs that may touch are no clearance"


def test_a_pair_that_overlaps_too_deep_refutes_where_it_begins_to() -> None:
    motion = Motion(np.array([STANDS + z * Z for z in (0.1, 0.009, -0.006)]))
    verdict = certificate([Part(held_bottle(), 0, 1), Part(held_bottle(), 1, 2)], motion, 0.0)
    assert verdict.certified is False and verdict.certified_margin is False
    assert verdict.refuted_pair == verdict.clearance_pair == "table – bottle"
    assert verdict.refuted_at == pytest.approx(1.0 + 10.0 / 15.0, abs=1e-3), "1 mm of 15 mm below"
    assert verdict.clearance == 0.0


def test_parts_without_allowed_contacts_say_nothing_of_them() -> None:
    scene = held_bottle()._replace(contacts=())
    verdict = certificate([Part(scene, 0, 1)], Motion(np.array([TOP * Z] * 2)), 0.0)
    assert verdict.allowed_contacts == verdict.penetration_pair == ""
    assert verdict.penetration is None


FREE = Certificate(True, True, 0.3, 2.0, "a – b", None, "", 10)
LATE = Certificate(False, False, 0.0, 7.0, "c – d", 7.0, "c – d", 5)
EARLY = LATE._replace(refuted_at=3.0, clearance_at=3.0, refuted_pair="e – f")
CLOSE = FREE._replace(clearance=0.1, clearance_at=5.0, certified_margin=False)
UNDECIDED = FREE._replace(certified=None, certified_margin=None)


@pytest.mark.parametrize(
    ("parts", "decisive"),
    [([FREE, LATE, EARLY], EARLY), ([FREE, CLOSE], CLOSE), ([FREE, UNDECIDED], UNDECIDED)],
    ids=["the first contact", "else the least clearance", "a part that is undecided"],
)
def test_one_part_decides_for_the_whole(parts: list, decisive: Certificate) -> None:
    assert combined(parts) == decisive._replace(certificate_queries=20)
