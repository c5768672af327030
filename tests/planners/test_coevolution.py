"""Co-evolution: the planner against an obvious version of what it says, and its settings."""

import itertools
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.errors import SettingError
from evoexp.papers.curkovic.measures import lower_bound
from evoexp.planners.coevolution.planner import Coevolution, Problem
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations

SMALL = ("ga.population_size=12", "ga.num_generations=15", "ga.hall_depth=0.25")
NO_HALL = ("ga=curkovic_1", "ga.population_size=12", "ga.num_generations=15")


def prepared(*overrides: str, experiment: str = "curkovic_methods") -> tuple[Coevolution, Problem]:
    words = [f"experiment={experiment}", *overrides]
    if not any(word.startswith("ga=") for word in words):
        words.append("ga=curkovic_5")
    label = "V" if experiment == "curkovic_methods" else ""
    return composed(*words, label=label).prepare()


def crosses(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Whether two segments in general position have a point in common."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) <= 0.0 and side(c, d, a) * side(c, d, b) <= 0.0


def links(base: tuple[float, float], angles: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    first = np.array(base)
    elbow = first + 0.25 * np.array([np.cos(angles[0]), np.sin(angles[0])])
    tip = elbow + 0.25 * np.array([np.cos(angles[1]), np.sin(angles[1])])
    return [(first, elbow), (elbow, tip)]


def test_costs_are_the_papers_sums() -> None:
    planner, problem = prepared()
    genes = planner.sample(problem, np.random.default_rng(0), 7)
    found = planner.evaluated(problem, genes)
    bases = ((0.0, 0.0), (0.3, 0.0))
    paths = [
        [
            np.vstack([problem.start[r], genes[r, :, i].reshape(4, 2), problem.goal[r]])
            for i in range(7)
        ]
        for r in range(2)
    ]
    for i, j in itertools.product(range(7), range(7)):
        hits = sum(
            any(
                crosses(*one, *two)
                for one in links(bases[0], paths[0][i][k])
                for two in links(bases[1], paths[1][j][k])
            )
            for k in range(1, 5)
        )
        assert found.collisions[0, i, j] == hits
    for r, i in itertools.product(range(2), range(7)):
        tips = np.array([links(bases[r], angles)[1][1] for angles in paths[r][i]])
        steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
        turns = np.abs(np.diff(paths[r][i], axis=0)).sum()
        collisions = found.collisions[0].sum(axis=1 - r)[i]
        expected = [collisions, steps.sum(), turns, steps.max() - steps.min()]
        assert found.criteria[r, :, i] == pytest.approx(expected, abs=1e-12)
        assert found.costs[r, i] == pytest.approx(sum(expected), abs=1e-12)


def test_lines_that_are_not_finite_are_refused() -> None:
    planner, problem = prepared()
    genes = planner.sample(problem, np.random.default_rng(1), 9)
    genes[0, 3, 4] = np.inf
    with pytest.raises(ValueError, match="must be finite"):
        planner.evaluated(problem, genes)


def test_the_best_team_is_what_it_says() -> None:
    planner, problem = prepared(*SMALL)
    *_, last = generations(planner.evolve(problem, np.random.default_rng(2)))
    assert last.solved
    terms = planner.evaluate(problem, last.best)
    assert terms["team_collisions"] == 0.0
    assert terms["team_cost"] == pytest.approx(last.best_cost, abs=1e-9)
    paths = last.best.reshape(2, 6, 2)
    assert paths[:, 0] == pytest.approx(np.array([[150.0, 60.0], [150.0, 180.0]]))
    assert paths[:, -1] == pytest.approx(np.array([[30.0, 0.0], [30.0, 120.0]]))
    motion = planner.motion(problem, last.best)
    assert motion.q.shape == (6, 4)
    assert np.rad2deg(motion.q[:, 0] + motion.q[:, 1]) == pytest.approx(
        paths[0, :, 1]
    )  # relative to the link before


def test_random_search_draws_teams_of_its_own() -> None:
    planner, problem = prepared(*SMALL)
    population = planner.sample(problem, np.random.default_rng(4), 9)
    judged = planner.cost(problem, population)
    found = planner.evaluated(problem, population)
    for i in range(9):
        free = [
            found.own[0, i] + found.own[1, j] for j in range(9) if found.collisions[0, i, j] == 0
        ]
        assert judged.cost[i] == pytest.approx(min(free, default=np.inf))
    k = int(np.argmin(judged.cost))
    terms = planner.evaluate(problem, planner.solution(problem, population, k))
    assert terms["team_cost"] == pytest.approx(judged.cost[k], abs=1e-9)


def test_restarts_draw_fresh_populations() -> None:
    """A single pair, which collides at first.

    Without restarts it changes one allele at most, with them all of them.
    """
    lonely = (
        "ga=curkovic_1",
        "ga.population_size=1",
        "ga.num_generations=6",
        "ga.mutation_rate=1.0",
    )
    seed = next(
        seed
        for seed in range(50)
        if not next(
            iter(
                generations(
                    prepared(*lonely)[0].evolve(prepared(*lonely)[1], np.random.default_rng(seed))
                )
            )
        ).solved
    )
    for restart, changed in (("null", 1), ("1", 8)):
        planner, problem = prepared(*lonely, f"ga.restart_after={restart}")
        first, second, *_ = (
            g.population.copy()
            for g in generations(planner.evolve(problem, np.random.default_rng(seed)))
        )
        assert (first != second).sum(axis=1).max() <= changed
        assert (first != second).sum() > (changed - 1) * 2 - 1


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("scenario.q_start=[{angles:[90.0,90.0]},{angles:[200.0,10.0]}]",),
            "q_start[1].angles[0]: must be within [0, 180]",
        ),
        (
            ("scenario.q_start=[{angles:[60.0,0.0]},{angles:[120.0,180.0]}]",),
            "q_start: must be free of collision (robots 1 and 2 touch: arm_1_link_2 and "
            "arm_2_link_2)",
        ),
        (
            ("scenario.q_goal=[{tip:[0.9,0.0],elbow:left},{angles:[30.0,120.0]}]",),
            "q_goal[0].tip: must be 0 to 0.5 away",
        ),
        (
            ("scenario.q_goal=[{tip:[0.4,0.0]},{angles:[30.0,120.0]}]",),
            "elbow: must be given with tip",
        ),
        (("scenario.stationary=[0]",), "q_goal[0]: must be the same as its start"),
        (("ga.hall_depth=0.001",), "hall_depth: must be 0, or large enough"),
        (("planner.chromosome_length=7",), "chromosome_length: must be even and at least 2"),
        (("planner.chromosome_length=0",), "chromosome_length: must be "),
    ],
)
def test_what_cannot_be_is_refused(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(SettingError) as refused:
        prepared(*words)
    assert message in str(refused.value)


def test_a_tip_is_reached_by_both_elbows() -> None:
    tips: list[Any] = []
    for elbow in ("left", "right"):
        goal = f"scenario.q_goal=[{{tip:[0.1,0.35],elbow:{elbow}}},{{angles:[30.0,120.0]}}]"
        _, problem = prepared(goal)
        arm = problem.collision.arms[0]
        points = arm.outlines(problem.goal[0].reshape(1, 2, 1))[0, :4, 0]
        assert points[2:] == pytest.approx([0.1, 0.35], abs=1e-12)
        tips.append(points[:2])
    left = np.cross(np.append([0.1, 0.35], 0.0), np.append(tips[0], 0.0))[2]
    assert left > 0.0
    assert not np.allclose(tips[0], tips[1])


def test_a_robot_that_stands_still_keeps_its_posture() -> None:
    planner, problem = prepared(
        *SMALL,
        "scenario.stationary=[1]",
        "scenario.q_start=[{angles:[150.0,60.0]},{angles:[10.0,80.0]}]",
        "scenario.q_goal=[{angles:[30.0,0.0]},{angles:[10.0,80.0]}]",
    )
    *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    assert (last.population[1] == np.tile(problem.start[1], 4)[:, None]).all()
    assert last.best.reshape(2, 6, 2)[1] == pytest.approx(np.tile([10.0, 80.0], (6, 1)))


def test_no_team_is_cheaper_than_the_lower_bound() -> None:
    from evoexp.report.results.stored_results import ConditionResults

    condition = composed("experiment=curkovic_methods", label="V")
    nothing: Any = None
    bound = lower_bound(ConditionResults("V", condition, 1, nothing, {}, None, {}))
    planner, problem = prepared(*SMALL)
    *_, last = generations(planner.evolve(problem, np.random.default_rng(6)))
    assert last.best_cost > bound
    turns = np.abs(problem.goal - problem.start).sum()
    assert bound > turns


def test_a_spline_is_executed_between_the_same_configurations() -> None:
    planner, problem = prepared(*SMALL)
    curved, _ = prepared(*SMALL, "planner.interpolation=cubic")
    solution = list(generations(planner.evolve(problem, np.random.default_rng(8))))[-1].best
    again = list(generations(curved.evolve(problem, np.random.default_rng(8))))[-1].best
    assert np.array_equal(solution, again)  # the search does not know
    straight, spline = planner.motion(problem, solution), curved.motion(problem, solution)
    assert spline.q == pytest.approx(straight.q, abs=1e-12)
    assert spline.at(2.5) != pytest.approx(straight.at(2.5), abs=1e-6)
    terms = curved.evaluate(problem, solution)
    times = np.linspace(0.0, 5.0, 5001)
    relative = np.rad2deg([spline.at(t) for t in times])
    absolute = relative.copy()
    absolute[:, 1::2] += relative[:, ::2]
    for r in range(2):
        own = absolute[:, 2 * r : 2 * r + 2]
        beyond = max(0.0, -own.min(), own.max() - 180.0)
        assert terms[f"out_of_range_robot_{r + 1}_deg"] == pytest.approx(beyond, abs=1e-3)
        speed = np.abs(np.gradient(own, times, axis=0)).max()
        assert terms[f"fastest_turn_robot_{r + 1}_deg"] == pytest.approx(speed, abs=0.05)
        steps = np.abs(np.diff(solution.reshape(2, 6, 2)[r], axis=0)).max()
        assert planner.evaluate(problem, solution)[
            f"fastest_turn_robot_{r + 1}_deg"
        ] == pytest.approx(steps)


def test_the_first_generations_of_method_v_are_those_of_the_pareto_experiment() -> None:
    """Eq. 10 over 30 generations, with the decay that 30 of 200 have."""
    condition = composed("experiment=curkovic_pareto")
    front, problem = condition.prepare()
    method, _ = prepared()
    pairs = zip(
        generations(front.evolve(problem, np.random.default_rng(9))),
        generations(method.evolve(problem, np.random.default_rng(9))),
        strict=False,
    )
    for one, other in pairs:
        assert np.array_equal(one.population, other.population)
    assert one.index == 30
    assert one.criteria is not None
    assert one.criteria.shape == (2, 4, 100)
    assert one.criteria.sum(axis=1) == pytest.approx(one.costs)
    assert other.criteria is None


@pytest.mark.matrix
def test_thick_links_and_tools_are_judged_by_their_bodies() -> None:
    """What the envelopes' lines let pass between configurations, or a circle hides.

    The exact verdict sees.
    """
    planner, problem = prepared("collision.tcp_radius=0.04", experiment="curkovic_safety")
    names = set(problem.scene.names)
    assert names == {f"arm_{r}_link_{k}" for r in (1, 2) for k in (1, 2, 3)}
    radii = [shape.radius for shape, _, _ in problem.scene.shapes]
    assert radii == [0.02, 0.02, 0.04] * 2
    *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    verdict = judge_motion(planner, problem, planner.motion(problem, last.best))
    assert verdict.certified is not None
