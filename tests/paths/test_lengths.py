"""Lengths and unevenness of paths against loops over Eqs 2 to 5."""

import math

import numpy as np
import pytest

from evoexp.paths.lengths import measure_paths

ARMS = np.array([[0, 2], [2, 5], [5, 6]])


def measure(via_points):
    out = np.full((2, len(ARMS), via_points.shape[2]), np.nan)
    measure_paths(via_points, ARMS, out[0], out[1])
    return out


@pytest.mark.parametrize("num", [1, 2, 20])
def test_are_the_sums_of_the_paper(num):
    via_points = np.random.default_rng(num).uniform(-100.0, 100.0, (6, num + 1, 16))
    lengths, unevenness = measure(via_points)
    for arm, (first, stop) in enumerate(ARMS):
        for lane in range(16):
            path = via_points[first:stop, :, lane].T
            d = [math.dist(path[i], path[i - 1]) for i in range(1, num + 1)]
            mean = sum(d) / num
            # 40 additions of numbers below 350: rounding stays below 40 · 350 · 20 · 1e-16
            assert lengths[arm, lane] == pytest.approx(sum(d), rel=1e-13)
            assert unevenness[arm, lane] == pytest.approx(
                sum(abs(x - mean) for x in d), rel=1e-12, abs=1e-10
            )


def test_a_path_without_length_and_an_even_one():
    via_points = np.zeros((6, 21, 8))
    via_points[:, :, 1:] = np.arange(21.0)[:, None]
    lengths, unevenness = measure(via_points)
    assert not lengths[:, 0].any()
    assert np.allclose(lengths[:, 1:], 20.0 * np.sqrt([[2.0], [3.0], [1.0]]), rtol=1e-14)
    assert np.all(unevenness < 1e-12)


def test_lanes_do_not_meet():
    via_points = np.random.default_rng(3).uniform(-100.0, 100.0, (6, 21, 24))
    order = np.random.default_rng(4).permutation(24)
    permuted = measure(np.ascontiguousarray(via_points[:, :, order]))
    assert np.array_equal(permuted, measure(via_points)[:, :, order])
