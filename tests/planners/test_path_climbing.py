"""Hill climbing on grid paths: valid paths, equal evaluations, never worse."""

from itertools import pairwise

import numpy as np
import pytest

from composed import composed
from evoexp.collision.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.planners.grid_path_ga.path_climbing import PathClimbing
from planners.grid_samples import FIELDS, planner, robot, scenario, solvable
from planners.runs import evolved


@pytest.mark.parametrize(
    "fields", [{}, {"obstacle_potentials": (2.5, 1.0)}, {"goal_potentials": (0.5, 1.75)}]
)
@pytest.mark.parametrize("revisits", [False, True])
@pytest.mark.parametrize("num_paths", [1, 3])
def test_every_path_stays_valid_and_no_generation_is_worse(
    num_paths: int, revisits: bool, fields: dict[str, tuple[float, ...]]
) -> None:
    """Whether unsafeness and weights of moves are whole numbers or not."""
    own = planner((0.1, 2.0), revisits=revisits, collision=PotentialFields(**(FIELDS | fields)))
    problem = solvable((9, 8), 0.2, 1, own)
    rows = evolved(PathClimbing(planner=own, num_paths=num_paths), problem, 2)
    counts = [own.num_evaluations(k) for k in range(own.num_generations + 1)]
    assert [one.evaluations for one in rows] == np.cumsum(counts).tolist()
    assert all((after.costs <= before.costs).all() for before, after in pairwise(rows))
    for one in rows:
        assert len(one.costs) == num_paths
        terms = own.evaluate(problem, one.best)
        assert terms["cost"] == pytest.approx(one.best_cost, rel=1e-12)
        assert own.departures(problem, one.best) == []
    assert rows[-1].best_cost < rows[0].best_cost


def test_the_first_paths_are_the_best_of_as_many_walks_as_the_planner_draws() -> None:
    own = planner((0.1, 2.0))
    problem = solvable((9, 8), 0.2, 1, own)
    first = evolved(PathClimbing(planner=own, num_paths=2), problem, 7)[0]
    drawn = own.sample(problem, np.random.default_rng(7), own.num_evaluations(0))
    np.testing.assert_array_equal(first.costs, np.sort(own.cost(problem, drawn).cost)[:2])


def test_more_paths_than_walks_and_other_planners_are_refused() -> None:
    climbing = PathClimbing(planner=planner(), num_paths=10**6)
    with pytest.raises(
        SettingError, match=r"control\.num_paths: must be at most ga\.population_si"
    ):
        climbing.prepare(robot(), scenario(np.zeros((5, 5), dtype=bool)))
    other, _ = composed("experiment=chen_placement", label="B link").prepare()
    with pytest.raises(SettingError, match="control: must be left out: placement_ga has no paths"):
        PathClimbing(planner=other, num_paths=1).prepare(None, None)
