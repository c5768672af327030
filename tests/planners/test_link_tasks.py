"""Tasks of two-link robots for planners that go from one configuration to another."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations

RRT = "planner=rrt_connect", "ga=rrt_connect", "objective=null", "collision=curkovic_edges"
STRINGS = "planner=rana_planar", "ga=rana_planar", "objective=rana_planar", RRT[-1]
SCENES = [
    ("two_links_03", "curkovic_a"),
    ("two_links_05", "curkovic_b"),
    ("three_links_05", "curkovic_three"),
]


def last_of(chosen: Condition, seed: int = 0) -> Any:
    planner, problem = chosen.prepare()
    *_, last = generations(planner.evolve(problem, np.random.default_rng(seed)))
    return last


@pytest.mark.parametrize(("robot", "scenario"), SCENES)
def test_ends_are_those_of_co_evolution(robot: str, scenario: str) -> None:
    scene = f"robot={robot}", f"scenario={scenario}"
    own = "planner=coevolution", "ga=curkovic_5", "objective=curkovic", "collision=curkovic"
    planner, problem = composed(*scene, *own).prepare()
    genes = planner.sample(problem, np.random.default_rng(0), 1)
    members = np.zeros(len(problem.start), dtype=np.int64)
    motion = planner.motion(problem, planner.team_solution(problem, genes, members))
    _, task = composed(*scene, *RRT).prepare()
    assert np.radians(task.start) == pytest.approx(motion.q[0])
    assert np.radians(task.goal) == pytest.approx(motion.q[-1])
    pairs = [set(map(tuple, each.scene.pairs.tolist())) for each in (task, problem)]
    assert pairs[0] == pairs[1]


@pytest.mark.parametrize(("robot", "scenario"), SCENES)
def test_trees_and_strings_solve_them(robot: str, scenario: str) -> None:
    few = "ga.num_generations=60", "collision.collision_substeps=2"
    for words in (RRT, (*STRINGS, *few)):
        chosen = composed(f"robot={robot}", f"scenario={scenario}", *words)
        last = last_of(chosen)
        planner, problem = chosen.prepare()
        assert last.solved
        assert planner.departures(problem, last.best) == []
        found = judge_motion(planner, problem, planner.motion(problem, last.best))
        assert found.certified is True or words is not RRT


def test_robots_that_stand_still_are_refused() -> None:
    scene = "robot=two_links_05", "scenario=curkovic_stationary"
    must = r"scenario\.stationary: must be empty: this planner moves all robots, was \[1\]"
    with pytest.raises(SettingError, match=must):
        composed(*scene, *RRT).prepare()


def test_other_robots_are_refused() -> None:
    with pytest.raises(SettingError, match="robot: must be planar arms of two links"):
        composed("robot=planar_7r", "scenario=curkovic_a", *RRT).prepare()
