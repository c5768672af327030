"""Random walks of strings against a literal version with true angles."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.paths.walk import num_uniforms, walk_strings


def walked(
    start: Any, goal: Any, num: int, uniforms: list[float], step: float, max_turn: float
) -> Any:
    """Return the random walk (N + 1, joints) of one arm with true angles; takes its uniforms."""
    joints, length = len(start), step * math.dist(start, goal) / num
    path = [start]
    for _ in range(num - 1):
        d = goal - path[-1]
        if joints == 1:
            path.append(path[-1] + length * np.sign(d))
            continue
        angles = [math.atan2(d[1], d[0])]
        angles += [math.atan2(d[k], math.hypot(*d[:k])) for k in range(2, joints)]
        angles = [a + (2 * uniforms.pop(0) - 1) * max_turn for a in angles]
        move, rest = np.zeros(joints), length
        for k in range(joints - 1, 0, -1):
            move[k] = rest * math.sin(angles[k - 1])
            rest *= math.cos(angles[k - 1])
        move[0] = rest
        path.append(path[-1] + move)
    return np.array([*path, goal])


def walks(seed: int, joints: Any, num: int, max_turn: float, *ends: Any) -> tuple[Any, ...]:
    """Return walks in the lanes 3 … 6 of a population of NaN, their numbers, ends and arms."""
    stops, rng = np.cumsum(joints), np.random.default_rng(seed)
    arms = np.stack([stops - joints, stops], axis=1)
    start, goal = np.array(ends or rng.uniform(-300.0, 300.0, (2, stops[-1])), dtype=float)
    via_points = np.full((stops[-1], num + 1, 9), np.nan)
    uniforms = rng.random((4, num_uniforms(arms, num)))
    walk_strings(via_points, np.arange(3, 7), uniforms, start, goal, arms, 2.3, max_turn)
    return via_points, uniforms, start, goal, arms


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1), joints=st.lists(st.integers(1, 6), min_size=1, max_size=3),
    num=st.integers(1, 25), max_turn=st.sampled_from([0.0, 1.0, math.pi / 2, math.radians(120)]),
)  # fmt: skip
def test_is_the_walk_with_true_angles(
    seed: int, joints: list[int], num: int, max_turn: float
) -> None:
    via_points, uniforms, start, goal, arms = walks(seed, joints, num, max_turn)
    assert np.isnan(via_points[:, :, [0, 1, 2, 7, 8]]).all()
    assert np.array_equal(via_points[:, 0, 3:7].T, np.tile(start, (4, 1)))
    assert np.array_equal(via_points[:, -1, 3:7].T, np.tile(goal, (4, 1)))
    for walk, own in enumerate(uniforms.tolist()):
        for first, stop in arms:
            truth = walked(start[first:stop], goal[first:stop], num, own, 2.3, max_turn)
            # 25 steps of 60; an error grows by step / distance where a walk passes the goal closely
            assert np.allclose(via_points[first:stop, :, walk + 3].T, truth, rtol=0.0, atol=1e-9)
        assert not own


@pytest.mark.parametrize("joints", [[1], [2], [3], [6], [2, 1, 3]])
def test_a_walk_to_where_it_begins_stays_there(joints: list[int]) -> None:
    here = np.full(sum(joints), 0.3)
    assert (walks(5, joints, 20, 2.0, here, here)[0][:, :, 3:7] == 0.3).all()


@pytest.mark.parametrize(
    ("start", "goal"), [([0, 0, 0], [0, 0, 90]), ([0, 0, 90], [0, 0, 0]), ([0, 0, 0], [0, 50, 0])]
)
def test_a_goal_along_one_axis_gives_no_nan(start: list[float], goal: list[float]) -> None:
    assert np.isfinite(walks(6, [3], 20, math.pi / 2, start, goal)[0][:, :, 3:7]).all()
