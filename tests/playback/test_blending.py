"""Rounded corners: lines and parabolas that are proven as the motion with corners is."""

import numpy as np
import pytest

from evoexp.collision.certifier.certificate import certificate
from evoexp.paths.motion import Motion
from evoexp.playback.blending import blended
from playback_samples import recording

SPEEDS = np.array([0.5, 1.0])


@pytest.mark.parametrize("name", ["two arms", "redundant arm", "mission", "pick and place"])
def test_a_rounded_motion_is_continuous_with_its_derivative_but_at_stops(name: str) -> None:
    shown = recording(name)
    speeds = np.full(shown.motion.q.shape[1], 0.7)
    found = blended(shown.motion, shown.parts, shown.margin, speeds)
    c0, c1, c2, c3 = found.motion.polynomials.transpose(1, 0, 2)
    assert not c3.any()
    assert np.allclose((c0 + c1 + c2)[:-1], c0[1:], atol=1e-9)
    before = (c1 + 2.0 * c2) / found.lengths[:, None]
    jumps = np.abs(before[:-1] - (c1 / found.lengths[:, None])[1:]).max(axis=1)
    smooth = np.ones(len(jumps), dtype=bool)
    smooth[[stop - 1 for stop in found.stops]] = False
    assert jumps[smooth].max() < 1e-6
    assert np.array_equal(found.motion.q[[0, -1]], shown.motion.q[[0, -1]])
    verdict = certificate(found.parts, found.motion, shown.margin)
    assert verdict.certified == shown.verdict.certified
    assert verdict.certified_margin or not shown.verdict.certified_margin


def test_parts_begin_and_end_where_they_did() -> None:
    shown = recording("pick and place")
    speeds = np.full(shown.motion.q.shape[1], 0.7)
    found = blended(shown.motion, shown.parts, shown.margin, speeds)
    for before, after in zip(shown.parts, found.parts, strict=True):
        for ours, theirs in ((before.first, after.first), (before.last, after.last)):
            assert np.allclose(shown.motion.q[ours], found.motion.q[theirs], atol=1e-12)


def test_where_a_parabola_would_touch_it_is_made_smaller() -> None:
    """Of random ways with one corner that are free, those are tried that a full parabola spoils."""
    part = recording("two arms").parts[0]._replace(last=2, margins=None)
    rng = np.random.Generator(np.random.PCG64(7))
    smaller = 0
    base = recording("two arms").motion.q
    for _ in range(1000):
        motion = Motion(base[rng.integers(len(base))] + rng.uniform(-3.0, 3.0, (3, 4)))
        if not certificate([part], motion, 0.0).certified:
            continue
        full = blended(motion, (), 0.0, np.ones(4))  # without bodies nothing is in the way
        pieces = [part._replace(last=full.motion.num_segments)]
        if full.num_corners == 0 or certificate(pieces, full.motion, 0.0).certified:
            continue
        found = blended(motion, [part], 0.0, np.ones(4))
        assert found.verdict.certified
        assert found.lengths.sum() > full.lengths.sum() - 1e-12  # nearer to the corner
        assert len(found.lengths) == 3 or found.stops
        smaller += 1
    assert smaller >= 3
