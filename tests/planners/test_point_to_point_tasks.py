"""Ways over a floor and tasks of two-link robots, for planners between two configurations."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from planners.runs import ran

TREES, STRINGS = "ga=rrt_connect objective=null", "ga.num_generations=60"
FLOOR = "robot=floor_platform scenario=chen"
FLOOR_TREES = f"planner=rrt_connect_floor collision=floor_edges {TREES}"
FLOOR_STRINGS = "planner=via_points ga=via_points objective=via_points collision=floor_edges"
LINK_TREES = f"planner=rrt_connect collision=curkovic_edges {TREES}"
LINK_STRINGS = "planner=rana_planar ga=rana_planar objective=rana_planar collision=curkovic_edges"
SCENES = [
    f"robot={robot} scenario={scenario}"
    for robot, scenario in (
        ("two_links_03", "curkovic_a"),
        ("two_links_05", "curkovic_b"),
        ("three_links_05", "curkovic_three"),
    )
]


def condition(*words: str) -> Condition:
    return composed(*" ".join(words).split())


def pairs_of(problem: Any) -> set[tuple[int, ...]]:
    return set(map(tuple, problem.scene.pairs.tolist()))


def test_ends_limits_and_bodies_are_those_of_the_grid() -> None:
    chosen: Any = condition(FLOOR, FLOOR_TREES)
    problem, paths = chosen.prepare().problem, composed("experiment=chen_path").prepare().problem
    in_units = np.degrees(1.0)  # a length unit counts as a radian
    assert problem.start == pytest.approx(in_units * np.array(chosen.scenario.start))
    assert problem.goal == pytest.approx(in_units * np.array(chosen.scenario.goal))
    assert problem.limits == pytest.approx(in_units * np.array([[0.0, 31.0], [0.0, 31.0]]))
    bodies = zip(problem.scene.shapes, paths.scene.shapes, strict=True)
    assert all(repr(one[1:]) == repr(two[1:]) for one, two in bodies)
    assert pairs_of(problem) == pairs_of(paths)


@pytest.mark.parametrize("scene", SCENES)
def test_ends_and_pairs_are_those_of_co_evolution(scene: str) -> None:
    own = "planner=coevolution ga=curkovic_5 objective=curkovic collision=curkovic"
    planner, problem = condition(scene, own).prepare()
    genes = planner.sample(problem, np.random.default_rng(0), 1)
    members = np.zeros(len(problem.start), dtype=np.int64)
    motion = planner.motion(problem, planner.team_solution(problem, genes, members))
    task = condition(scene, LINK_TREES).prepare().problem
    assert np.radians([task.start, task.goal]) == pytest.approx(motion.q[[0, -1]])
    assert pairs_of(task) == pairs_of(problem)


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (FLOOR, FLOOR_TREES),
        (FLOOR, f"{FLOOR_STRINGS} {STRINGS}"),
        *((scene, LINK_TREES) for scene in SCENES),
        *((scene, f"{LINK_STRINGS} {STRINGS} collision.collision_substeps=2") for scene in SCENES),
    ],
)
def test_trees_and_strings_solve_them(scene: str, words: str) -> None:
    run = ran(condition(scene, words))
    assert run.last.solved
    assert run.planner.departures(run.problem, run.last.best) == []
    assert run.verdict().certified is True or "rrt_connect" not in words
    motion = run.planner.motion(run.problem, run.last.best)
    assert np.degrees(motion.q[[0, -1]]) == pytest.approx(
        np.array([run.problem.start, run.problem.goal])
    )
    if scene == FLOOR:
        assert ((motion.q >= 0.0) & (motion.q <= 31.0)).all()


def test_the_model_tests_the_discs_that_are_judged() -> None:
    chosen: Any = condition(FLOOR, FLOOR_TREES, "collision.covers.padding=0")
    q = np.random.default_rng(1).uniform(0.0, 31.0, (2000, 2))
    edges = np.ascontiguousarray(np.degrees(q).T)
    hits = chosen.prepare().problem.collision.clearance(edges).least < 0.0
    boxes = chosen.scenario.bodies()
    away = [np.maximum(np.abs(q - b.center[:2]) - 0.5 * np.array(b.size[:2]), 0.0) for b in boxes]
    clear = np.min([np.linalg.norm(each, axis=1) for each in away], axis=0)
    assert (hits == (clear < 0.5)).all()
    assert 0.1 < hits.mean() < 0.9


def test_maps_in_space() -> None:
    size = "scenario.size=[9,9,9] scenario.start=[0,0,0] scenario.goal=[8,8,8]"
    block = "robot.dimensions=3 scenario.obstacles=[[3,3,3,5,5,5]]"
    run = ran(condition(FLOOR, FLOOR_TREES, size, block))
    assert run.last.solved
    assert run.planner.motion(run.problem, run.last.best).q.shape[1] == 3


@pytest.mark.parametrize(
    ("words", "queries"),
    [
        ("experiment=chen_path", 32 * 32),
        ("experiment=chen_path control=random_search", 32 * 32),
        (f"{FLOOR} {FLOOR_TREES}", 0),
        ("experiment=rana_planar", 0),
    ],
)
def test_a_map_counts_as_queries_of_its_nodes(words: str, queries: int) -> None:
    planner, problem = condition(words).prepare()
    assert planner.prior_queries(problem) == queries
