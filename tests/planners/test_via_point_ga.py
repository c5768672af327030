"""The planner of Rana & Zalzala: its problem, its margins, its degenerate cases."""

import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.planners.answers import judge_motion
from evoexp.planners.via_point_ga.planner import Problem, ViaPointGa, sampled
from evoexp.records import FloatArray, generations
from planners.runs import evolved


def condition(*overrides: str, experiment: str = "rana_planar", length: int = 5) -> Condition:
    return composed(f"experiment={experiment}", f"ga.num_generations={length}", *overrides)


def prepared(*overrides: str, experiment: str = "rana_planar") -> tuple[ViaPointGa, Problem]:
    return condition(*overrides, experiment=experiment).prepare()


def straight(problem: Problem, num: int) -> FloatArray:
    """Return the straight line from start to goal as a flat solution."""
    line = np.linspace(problem.start, problem.goal, num + 1)
    return np.concatenate([line[:, first:stop].ravel() for first, stop in problem.arm_slices])


def test_solutions_keep_the_documented_order_and_the_straight_line_collides() -> None:
    planner, problem = prepared()
    population = planner.sample(problem, np.random.default_rng(0), 3)
    solution = planner.solution(problem, population, 1).reshape(2, 21, 2)
    assert np.array_equal(solution[0, :, 0], population[0, :, 1])
    assert np.array_equal(solution[1, :, 1], population[3, :, 1])
    assert np.array_equal(solution[0, 0], [45.0, 225.0])
    assert np.array_equal(solution[1, -1], [315.0, 315.0])
    motion = planner.motion(problem, solution.ravel())
    assert motion.q[7] == pytest.approx(np.deg2rad(population[:, 7, 1]))
    terms = planner.evaluate(problem, straight(problem, 20))
    assert terms["collisions"] > 0
    assert terms["path_length_ratio"] == pytest.approx(1.0)
    assert terms["unevenness_arm_1_deg"] == pytest.approx(0.0, abs=1e-9)


def test_samples_of_a_string_are_its_segments_via_points_included() -> None:
    strings = np.random.default_rng(0).normal(size=(3, 6))
    instants = np.linspace(0.0, 5.0, 21)
    expected = [np.interp(instants, np.arange(6.0), row) for row in strings]
    np.testing.assert_allclose(sampled(strings, 4), expected, rtol=0.0, atol=1e-14)
    np.testing.assert_array_equal(sampled(strings, 4)[:, ::4], strings)


@pytest.mark.examples(5)
@pytest.mark.parametrize(
    "words",
    [
        "ga.population_size=1 ga.num_elites=0 planner.num_new_trajectories=0",
        "ga.population_size=1 ga.num_elites=1 planner.num_new_trajectories=0",
        "ga.population_size=3 ga.num_elites=0 planner.num_new_trajectories=3",
        "planner.num_via_points=1",
        "planner.num_via_points=2",
        "objective.fitness_offset=0",
        "objective.length_weight=0 objective.unevenness_weight=0 objective.collision_weight=0",
        "planner.redistribution=false planner.relaxation_step=0",
        "planner.relaxation_step=1 planner.max_turn=0",
        "planner.spline_end=clamped planner.max_turn=180",
        "ga.crossover_rate=0 ga.mutation_rate=0",
        "scenario.q_goal=[[45,225],[225,225]]",
        "scenario.q_goal=[[45,225],[270,225]]",
        "collision.spheres_per_link=1 collision.sphere_radius=1.2",
    ],
)
def test_degenerate_settings_run(words: str) -> None:
    planner, problem = prepared(*words.split())
    for generation in generations(planner.evolve(problem, np.random.default_rng(0))):
        assert np.isfinite(generation.costs).all()
        assert np.isfinite(generation.population).all()


def test_arms_and_obstacles_have_margins_of_their_own() -> None:
    """Verdicts on the best strings of some runs, against distances of coal at many instants."""
    planner, problem = condition(experiment="rana_obstacles", length=200).prepare()
    assert (problem.security_margin, problem.obstacle_margin) == (1.0, 0.5)
    bodies = problem.scene
    among = np.array(["obstacle" in bodies.names[b] for _, b in bodies.pairs])
    assert np.array_equal(problem.margins, np.where(among, 0.5, 1.0))
    data, placements = bodies.model.createData(), bodies.geometry.createData()
    free = 0
    for seed in range(6):
        motion = planner.motion(problem, evolved(planner, problem, seed)[-1].best)
        least = np.full(len(among), np.inf)
        for t in np.linspace(0.0, motion.num_segments, 401):
            pin.computeDistances(bodies.model, data, bodies.geometry, placements, motion.at(t))
            distances = [result.min_distance for result in placements.distanceResults]
            least = np.minimum(least, distances)
        arms, obstacles = least[~among].min(), least[among].min()
        if min(arms, obstacles) < 0.05:
            continue
        free += 1
        for share, other, expected in ((0.8, 0.8, True), (1.01, 0.8, False), (0.8, 1.01, False)):
            own = {"security_margin": share * arms, "obstacle_margin": other * obstacles}
            found = judge_motion(planner, dataclasses.replace(problem, **own), motion)
            assert found.certified_margin is expected
    assert free >= 3


def test_without_a_margin_of_their_own_obstacles_have_that_of_the_arms() -> None:
    given = condition("scenario.obstacle_margin=null", experiment="rana_obstacles")
    problem = given.prepare().problem
    assert np.array_equal(problem.margins, np.ones(len(problem.scene.pairs)))
    assert "obstacle_margin" not in given.to_json().decode()
