"""Sequential search: the loop of Lavoie & Boudreau 2001 with uniform draws in place of evolution.

The second opinion draws the same numbers and judges them by the numpy version of the scene.
"""

from typing import Any, NamedTuple

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import SettingError
from evoexp.records import generations
from references import lavoie_numpy

SMALL = ("ga.population_size=60", "ga.num_generations=8", "planner.num_attempts=3")


class Outcome(NamedTuple):
    """The end of a run of the second opinion."""

    solved: bool
    attempts: int
    evaluations: int
    cost: float
    lowest: list[float]  # of every generation


def condition(*overrides: str, experiment: str = "lavoie_7dof") -> Condition:
    words = [f"experiment={experiment}", "control=sequential_search", *overrides]
    return composed(*words)


def drawn(planner: Any, scene: lavoie_numpy.Scene, rng: np.random.Generator) -> Outcome:
    """Draw sub-path by sub-path, one population after the other, as plainly as can be."""
    ga, stops = planner.ga, (planner.stop_cost_sp1, planner.stop_cost_sp2)
    breeding = lavoie_numpy.Breeding(ga, scene)
    evaluations, best_plan, lowest = 0, np.inf, []
    for attempt in range(1, planner.num_attempts + 1):
        start = scene.start
        for sub_path in (0, 1):
            best, end = np.inf, start
            for index in range(ga.num_generations + 1):
                count = ga.population_size - (ga.num_elites if index else 0)
                breeding.ga = ga.model_copy(update={"population_size": count})
                angles = breeding.angles(breeding.first(rng))
                costs = scene.costs(sub_path, start, angles)
                evaluations += count
                lowest.append(float(costs.min()))
                if costs.min() < best:
                    best, end = float(costs.min()), angles[:, np.argmin(costs)]
                if best < stops[sub_path]:
                    break
            if sub_path == 1:
                best_plan = min(best_plan, best)
            if not best < stops[sub_path]:
                break
            start = end
        else:
            return Outcome(True, attempt, evaluations, best_plan, lowest)
    return Outcome(False, planner.num_attempts, evaluations, best_plan, lowest)


@pytest.mark.parametrize(
    ("overrides", "solved"),
    [
        ((*SMALL, "planner.stop_cost_sp1=16", "planner.stop_cost_sp2=12"), True),
        ((*SMALL, "planner.stop_cost_sp1=9", "planner.stop_cost_sp2=3"), False),
        ((*SMALL, "ga=lavoie_binary", "planner.stop_cost_sp1=16", "ga.num_elites=3"), False),
    ],
)
def test_it_draws_what_a_plain_loop_draws(overrides: tuple[str, ...], solved: bool) -> None:
    given = condition(*overrides)
    wrapped: Any = given.planner
    planner, problem = given.prepare()
    found = []  # costs are views that the next generation overwrites
    for last in generations(planner.evolve(problem, np.random.default_rng(1))):
        found.append(float(last.costs.min()))
    scene = lavoie_numpy.Scene(
        given._replace(planner=wrapped.planner)  # the scene reads settings of the algorithm
    )
    expected = drawn(wrapped.planner, scene, np.random.default_rng(1))
    assert (last.solved, last.terms["attempts"]) == (expected.solved, expected.attempts)
    assert last.solved == solved
    assert last.evaluations == expected.evaluations
    assert last.best_cost == pytest.approx(expected.cost, abs=1e-9)
    np.testing.assert_allclose(found, expected.lowest, atol=1e-9)


def test_the_first_generation_is_that_of_the_algorithm_and_none_descends_from_another() -> None:
    given = condition(*SMALL)
    planner, problem = given.prepare()
    own: Any = given.planner
    search = generations(planner.evolve(problem, np.random.default_rng(4)))
    algorithm = generations(own.planner.evolve(problem, np.random.default_rng(4)))
    first, other = next(search), next(algorithm)
    np.testing.assert_array_equal(first.population, other.population)
    before = first.population.copy()
    second = next(search)
    assert second.population.shape == (7, 59)
    assert second.evaluations == next(algorithm).evaluations == 60 + 59
    assert not np.isin(second.population, before).any()


def test_draws_are_the_same_however_many_are_made_per_call(monkeypatch: pytest.MonkeyPatch) -> None:
    planner, problem = condition(*SMALL, "planner.stop_cost_sp1=9").prepare()
    runs = []
    for stretch in (1, 3, 8):
        monkeypatch.setattr("evoexp.planners.redundant_ga.sub_path.STRETCH", stretch)
        rng = np.random.default_rng(2)
        runs.append(
            [
                (each.population.tobytes(), each.costs.tobytes(), each.state)
                for each in generations(planner.evolve(problem, rng))
            ]
        )
    assert runs[0] == runs[1] == runs[2]
    assert len(runs[0]) > 9


def test_without_offspring_nothing_is_drawn_after_the_first_population() -> None:
    planner, problem = condition(*SMALL, "ga.num_elites=60").prepare()
    searches = set()
    for last in generations(planner.evolve(problem, np.random.default_rng(0))):
        searches.add((last.terms["attempts"], last.terms["sub_path"]))
    assert last.evaluations == 60 * len(searches)


def test_it_solves_the_arm_of_ten_joints_less_often_than_evolution() -> None:
    """The algorithm ends each run with a solution, drawing about a quarter of them."""
    given = condition(experiment="lavoie_10dof")
    planner, problem = given.prepare()
    own: Any = given.planner
    solved = []
    for seed in range(4):
        *_, search = generations(planner.evolve(problem, given.rng(seed)))
        *_, algorithm = generations(own.planner.evolve(problem, given.rng(seed)))
        assert algorithm.solved
        solved.append(search.solved)
    assert sum(solved) <= 2


def test_another_planner_is_refused_in_one_line() -> None:
    with pytest.raises(SettingError) as caught:
        compose.expand(["experiment=chen_path", "control=sequential_search"])
    assert "planner: must be redundant_ga, whose sub-paths sequential_search draws, was " in str(
        caught.value
    )
    assert "\n" not in str(caught.value)
