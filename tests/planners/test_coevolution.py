"""Co-evolution: what its answers are, its hall of fame over many seeds, and its settings."""

import itertools
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.papers.curkovic.measures import lower_bound
from evoexp.planners.coevolution.planner import Coevolution, Problem
from evoexp.report.results.stored_results import ConditionResults
from matrix import num_cases
from planners.runs import evolved, ran

SMALL = ("ga.population_size=12", "ga.num_generations=15", "ga.hall_depth=0.25")


def condition(*overrides: str, label: str = "V", experiment: str = "curkovic_methods") -> Condition:
    return composed(f"experiment={experiment}", *overrides, label=label)


def prepared(*overrides: str) -> tuple[Coevolution, Problem]:
    return condition(*overrides).prepare()


def test_coordinates_that_are_not_finite_are_refused() -> None:
    planner, problem = prepared(*SMALL)
    genes = planner.sample(problem, np.random.default_rng(1), 9)
    genes[0, 3, 4] = np.inf
    with pytest.raises(ValueError, match="must be finite"):
        planner.evaluated(problem, genes)
    with pytest.raises(ValueError, match="must be finite"):
        evolved(planner, problem._replace(arms=np.full_like(problem.arms, 1e200)))


def test_the_best_team_is_what_it_says() -> None:
    planner, problem, (*_, last) = ran(condition(*SMALL), 2)
    assert last.solved
    terms = planner.evaluate(problem, last.best)
    assert terms["team_collisions"] == 0.0
    assert terms["team_cost"] == pytest.approx(last.best_cost, abs=1e-9)
    paths = last.best.reshape(2, 6, 2)
    assert paths[:, 0] == pytest.approx(np.array([[150.0, 60.0], [150.0, 180.0]]))
    assert paths[:, -1] == pytest.approx(np.array([[30.0, 0.0], [30.0, 120.0]]))
    motion = planner.motion(problem, last.best)
    assert motion.q.shape == (6, 4)
    relative = motion.q[:, 0] + motion.q[:, 1]  # to the link before
    assert np.rad2deg(relative) == pytest.approx(paths[0, :, 1])
    nothing: Any = None
    bound = lower_bound(ConditionResults("V", condition(), 1, nothing, {}, None, {}))
    assert np.abs(problem.goal - problem.start).sum() < bound < last.best_cost


def test_random_search_draws_teams_of_its_own() -> None:
    planner, problem = prepared(*SMALL)
    population = planner.sample(problem, np.random.default_rng(4), 9)
    judged, found = planner.cost(problem, population), planner.evaluated(problem, population)
    teams = np.where(found.collisions[0] == 0, found.own[0][:, None] + found.own[1], np.inf)
    assert judged.cost == pytest.approx(teams.min(axis=1))
    k = int(np.argmin(judged.cost))
    terms = planner.evaluate(problem, planner.solution(problem, population, k))
    assert terms["team_cost"] == pytest.approx(judged.cost[k], abs=1e-9)


def test_a_tip_is_reached_by_both_elbows() -> None:
    tip, elbows = np.array([0.1, 0.35]), []
    for elbow in ("left", "right"):
        goal = f"scenario.q_goal=[{{tip:[0.1,0.35],elbow:{elbow}}},{{angles:[30.0,120.0]}}]"
        _, problem = prepared(goal)
        outline = problem.collision.arms[0].outlines(problem.goal[0].reshape(1, 2, 1))[0, :4, 0]
        assert outline[2:] == pytest.approx(tip, abs=1e-12)
        elbows.append(outline[:2])
    sides = [tip[0] * elbow[1] - tip[1] * elbow[0] for elbow in elbows]
    assert sides[0] > 0.0 > sides[1]


def test_a_spline_is_executed_between_the_same_configurations() -> None:
    run, curved = (
        ran(condition(*SMALL), 8),
        ran(condition(*SMALL, "planner.interpolation=cubic"), 8),
    )
    problem, solution = run.problem, run.last.best
    assert np.array_equal(solution, curved.last.best)  # the search does not know
    straight, spline = (each.planner.motion(problem, solution) for each in (run, curved))
    assert spline.q == pytest.approx(straight.q, abs=1e-12)
    assert spline.at(2.5) != pytest.approx(straight.at(2.5), abs=1e-6)
    plain, terms = (each.planner.evaluate(problem, solution) for each in (run, curved))
    times = np.linspace(0.0, 5.0, 5001)
    angles = np.rad2deg([spline.at(t) for t in times]).reshape(-1, 2, 2).cumsum(axis=2)  # absolute
    for r, (own, path) in enumerate(
        zip(angles.swapaxes(0, 1), solution.reshape(2, 6, 2), strict=True)
    ):
        beyond, fastest = f"out_of_range_robot_{r + 1}_deg", f"fastest_turn_robot_{r + 1}_deg"
        assert terms[beyond] == pytest.approx(max(0.0, -own.min(), own.max() - 180.0), abs=1e-3)
        speed = np.abs(np.gradient(own, times, axis=0)).max()
        assert terms[fastest] == pytest.approx(speed, abs=0.05)
        assert plain[fastest] == pytest.approx(np.abs(np.diff(path, axis=0)).max())


def worsens(given: Condition, seed: Any) -> bool:
    """Whether the best team of a generation is ever more expensive than the one before."""
    costs = [record.best_cost_in_generation for record in ran(given, seed).records]
    return any(after > before for before, after in itertools.pairwise(costs))


@pytest.mark.parametrize(
    ("experiment", "label", "words"),
    [
        *(
            ("curkovic_methods", method, f"ga.mutation_direction={direction}")
            for method in ("V", "VI", "VII", "VIII")
            for direction in ("one_sided", "symmetric")
        ),
        *(
            (experiment, label, "ga.population_size=20 ga.num_generations=40 ga.hall_depth=0.15")
            for experiment, label in (
                ("curkovic_methods_b", "VII"),
                ("curkovic_three", "configurations only"),
                ("curkovic_stationary", "5 substeps"),
            )
        ),
    ],
)
def test_the_best_team_never_worsens(experiment: str, label: str, words: str) -> None:
    given = condition(*words.split(), label=label, experiment=experiment)
    for seed in range(num_cases(20, 200)):
        assert not worsens(given, seed), seed


@pytest.mark.parametrize(("method", "replicate"), [("V", 9), ("VIII", 15)])
def test_a_pair_that_indices_lose_is_kept_by_genomes(method: str, replicate: int) -> None:
    """A member of the hall finds a better partner, and only by index has none to offer."""
    for distinct, lost in (("index", True), ("genome", False)):
        given = condition("seed=11", f"ga.hall_distinct={distinct}", label=method)
        assert worsens(given, given.rng(replicate)) is lost
