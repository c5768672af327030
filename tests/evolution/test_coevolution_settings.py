"""Settings of co-evolution: what follows from them, and which are refused."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.errors import SettingError
from evoexp.planners.coevolution.settings import CoevolutionSettings
from evoexp.validation import build

METHOD_V: dict[str, Any] = {
    "population_size": 100,
    "num_generations": 200,
    "crossover_rate": 0.6,
    "mutation_rate": 1.0,
    "mutation_decay": 0.9,
    "mutation_step": 36.0,
    "mutation_direction": "one_sided",
    "selection": "inverse",
    "num_elites": 0,
    "hall_depth": 0.15,
    "hall_memory": None,
    "hall_frozen": False,
    "restart_after": None,
}


def built(**changes: Any) -> CoevolutionSettings:
    settings = build(
        {"_target_": "coevolutionary"} | METHOD_V | changes,
        lambda name, field: CoevolutionSettings,
        "ga",
    )
    assert isinstance(settings, CoevolutionSettings)
    return settings


@pytest.mark.parametrize(
    ("size", "depth", "teams"),
    [(100, 0.15, 15), (50, 0.15, 7), (150, 0.15, 22), (100, 0.29, 29), (100, 0.0, 0)],
)
def test_depth_of_the_hall_is_rounded_down(size: int, depth: float, teams: int) -> None:
    settings = built(population_size=size, hall_depth=depth, num_elites=2)
    assert settings.num_hall_teams == teams
    assert settings.num_offspring == size - 2 - teams


@given(st.integers(1, 1000), st.integers(0, 100))
def test_a_depth_in_percent_is_exact(size: int, percent: int) -> None:
    if percent == 0 or percent * size >= 100:
        assert built(population_size=size, hall_depth=percent / 100).num_hall_teams == math.floor(
            percent * size / 100
        )


def test_everything_may_be_null_or_off() -> None:
    plain = built(hall_depth=0.0, mutation_decay=0.0, mutation_rate=0.1)
    assert plain.num_offspring == 100
    full = built(
        hall_memory=3,
        restart_after=50,
        num_elites=85,
        selection="difference",
        mutation_direction="symmetric",
    )
    assert full.num_offspring == 0
    assert built(hall_frozen=True).hall_frozen
    assert built(hall_distinct="index").hall_distinct == "index"


def test_distinct_genomes_are_the_default_and_no_part_of_the_canonical_form() -> None:
    assert built() == built(hall_distinct="genome")
    assert "hall_distinct" not in built().canonical()
    assert built(hall_distinct="index").canonical()["hall_distinct"] == "index"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"num_elites": 101}, "ga.num_elites: must be at most population_size (100), was 101"),
        (
            {"num_elites": 86},
            "ga.num_elites: must be at most population_size less the hall's teams (85), was 86",
        ),
        ({"mutation_rate": 0.5}, "ga.mutation_decay: must be at most mutation_rate (0.5), was 0.9"),
        (
            {"hall_depth": 0.009},
            "ga.hall_depth: must be 0, or large enough for one pair (at least "
            "1/population_size), was 0.009",
        ),
        (
            {"hall_depth": 0.0, "hall_memory": 3},
            "ga.hall_memory: must be null where there is no hall (hall_depth is 0), was 3",
        ),
        (
            {"hall_depth": 0.0, "hall_frozen": True},
            "ga.hall_frozen: must be false where there is no hall (hall_depth is 0), was True",
        ),
        (
            {"hall_depth": 0.0, "hall_distinct": "index"},
            "ga.hall_distinct: must be genome where there is no hall (hall_depth is 0), was "
            "'index'",
        ),
        (
            {"hall_distinct": "genomes"},
            "ga.hall_distinct: must be one of 'genome' or 'index', was 'genomes'; did you mean "
            "'genome'?",
        ),
        (
            {"hall_frozen": True, "hall_memory": 3},
            "ga.hall_memory: must be null where the hall is frozen (hall_frozen), was 3",
        ),
        ({"population_size": 0}, "ga.population_size: must be at least 1, was 0"),
        ({"mutation_step": 0.0}, "ga.mutation_step: must be greater than 0.0, was 0.0"),
        ({"hall_depth": 1.5}, "ga.hall_depth: must be at most 1.0, was 1.5"),
        ({"hall_memory": 0}, "ga.hall_memory: must be at least 1, was 0"),
        ({"restart_after": 0}, "ga.restart_after: must be at least 1, was 0"),
        (
            {"selection": "inverses"},
            "ga.selection: must be one of 'inverse' or 'difference', was 'inverses'; did you "
            "mean 'inverse'?",
        ),
        ({"hall_frozen": 1}, "ga.hall_frozen: must be true or false, was 1"),
    ],
)
def test_errors_name_the_field(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingError) as error:
        built(**changes)
    assert str(error.value) == message


def test_schedule_of_eq_10() -> None:
    rates = [built().mutation_rate_at(t) for t in range(201)]
    assert rates[0] == 1.0
    assert rates[100] == pytest.approx(0.55, rel=1e-15)
    assert rates[200] == pytest.approx(0.1, rel=1e-15)
    assert all(later < earlier for earlier, later in zip(rates, rates[1:], strict=False))
    constant = built(mutation_rate=0.3, mutation_decay=0.0)
    assert [constant.mutation_rate_at(t) for t in (0, 77, 200)] == [0.3, 0.3, 0.3]
    assert built(mutation_rate=0.3, mutation_decay=0.3).mutation_rate_at(300) == 0.0
    assert built(num_generations=0).mutation_rate_at(0) == 1.0
