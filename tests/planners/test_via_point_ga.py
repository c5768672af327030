"""The planner of Rana & Zalzala: its problem, its operators together, its degenerate cases."""

import dataclasses
import math

import numpy as np
import pinocchio as pin
import pytest

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import SettingError
from evoexp.planners.proofs import judge_motion
from evoexp.planners.via_point_ga.planner import Problem, ViaPointGa, sampled
from evoexp.records import generations
from evoexp.robots.arms import Arms
from evoexp.robots.serial_chain import SerialChain, SerialJoint
from evoexp.scenarios.arm_motion import ArmMotion
from references import rana_numpy


def condition(*overrides: str, experiment: str = "rana_planar") -> Condition:
    short = (
        () if any("num_generations" in text for text in overrides) else ("ga.num_generations=5",)
    )
    expanded = compose.expand([f"experiment={experiment}", *short, *overrides])
    return expanded[0].conditions[0].condition


def prepared(*overrides: str, experiment: str = "rana_planar") -> tuple[ViaPointGa, Problem]:
    return condition(*overrides, experiment=experiment).prepare()


def straight(problem: Problem, num: int) -> np.ndarray:
    """The straight line from start to goal as strings (nq, N + 1)."""
    return problem.start[:, None] + (problem.goal - problem.start)[:, None] * np.linspace(
        0.0, 1.0, num + 1
    )


def terms_by_hand(strings: np.ndarray, arms: np.ndarray) -> dict[str, float]:
    """Eqs. 2–6 for two arms of two links of 4 from (0, 0) and (0, 8), with circles of radius 0.5.

    In plain Python.
    """
    terms: dict[str, float] = {}
    for a, (first, stop) in enumerate(arms):
        steps = [
            math.dist(p, q)
            for p, q in zip(strings[first:stop].T, strings[first:stop].T[1:], strict=False)
        ]
        mean = math.fsum(steps) / len(steps)
        terms[f"length_arm_{a + 1}_deg"] = math.fsum(steps)
        terms[f"unevenness_arm_{a + 1}_deg"] = math.fsum(abs(step - mean) for step in steps)
    collisions = 0
    for q in strings.T[1:]:
        circles = []
        for base, (one, two) in zip(((0.0, 0.0), (0.0, 8.0)), (q[:2], q[2:]), strict=True):
            a, b = math.radians(one), math.radians(one + two)
            elbow = (base[0] + 4 * math.cos(a), base[1] + 4 * math.sin(a))
            tip = (elbow[0] + 4 * math.cos(b), elbow[1] + 4 * math.sin(b))
            ends = [(base, elbow), (elbow, tip)]
            circles.append(
                [
                    tuple(p + k / 4 * (r - p) for p, r in zip(s, e, strict=True))
                    for s, e in ends
                    for k in range(5)
                ]
            )
        collisions += min(math.dist(c, d) for c in circles[0] for d in circles[1]) < 1.0
    return terms | {"collisions": float(collisions)}


def test_terms_agree_with_plain_python() -> None:
    planner, problem = prepared()
    rng = np.random.default_rng(0)
    population = planner.sample(problem, rng, 40)
    judged = planner.cost(problem, population)
    hits = 0
    for k in range(40):
        expected = terms_by_hand(population[:, :, k], problem.arm_slices)
        assert judged.named_terms(k) == pytest.approx(expected, rel=1e-9)
        lengths = expected["length_arm_1_deg"] + expected["length_arm_2_deg"]
        uneven = expected["unevenness_arm_1_deg"] + expected["unevenness_arm_2_deg"]
        assert judged.cost[k] == pytest.approx(
            0.5 * lengths + 0.005 * uneven + 100 * expected["collisions"], rel=1e-9
        )
        hits += int(expected["collisions"])
    assert hits > 0, "the sample meets collisions"


def test_the_straight_line_collides() -> None:
    """The scene is not trivial."""
    planner, problem = prepared()
    solution = planner.solution(problem, straight(problem, 20)[:, :, None], 0)
    terms = planner.evaluate(problem, solution)
    assert terms["collisions"] > 0
    assert terms["path_length_ratio"] == pytest.approx(1.0)
    assert terms["unevenness_arm_1_deg"] == pytest.approx(0.0, abs=1e-9)


def test_solutions_keep_the_documented_order() -> None:
    planner, problem = prepared()
    population = planner.sample(problem, np.random.default_rng(0), 3)
    solution = planner.solution(problem, population, 1).reshape(2, 21, 2)
    assert np.array_equal(solution[0, :, 0], population[0, :, 1])
    assert np.array_equal(solution[1, :, 1], population[3, :, 1])
    assert np.array_equal(solution[0, 0], [45.0, 225.0])
    assert np.array_equal(solution[1, -1], [315.0, 315.0])
    motion = planner.motion(problem, solution.ravel())
    assert motion.q[7] == pytest.approx(np.deg2rad(population[:, 7, 1]))


SIX = ((0, 6), (6, 12))


