"""Sequential search: the loop of Lavoie & Boudreau 2001, with draws in place of evolution."""

from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from planners.runs import ran
from references import lavoie_numpy


def condition(*overrides: str, experiment: str = "lavoie_7dof") -> Condition:
    small = ("ga.population_size=60", "ga.num_generations=8", "planner.num_attempts=3")
    return composed(f"experiment={experiment}", "control=sequential_search", *small, *overrides)


@pytest.mark.parametrize("stretch", [1, 3, 8])
@pytest.mark.parametrize(
    ("words", "solved"),
    [
        ("planner.stop_cost_sp1=16 planner.stop_cost_sp2=12", True),
        ("planner.stop_cost_sp1=9 planner.stop_cost_sp2=3", False),
        ("ga=lavoie_binary planner.stop_cost_sp1=16 ga.num_elites=3", False),
    ],
)
def test_it_draws_what_a_plain_loop_draws(
    words: str, solved: bool, stretch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many populations are drawn per call."""
    monkeypatch.setattr("evoexp.planners.redundant_ga.sub_path.STRETCH", stretch)
    given = condition(*words.split())
    own: Any = given.planner
    records = ran(given, 1).records
    slow = given._replace(planner=own.planner)
    expected = list(lavoie_numpy.evolve(slow, np.random.default_rng(1), evolves=False))
    last = records[-1]
    assert last.solved == solved
    assert last.terms["attempts"] == expected[-1].attempt
    assert last.evaluations == sum(len(each.costs) for each in expected)
    assert last.best_cost == pytest.approx(expected[-1].best_cost, abs=1e-9)
    lowest = [record.costs.min() for record in records]
    np.testing.assert_allclose(lowest, [each.costs.min() for each in expected], atol=1e-9)


def test_without_offspring_nothing_is_drawn_after_the_first_population() -> None:
    records = ran(condition("ga.num_elites=60")).records
    searches = {(record.terms["attempts"], record.terms["sub_path"]) for record in records}
    assert records[-1].evaluations == 60 * len(searches)
