"""What the certifier's proofs rest on: bounds of speed and of distance that nothing exceeds."""

import coal
import numpy as np
import pinocchio as pin
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from collision.certifier_scenes import random_motion, random_scene
from evoexp.collision.certifier.convex_distance import CONVERGED
from evoexp.collision.certifier.least_distance import polish
from evoexp.collision.certifier.task import (
    Task,
    least_separation,
    move_to,
    pair_distance,
    work_space,
)
from evoexp.collision.certifier.verdict import Limits, _Judgement
from evoexp.collision.motion_bounds import approach_bounds
from evoexp.collision.scene import geometry_scene
from evoexp.paths.motion import Motion, cubic_motion, spline_motion
from matrix import num_cases


def judgement(seed: int) -> _Judgement:
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    motion = random_motion(rng, scene.model.nq)
    return _Judgement(scene, motion, 0.0, 1e-3, Limits())


def write_bounds(task: Task, begin: float, end: float, bounds: np.ndarray) -> None:
    scratch = np.empty(len(task.chain.parent))
    approach_bounds(task.chain, task.coefficients[0], begin, end, task.weights, bounds, scratch)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), begin=st.floats(0.0, 0.99), width=st.floats(1e-3, 1.0))
def test_distances_never_change_faster_than_the_bound(
    seed: int, begin: float, width: float
) -> None:
    judged = judgement(seed)
    end = min(begin + width, 1.0)
    bounds = np.empty((2, len(judged.scene.pairs)))
    write_bounds(judged.task, begin, end, bounds)
    t = np.linspace(begin, end, 9)
    for pair, bound in enumerate(bounds[0]):
        d = np.array([max(judged.coal(pair, float(instant)), 0.0) for instant in t])
        steps = np.abs(d[:, None] - d[None, :])
        assert np.all(steps <= bound * np.abs(t[:, None] - t[None, :]) + 1e-6)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), begin=st.floats(0.0, 0.9), width=st.floats(1e-3, 1.0))
def test_bodies_stay_as_far_apart_as_their_velocities_and_accelerations_say(
    seed: int, begin: float, width: float
) -> None:
    judged = judgement(seed)
    task, work, end = judged.task, work_space(judged.task), min(begin + width, 1.0)
    bounds, u, half = (
        np.empty((2, len(judged.scene.pairs))),
        0.5 * (begin + end),
        0.5 * (end - begin),
    )
    write_bounds(task, begin, end, bounds)
    move_to(task, work, 0, u)
    assert task.by_one.all()
    for pair in range(len(task.pairs)):
        low, _ = pair_distance(task, work, pair, np.inf, -np.inf, CONVERGED)
        assert least_separation(task, work, pair, 0, u, 0.0) <= low + 1e-9
        bound = least_separation(task, work, pair, 0, u, half) - 0.5 * half * half * bounds[1, pair]
        distances = [judged.coal(pair, float(t)) for t in np.linspace(begin, end, 15)]
        assert bound <= max(min(distances), 0.0) + 1e-6


def test_the_bound_is_reached() -> None:
    """Not only an upper bound: a tip that comes straight at a body moves at it."""
    model, geometry = pin.Model(), pin.GeometryModel()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "turn")
    tip = pin.SE3(np.eye(3), np.array([2.0, 0.0, 0.0]))
    geometry.addGeometryObject(pin.GeometryObject("tip", joint, 0, tip, coal.Sphere(0.1)))
    ball = pin.SE3(np.eye(3), np.array([2.0, 3.0, 0.0]))
    geometry.addGeometryObject(pin.GeometryObject("ball", 0, 0, ball, coal.Sphere(0.1)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    motion = Motion(np.array([[0.0], [0.5]]))
    judged = _Judgement(geometry_scene(model, geometry), motion, 0.0, 1e-3, Limits())
    bounds = np.empty((2, 1))
    write_bounds(judged.task, 0.0, 1.0, bounds)
    assert bounds[0, 0] == pytest.approx(0.5 * 2.1)
    slope = (judged.coal(0, 0.0) - judged.coal(0, 1e-6)) / 1e-6
    assert slope == pytest.approx(0.5 * 2.0, rel=1e-4)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), u=st.floats(0.0, 1.0), stop=st.floats(-1.0, 3.0))