def six_axes(base: tuple[float, float, float]) -> SerialChain:
    """Return a 6R arm of a PUMA's build: waist, shoulder, elbow, and a wrist of three axes."""
    axes = ((0, 0, 1), (0, -1, 0), (0, -1, 0), (1, 0, 0), (0, -1, 0), (1, 0, 0))
    offsets = ((0, 0, 1), (0, 0, 0), (1, 0, 0), (0.8, 0, 0), (0, 0, 0), (0, 0, 0))
    joints = tuple(
        SerialJoint(axis=tuple(map(float, axis)), offset=tuple(map(float, offset)))  # type: ignore[arg-type]
        for axis, offset in zip(axes, offsets, strict=True)
    )
    return SerialChain(joints=joints, tip=(0.2, 0.0, 0.0), base_position=base)


def test_samples_of_a_string_are_its_segments_via_points_included() -> None:
    strings = np.random.default_rng(0).normal(size=(3, 6))
    instants = np.linspace(0.0, 5.0, 21)
    expected = [np.interp(instants, np.arange(6.0), row) for row in strings]
    np.testing.assert_allclose(sampled(strings, 4), expected, rtol=0.0, atol=1e-14)
    np.testing.assert_array_equal(sampled(strings, 4)[:, ::4], strings)


def test_two_arms_of_six_joints_are_planned_by_the_same_planner() -> None:
    """With the wrists held straight they are the paper's arms.

    The straight line collides, the plan does not.
    """
    planner, _ = prepared(
        "ga.num_generations=60", "objective.collision_weight=100.0", experiment="rana_puma"
    )
    robot = Arms(arms=(six_axes((0.0, 0.0, 0.0)), six_axes((0.0, 2.5, 0.0))))
    scenario = ArmMotion(
        q_start=((15.0, -15.0, -30.0, 0.0, 0.0, 0.0), (-150.0, -15.0, 30.0, 0.0, 0.0, 0.0)),
        q_goal=((150.0, -15.0, 30.0, 0.0, 0.0, 0.0), (-15.0, -15.0, -30.0, 0.0, 0.0, 0.0)),
        security_margin=0.25,
        length_unit="unit",
    )
    problem = planner.prepare(robot, scenario)
    share = np.linspace(0.0, 1.0, 41)[:, None]
    straight = np.concatenate(
        [((1 - share) * problem.start[a:b] + share * problem.goal[a:b]).ravel() for a, b in SIX]
    )
    assert planner.evaluate(problem, straight)["collisions"] > 0.0
    first, *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    assert last.best.shape == (2 * 41 * 6,)
    assert planner.shape(problem) == ((41, 6), (41, 6))
    assert planner.motion(problem, last.best).q.shape == (41, 12)
    assert last.solved
    assert planner.evaluate(problem, last.best)["collisions"] == 0.0
    assert last.best_cost < 0.8 * first.best_cost


def test_puma_like_arms_move_by_eq_10_and_their_straight_line_collides() -> None:
    planner, problem = prepared(experiment="rana_puma")
    q = np.array([[20.0, 30.0, -40.0, -70.0, 10.0, 55.0]]).T
    spheres = problem.collision
    found = np.concatenate(problem.sphere_centres(q[:, 0]))
    assert [stop - first for first, stop in spheres.arm_spheres] == [9, 9]  # none on the columns
    for arm, (first, stop) in enumerate(spheres.arm_spheres):
        one, two, three = np.deg2rad(q[3 * arm : 3 * arm + 3, 0])
        shoulder = np.array([0.0, 2.5 * arm, 1.0])
        elbow = shoulder + np.array(
            [np.cos(one) * np.cos(two), np.sin(one) * np.cos(two), np.sin(two)]
        )
        reach = two + three
        tip = elbow + np.array(
            [np.cos(one) * np.cos(reach), np.sin(one) * np.cos(reach), np.sin(reach)]
        )
        expected = [shoulder + f * (elbow - shoulder) for f in np.linspace(0.0, 1.0, 5)]
        expected += [elbow + f * (tip - elbow) for f in np.linspace(0.25, 1.0, 4)]
        assert found[first:stop] == pytest.approx(np.array(expected), abs=1e-12)
    share = np.linspace(0.0, 1.0, 41)[:, None]
    straight = [
        ((1 - share) * problem.start[a:b] + share * problem.goal[a:b]).ravel()
        for a, b in ((0, 3), (3, 6))
    ]
    assert planner.evaluate(problem, np.concatenate(straight))["collisions"] == 3.0


