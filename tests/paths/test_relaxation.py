"""Relaxation against the loop of Eqs 8 and 9 as it is written."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from paths.string_operators import relax


def strings(seed, nq=3, num=20, lanes=24):
    return np.random.default_rng(seed).uniform(-100.0, 100.0, (nq, num + 1, lanes))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), delta=st.floats(0.0, 1.0), num=st.integers(1, 30))
def test_is_the_papers_loop_bit_for_bit(seed, delta, num):
    expected = strings(seed, num=num)
    moved = expected.copy()
    relax(moved, delta, 24)
    if delta > 0.0:
        for a in (expected[j, :, lane] for j in range(3) for lane in range(24)):
            for i in range(1, num):
                a[i] = a[i] + delta * ((a[i - 1] + a[i + 1]) / 2 - a[i])
    assert np.array_equal(moved, expected)


def test_a_lane_depends_neither_on_its_place_nor_on_the_padding():
    given = strings(2)
    order = np.random.default_rng(0).permutation(24)
    moved, permuted, dirty = given.copy(), np.ascontiguousarray(given[:, :, order]), given.copy()
    dirty[:, :, 10:] = np.nan
    relax(moved, 0.5, 24)
    relax(permuted, 0.5, 24)
    relax(dirty, 0.5, 10)
    assert np.array_equal(permuted, moved[:, :, order])
    assert np.array_equal(dirty[:, :, :10], moved[:, :, :10])
