"""Redistribution with relaxation, and random walks, of 100 planar paths (50 individuals.

Two arms) beside numpy.
"""

import math
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from evoexp.paths.walk import num_uniforms, walk_strings
from evoexp.paths.workspace import prepare_redistribution
from paths.string_operators import redistribute, relax

ARMS, N, LANES, STRINGS = np.array([[0, 2], [2, 4]]), 20, 56, 50
START, GOAL = np.array([225.0, 0.0, 315.0, 0.0]), np.array([315.0, 135.0, 225.0, 90.0])
STEP, TURN = 2.5, math.radians(120)
UNIFORMS = np.random.default_rng(0).random((STRINGS, num_uniforms(ARMS, N)))


def population() -> Any:
    """Return fresh walks with one crossover each, what redistribution meets.  # (4, 21, 56)."""
    via_points = np.zeros((4, N + 1, LANES))
    walk_strings(via_points, np.arange(STRINGS), UNIFORMS, START, GOAL, ARMS, STEP, TURN)
    redistribute(via_points, ARMS, STRINGS, prepare_redistribution(N, 2))
    relax(via_points, 0.5, STRINGS)
    other = np.roll(via_points[:, :, :STRINGS], 1, axis=2)
    for lane, site in enumerate(np.random.default_rng(1).integers(1, N, STRINGS)):
        via_points[:, site:, lane] = other[:, site:, lane]
    return via_points


def numpy_redistribute(paths: Any, chords: int) -> None:
    """Move points of paths (paths, N + 1, joints) by chords, for all paths at once."""
    rows = np.arange(len(paths))[:, None]
    spline = CubicSpline(np.arange(N + 1), paths, axis=1, bc_type="natural")
    dense = spline(np.arange(N * chords + 1) / chords)
    length = np.zeros(dense.shape[:2])
    np.cumsum(np.linalg.norm(np.diff(dense, axis=1), axis=2), axis=1, out=length[:, 1:])
    target = length[:, -1:] * (np.arange(1, N) / N)
    k = np.clip((length[:, None, :] <= target[:, :, None]).sum(axis=2) - 1, 0, N * chords - 1)
    u = (k + (target - length[rows, k]) / (length[rows, k + 1] - length[rows, k])) / chords
    segment = np.minimum(u.astype(int), N - 1)
    t = (u - segment)[:, :, None]
    c = spline.c[:, segment, rows]  # (4, paths, N − 1, joints)
    paths[:, 1:N] = ((c[0] * t + c[1]) * t + c[2]) * t + c[3]


def numpy_relax(paths: Any, delta: float) -> None:
    """Relax all paths at once, point by point."""
    for i in range(1, N):
        paths[:, i] += delta * ((paths[:, i - 1] + paths[:, i + 1]) / 2 - paths[:, i])


def numpy_walk(start: Any, goal: Any, turn: Any) -> Any:
    """Return walks (strings, N + 1, 2) of one planar arm; turn (strings, N − 1) [rad]."""
    step = STEP * np.linalg.norm(goal - start) / N
    path = np.empty((len(turn), N + 1, 2))
    path[:, 0], path[:, N] = start, goal
    for i in range(1, N):
        d = goal - path[:, i - 1]
        angle = np.arctan2(d[:, 1], d[:, 0]) + turn[:, i - 1]
        path[:, i] = path[:, i - 1] + step * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return path


@pytest.mark.parametrize("samples", [8, 16])
def test_redistribution_and_relaxation(benchmark: Any, samples: int) -> None:
    given = population()
    via_points, workspace = given.copy(), prepare_redistribution(N, 2, "natural", samples)

    def run() -> None:
        np.copyto(via_points, given)
        redistribute(via_points, ARMS, STRINGS, workspace)
        relax(via_points, 0.5, STRINGS)

    benchmark.pedantic(run, rounds=500, iterations=10, warmup_rounds=5)
    assert np.array_equal(via_points[:, [0, N]], given[:, [0, N]])


def test_relaxation(benchmark: Any) -> None:
    via_points = population()
    benchmark.pedantic(
        lambda: relax(via_points, 0.5, STRINGS), rounds=500, iterations=10, warmup_rounds=5
    )
    assert np.all(np.isfinite(via_points))


@pytest.mark.parametrize("chords", [8, 16])
def test_redistribution_and_relaxation_in_numpy(benchmark: Any, chords: int) -> None:
    given = (
        population()[:, :, :STRINGS]
        .reshape(2, 2, N + 1, STRINGS)
        .transpose(0, 3, 2, 1)
        .reshape(-1, N + 1, 2)
    )
    paths = given.copy()

    def run() -> None:
        np.copyto(paths, given)
        numpy_redistribute(paths, chords)
        numpy_relax(paths, 0.5)

    benchmark.pedantic(run, rounds=50, iterations=1, warmup_rounds=2)
    via_points = population()
    redistribute(via_points, ARMS, STRINGS, prepare_redistribution(N, 2))
    relax(via_points, 0.5, STRINGS)
    ours = (
        via_points[:, :, :STRINGS]
        .reshape(2, 2, N + 1, STRINGS)
        .transpose(0, 3, 2, 1)
        .reshape(-1, N + 1, 2)
    )
    assert np.abs(ours - paths).max() < 2.0  # [deg], spacing about 10


@pytest.mark.parametrize("strings", [5, 50])
def test_walk(benchmark: Any, strings: int) -> None:
    via_points, lanes, uniforms = (
        np.zeros((4, N + 1, LANES)),
        np.arange(strings),
        UNIFORMS[:strings],
    )
    benchmark.pedantic(
        lambda: walk_strings(via_points, lanes, uniforms, START, GOAL, ARMS, STEP, TURN),
        rounds=300, iterations=10, warmup_rounds=5,
    )  # fmt: skip
    turn = (2 * uniforms[:, : N - 1] - 1) * TURN
    expected = numpy_walk(START[:2], GOAL[:2], turn)
    assert np.allclose(
        via_points[:2, :, :strings].transpose(2, 1, 0), expected, rtol=0.0, atol=1e-8
    )


@pytest.mark.parametrize("strings", [5, 50])
def test_walk_in_numpy(benchmark: Any, strings: int) -> None:
    turn = (2 * UNIFORMS[:strings].reshape(strings, 2, N - 1) - 1) * TURN

    def run() -> Any:
        return [
            numpy_walk(START[2 * a : 2 * a + 2], GOAL[2 * a : 2 * a + 2], turn[:, a])
            for a in (0, 1)
        ]

    paths = benchmark.pedantic(run, rounds=100, iterations=1, warmup_rounds=2)
    assert np.array_equal(paths[0][0, -1], GOAL[:2])
