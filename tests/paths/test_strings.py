"""Kernels on strings of via-points: walks, redistribution, relaxation, configurations between."""

import math
from typing import Any

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.paths.interpolation import interpolate_linear
from evoexp.paths.redistribution import redistribute_arms
from evoexp.planners.via_point_ga.string_operators import num_uniforms, walk_strings
from evoexp.records import FloatArray

ENDS = ["natural", "clamped"]
SEEDS = st.integers(0, 2**32 - 1)
ARMS = np.array([[0, 2], [2, 5], [5, 6], [6, 12]])
DENSE = 512  # sub-intervals per segment, with Gauss's four points on each


def strings(seed: int, nq: int, num: int, lanes: int, scale: float = 100.0) -> FloatArray:
    """Random strings: the hardest paths there are, with cusps and loops at every point."""
    return np.random.default_rng(seed).uniform(0.0, scale, (nq, num + 1, lanes))


def redistributed(path: FloatArray, end: Any) -> FloatArray:
    """Return the points (N + 1, joints) at equal arc length along scipy's spline through `path`."""
    num = len(path) - 1
    spline = scipy.interpolate.CubicSpline(np.arange(num + 1), path, bc_type=end)
    edges = np.arange(num * DENSE + 1) / DENSE
    pieces = np.zeros(num * DENSE)
    for node, weight in zip(*np.polynomial.legendre.leggauss(4), strict=True):
        at = edges[:-1] + (node + 1) / 2 / DENSE
        pieces += weight / 2 / DENSE * np.linalg.norm(spline(at, 1), axis=1)
    length = np.concatenate([[0.0], np.cumsum(pieces)])
    inner = np.interp(np.arange(1, num) * length[-1] / num, length, edges)
    return np.vstack([path[0], spline(inner), path[-1]])


def moved(
    given: FloatArray, arms: Any, lanes: int, end: Any = "natural", samples: int = 8
) -> FloatArray:
    """Return the strings of the first lanes redistributed, arm by arm."""
    out, padded = given.copy(), -(-lanes // 8) * 8
    redistribute_arms(out, np.array(arms, dtype=np.int64), padded, samples, end == "clamped")
    return out


# Root mean square and largest error, twice the worst measured over N and end condition. The points
# are random, so that every path turns sharply everywhere; with one joint it stops dead wherever it
# turns, and the rule is of second order.
BOUNDS = {
    ("several", 8): (7e-3, 4e-2), ("several", 16): (1.2e-3, 7e-3), ("several", 128): (8e-6, 1e-4),
    ("one", 8): (3.5e-2, 1.1e-1), ("one", 16): (9e-3, 3e-2), ("one", 128): (1.4e-4, 5e-4),
}  # fmt: skip


@pytest.mark.examples(12)
@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(("joints", "samples"), BOUNDS)
@pytest.mark.parametrize("num", [2, 3, 20, 40])
def test_points_are_those_of_scipys_spline_at_equal_arc_length(
    num: int, joints: str, samples: int, end: str
) -> None:
    given = strings(num, 12, num, 16)
    given[:, :, 3] = np.cumsum(given[:, :, 3] - 40.0, axis=1)  # a path that hardly turns
    found = moved(given, ARMS, 16, end, samples)
    errors = []  # in units of the mean spacing
    for first, stop in ARMS:
        if (stop - first > 1) == (joints == "several"):
            for lane in range(16):
                truth = redistributed(given[first:stop, :, lane].T, end)
                spacing = np.linalg.norm(np.diff(truth, axis=0), axis=1).mean()
                away = np.linalg.norm(found[first:stop, :, lane].T - truth, axis=1)
                errors.append(away / spacing)
    mean, largest = BOUNDS[joints, samples]
    assert np.sqrt(np.mean(np.square(errors))) < mean
    assert np.max(errors) < largest


@settings(max_examples=40, deadline=None)
@given(
    num=st.integers(2, 45), joints=st.lists(st.integers(1, 6), min_size=1, max_size=3), seed=SEEDS,
    scale=st.sampled_from([1e-9, 1e-3, 1.0, 1e6]), end=st.sampled_from(ENDS),
    samples=st.sampled_from([8, 16, 32]),
)  # fmt: skip
def test_ends_keep_their_bits_points_stay_finite_and_other_joints_alone(
    num: int, joints: list[int], seed: int, scale: float, end: str, samples: int
) -> None:
    stops = np.cumsum(joints)
    given = strings(seed, int(stops[-1]) + 1, num, 16, scale)
    found = moved(given, np.stack([stops - joints, stops], axis=1), 16, end, samples)
    assert np.array_equal(found[:, [0, -1]], given[:, [0, -1]])
    assert np.array_equal(found[-1], given[-1])  # a joint of no arm
    assert np.isfinite(found).all()
    assert not np.array_equal(found, given)


@pytest.mark.parametrize("garbage", [0.0, 1e155, -1e300, 1e308, np.inf, np.nan])
@pytest.mark.parametrize("num_lanes", [1, 9, 50])
def test_a_lane_depends_neither_on_its_place_nor_on_padding(num_lanes: int, garbage: float) -> None:
    given, arms = strings(7, 5, 20, 56), [[0, 2], [2, 5]]
    dirty, order = given.copy(), np.random.default_rng(0).permutation(56)
    dirty[:, ::2, num_lanes:] = garbage
    clean, found = moved(given, arms, 56), moved(dirty, arms, num_lanes)
    assert np.array_equal(found[:, :, :num_lanes], clean[:, :, :num_lanes])
    assert np.isfinite(found).all() or not np.isfinite(garbage)
    rest = -(-num_lanes // 8) * 8
    assert np.array_equal(found[:, :, rest:], dirty[:, :, rest:], equal_nan=True)
    permuted = np.ascontiguousarray(given[:, :, order])
    assert np.array_equal(moved(permuted, arms, 56), clean[:, :, order])


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("value", [0.0, -0.0, 0.1, 315.0])
def test_a_path_without_length_stays_bit_for_bit(value: float, end: str) -> None:
    given = strings(3, 3, 20, 8)
    given[:, :, 5] = value
    found = moved(given, [[0, 2], [2, 3]], 8, end)
    assert np.array_equal(found[:, :, 5].view(np.int64), given[:, :, 5].view(np.int64))
    assert not np.array_equal(found[:, :, 4], given[:, :, 4])


def test_fewer_than_one_substep_is_refused() -> None:
    with pytest.raises(ValueError, match="substeps"):
        interpolate_linear(np.zeros((2, 3, 8)), 0)


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
