"""Curves through configurations: what they pass, how far they reach, how fast they are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.paths.motion import Motion, clamped_cubic, joint_ranges, top_speeds

CONFIGURATIONS = st.integers(2, 8).flatmap(
    lambda n: st.lists(
        st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=2), min_size=n, max_size=n
    )
)


@given(CONFIGURATIONS)
@settings(max_examples=60, deadline=None)
def test_a_clamped_cubic_starts_and_ends_at_rest_and_is_smooth(rows: list[list[float]]) -> None:
    q = np.array(rows)
    motion = clamped_cubic(q)
    assert motion.q == pytest.approx(q, abs=1e-12)
    c1, c2, c3 = motion.polynomials.transpose(1, 0, 2)[1:]
    end, bend = c1 + 2.0 * c2 + 3.0 * c3, 2.0 * c2 + 6.0 * c3
    assert c1[0] == pytest.approx(np.zeros(2), abs=1e-9)
    assert end[-1] == pytest.approx(np.zeros(2), abs=1e-9)
    assert end[:-1] == pytest.approx(c1[1:], abs=1e-9)
    assert bend[:-1] == pytest.approx(2.0 * c2[1:], abs=1e-9)


@given(CONFIGURATIONS, st.booleans())
@settings(max_examples=60, deadline=None)
def test_ranges_and_speeds_against_dense_samples(rows: list[list[float]], straight: bool) -> None:
    q = np.array(rows)
    motion = Motion(q) if straight else clamped_cubic(q)
    u = np.linspace(0.0, 1.0, 2001)[:, None]
    values, speeds = [], []
    for c0, c1, c2, c3 in motion.polynomials:
        values.append(c0 + u * (c1 + u * (c2 + u * c3)))
        speeds.append(np.abs(c1 + u * (2.0 * c2 + 3.0 * u * c3)))
    sampled = np.concatenate(values)
    found = joint_ranges(motion)
    assert found[:, 0] == pytest.approx(sampled.min(axis=0), abs=1e-5)
    assert found[:, 1] == pytest.approx(sampled.max(axis=0), abs=1e-5)
    assert (found[:, 0] <= sampled.min(axis=0) + 1e-12).all()
    assert (found[:, 1] >= sampled.max(axis=0) - 1e-12).all()
    assert top_speeds(motion) == pytest.approx(np.concatenate(speeds).max(axis=0), abs=1e-4)


def test_one_configuration_is_no_curve() -> None:
    with pytest.raises(ValueError, match="2 or more instants"):
        clamped_cubic(np.zeros((1, 2)))
