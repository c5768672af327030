"""The hall of fame of co-evolution: distinct genomes, offered again, the best pair never lost."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.planners.coevolution import generations as team_generations
from evoexp.records import generations
from matrix import first

METHODS = ("V", "VI", "VII", "VIII")
BLOCK = 20  # seeds per test


def condition(label: str, *overrides: str, experiment: str = "curkovic_methods") -> Condition:
    return composed(f"experiment={experiment}", *overrides, label=label)


def worsens(given: Condition, rng: np.random.Generator) -> bool:
    """Whether the best pair of a generation is ever more expensive than the one before."""
    planner, problem = given.prepare()
    costs = [found.best_cost_in_generation for found in generations(planner.evolve(problem, rng))]
    return any(after > before for before, after in zip(costs, costs[1:], strict=False))


@pytest.mark.parametrize("direction", ["one_sided", "symmetric"])
@pytest.mark.parametrize("start", first(1, range(0, 200, BLOCK)))
@pytest.mark.parametrize("method", METHODS)
def test_the_best_pair_never_worsens(method: str, start: int, direction: str) -> None:
    given = condition(method, f"ga.mutation_direction={direction}")
    for seed in range(start, start + BLOCK):
        assert not worsens(given, np.random.default_rng(seed)), seed


@pytest.mark.parametrize(("method", "replicate"), [("V", 9), ("VIII", 15)])
def test_a_pair_that_indices_lose_is_kept_by_genomes(method: str, replicate: int) -> None:
    """A member of the hall finds a better partner, and only by index has none to offer."""
    for distinct, lost in (("index", True), ("genome", False)):
        given = condition(method, "seed=11", f"ga.hall_distinct={distinct}")
        assert worsens(given, given.rng(replicate)) is lost


@pytest.mark.parametrize(
    ("experiment", "label"),
    [
        ("curkovic_methods_b", "VII"),
        ("curkovic_three", "configurations only"),
        ("curkovic_stationary", "5 substeps"),
    ],
)
def test_the_best_team_never_worsens_in_other_scenes(experiment: str, label: str) -> None:
    small = ("ga.population_size=20", "ga.num_generations=40", "ga.hall_depth=0.15")
    given = condition(label, *small, experiment=experiment)
    for seed in range(5):
        assert not worsens(given, np.random.default_rng(seed)), seed


def halls(given: Condition, seed: int, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return (populations, teams (teams, robots)) of every generation's hall."""
    found: list[Any] = []
    renew = team_generations.renew

    def watched(populations: Any, *rest: Any) -> int:
        held, heredity = renew(populations, *rest), rest[-1]
        found.append((populations.copy(), heredity.hall.teams[:held].copy()))
        return int(held)

    with monkeypatch.context() as patch:
        planner, problem = given.prepare()
        # kernel by kernel, so that one of them can be watched
        patch.setattr(type(problem.collision), "is_lines", False)
        patch.setattr(team_generations, "follow", team_generations.follow.py_func)
        patch.setattr(team_generations, "renew", watched)
        for _ in planner.evolve(problem, np.random.default_rng(seed)):
            pass
    assert found
    return found


def num_genomes(population: np.ndarray, members: np.ndarray) -> int:
    return len({population[:, i].tobytes() for i in members})


@pytest.mark.parametrize("direction", ["one_sided", "symmetric"])
def test_nobody_is_in_two_pairs_as_a_genome(
    direction: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for distinct in ("genome", "index"):
        words = (f"ga.hall_distinct={distinct}", f"ga.mutation_direction={direction}")
        fewest = 15
        for populations, teams in halls(condition("V", *words), 0, monkeypatch):
            found = [num_genomes(populations[r], teams[:, r]) for r in range(2)]
            assert all(len(set(teams[:, r])) == len(teams) for r in range(2))
            if len(teams) == 15:
                fewest = min(fewest, *found)
            if distinct == "genome":
                assert found == [len(teams)] * 2
        assert (fewest < 15) is (distinct == "index")


def test_a_robot_that_stands_still_does_not_empty_the_hall(monkeypatch: pytest.MonkeyPatch) -> None:
    """It has one genome, which may be in all pairs; the others are in one pair each."""
    small = ("ga.population_size=40", "ga.num_generations=20")
    given = condition("configurations only", *small, experiment="curkovic_stationary")
    populations, teams = halls(given, 0, monkeypatch)[-1]
    assert len(teams) == 6
    assert num_genomes(populations[0], teams[:, 0]) == 6
    assert num_genomes(populations[1], teams[:, 1]) == 1
