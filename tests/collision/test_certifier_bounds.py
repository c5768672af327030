"""The certifier beside coal at very many instants, and the bounds that its proofs rest on."""

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from collision.certifier_scenes import SAMPLES, brute_force, random_motion, random_scene
from evoexp.collision.certifier.convex_distance import CONVERGED
from evoexp.collision.certifier.task import (
    LeastDistance,
    known,
    least_separation,
    move_to,
    pair_distance,
    work_space,
)
from evoexp.collision.certifier.verdict import RESOLUTION, _Judgement, certify, is_clear
from evoexp.collision.motion_bounds import approach_bounds
from evoexp.collision.scene import scene
from evoexp.paths.motion import Motion, cubic_motion, spline_motion
from evoexp.robots.arms import PlanarChain
from matrix import first

SEEDS = st.integers(0, 2**32 - 1)
SHARES = st.floats(0.0, 1.0)


def judgement(seed: int) -> _Judgement:
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    return _Judgement(scene, random_motion(rng, scene.model.nq), 0.0, RESOLUTION)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(seed=SEEDS, begin=st.floats(0.0, 0.99), width=st.floats(1e-3, 1.0))
def test_nothing_moves_faster_or_nearer_than_its_bounds(
    seed: int, begin: float, width: float
) -> None:
    judged = judgement(seed)
    task, work, end = judged.task, work_space(judged.task), min(begin + width, 1.0)
    bounds, scratch = np.empty((2, len(task.pairs))), np.empty(len(task.chain.parent))
    approach_bounds(task.chain, task.coefficients[0], begin, end, task.weights, bounds, scratch)
    speeds, accelerations = bounds
    u, half, t = 0.5 * (begin + end), 0.5 * (end - begin), np.linspace(begin, end, 15)
    move_to(task, work, 0, u)
    assert task.by_one.all()
    for pair in range(len(task.pairs)):
        d = np.array([max(judged.coal(pair, float(instant)), 0.0) for instant in t])
        steps, times = np.abs(d[:, None] - d[None, :]), np.abs(t[:, None] - t[None, :])
        assert np.all(steps <= speeds[pair] * times + 1e-6)
        low, _ = pair_distance(task, work, pair, np.inf, -np.inf, CONVERGED)
        assert least_separation(task, work, pair, 0, u, 0.0) <= low + 1e-9
        separation = least_separation(task, work, pair, 0, u, half)
        assert separation - 0.5 * half * half * accelerations[pair] <= d.min() + 1e-6


@settings(max_examples=150, deadline=None, derandomize=True)
@given(seed=SEEDS, u=SHARES, stop=st.floats(-1.0, 3.0))
def test_bounds_of_distances_hold_however_early_they_stop(seed: int, u: float, stop: float) -> None:
    judged = judgement(seed)
    task, work = judged.task, work_space(judged.task)
    move_to(task, work, 0, u)
    for pair in range(len(task.pairs)):
        exact, is_exact = judged.coal(pair, u), task.exact[pair]
        for need, enough in ((np.inf, -np.inf), (stop, stop), (stop, -np.inf), (np.inf, stop)):
            low, high = pair_distance(task, work, pair, need, enough, CONVERGED)
            assert low <= max(exact, 0.0) + 1e-6
            if is_exact:
                assert high >= min(exact, 0.0) - 1e-6 and (high >= exact - 1e-6 or high <= 0.0)
            if need == np.inf and enough == -np.inf and is_exact and exact > 0.0:
                assert [low, high] == pytest.approx([exact, exact], abs=1e-6)
        low, high = pair_distance(task, work, pair, np.inf, -np.inf, 1e-3)
        assert low <= max(exact, 0.0) + 1e-6
        if is_exact and exact > 0.0:
            # what is swept around the cores is taken off
            cores = exact + task.bodies.radius[task.pairs[pair]].sum()
            assert exact - 1e-6 <= high <= low + 1e-3 * cores + 1e-5


