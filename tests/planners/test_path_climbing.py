"""Hill climbing on grid paths: valid paths, equal evaluations, never worse."""

from itertools import pairwise

import numpy as np
import pytest

from composed import composed
from evoexp.collision.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.planners.grid_path_ga.path_climbing import PathClimbing
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.records import generations
from planners.grid_samples import FIELDS, planner, robot, scenario, solvable


@pytest.mark.parametrize("revisits", [False, True])
@pytest.mark.parametrize("num_paths", [1, 3])
def test_every_path_stays_valid_and_no_generation_is_worse(num_paths: int, revisits: bool) -> None:
    own = planner((0.1, 2.0), revisits=revisits)
    problem = solvable((9, 8), 0.2, 1, own)
    climbing = PathClimbing(planner=own, num_paths=num_paths)
    rows = [
        one._replace(costs=one.costs.copy())
        for one in generations(climbing.evolve(problem, np.random.default_rng(2)))
    ]
    assert len(rows) == own.num_generations + 1
    counts = [own.num_evaluations(k) for k in range(own.num_generations + 1)]
    assert [one.evaluations for one in rows] == np.cumsum(counts).tolist()
    for before, after in pairwise(rows):
        assert (after.costs <= before.costs).all()  # path by path
    for one in rows:
        assert len(one.costs) == num_paths
        terms = own.evaluate(problem, one.best)
        assert terms["cost"] == pytest.approx(one.best_cost, rel=1e-12)
        assert own.departures(problem, one.best) == []
    assert rows[-1].best_cost < rows[0].best_cost


def test_paths_whose_unsafeness_or_weights_are_no_whole_numbers_climb_as_well() -> None:
    for changed in ({"obstacle_potentials": (2.5, 1.0)}, {"goal_potentials": (0.5, 1.75)}):
        own = planner((0.1, 2.0), collision=PotentialFields(**(FIELDS | changed)))
        problem = solvable((9, 8), 0.2, 1, own)
        rows = list(generations(PathClimbing(planner=own, num_paths=2).evolve(problem, _rng())))
        assert rows[-1].best_cost < rows[0].best_cost
        assert own.departures(problem, rows[-1].best) == []


def test_the_first_paths_are_the_best_of_as_many_walks_as_the_planner_draws() -> None:
    own = planner((0.1, 2.0))
    problem = solvable((9, 8), 0.2, 1, own)
    first = next(iter(generations(PathClimbing(planner=own, num_paths=2).evolve(problem, _rng()))))
    drawn = own.sample(problem, _rng(), own.num_evaluations(0))
    np.testing.assert_array_equal(first.costs, np.sort(own.cost(problem, drawn).cost)[:2])


def _rng() -> np.random.Generator:
    return np.random.default_rng(7)


def test_more_paths_than_walks_and_other_planners_are_refused() -> None:
    own = planner((0.1, 2.0))
    must = r"control\.num_paths: must be at most ga\.population_size"
    with pytest.raises(SettingError, match=must):
        PathClimbing(planner=own, num_paths=10**6).prepare(
            robot(), scenario(np.zeros((5, 5), dtype=bool))
        )
    other, _ = composed("experiment=chen_placement", label="B link").prepare()
    assert not isinstance(other, GridPathGa)
    with pytest.raises(SettingError, match="control: must be left out: placement_ga has no paths"):
        PathClimbing(planner=other, num_paths=1).prepare(None, None)
