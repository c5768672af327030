"""Ends of sub-paths, in blocks, beside the same one by one."""

import math

import numpy as np
import pytest

from evoexp.numeric.vectors import LANES
from evoexp.objectives.reaching import measure_reach
from evoexp.robots.planar_ends import PlanarArm


@pytest.mark.parametrize("count", [1, LANES, 2 * LANES + 5, 300])
def test_cost_error_and_way_are_those_of_equations_1_2_and_4(count: int) -> None:
    rng = np.random.default_rng(count)
    lengths = rng.uniform(0.5, 3.0, 6)
    arm, target, box = (
        PlanarArm(lengths, 0.5, -0.25, 0.3),
        np.array([3.0, 4.0]),
        np.array([-2.0, 6.0, -3.0, 5.0]),
    )
    filled = -(-count // LANES) * LANES  # up to whole vectors
    start, ends = rng.uniform(-3.0, 3.0, 6), rng.uniform(-3.0, 3.0, (6, filled + 3))
    weights = (1.0, 0.7)
    whole = np.full((3, filled + 3), -1.0)
    starts, lanes = np.repeat(start[:, None], filled + 3, axis=1), np.arange(count + LANES)
    measure_reach(starts, ends, lanes, count, arm, target, box, weights, *whole)
    assert (whole[:, count:] == -1.0).all()
    for k in range(count):
        directions = 0.3 + np.cumsum(ends[:, k])
        x, y = (
            0.5 + float(lengths @ np.cos(directions)),
            -0.25 + float(lengths @ np.sin(directions)),
        )
        cost, error, way = whole[:, k]
        assert error == pytest.approx(math.dist((x, y), target), abs=1e-12)
        assert way == pytest.approx(math.dist(start, ends[:, k]), abs=1e-12)
        inside = -2.0 <= x <= 6.0 and -3.0 <= y <= 5.0
        assert cost == (pytest.approx(error + 0.7 * way, abs=1e-12) if inside else math.inf)