def test_a_spline_becomes_a_motion() -> None:
    knots = np.array([0.0, 0.5, 2.0, 2.3])
    spline = scipy.interpolate.CubicSpline(knots, np.random.default_rng(0).normal(size=(4, 3)))
    motion = spline_motion(spline)
    assert motion.num_segments == 3
    for segment, (begin, end) in enumerate(zip(knots[:-1], knots[1:], strict=True)):
        for u in (0.0, 0.3, 1.0):
            expected = spline(begin + u * (end - begin))
            assert np.allclose(motion.at(segment + u), expected, atol=1e-12)


def test_a_straight_motion() -> None:
    motion = Motion(np.array([[0.0, 1.0], [2.0, -1.0], [2.0, 0.0]]))
    assert [motion.at(t).tolist() for t in (0.25, 2.0)] == [[0.5, 0.5], [2.0, 0.0]]
    assert motion.speed_bound(0).tolist() == [2.0, 2.0]
    with pytest.raises(ValueError, match=r"t must lie in \[0, 2\], was 2.5"):
        motion.at(2.5)


def test_a_cubic_motion_must_hang_together() -> None:
    broken = np.zeros((2, 4, 1))
    broken[1, 0] = 1.0
    with pytest.raises(ValueError, match="jump by 1.0 behind segment 0"):
        cubic_motion(broken)
    with pytest.raises(ValueError, match=r"must have shape \(segments, 4, nq\), was \(2, 3\)"):
        cubic_motion(np.zeros((2, 3)))


SCENES, BATCH = 200, 20

COAL_ERROR = 1e-6  # of distances of curved bodies, far above what was seen
FASTEST = 20.0 / SAMPLES  # from sample to sample: no body moves faster than 20 per segment


@pytest.mark.examples(1)
@pytest.mark.parametrize("first_scene", first(2, range(0, SCENES, BATCH)))
def test_brute_force_never_contradicts(first_scene: int) -> None:
    statuses = []
    for seed in range(first_scene, first_scene + BATCH):
        rng = np.random.default_rng(seed)
        scene = random_scene(rng)
        motion = random_motion(rng, scene.model.nq)
        verdict, brute = certify(scene, motion), brute_force(scene, motion)
        assert is_clear(scene, motion) == (verdict.status == "certified"), seed
        margins = np.array([0.5, 1.5]) * verdict.clearance
        if 0.0 < verdict.clearance < np.inf:
            assert [is_clear(scene, motion, margin) for margin in margins] == [True, False], seed
        statuses.append(verdict.status)
        least, touching = brute.least.min(), brute.t[brute.least <= scene.tolerances[brute.pair]]
        if verdict.status == "certified":
            assert len(touching) == 0, seed
            most = verdict.proven * 1.002 + 1e-5 * scene.size
            assert verdict.proven - COAL_ERROR <= least, seed
            assert verdict.clearance - COAL_ERROR <= least <= verdict.clearance + FASTEST, seed
            assert verdict.proven <= verdict.clearance <= most, seed
        elif verdict.status == "refuted":
            assert len(touching) > 0 or least < FASTEST, seed
            assert len(touching) == 0 or verdict.refuted_at <= touching[0] + 1e-9, seed
            before = brute.least[brute.t < verdict.refuted_at]
            assert len(touching) == 0 or len(before) == 0 or before[-1] < FASTEST, seed
    assert set(statuses) == {"certified", "refuted"}


@pytest.mark.examples(6)
@pytest.mark.parametrize("seed", range(40))
def test_distances_are_those_of_coal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = random_scene(rng)
    if not known(found):
        return
    q = rng.uniform(-3.0, 3.0, size=(found.model.nq, 200))
    # coal errs by 4e-6 with ellipsoids
    least = np.maximum(brute_force(found, Motion(q.T.copy()), 1).least, 0.0)
    np.testing.assert_allclose(LeastDistance(found)(q), least, atol=2e-5 * found.size)


def test_without_pairs_nothing_is_near() -> None:
    arm = PlanarChain(link_lengths=(1.0, 1.0), base_position=(0.0, 0.0)).build()
    assert LeastDistance(scene(arm))(np.zeros((2, 3))).tolist() == [np.inf] * 3
