"""Hill climbing on grid paths: valid paths, equal evaluations, never worse."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from composed import composed
from evoexp.collision.models.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.numeric.random_stream import Block
from evoexp.planners.grid_path_ga import kernels
from evoexp.planners.grid_path_ga.climbing_kernels import Ledger, climb_by_pieces
from evoexp.planners.grid_path_ga.kernels import RESULTS, Population
from evoexp.planners.grid_path_ga.path_climbing import PathClimbing
from evoexp.planners.grid_path_ga.path_operators import Scratch
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.records import generations
from matrix import num_cases
from paths.walked_worlds import SEEDS
from planners.grid_samples import FIELDS, planner, robot, scenario, solvable

SHAPES = st.sampled_from([(3, 3), (6, 5), (9, 9), (12, 4)])


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


@settings(max_examples=num_cases(5, 40), deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), st.integers(1, 4), st.booleans(), SEEDS)
def test_pieces_are_those_of_whole_paths_that_are_regenerated_settled_and_measured(
    shape: tuple[int, ...], share: float, num_paths: int, is_safety: bool, seed: int
) -> None:
    own = planner((0.0, 1.0) if is_safety else (0.3, 2.0))
    problem, rng = solvable(shape, share, seed, own), np.random.default_rng(seed)
    drawn = own.sample(problem, rng, num_paths)
    size = problem.fields.grid.num_nodes
    paths = np.zeros((num_paths, size + 1), dtype=np.int32)
    paths[:, : drawn.shape[1]] = drawn
    results = own.measured(problem, drawn)
    one = Population(paths.copy(), results.copy())
    two = Population(paths.copy(), results.copy())
    assert Ledger.is_fit(problem.world)
    ledger = Ledger.of(one.paths, problem.world)
    candidate = Population(np.empty((1, size + 1), dtype=np.int32), np.empty((RESULTS, 1)))
    scratch, weights = Scratch.of(size), own.objective.weights
    uniforms, begin, end, trial = rng.random(60_000), 0, 0, 0
    while trial < 300:  # blocks end wherever
        end += int(rng.integers(1, 2000))
        draws = [Block(uniforms[begin:end], np.zeros(1, dtype=np.int64)) for _ in range(2)]
        following = climb_by_pieces(draws[0], trial, 300, problem.world, weights, one, ledger)
        general = problem.world, weights, True, two, candidate, scratch
        assert kernels.climb(draws[1], trial, 300, *general) == following
        assert draws[0].taken[0] == draws[1].taken[0]
        begin, trial = begin + int(draws[0].taken[0]), following
    for k, path in enumerate(one.paths):
        assert path[: path[0] + 1].tolist() == two.paths[k, : path[0] + 1].tolist()
        assert np.flatnonzero(ledger.place[k]).tolist() == sorted(path[1 : path[0] + 1].tolist())
        assert ledger.place[k][path[1 : path[0] + 1]].tolist() == list(range(1, path[0] + 1))
    np.testing.assert_array_equal(one.results, two.results)


def test_paths_whose_unsafeness_or_weights_are_no_whole_numbers_are_measured_as_a_whole() -> None:
    for changed in ({"obstacle_potentials": (2.5, 1.0)}, {"goal_potentials": (0.5, 1.75)}):
        own = planner((0.1, 2.0), collision=PotentialFields(**(FIELDS | changed)))
        problem = solvable((9, 8), 0.2, 1, own)
        assert not Ledger.is_fit(problem.world)
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
