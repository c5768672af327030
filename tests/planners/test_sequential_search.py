"""Sequential search: the loop of Lavoie & Boudreau 2001 with uniform draws in place of evolution.

The second opinion draws the same numbers and judges them by the numpy version of the scene.
"""

from typing import Any, NamedTuple

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import SettingError
from planners.runs import ran
from references import lavoie_numpy


class Outcome(NamedTuple):
    """The end of a run of the second opinion."""

    solved: bool
    attempts: int
    evaluations: int
    cost: float
    lowest: list[float]  # of every generation


def condition(*overrides: str, experiment: str = "lavoie_7dof") -> Condition:
    small = ("ga.population_size=60", "ga.num_generations=8", "planner.num_attempts=3")
    return composed(f"experiment={experiment}", "control=sequential_search", *small, *overrides)


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
    scene = lavoie_numpy.Scene(given._replace(planner=own.planner))
    expected = drawn(own.planner, scene, np.random.default_rng(1))
    last = records[-1]
    assert last.solved == expected.solved == solved
    assert last.terms["attempts"] == expected.attempts
    assert last.evaluations == expected.evaluations
    assert last.best_cost == pytest.approx(expected.cost, abs=1e-9)
    lowest = [record.costs.min() for record in records]
    np.testing.assert_allclose(lowest, expected.lowest, atol=1e-9)


def test_without_offspring_nothing_is_drawn_after_the_first_population() -> None:
    records = ran(condition("ga.num_elites=60")).records
    searches = {(record.terms["attempts"], record.terms["sub_path"]) for record in records}
    assert records[-1].evaluations == 60 * len(searches)


def test_another_planner_is_refused_in_one_line() -> None:
    must = "planner: must be redundant_ga, whose sub-paths sequential_search draws, was [^\n]*$"
    with pytest.raises(SettingError, match=must):
        composed("experiment=chen_path", "control=sequential_search")
