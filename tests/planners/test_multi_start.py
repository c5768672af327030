"""Multi-start improvement: the same evaluations as the planner, its operator, fresh starts."""

import numpy as np
import pytest

from composed import composed
from planners.runs import ran
from references import rana_numpy


@pytest.mark.parametrize(("redistribution", "tolerance"), [("true", 0.01), ("false", 1e-9)])
def test_generations_are_starts_and_sweeps_as_a_slow_version_makes_them(
    redistribution: str, tolerance: float
) -> None:
    """In plain numpy: fresh walks, smoothed k times more in the k-th generation of a start."""
    words = "ga.num_generations=5", "control.num_sweeps=2", "planner.samples_per_segment=128"
    own = f"planner.redistribution={redistribution}"
    given = composed("experiment=rana_planar", "control=multi_start", *words, own)
    alone = given._replace(planner=given.planner.planner)
    slow = rana_numpy.from_condition(alone, chords_per_segment=512)
    rng, lowest = np.random.default_rng(3), np.inf
    for k, generation in enumerate(ran(given, 3).records):
        if k % 3 == 0:
            strings = rana_numpy.walks(slow, rng, 50 if k == 0 else 48)
        strings = rana_numpy.smooth(slow, strings[:48] if k else strings)
        expected = rana_numpy.judge(slow, strings)
        lowest = min(lowest, expected.cost.min())
        assert generation.costs == pytest.approx(expected.cost, abs=tolerance)
        assert generation.best_cost == pytest.approx(lowest, abs=tolerance)
        assert generation.num_feasible == np.count_nonzero(expected.collisions == 0)
