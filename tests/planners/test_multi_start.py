"""Multi-start improvement: the same evaluations as the planner, its operator, fresh starts."""

import numpy as np
import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.records import generations
from references import rana_numpy


def control(*overrides: str, experiment: str = "rana_planar") -> Condition:
    given = [f"experiment={experiment}", "control=multi_start", *overrides]
    return composed(*given)


def test_generations_are_starts_and_sweeps_as_a_slow_version_makes_them() -> None:
    """In plain numpy: fresh walks, smoothed k times more in the k-th generation of a start."""
    given = control(
        "ga.num_generations=5", "control.num_sweeps=2", "planner.samples_per_segment=128"
    )
    planner, problem = given.prepare()
    slow = rana_numpy.from_condition(
        given._replace(planner=given.planner.planner), chords_per_segment=512
    )
    rng = np.random.default_rng(3)
    strings = np.empty((0, 2, 21, 2))
    lowest = np.inf
    for k, generation in enumerate(generations(planner.evolve(problem, np.random.default_rng(3)))):
        if k % 3 == 0:
            strings = rana_numpy.smooth(slow, rana_numpy.walks(slow, rng, 50 if k == 0 else 48))
        else:
            strings = rana_numpy.smooth(slow, strings[:48])
        expected = rana_numpy.judge(slow, strings)
        lowest = min(lowest, expected.cost.min())
        assert generation.costs == pytest.approx(expected.cost, abs=0.01)
        assert generation.best_cost == pytest.approx(lowest, abs=0.01)
        assert generation.num_feasible == np.count_nonzero(expected.collisions == 0)


def test_where_more_are_to_be_evaluated_fresh_samples_join() -> None:
    given = control("ga.num_generations=2")
    planner, problem = given.prepare()
    growing = type("Growing", (), {})  # a planner whose generations grow by three individuals
    for name in ("sample", "improve", "cost", "solution", "num_generations"):
        setattr(growing, name, getattr(given.planner.planner, name))
    growing.num_evaluations = staticmethod(lambda index: 5 + 3 * index)
    found = planner.model_copy(update={"planner": growing})
    populations = [
        each.population.copy()
        for each in generations(found.evolve(problem, np.random.default_rng(1)))
    ]
    assert [each.shape[-1] for each in populations] == [5, 8, 11]
    rng = np.random.default_rng(1)
    first = planner.sample(problem, rng, 5)
    assert np.array_equal(
        populations[1][..., :5], given.planner.planner.improve(problem, first, rng)
    )
    assert np.array_equal(populations[1][..., 5:], planner.sample(problem, rng, 3))


def test_a_planner_without_a_local_operator_is_refused() -> None:
    given = control(experiment="lavoie_7dof")
    must = "control: must be left out: redundant_ga has no local operator to be repeated"
    with pytest.raises(SettingError, match=must):
        given.prepare()
