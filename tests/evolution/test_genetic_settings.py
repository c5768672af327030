"""Settings of evolutionary searches: what follows from them, and which are refused."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from evoexp.errors import SettingError
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.planners.coevolution.settings import CoevolutionSettings
from evoexp.planners.posture_es.settings import StrategySettings
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic
from evoexp.validation import Component, build

SHARED = {
    "population_size": 50, "num_generations": 500, "num_elites": 2, "crossover_rate": 0.9,
    "mutation_rate": 1.0,
}  # fmt: skip
METHOD_V = SHARED | {
    "population_size": 100, "num_generations": 200, "mutation_decay": 0.9, "mutation_step": 36.0,
    "mutation_direction": "one_sided", "selection": "inverse", "num_elites": 0, "hall_depth": 0.15,
    "hall_memory": None, "hall_frozen": False, "restart_after": None,
}  # fmt: skip
SELECTIVE = SHARED | {"selection": "tournament", "tournament_size": 2, "rank_pressure": 1.5}
REAL = SELECTIVE | {
    "crossover": "one_point", "blend_alpha": 0.5, "mutation": "non_uniform",
    "mutation_scope": "gene", "mutation_power": 2, "mutation_std": 0.1,
}  # fmt: skip
BINARY = SELECTIVE | {"bits_per_gene": 16}
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


@pytest.mark.parametrize(
    ("kind", "settings", "message"),
    [
        (GeneticSettings, SHARED | {"num_elites": 51}, r"num_elites: must be at most .* \(50\)"),
        (StrategySettings, STRATEGY | {"num_parents": 103}, r"\(100\) with comma selection"),
        *((RealGenetic, REAL | {field: value}, field) for field, value in (
            ("blend_alpha", -0.1), ("tournament_size", 0), ("rank_pressure", 0.9),
            ("rank_pressure", 2.1), ("mutation_power", -1), ("mutation_std", 0.0),
            ("selection", "lottery"), ("crossover", "two_point"), ("mutation", "none"),
            ("mutation_scope", "all"),
        )),
        *((BinaryGenetic, BINARY | {"bits_per_gene": bits}, "bits_per_gene") for bits in (0, 53)),
    ],
)  # fmt: skip
def test_settings_out_of_range_are_refused(
    kind: type[Component], settings: dict[str, Any], message: str
) -> None:
    with pytest.raises((SettingError, ValidationError), match=message):
        kind(**settings)


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


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"num_elites": 86},
            "num_elites: must be at most population_size less the hall's teams (85)",
        ),
        ({"mutation_rate": 0.5}, "mutation_decay: must be at most mutation_rate (0.5), was 0.9"),
        ({"hall_depth": 0.009}, "hall_depth: must be 0, or large enough for one pair"),
        ({"hall_depth": 0.0, "hall_memory": 3}, "hall_memory: must be null where there is no hall"),
        ({"hall_depth": 0.0, "hall_frozen": True}, "hall_frozen: must be false where there is no"),
        ({"hall_depth": 0.0, "hall_distinct": "index"}, "hall_distinct: must be genome where"),
        ({"hall_depth": 0.0, "hall_members": "front"}, "hall_members: must be pairs where there"),
        ({"hall_members": "front", "hall_memory": 3}, "hall_memory: must be null where fronts are"),
        ({"hall_distinct": "genomes"}, "'genome' or 'index', was 'genomes'; did you mean"),
        ({"hall_frozen": True, "hall_memory": 3}, "hall_memory: must be null where the hall is"),
        ({"population_size": 0}, "population_size: must be at least 1, was 0"),
        ({"mutation_step": 0.0}, "mutation_step: must be greater than 0.0, was 0.0"),
        ({"hall_depth": 1.5}, "hall_depth: must be at most 1.0, was 1.5"),
        ({"hall_memory": 0}, "hall_memory: must be at least 1, was 0"),
        ({"restart_after": 0}, "restart_after: must be at least 1, was 0"),
        ({"selection": "inverses"}, "selection: must be one of 'inverse' or 'difference'"),
        ({"hall_frozen": 1}, "hall_frozen: must be true or false, was 1"),
    ],
)
def test_refusals_of_co_evolution_name_the_field(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingError) as error:
        built(**changes)
    assert str(error.value).startswith("ga.")
    assert message in str(error.value)
