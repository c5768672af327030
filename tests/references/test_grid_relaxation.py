"""Bounds by Lagrangian relaxation: below all paths of small grids."""

import numpy as np
import pytest

from composed import composed
from evoexp.references.grid_bounds import arrivals_of, network_of, relaxed, without_loops
from evoexp.references.grid_frontier import GridFrontier
from planners.grid_samples import planner, solvable
from references.all_paths import all_simple_paths, path_cost
from references.test_grid_frontier import SETTINGS


@pytest.mark.examples(8)
@pytest.mark.parametrize("seed", range(16))
@pytest.mark.parametrize("weights", [(0.05, 2.0), (0.3, 1.0)])
def test_no_path_of_any_number_of_nodes_is_below_its_bound(
    weights: tuple[float, float], seed: int
) -> None:
    own = planner(weights)
    problem = solvable((4, 4), 0.35, seed, own)
    truth = GridFrontier(planner=own, **SETTINGS).truth(problem)
    least: dict[int, float] = {}
    for path in all_simple_paths(problem):
        cost = path_cost(own, problem, path)
        least[len(path)] = min(cost, least.get(len(path), np.inf))
    best = min(least.values())
    for number, bound in truth.arrays["bounds"]:
        assert bound <= least.get(int(number), np.inf) + 1e-12
    assert truth.terms["walk_cost"] - 1e-12 <= truth.terms["lower_bound"] <= best + 1e-12
    assert truth.terms["lower_bound"] >= 0.97 * best, "loose"
    if truth.terms["bound_is_reached"]:
        assert truth.cost == pytest.approx(best)


def test_without_steps_the_floors_stay_and_a_step_raises_them() -> None:
    own = planner((0.05, 2.0))
    problem = solvable((6, 6), 0.1, 3, own)
    arrivals = arrivals_of(network_of(problem), 0.05)
    floors, raised = np.full(40, 0.5), np.full(40, 0.5)
    assert relaxed(arrivals, 2.0, 10.0, 10.0, floors, 0) == []
    assert (floors == 0.5).all()
    paths = relaxed(arrivals, 2.0, 10.0, 10.0, raised, 1)
    assert (raised >= floors).all() and (raised[10:] > floors[10:]).all()
    assert all(path_cost(own, problem, path) >= raised[len(path)] for path in paths)


def test_a_walk_without_its_loops() -> None:
    assert without_loops(np.array([1, 2, 3, 2, 4, 5, 4, 6])) == (1, 2, 4, 6)
    assert without_loops(np.array([1, 2, 1, 3])) == (1, 3)


@pytest.mark.matrix
@pytest.mark.parametrize(("label", "least"), [("(b), exact", 31.540), ("(c), exact", 55.998)])
def test_the_truth_of_the_papers_workspace_is_known_within_one_per_cent(
    label: str, least: float
) -> None:
    own, problem = composed("experiment=chen_path", label=label).prepare()
    truth = own.truth(problem)
    assert least < truth.terms["lower_bound"] <= truth.cost
    assert truth.cost <= 1.01 * truth.terms["lower_bound"]
