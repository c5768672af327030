"""Exchanges of pieces of paths: against all paths of small grids, and one by one."""

from itertools import permutations
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.references.grid_bounds import Exchanges, network_of
from evoexp.references.grid_frontier import frontier
from planners.grid_samples import planner, solvable
from references.all_paths import all_simple_paths, path_cost


def descended(own: Any, problem: Any, path: np.ndarray, longest: int) -> np.ndarray:
    exchanges = Exchanges(network_of(problem), own.objective.weights, longest)
    return exchanges.descend(path)


def shortest_path(problem: Any) -> np.ndarray:
    ((_, path),) = frontier(network_of(problem), np.array([1e-6]))
    return path.astype(np.int64)


def is_move(problem: Any, one: int, two: int) -> bool:
    return two in problem.fields.grid.neighbours[one]


def better_exchanges(own: Any, problem: Any, path: list[int], longest: int) -> list[list[int]]:
    """Return all paths that cost less and differ in one piece, by trying all nodes around."""
    cost = path_cost(own, problem, path)
    coordinates = problem.fields.grid.coordinates
    found = []
    for removed in range(longest + 1):
        for place in range(len(path) - 1 - removed):
            head, tail = path[: place + 1], path[place + 1 + removed :]
            # a piece stays within as many moves of the node before it as it has nodes
            around = [
                node
                for node in np.flatnonzero(problem.fields.grid.free.ravel()).tolist()
                if np.abs(coordinates[node] - coordinates[head[-1]]).max() <= longest
                and np.abs(coordinates[node] - coordinates[tail[0]]).max() <= longest
                and node not in head
                and node not in tail
            ]
            for count in range(longest + 1):
                for piece in permutations(around, count):
                    own_path = [*head[-1:], *piece, tail[0]]
                    if all(
                        is_move(problem, *pair)
                        for pair in zip(own_path, own_path[1:], strict=False)
                    ):
                        other = [*head, *piece, *tail]
                        if path_cost(own, problem, other) < cost - 1e-9:
                            found.append(other)
    return found


@pytest.mark.parametrize("seed", range(4))
def test_a_descent_ends_where_no_exchange_helps(seed: int) -> None:
    own = planner((0.05, 2.0))
    problem = solvable((6, 5), 0.2, seed, own)
    path = descended(own, problem, shortest_path(problem), 2)
    assert better_exchanges(own, problem, path.tolist(), 2) == []


@pytest.mark.examples(4)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("weights", [(0.05, 2.0), (0.3, 1.0)])
def test_improved_paths_are_nearly_always_the_best_of_all(
    weights: tuple[float, float], seed: int
) -> None:
    own = planner(weights)
    problem = solvable((4, 4), 0.35, seed, own)
    path = shortest_path(problem)
    better = descended(own, problem, path, 3)
    cost = path_cost(own, problem, better)
    assert np.isfinite(cost) and len(set(better.tolist())) == len(better)
    assert cost <= path_cost(own, problem, path)
    least = min(path_cost(own, problem, other) for other in all_simple_paths(problem))
    assert least - 1e-12 <= cost <= 1.03 * least


@pytest.mark.matrix
@pytest.mark.parametrize("label", ["(b), exact", "(c), exact"])
def test_no_exchange_of_three_nodes_improves_the_best_path_known(label: str) -> None:
    own, problem = composed("experiment=chen_path", label=label).prepare()
    truth = own.truth(problem)
    nodes = truth.best.reshape(-1, 2).astype(int)
    grid = problem.fields.grid
    path = [grid.index_of(tuple(node)) for node in nodes.tolist()]
    assert len(set(path)) == len(path)
    assert path_cost(own.planner, problem, path) == pytest.approx(truth.cost, rel=1e-12)
    assert truth.cost < {"(b), exact": 32.7305, "(c), exact": 60.3435}[label]
    assert better_exchanges(own.planner, problem, path, 2) == []
    assert descended(own.planner, problem, np.array(path), 3).tolist() == path
