"""Trees toward places of a planar arm's tip: postures, paths, answers of the task."""

import itertools
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.robots.planar_ends import bring_tip_to, tip
from planners.runs import ran

ARMS = "lavoie_7dof", "lavoie_10dof"
TREES = "planner=rrt_reaching", "ga=rrt_connect", "objective=null", "collision=lavoie"


def condition(*words: str, arm: str = "lavoie_7dof") -> Condition:
    return composed(f"robot=planar_{arm[7:-3]}r", f"scenario={arm}", *TREES, *words)


@pytest.mark.parametrize("arm", ARMS)
def test_the_tip_is_brought_to_a_place_within_the_limits(arm: str) -> None:
    _, problem = condition(arm=arm).prepare()
    rng, planar = np.random.default_rng(0), problem.collision.arm
    low, high = problem.joint_limits.T
    reached = 0
    for target in np.repeat(problem.targets, 50, axis=0):
        q = low + (high - low) * rng.random(len(low))
        if bring_tip_to(q, target, problem.joint_limits, planar):
            reached += 1
            turns = np.exp(1j * (planar.base_angle + np.cumsum(q)))
            there = complex(planar.base_x, planar.base_y) + planar.lengths @ turns
            assert abs(there - complex(*target)) < 1e-7
            assert tip(q, planar) == pytest.approx((there.real, there.imag))
            assert ((low <= q) & (q <= high)).all()
    assert reached > 80
    far = 2.0 * np.array([planar.lengths.sum(), 0.0])
    assert not bring_tip_to(problem.start.copy(), far, problem.joint_limits, planar)


@pytest.mark.parametrize("arm", ARMS)
def test_configurations_are_judged_as_paths_that_stay(arm: str) -> None:
    _, problem = condition(arm=arm).prepare()
    low, high = problem.joint_limits.T
    q = np.random.default_rng(1).uniform(low, high, (300, len(low)))
    expected = [problem.collision.contact(each, each) is not None for each in q]
    assert problem.collision.collides(np.degrees(q.T.copy())).tolist() == expected
    assert 20 < sum(expected) < 280


@pytest.mark.parametrize("arm", ARMS)
def test_answers_are_of_the_task_and_mostly_proven(arm: str) -> None:
    num_proven = 0
    for seed in range(4):
        run = ran(condition(arm=arm), seed)
        planner, problem, last = run.planner, run.problem, run.last
        assert (last.solved, last.stop_reason) == (True, "solution")
        assert planner.departures(problem, last.best) == []
        terms = planner.evaluate(problem, last.best)
        assert terms["collisions"] == 0.0
        assert terms["length_deg"] == pytest.approx(last.best_cost)
        assert max(terms["via_error"], terms["goal_error"]) < 1e-6
        counts = [record.collision_queries for record in run.records]
        assert all(earlier <= later for earlier, later in itertools.pairwise(counts))
        num_proven += run.verdict().certified is True
    assert num_proven >= 1


def test_a_search_may_end_without_a_plan() -> None:
    planner, problem, (*_, last) = ran(condition("planner.max_iterations=1"))
    assert (last.solved, last.stop_reason) == (False, "no solution")
    assert np.array_equal(last.best, problem.start)
    assert planner.motion(problem, last.best) is None
    assert len(planner.departures(problem, last.best)) == 2


def test_what_cannot_be_is_refused() -> None:
    planner: Any
    planner, problem = condition().prepare()
    with pytest.raises(SettingError, match="a planner that draws paths one by one"):
        planner.sample(problem, np.random.default_rng(0), 1)
    with pytest.raises(ValueError, match="a multiple of 7"):
        planner.evaluate(problem, np.zeros(8))
