"""Settings of evolutionary searches: what follows from them, and which are refused."""

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from evoexp.planners.coevolution.generations import CoevolutionSettings
from evoexp.planners.posture_es.cycles import StrategySettings
from evoexp.validation import build

SHARED = {
    "population_size": 50, "num_generations": 500, "num_elites": 2, "crossover_rate": 0.9,
    "mutation_rate": 1.0,
}  # fmt: skip
METHOD_V = SHARED | {
    "population_size": 100, "num_generations": 200, "mutation_decay": 0.9, "mutation_step": 36.0,
    "mutation_direction": "one_sided", "selection": "inverse", "num_elites": 0, "hall_depth": 0.15,
    "hall_memory": None, "hall_frozen": False, "restart_after": None,
}  # fmt: skip
STRATEGY = {
    "num_parents": 5, "num_offspring": 100, "initial_size": 50, "num_immigrants": 2,
    "num_generations": 10, "patience": 15, "selection": "comma", "mutation": "uniform",
    "mutation_std": 0.5, "parent_choice": "equal", "parent_std": 0.5, "crossover_rate": 0.0,
}  # fmt: skip


def built(**changes: Any) -> CoevolutionSettings:
    given = {"_target_": "coevolutionary"} | METHOD_V | changes
    settings = build(given, lambda name, field: CoevolutionSettings, "ga")
    assert isinstance(settings, CoevolutionSettings)
    return settings


def test_plus_selection_may_have_more_parents_than_offspring() -> None:
    plus = StrategySettings(**STRATEGY | {"num_parents": 103, "selection": "plus"})
    assert plus.num_parents == 103


@given(st.integers(1, 1000), st.integers(0, 100))
def test_a_depth_in_percent_is_exact(size: int, percent: int) -> None:
    if percent == 0 or percent * size >= 100:
        teams = built(population_size=size, hall_depth=percent / 100).num_hall_teams
        assert teams == math.floor(percent * size / 100)


def test_distinct_genomes_are_the_default_and_no_part_of_the_canonical_form() -> None:
    assert built() == built(hall_distinct="genome")
    assert "hall_distinct" not in built().canonical()
    assert built(hall_distinct="index").canonical()["hall_distinct"] == "index"
