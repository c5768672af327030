"""Criteria of motions against the obvious loop."""

import numpy as np
import pytest

from evoexp.objectives.motion_criteria import measure_motions


def test_criteria_are_eqs_6_to_8() -> None:
    rng = np.random.default_rng(0)
    angles, points = rng.uniform(0.0, np.pi, (6, 2, 5)), rng.normal(size=(6, 4, 5))
    criteria, own = np.empty((3, 5)), np.empty(5)
    measure_motions(angles, points, (2.0, 3.0, 5.0), criteria, own)
    for n in range(5):
        steps = [float(np.hypot(*(points[i, 2:, n] - points[i - 1, 2:, n]))) for i in range(1, 6)]
        turns = sum(
            abs(angles[i, j, n] - angles[i - 1, j, n]) for i in range(1, 6) for j in range(2)
        )
        expected = [sum(steps), turns, max(steps) - min(steps)]
        assert criteria[:, n] == pytest.approx(expected, abs=1e-12)
        assert own[n] == pytest.approx(
            2.0 * expected[0] + 3.0 * expected[1] + 5.0 * expected[2], abs=1e-12
        )