def test_substeps_find_more_collisions_and_never_fewer() -> None:
    planner, problem = prepared()
    finer, same = prepared("collision.collision_substeps=10")
    population = planner.sample(problem, np.random.default_rng(3), 60)
    coarse = planner.cost(problem, population).terms["collisions"]
    fine = finer.cost(same, population).terms["collisions"]
    assert np.all(fine >= coarse)
    assert np.any(fine > coarse)


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    "overrides",
    [
        ("ga.population_size=1", "ga.num_elites=0", "planner.num_new_trajectories=0"),
        ("ga.population_size=1", "ga.num_elites=1", "planner.num_new_trajectories=0"),
        ("ga.population_size=3", "ga.num_elites=0", "planner.num_new_trajectories=3"),
        ("planner.num_via_points=1",),
        ("planner.num_via_points=2",),
        ("objective.fitness_offset=0",),
        (
            "objective.length_weight=0",
            "objective.unevenness_weight=0",
            "objective.collision_weight=0",
        ),
        ("planner.redistribution=false", "planner.relaxation_step=0"),
        ("planner.relaxation_step=1", "planner.max_turn=0"),
        ("planner.spline_end=clamped", "planner.max_turn=180"),
        ("ga.crossover_rate=0", "ga.mutation_rate=0"),
        ("scenario.q_goal=[[45,225],[225,225]]",),
        ("scenario.q_goal=[[45,225],[270,225]]",),
        ("collision.spheres_per_link=1", "collision.sphere_radius=1.2"),
    ],
    ids=lambda o: " ".join(o),
)
def test_degenerate_settings_run(overrides: tuple[str, ...]) -> None:
    planner, problem = prepared(*overrides)
    for generation in generations(planner.evolve(problem, np.random.default_rng(0))):
        assert np.all(np.isfinite(generation.costs))
        assert np.all(np.isfinite(generation.population))


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            ("scenario.q_start=[[90,0],[270,0]]",),
            "scenario.q_start: must be free of collision (two arms overlap",
        ),
        (("scenario.q_goal=[[90,0],[270,0]]",), "scenario.q_goal: must be free of collision"),
        (
            ("scenario.q_start=[[45,225]]",),
            "scenario.q_start: must be one list per arm of the robot",
        ),
        (
            ("scenario.q_start=[[45,225],[1,2,3]]",),
            "scenario.q_start: must be one list per arm of the robot",
        ),
        (
            ("planner.num_new_trajectories=49",),
            "planner.num_new_trajectories: must be at most the offspring",
        ),
    ],
)
def test_problems_that_cannot_be_are_refused(overrides: tuple[str, ...], message: str) -> None:
    with pytest.raises(SettingError) as caught:
        prepared(*overrides)
    assert message in str(caught.value)


def test_a_start_inside_an_obstacle_is_refused() -> None:
    with pytest.raises(SettingError, match="an arm and an obstacle overlap"):
        prepared("scenario.obstacles=[{shape: sphere, center: [2.8, 2.8], radius: 0.5}]")


def test_arms_and_obstacles_have_margins_of_their_own() -> None:
    """Verdicts on the best strings of some runs, against distances of coal at many instants."""
    planner, problem = prepared("ga.num_generations=200", experiment="rana_obstacles")
    assert (problem.security_margin, problem.obstacle_margin) == (1.0, 0.5)
    bodies = problem.scene
    among = np.array(["obstacle" in bodies.names[b] for _, b in bodies.pairs])
    assert np.array_equal(problem.margins, np.where(among, 0.5, 1.0))
    data, placements = bodies.model.createData(), bodies.geometry.createData()
    free = 0
    for seed in range(6):
        *_, last = generations(planner.evolve(problem, np.random.default_rng(seed)))
        motion = planner.motion(problem, last.best)
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


def test_a_solution_of_another_size_is_refused() -> None:
    planner, problem = prepared()
    with pytest.raises(ValueError, match="a solution has 84 values"):
        planner.evaluate(problem, np.zeros(83))


@pytest.mark.parametrize("redistribution", [True, False])
def test_improving_is_one_pass_of_redistribution_and_relaxation(redistribution: bool) -> None:
    """Against the slow version, by rounding where nothing measures an arc length."""
    given = condition(f"planner.redistribution={str(redistribution).lower()}")
    planner, problem = given.prepare()
    rng = np.random.default_rng(4)
    population = planner.sample(problem, rng, 13)
    before = population.copy()
    improved = planner.improve(problem, population, rng)
    assert np.array_equal(population, before)
    assert improved.shape == population.shape
    arms = np.array([before[a:b] for a, b in problem.arm_slices]).transpose(3, 0, 2, 1)
    slow = rana_numpy.smooth(rana_numpy.from_condition(given, chords_per_segment=512), arms)
    found = np.array([improved[a:b] for a, b in problem.arm_slices]).transpose(3, 0, 2, 1)
    assert np.abs(found - slow).max() < (0.5 if redistribution else 1e-9)  # [deg]
    assert np.abs(found - arms).max() > 1.0


def test_repeated_improvement_shortens_and_evens_strings() -> None:
    planner, problem = prepared()
    rng = np.random.default_rng(5)
    population = planner.sample(problem, rng, 20)
    first = planner.cost(problem, population).terms
    for _ in range(20):
        population = planner.improve(problem, population, rng)
    last = planner.cost(problem, population).terms
    for arm in (1, 2):
        length, unevenness = f"length_arm_{arm}_deg", f"unevenness_arm_{arm}_deg"
        assert np.all(last[length] < first[length])
        assert last[unevenness].mean() < first[unevenness].mean()