def test_bounds_of_distances_hold_however_early_they_stop(seed: int, u: float, stop: float) -> None:
    judged = judgement(seed)
    task, work = judged.task, work_space(judged.task)
    move_to(task, work, 0, u)
    for pair in range(len(task.pairs)):
        exact = judged.coal(pair, u)
        for need, enough in ((np.inf, -np.inf), (stop, stop), (stop, -np.inf), (np.inf, stop)):
            low, high = pair_distance(task, work, pair, need, enough, CONVERGED)
            assert low <= max(exact, 0.0) + 1e-6
            if task.exact[pair]:
                assert high >= min(exact, 0.0) - 1e-6 and (high >= exact - 1e-6 or high <= 0.0)
            if need == np.inf and enough == -np.inf and task.exact[pair] and exact > 0.0:
                assert low == pytest.approx(exact, abs=1e-6) and high == pytest.approx(
                    exact, abs=1e-6
                )
        low, high = pair_distance(task, work, pair, np.inf, -np.inf, 1e-3)
        assert low <= max(exact, 0.0) + 1e-6
        if task.exact[pair] and exact > 0.0:
            cores = (
                exact + task.bodies.radius[task.pairs[pair]].sum()
            )  # what is swept around them is taken off
            assert exact - 1e-6 <= high <= low + 1e-3 * cores + 1e-5


def slow_walk(judged: _Judgement, pair: int, t: float) -> float:
    """Down to a local minimum of coal's distance in steps that are halved."""
    step, least = 0.02, judged.coal(pair, t)
    while step > 1e-9:
        nearby = [min(max(t + ahead, 0.0), judged.task.last) for ahead in (step, -step)]
        distances = [judged.coal(pair, tried) for tried in nearby]
        if min(distances) < least:
            least, t = min(zip(distances, nearby, strict=True))
        else:
            step *= 0.5
    return least


@settings(max_examples=num_cases(6, 60), deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), t=st.floats(0.0, 1.0))
def test_local_minima_are_found(seed: int, t: float) -> None:
    """As by halving steps, from the same instant.

    The two may end in different minima, if each is one.
    """
    judged = judgement(seed)
    pairs = np.flatnonzero(judged.task.exact)
    at, distances = np.full(len(pairs), t), np.empty(len(pairs))
    polish(judged.task, judged.work, pairs, at, distances)
    for pair, end, distance in zip(
        pairs, at, np.maximum(distances, 0.0), strict=True
    ):  # how deep is not known
        assert 0.0 <= end <= judged.task.last
        assert distance == pytest.approx(max(judged.coal(int(pair), float(end)), 0.0), abs=1e-6)
        slow = max(slow_walk(judged, int(pair), t), 0.0)
        if abs(distance - slow) > 1e-6:
            assert max(slow_walk(judged, int(pair), float(end)), 0.0) == pytest.approx(
                distance, abs=1e-6
            )


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), begin=st.floats(0.0, 1.0), end=st.floats(0.0, 1.0))
def test_speeds_of_cubics_stay_below_their_bound(seed: int, begin: float, end: float) -> None:
    begin, end = min(begin, end), max(begin, end)
    c = np.random.default_rng(seed).normal(size=(1, 4, 3))
    motion = cubic_motion(c)
    u = np.linspace(begin, end, 33)[:, None]
    speed = np.abs(c[0, 1] + 2.0 * c[0, 2] * u + 3.0 * c[0, 3] * u**2)
    assert np.all(speed <= motion.speed_bound(0, begin, end) + 1e-12)
    q = np.array([motion.at(float(t)) for t in np.linspace(0.0, 1.0, 33)])
    assert np.all(np.abs(q) <= motion.greatest + 1e-12)


def test_a_spline_becomes_a_motion() -> None:
    rng = np.random.default_rng(0)
    knots = np.array([0.0, 0.5, 2.0, 2.3])
    values = rng.normal(size=(4, 3))
    spline = scipy.interpolate.CubicSpline(knots, values)
    motion = spline_motion(spline)
    assert motion.num_segments == 3
    assert np.allclose(motion.q, values, atol=1e-12)
    for segment in range(3):
        for u in (0.0, 0.3, 1.0):
            expected = spline(knots[segment] + u * (knots[segment + 1] - knots[segment]))
            assert np.allclose(motion.at(segment + u), expected, atol=1e-12)


def test_a_straight_motion() -> None:
    motion = Motion(np.array([[0.0, 1.0], [2.0, -1.0], [2.0, 0.0]]))
    assert motion.num_segments == 2
    assert motion.at(0.25).tolist() == [0.5, 0.5]
    assert motion.at(2.0).tolist() == [2.0, 0.0]
    assert motion.speed_bound(0).tolist() == [2.0, 2.0]
    assert motion.polynomials.shape == (2, 4, 2)
    assert Motion(np.array([[1.0, 2.0]])).at(0.0).tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match=r"t must lie in \[0, 2\], was 2.5"):
        motion.at(2.5)


def test_a_cubic_motion_must_hang_together() -> None:
    broken = np.zeros((2, 4, 1))
    broken[1, 0] = 1.0
    with pytest.raises(ValueError, match="jump by 1.0 behind segment 0"):
        cubic_motion(broken)
    with pytest.raises(ValueError, match=r"must have shape \(segments, 4, nq\), was \(2, 3\)"):
        cubic_motion(np.zeros((2, 3)))
