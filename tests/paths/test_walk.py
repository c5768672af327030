"""Random walks against a literal version with true angles, and their statistics."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_paths import walked

from evoexp.paths.walk import num_uniforms, walk_strings

TURN = math.radians(120)


def fresh(seed, joints, num, strings, step=2.5, max_turn=TURN, start=None, goal=None):
    """Return (via_points, uniforms, start, goal, arm_slices) of walks in the lanes 3, 4.

    … of a population of NaN.
    """
    stops = np.cumsum(joints)
    arm_slices = np.stack([stops - joints, stops], axis=1)
    rng = np.random.default_rng(seed)
    start = rng.uniform(-300.0, 300.0, stops[-1]) if start is None else np.array(start)
    goal = rng.uniform(-300.0, 300.0, stops[-1]) if goal is None else np.array(goal)
    via_points = np.full((stops[-1], num + 1, strings + 5), np.nan)
    uniforms = rng.random((strings, num_uniforms(arm_slices, num)))
    walk_strings(
        via_points, np.arange(3, strings + 3), uniforms, start, goal, arm_slices, step, max_turn
    )
    return via_points, uniforms, start, goal, arm_slices


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1), joints=st.lists(st.integers(1, 6), min_size=1, max_size=3),
    num=st.integers(1, 25), max_turn=st.sampled_from([0.0, 1.0, math.pi / 2, math.radians(120)]),
)  # fmt: skip
def test_is_the_walk_with_true_angles(seed, joints, num, max_turn):
    via_points, uniforms, start, goal, arm_slices = fresh(seed, joints, num, 4, 2.3, max_turn)
    for s in range(4):
        rest = list(uniforms[s])
        for first, stop in arm_slices:
            used, rest = (
                rest[: (num - 1) * (stop - first - 1)],
                rest[(num - 1) * (stop - first - 1) :],
            )
            truth = walked(start[first:stop], goal[first:stop], num, used, 2.3, max_turn)
            # 25 steps of 60; an error grows by step / distance where a walk passes the goal closely
            assert np.allclose(via_points[first:stop, :, s + 3].T, truth, rtol=0.0, atol=1e-9)
        assert not rest


def test_other_lanes_are_left_alone():
    via_points = fresh(1, [2, 2], 20, 5)[0]
    assert np.all(np.isnan(via_points[:, :, [0, 1, 2, 8, 9]]))
    assert np.all(np.isfinite(via_points[:, :, 3:8]))


def test_begins_and_ends_bit_for_bit_and_every_step_has_its_length():
    via_points, _, start, goal, arm_slices = fresh(2, [2, 3, 6], 20, 40)
    strings = via_points[:, :, 3:43]
    assert np.array_equal(strings[:, 0], np.repeat(start[:, None], 40, axis=1))
    assert np.array_equal(strings[:, -1], np.repeat(goal[:, None], 40, axis=1))
    for first, stop in arm_slices:
        step = 2.5 * np.linalg.norm(goal[first:stop] - start[first:stop]) / 20
        lengths = np.linalg.norm(np.diff(strings[first:stop], axis=1), axis=0)[:-1]
        assert np.allclose(lengths, step, rtol=1e-12)


@pytest.mark.parametrize("joints", [[1], [2], [3], [6], [2, 1, 3]])
def test_a_walk_to_where_it_begins_stays_there(joints):
    here = np.full(sum(joints), 0.3)
    via_points = fresh(5, joints, 20, 4, start=here, goal=here)[0]
    assert np.all(via_points[:, :, 3:7] == 0.3)


@pytest.mark.parametrize(
    ("start", "goal"), [([0, 0, 0], [0, 0, 90]), ([0, 0, 90], [0, 0, 0]), ([0, 0, 0], [0, 50, 0])]
)
def test_a_goal_along_one_axis_gives_no_nan(start, goal):
    via_points, _, _, _, _ = fresh(
        6, [3], 20, 30, max_turn=math.pi / 2, start=np.float64(start), goal=np.float64(goal)
    )
    assert np.all(np.isfinite(via_points[:, :, 3:33]))


def test_consumes_one_angle_fewer_than_joints_per_step():
    assert num_uniforms(np.array([[0, 2], [2, 4]]), 20) == 38
    assert num_uniforms(np.array([[0, 3], [3, 4], [4, 10]]), 40) == 39 * 7
    assert num_uniforms(np.array([[0, 2]]), 1) == 0
