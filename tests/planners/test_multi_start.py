"""Multi-start improvement: the same evaluations as the planner, its operator, fresh starts."""

import numpy as np
import pytest

from composed import composed
from evoexp.errors import SettingError
from planners.runs import evolved, ran
from references import rana_numpy


@pytest.mark.parametrize(("redistribution", "tolerance"), [("true", 0.01), ("false", 1e-9)])
def test_generations_are_starts_and_sweeps_as_a_slow_version_makes_them(
    redistribution: str, tolerance: float
) -> None:
    """In plain numpy: fresh walks, smoothed k times more in the k-th generation of a start."""
    words = "ga.num_generations=5", "control.num_sweeps=2", "planner.samples_per_segment=128"
    own = f"planner.redistribution={redistribution}"
    given = composed("experiment=rana_planar", "control=multi_start", *words, own)
    alone = given._replace(planner=given.planner.planner)
    slow = rana_numpy.from_condition(alone, chords_per_segment=512)
    rng, lowest = np.random.default_rng(3), np.inf
    for k, generation in enumerate(ran(given, 3).records):
        if k % 3 == 0:
            strings = rana_numpy.walks(slow, rng, 50 if k == 0 else 48)
        strings = rana_numpy.smooth(slow, strings[:48] if k else strings)
        expected = rana_numpy.judge(slow, strings)
        lowest = min(lowest, expected.cost.min())
        assert generation.costs == pytest.approx(expected.cost, abs=tolerance)
        assert generation.best_cost == pytest.approx(lowest, abs=tolerance)
        assert generation.num_feasible == np.count_nonzero(expected.collisions == 0)


def test_where_more_are_to_be_evaluated_fresh_samples_join() -> None:
    words = "experiment=rana_planar", "control=multi_start", "ga.num_generations=2"
    planner, problem = composed(*words).prepare()
    # a planner whose generations grow by three individuals
    growing = type("Growing", (), {"answers_are_proven": False})
    for name in ("sample", "improve", "cost", "solution", "num_generations"):
        setattr(growing, name, getattr(planner.planner, name))
    growing.num_evaluations = staticmethod(lambda index: 5 + 3 * index)
    records = evolved(planner.model_copy(update={"planner": growing}), problem, 1)
    populations = [record.population for record in records]
    assert [population.shape[-1] for population in populations] == [5, 8, 11]
    rng = np.random.default_rng(1)
    improved = planner.planner.improve(problem, planner.sample(problem, rng, 5), rng)
    assert np.array_equal(populations[1][..., :5], improved)
    assert np.array_equal(populations[1][..., 5:], planner.sample(problem, rng, 3))


def test_a_planner_without_a_local_operator_is_refused() -> None:
    must = "control: must be left out: redundant_ga has no local operator to be repeated"
    with pytest.raises(SettingError, match=must):
        composed("experiment=lavoie_7dof", "control=multi_start").prepare()
