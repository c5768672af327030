"""Configurations between via-points."""

import numpy as np
import pytest

from evoexp.paths.interpolation import interpolate_linear


@pytest.mark.parametrize("substeps", [1, 2, 3, 5, 10])
@pytest.mark.parametrize("num", [1, 20])
def test_are_at_the_fractions_of_each_segment(num, substeps):
    via_points = np.random.default_rng(num).uniform(-300.0, 300.0, (4, num + 1, 16))
    out = interpolate_linear(via_points, substeps)
    assert out.shape == (4, num * substeps, 16)
    at = np.arange(1, num * substeps + 1) / substeps
    for j in range(4):
        for lane in range(16):
            expected = np.interp(at, np.arange(num + 1), via_points[j, :, lane])
            assert np.allclose(
                out[j, :, lane], expected, rtol=0.0, atol=1e-12
            )  # 20 roundings at 600
    assert np.array_equal(out[:, substeps - 1 :: substeps], via_points[:, 1:])


def test_fewer_than_one_substep_is_refused():
    with pytest.raises(ValueError, match="substeps"):
        interpolate_linear(np.zeros((2, 3, 8)), 0)
