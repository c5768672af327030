from typing import Any

import pytest

from evoexp.errors import SettingError
from evoexp.planners.posture_es.settings import StrategySettings

SETTINGS: dict[str, Any] = {
    "num_parents": 5,
    "num_offspring": 100,
    "initial_size": 50,
    "num_immigrants": 2,
    "num_generations": 10,
    "patience": 15,
    "selection": "comma",
    "mutation": "uniform",
    "mutation_std": 0.5,
    "parent_choice": "equal",
    "parent_std": 0.5,
    "crossover_rate": 0.0,
}


def test_evaluations_of_all_cycles() -> None:
    assert StrategySettings(**SETTINGS).num_evaluations == 1 + (50 + 2) + 9 * (100 + 2)
    assert StrategySettings(**SETTINGS | {"num_generations": 0}).num_evaluations == 1


def test_more_parents_than_offspring_are_for_plus_selection_only() -> None:
    with pytest.raises(
        SettingError,
        match=r"num_parents: must be at most num_offspring \(100\) with comma selection",
    ):
        StrategySettings(**SETTINGS | {"num_parents": 103})
    assert (
        StrategySettings(**SETTINGS | {"num_parents": 103, "selection": "plus"}).num_parents == 103
    )
