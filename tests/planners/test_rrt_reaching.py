"""Trees toward places of a planar arm's tip: postures, paths, answers of the task."""

import itertools
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations
from evoexp.robots.planar_ends import bring_tip_to, tip

ARMS = "lavoie_7dof", "lavoie_10dof"
TREES = "planner=rrt_reaching", "ga=rrt_connect", "objective=null", "collision=lavoie"


def condition(arm: str, *words: str) -> Condition:
    scene = f"robot=planar_{arm[7:-3]}r", f"scenario={arm}"
    return composed(*scene, *TREES, *words)


def evolved(chosen: Condition, seed: int) -> list[Any]:
    planner, problem = chosen.prepare()
    return list(generations(planner.evolve(problem, np.random.default_rng(seed))))


def complex_tip(q: Any, arm: Any) -> complex:
    """Return the tip as a sum of complex numbers."""
    turns = np.exp(1j * (arm.base_angle + np.cumsum(q)))
    return complex(arm.base_x + 1j * arm.base_y + (arm.lengths * turns).sum())


@pytest.mark.parametrize("arm", ARMS)
def test_the_tip_is_brought_to_a_place_within_the_limits(arm: str) -> None:
    _, problem = condition(arm).prepare()
    rng, planar = np.random.default_rng(0), problem.collision.arm
    low, high = problem.joint_limits.T
    found = 0
    for target in np.repeat(problem.targets, 50, axis=0):
        q = low + (high - low) * rng.random(len(low))
        if bring_tip_to(q, target, problem.joint_limits, planar):
            found += 1
            there = complex_tip(q, planar)
            assert abs(there - complex(*target)) < 1e-7
            assert tip(q, planar) == pytest.approx((there.real, there.imag))
            assert ((low <= q) & (q <= high)).all()
    assert found > 80
    far = 2.0 * np.array([planar.lengths.sum(), 0.0])
    assert not bring_tip_to(problem.start.copy(), far, problem.joint_limits, planar)


@pytest.mark.parametrize("arm", ARMS)
def test_configurations_are_judged_as_paths_that_stay(arm: str) -> None:
    _, problem = condition(arm).prepare()
    low, high = problem.joint_limits.T
    q = low[:, None] + (high - low)[:, None] * np.random.default_rng(1).random((len(low), 300))
    found = problem.collision.collides(np.degrees(q))
    wanted = [problem.collision.contact(each, each) is not None for each in q.T]
    assert found.tolist() == wanted
    assert 20 < sum(wanted) < 280


@pytest.mark.parametrize("arm", ARMS)
def test_answers_are_of_the_task_and_mostly_proven(arm: str) -> None:
    chosen = condition(arm)
    planner, problem = chosen.prepare()
    num_proven = 0
    for seed in range(4):
        records = evolved(chosen, seed)
        last = records[-1]
        assert last.solved
        assert last.stop_reason == "solution"
        assert planner.departures(problem, last.best) == []
        terms = planner.evaluate(problem, last.best)
        assert terms["collisions"] == 0.0
        assert terms["length_deg"] == pytest.approx(last.best_cost)
        assert max(terms["via_error"], terms["goal_error"]) < 1e-6
        found = judge_motion(planner, problem, planner.motion(problem, last.best))
        num_proven += found.certified is True
        counts = [record.collision_queries for record in records]
        assert all(a <= b for a, b in itertools.pairwise(counts))
    assert num_proven >= 1


@pytest.mark.parametrize("arm", ARMS)
def test_with_proofs_every_answer_is_proven(arm: str) -> None:
    chosen = condition(arm, "planner.acceptance=certified")
    planner, problem = chosen.prepare()
    num_solved = 0
    for seed in range(3):
        for record in evolved(chosen, seed):
            assert record.solved == np.isfinite(record.best_cost)
        num_solved += record.solved
        if record.solved:
            found = judge_motion(planner, problem, planner.motion(problem, record.best))
            assert found.certified is True
    assert num_solved >= 2


def test_shortcuts_and_restarts_make_plans_shorter() -> None:
    few = "planner.num_postures=3"
    once = few, "planner.num_restarts=0"
    plain = evolved(condition("lavoie_7dof", *once, "planner.num_shortcuts=0"), 0)[-1]
    shortened = evolved(condition("lavoie_7dof", *once), 0)[-1]
    again = evolved(condition("lavoie_7dof", few, "planner.num_restarts=3"), 0)[-1]
    assert again.best_cost <= shortened.best_cost < plain.best_cost
    assert 1.0 < again.terms["plans"] <= 4.0


def test_a_run_depends_on_its_seed_alone_and_ends_without_a_plan() -> None:
    one, two = (evolved(condition("lavoie_7dof"), 3)[-1] for _ in range(2))
    assert np.array_equal(one.best, two.best)
    assert one.collision_queries == two.collision_queries
    last = evolved(condition("lavoie_7dof", "planner.max_iterations=1"), 0)[-1]
    assert last.stop_reason == "no solution"
    assert not last.solved
    planner, problem = condition("lavoie_7dof").prepare()
    assert np.array_equal(last.best, problem.start)
    assert planner.motion(problem, last.best) is None
    assert len(planner.departures(problem, last.best)) == 2


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(SettingError, match=r"scenario\.goal_point: must be in the box"):
        condition("lavoie_7dof", "scenario.goal_point=[5,5]").prepare()
    planner, problem = condition("lavoie_7dof").prepare()
    with pytest.raises(SettingError, match="one that draws paths one by one"):
        planner.sample(problem, np.random.default_rng(0), 1)
    with pytest.raises(ValueError, match="a multiple of 7"):
        planner.evaluate(problem, np.zeros(8))
