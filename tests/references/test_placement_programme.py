"""Compiled programmes of postures, against numpy and complex steps, and the planner's kernels."""

import functools
from typing import Any

import numpy as np
import pytest

from evoexp.references.placement_programme import (
    MARGINS,
    TORQUE_BOUNDS,
    Directions,
    Programme,
    directions_of,
)
from evoexp.references.placement_references import lowest, slide
from references import placement_complex as slow
from references.placement_samples import LABELS, problem

AROUND = np.array([[-180.0, 180.0], [-180.0, 180.0]])
POINTS = np.array(
    [
        [2.0, 0, 0.5, 5.2, 1.0],
        [1.0, 1, 0.3, 4.0, 0.1],
        [3.0, 2, 0.5, 5.2, 1.0],
        [0.7, 3, 0.9, 5.0, 2.0],
    ]
)


def directions(case: str, **changes: Any) -> Directions:
    return directions_of(problem(case).model, problem(case).angle_limits)._replace(**changes)


def limited(case: str) -> Directions:
    joints = np.array([[-2.5, 3.0], [-np.inf, 2.5], [-2.0, np.inf]])
    limits = {"joint_limits": joints, "torque_limits": np.array([[-6.0, 8.0]] * 3)}
    return directions(case, avoided=POINTS, **limits)


@pytest.mark.examples(2)
@pytest.mark.parametrize("with_limits", [False, True])
@pytest.mark.parametrize("case", LABELS)
def test_the_programme_and_its_derivatives_are_those_of_complex_steps(
    case: str, with_limits: bool
) -> None:
    model = limited(case) if with_limits else directions(case)
    programme, rng = Programme(model), np.random.default_rng(2)
    function = functools.partial(slow.programme, model)
    for z in rng.uniform(-3.0, 3.0, (40, 3 + programme.minimax)):
        values, slopes = programme.measured(z)
        assert len(values) == MARGINS + TORQUE_BOUNDS * programme.minimax + len(model.bounds())
        np.testing.assert_allclose(values, function(z), rtol=1e-11, atol=1e-13)
        expected = slow.gradient(function, z)
        np.testing.assert_allclose(slopes, expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max())

    smooth, x, h = functools.partial(slow.smooth, model), np.array([1.1, 1.9, 4.4]), 1e-6
    plain = [(smooth(x + h * e) - smooth(x - h * e)) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(slow.gradient(smooth, x), plain, rtol=1e-6)


def starts_of(case: str, model: Directions, count: int) -> list[np.ndarray]:
    """Return directions of the lowest minima of a coarse search."""
    rows = lowest(problem(case).model, AROUND, 60, count)
    return [model.reaching(np.radians(row[:2]), row[2] == 1.0) for row in rows]


@pytest.mark.parametrize("case", ["torque_norm", "obstacle_link", "manipulability"])
def test_the_subgradient_method_is_the_slow_one(case: str) -> None:
    model = directions(case)
    starts = starts_of(case, model, 6)
    steps = 0.3 / np.sqrt(np.arange(1.0, 41.0))
    ends, costs = slide(np.array(2 * starts).T, steps, model)
    for k, start in enumerate(starts):
        end, least = slow.slide(model, start, steps)
        # differences of 1e-6 rad: ten digits of the slope
        assert costs[k] == pytest.approx(least, rel=1e-5)
        np.testing.assert_allclose(ends[:, k], end, atol=1e-5)
        np.testing.assert_array_equal(ends[:, k], ends[:, k + len(starts)])
