"""Redistribution against scipy's splines with dense arc length, its properties.

And its degenerate cases.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_redistribution import run_plainly
from reference_paths import redistributed

from evoexp.paths.workspace import prepare_redistribution
from paths.string_operators import redistribute

ENDS = ["natural", "clamped"]


def strings(seed, nq, num, lanes, scale=100.0):
    """Random strings: the hardest paths there are, with cusps and loops at every point."""
    return np.random.default_rng(seed).uniform(0.0, scale, (nq, num + 1, lanes))


def arms(*slices):
    return np.array(slices, dtype=np.int64)


def run(via_points, arm_slices, num_lanes, end="natural", samples=8):
    joints = int(np.max(arm_slices[:, 1] - arm_slices[:, 0]))
    out = via_points.copy()
    redistribute(
        out,
        arm_slices,
        num_lanes,
        prepare_redistribution(via_points.shape[1] - 1, joints, end, samples),
    )
    return out


def errors(given, moved, arm_slices, num_lanes, end):
    """Distances from the reference in units of the mean spacing."""
    result = []
    for first, stop in arm_slices:
        for lane in range(num_lanes):
            truth = redistributed(given[first:stop, :, lane].T, end)
            spacing = np.linalg.norm(np.diff(truth, axis=0), axis=1).mean()
            result.append(np.linalg.norm(moved[first:stop, :, lane].T - truth, axis=1) / spacing)
    return np.array(result)


# Root mean square and largest error, twice the worst measured over N and end condition. The points
# are random, so that every path turns sharply everywhere; with one joint it stops dead wherever it
# turns, and the rule is of second order.
BOUNDS = {
    ("several", 8): (7e-3, 4e-2), ("several", 16): (1.2e-3, 7e-3), ("several", 128): (8e-6, 1e-4),
    ("one", 8): (3.5e-2, 1.1e-1), ("one", 16): (9e-3, 3e-2), ("one", 128): (1.4e-4, 5e-4),
}  # fmt: skip


@pytest.mark.examples(9)
@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(("joints", "samples"), BOUNDS)
@pytest.mark.parametrize("num", [2, 3, 20, 40])
def test_points_are_those_of_scipys_spline_at_equal_arc_length(num, joints, samples, end):
    given = strings(num, 12, num, 16)
    moved = run(given, arms((0, 2), (2, 5), (5, 6), (6, 12)), 16, end, samples)
    found = errors(
        given, moved, [(0, 2), (2, 5), (6, 12)] if joints == "several" else [(5, 6)], 16, end
    )
    mean, largest = BOUNDS[joints, samples]
    assert np.sqrt(np.mean(found**2)) < mean
    assert found.max() < largest


@pytest.mark.examples(12)
@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("samples", [8, 16, 64])
@pytest.mark.parametrize("joints", [1, 2, 3, 4])
@pytest.mark.parametrize("num", [2, 3, 7, 20])
def test_bits_are_those_of_the_same_operations_number_by_number(num, joints, samples, end):
    given = strings(num, joints + 2, num, 16)
    given[:, :, 8:] = np.cumsum(given[:, :, 8:] - 40.0, axis=1)  # paths that hardly turn
    given[:, 1:-1, 3] = given[:, :1, 3]  # and some with points that are repeated
    given[:, :, 4] = 7.0
    given[:, :, 5] = np.round(given[:, :, 5] / 50.0) * 50.0
    slices = arms([0, joints], [joints, joints + 2])
    expected = run_plainly(given, slices, end, samples)
    assert np.array_equal(run(given, slices, 16, end, samples), expected)


@settings(max_examples=40, deadline=None)
@given(
    num=st.integers(1, 45), joints=st.lists(st.integers(1, 6), min_size=1, max_size=3),
    seed=st.integers(0, 2**32 - 1),
    scale=st.sampled_from([1e-9, 1e-3, 1.0, 1e6]), end=st.sampled_from(ENDS),
    samples=st.sampled_from([8, 16, 32]),
)  # fmt: skip
def test_ends_keep_their_bits_and_points_stay_finite(num, joints, seed, scale, end, samples):
    stops = np.cumsum(joints)
    arm_slices = np.stack([stops - joints, stops], axis=1).astype(np.int64)
    given = strings(seed, int(stops[-1]), num, 16, scale)
    moved = run(given, arm_slices, 16, end, samples)
    assert np.array_equal(moved[:, [0, -1]], given[:, [0, -1]])
    assert np.all(np.isfinite(moved))
    assert num == 1 or not np.array_equal(moved, given)


@settings(max_examples=25, deadline=None)
@given(num=st.integers(2, 40), joints=st.integers(1, 6), seed=st.integers(0, 2**32 - 1))
def test_an_equally_spaced_straight_line_stays(num, joints, seed):
    start, goal = np.random.default_rng(seed).uniform(-300.0, 300.0, (2, joints, 1, 8))
    given = start + (goal - start) * np.linspace(0.0, 1.0, num + 1)[:, None]
    moved = run(given, arms((0, joints)), 8)
    length = np.linalg.norm(goal - start, axis=0).max()
    assert (
        np.max(np.abs(moved - given)) < 1e-11 * length + 1e-12
    )  # rounding: some 1e3 operations at 300


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), lanes=st.sampled_from([8, 24, 56, 104, 136]))
def test_a_lane_does_not_depend_on_its_place_or_company(seed, lanes):
    given = strings(seed, 5, 12, lanes)
    arm_slices = arms((0, 2), (2, 5))
    moved = run(given, arm_slices, lanes)
    order = np.random.default_rng(seed).permutation(lanes)
    assert np.array_equal(
        run(np.ascontiguousarray(given[:, :, order]), arm_slices, lanes), moved[:, :, order]
    )
    alone = np.zeros((5, 13, 8))
    alone[:, :, 3] = given[:, :, lanes - 1]
    assert np.array_equal(run(alone, arm_slices, 8)[:, :, 3], moved[:, :, lanes - 1])


@pytest.mark.parametrize("garbage", [0.0, 1e155, -1e300, 1e308, np.inf, np.nan])
@pytest.mark.parametrize("num_lanes", [1, 9, 50])
def test_garbage_in_the_padding_changes_nothing(num_lanes, garbage):
    given = strings(7, 5, 20, 56)
    dirty = given.copy()
    dirty[:, ::2, num_lanes:] = garbage
    moved, clean = (
        run(dirty, arms((0, 2), (2, 5)), num_lanes),
        run(given, arms((0, 2), (2, 5)), num_lanes),
    )
    assert np.array_equal(moved[:, :, :num_lanes], clean[:, :, :num_lanes])
    assert np.all(np.isfinite(moved)) or not np.isfinite(garbage)
    rest = -(-num_lanes // 8) * 8
    assert np.array_equal(moved[:, :, rest:], dirty[:, :, rest:], equal_nan=True)


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("value", [0.0, -0.0, 0.1, 315.0])
def test_a_path_without_length_stays_bit_for_bit(value, end):
    given = strings(3, 3, 20, 8)
    given[:, :, 5] = value
    moved = run(given, arms((0, 2), (2, 3)), 8, end)
    assert np.array_equal(moved[:, :, 5].view(np.int64), given[:, :, 5].view(np.int64))
    assert not np.array_equal(moved[:, :, 4], given[:, :, 4])


def test_one_segment_has_nothing_to_move():
    given = strings(5, 2, 1, 8)
    assert np.array_equal(run(given, arms((0, 2)), 8), given)


def test_joints_of_no_arm_are_left_alone():
    given = strings(6, 6, 10, 8)
    moved = run(given, arms((1, 3), (4, 5)), 8)
    assert np.array_equal(moved[[0, 3, 5]], given[[0, 3, 5]])
    assert not np.any(np.all(moved[[1, 2, 4]] == given[[1, 2, 4]], axis=(1, 2)))


def test_one_workspace_serves_arms_of_different_joints_in_any_order():
    workspace = prepare_redistribution(10, 6)
    given = strings(8, 9, 10, 24)
    both, single = given.copy(), given.copy()
    redistribute(both, arms((0, 6), (6, 9)), 24, workspace)
    redistribute(single, arms((6, 9)), 24, workspace)
    redistribute(single, arms((0, 6)), 24, workspace)
    assert np.array_equal(both, single)
