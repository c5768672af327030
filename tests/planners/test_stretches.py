"""Generations that are recorded many at a time, against the same ones recorded one by one."""

import itertools
from types import ModuleType

import numpy as np
import pytest

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.planners import gathering
from evoexp.planners.gathering import TOGETHER, Run
from evoexp.planners.grid_path_ga import planner as grid_planner
from evoexp.planners.placement_ga import planner as placement_planner
from evoexp.planners.stretches import stretch_of
from evoexp.store.log_reader import read_log
from masked_logs import masked_log

RUNS = (
    "experiment=rana_planar ga.num_generations=300",
    "experiment=rana_planar ga.num_generations=0",
    "experiment=rana_puma ga.num_generations=17",
    "experiment=chen_placement ga.num_generations=130",
    "experiment=chen_placement ga.num_generations=1 ga.population_size=31 ga.num_elites=1",
    "experiment=chen_path ga.num_generations=150",
    "experiment=chen_path planner.revisits=true ga.num_generations=16",
    "experiment=chen_mission budget=smoke",
    "experiment=chen_mission",
    "experiment=chen_path --only=(a),_random_search",
    "experiment=chen_placement --only=B_link,_random_search",
    "experiment=rana_planar --only=random_search ga.num_generations=30",
    "experiment=curkovic_methods ga.num_generations=150",
    "experiment=curkovic_methods ga.num_generations=0",
    "experiment=curkovic_three ga.num_generations=20",
    "experiment=chen_path --only=(c),_path_climbing",
    "experiment=chen_path ga.num_elites=3 --only=(a),_random_search",
    "experiment=chen_placement ga.num_elites=5 --only=B_link,_random_search",
    "experiment=chen_path planner.revisits=true ga.num_generations=20 --only=(a),_path_climbing",
    "experiment=chen_path planner.revisits=true ga.num_generations=20 --only=(a),_random_search",
)


def condition(words: str) -> Condition:
    """Return the condition of an experiment; spaces of a label are written _."""
    names = [word for word in words.split() if not word.startswith("--only=")]
    labels = [word[7:].replace("_", " ") for word in words.split() if word not in names]
    return compose.expand(names, only=labels)[0].conditions[0].condition


@pytest.mark.parametrize("words", RUNS)
def test_the_log_is_the_same_one_by_one_and_together(words: str) -> None:
    given = condition(words)
    heard: list[int] = []
    together = run_replicate(given, 3).content
    one_by_one = run_replicate(given, 3, hear=lambda each: heard.append(each.index)).content
    assert masked_log(together) == masked_log(one_by_one)
    assert heard == [*range(len(read_log(together).generations))]


@pytest.mark.parametrize("stretch", [16, 48])
@pytest.mark.parametrize(
    ("planner", "words"),
    [
        (grid_planner, "experiment=chen_path ga.num_generations=70"),
        (placement_planner, "experiment=chen_placement ga.num_generations=70"),
    ],
)
def test_states_are_recorded_by_rounds_however_many_generations_are_computed_per_call(
    planner: ModuleType, words: str, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planner, "BLOCK", 600)  # several blocks per round
    monkeypatch.setattr(planner, "STRETCH", stretch)
    given = condition(words)
    together = run_replicate(given, 3).content
    one_by_one = run_replicate(given, 3, hear=lambda each: None).content
    assert masked_log(together) == masked_log(one_by_one)


@pytest.mark.parametrize("words", RUNS[::3])
def test_a_run_yields_what_its_stretches_hold(words: str) -> None:
    planner, problem = condition(words).prepare()
    rngs = np.random.default_rng(2), np.random.default_rng(2)
    one, other = (planner.evolve(problem, rng) for rng in rngs)
    assert isinstance(other, Run)
    clock = itertools.count()
    for stretch in other.stretches(lambda: float(next(clock))):
        assert stretch.times == sorted(stretch.times)
        assert [each.place for each in stretch.standings] == sorted(
            {0, *(each.place for each in stretch.standings)}
        )
        costs = [row for block in stretch.costs for row in block]
        for k, lowest in enumerate(stretch.lowest):
            each, rng = next(one), rngs[0]
            standing = [found for found in stretch.standings if found.place <= k][-1]
            assert (each.index, each.best_cost, each.terms, each.solved) == (
                stretch.first + k,
                standing.cost,
                standing.terms,
                standing.solved,
            )
            np.testing.assert_array_equal(each.best, standing.best)
            np.testing.assert_array_equal(each.costs, costs[k])
            assert each.best_cost_in_generation == lowest
            assert (each.evaluations, each.collision_queries, each.num_feasible) == (
                stretch.evaluations[k],
                stretch.collision_queries[k],
                stretch.num_feasible[k],
            )
            np.testing.assert_array_equal(
                (each.mean_cost, each.std_cost), (stretch.means[k], stretch.deviations[k])
            )
            state = rng.bit_generator.state["state"]["state"]
            assert stretch.states[k][:16] == state.to_bytes(16, "little")
        assert len(stretch.lowest) >= TOGETHER or stretch.population is not None
    np.testing.assert_array_equal(each.population, stretch.population)
    assert next(one, None) is None


def test_an_iterator_goes_on_where_it_is() -> None:
    planner, problem = condition(RUNS[0]).prepare()
    run = planner.evolve(problem, np.random.default_rng(0))
    assert next(run).index == 0
    assert next(iter(run)).index == 1
    assert next(run).index == 2


def test_a_stretch_is_as_long_as_the_caches_allow() -> None:
    assert [stretch_of(16, size, 1000) for size in (0, 10, 100, 400, 2000)] == [16, 16, 10, 2, 1]


def test_costs_that_take_much_memory_are_recorded_sooner(monkeypatch: pytest.MonkeyPatch) -> None:
    given = condition("experiment=rana_planar ga.num_generations=40")
    expected = masked_log(run_replicate(given, 0).content)
    monkeypatch.setattr(gathering, "ENOUGH", 4_000)
    planner, problem = given.prepare()
    stretches = list(planner.evolve(problem, given.rng(0)).stretches(lambda: 0.0))
    assert len(stretches) > 2
    assert masked_log(run_replicate(given, 0).content) == expected


def test_a_run_that_is_closed_ends() -> None:
    planner, problem = condition(RUNS[0]).prepare()
    run = planner.evolve(problem, np.random.default_rng(0))
    each = iter(run)
    next(run)
    run.close()
    assert next(run, None) is None
    assert next(each, None) is None
