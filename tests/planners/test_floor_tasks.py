"""A platform's way over a floor, for planners that go from one configuration to another."""

import numpy as np
import pytest

from composed import composed
from evoexp.errors import SettingError
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations

FLOOR = "robot=floor_platform", "scenario=chen"
RRT = "planner=rrt_connect_floor", "ga=rrt_connect", "objective=null", "collision=floor_edges"
STRINGS = "planner=via_points", "ga=via_points", "objective=via_points", "collision=floor_edges"

PATHS = "planner=grid_path_ga", "ga=chen_path", "objective=chen_path_a", "collision=chen"


def test_ends_limits_and_bodies_are_those_of_the_grid() -> None:
    chosen = composed(*FLOOR, *RRT)
    _, problem = chosen.prepare()
    _, paths = composed("experiment=chen_path").prepare()
    in_units = np.degrees(1.0)  # a length unit counts as a radian
    assert problem.start == pytest.approx(in_units * np.array(chosen.scenario.start))
    assert problem.goal == pytest.approx(in_units * np.array(chosen.scenario.goal))
    assert problem.limits == pytest.approx(in_units * np.array([[0.0, 31.0], [0.0, 31.0]]))
    bodies = zip(problem.scene.shapes, paths.scene.shapes, strict=True)
    assert all(repr(one[1:]) == repr(two[1:]) for one, two in bodies)
    assert sorted(map(tuple, problem.scene.pairs)) == sorted(map(tuple, paths.scene.pairs))


def test_trees_and_strings_reach_the_goal() -> None:
    for words in (RRT, (*STRINGS, "ga.num_generations=60")):
        planner, problem = composed(*FLOOR, *words).prepare()
        *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
        assert last.solved
        assert planner.departures(problem, last.best) == []
        motion = planner.motion(problem, last.best)
        assert motion.q[0].tolist() == pytest.approx([2.0, 6.0])
        assert motion.q[-1].tolist() == pytest.approx([30.0, 27.0])
        assert ((motion.q >= 0.0) & (motion.q <= 31.0)).all()
        found = judge_motion(planner, problem, motion)
        assert found.certified is True or words is not RRT


def test_the_model_tests_the_discs_that_are_judged() -> None:
    _, problem = composed(*FLOOR, *RRT, "collision.covers.padding=0").prepare()
    rng, boxes = np.random.default_rng(1), composed(*FLOOR, *RRT).scenario.bodies()
    q = rng.uniform(0.0, 31.0, (2000, 2))
    edges = np.degrees(q)
    hits = problem.collision.clearance(np.ascontiguousarray(edges.T)).least < 0.0
    away = [np.maximum(np.abs(q - b.center[:2]) - 0.5 * np.array(b.size[:2]), 0.0) for b in boxes]
    clear = np.min([np.linalg.norm(each, axis=1) for each in away], axis=0)
    assert (hits == (clear < 0.5)).all()
    assert 0.1 < hits.mean() < 0.9


def test_maps_in_space() -> None:
    words = "robot=floor_platform", "robot.dimensions=3", "scenario=chen", *RRT
    size = "scenario.size=[9,9,9]", "scenario.start=[0,0,0]", "scenario.goal=[8,8,8]"
    planner, problem = composed(*words, *size, "scenario.obstacles=[[3,3,3,5,5,5]]").prepare()
    *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    assert last.solved
    assert planner.motion(problem, last.best).q.shape[1] == 3


@pytest.mark.parametrize(
    ("words", "refusal"),
    [
        (("robot=planar_7r",), "robot: must be one that slides along the 2 directions"),
        (("robot=floor_platform", "robot.dimensions=3"), "robot: must be one that slides along"),
        (("robot=floor_platform", "scenario.start=[7,9]"), "scenario.start: must be a free node"),
        (("robot=floor_platform", "robot.body_radius=5"), "free of contact between bodies"),
    ],
)
def test_what_does_not_fit_is_refused(words: tuple[str, ...], refusal: str) -> None:
    with pytest.raises(SettingError, match=refusal):
        composed("scenario=chen", *RRT, *words).prepare()


def test_a_map_counts_as_queries_of_its_nodes() -> None:
    planner, problem = composed("experiment=chen_path").prepare()
    assert planner.prior_queries(problem) == 32 * 32
    control, problem = composed(*FLOOR, *PATHS, "control=random_search").prepare()
    assert control.prior_queries(problem) == 32 * 32
    trees, problem = composed(*FLOOR, *RRT).prepare()
    assert trees.prior_queries(problem) == 0
