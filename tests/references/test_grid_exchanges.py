"""Exchanges of pieces of paths: against all paths of small grids, and one by one."""

from itertools import permutations
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.references.grid_exchanges import (
    Pieces,
    Terrain,
    best_exchange,
    best_single,
    descend,
    improve,
    list_pieces,
    measure,
    used_nodes,
)
from evoexp.references.grid_frontier import frontier
from evoexp.references.grid_networks import network_of
from planners.grid_samples import planner, solvable
from references.all_paths import all_simple_paths, path_cost


def terrain_of(own: Any, problem: Any) -> Terrain:
    return Terrain.of(problem.fields.grid, problem.fields.unsafeness, own.objective.weights)


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
@pytest.mark.parametrize("removed", [0, 1, 2])
def test_the_table_has_every_piece_once(seed: int, removed: int) -> None:
    own = planner((0.3, 1.0))
    problem = solvable((5, 5), 0.3, seed, own)
    path, terrain = shortest_path(problem), terrain_of(own, problem)
    place = (len(path) - 2 - removed) // 2
    pieces, used = Pieces.of(terrain, 2), used_nodes(terrain, path)
    before = used.copy()
    count = list_pieces(terrain, path, place, removed, used, pieces)
    np.testing.assert_array_equal(used, before)
    found = [tuple(pieces.nodes[row, : pieces.counts[row]].tolist()) for row in range(count)]
    kept = [*path[: place + 1].tolist(), *path[place + 1 + removed :].tolist()]
    free = [
        node
        for node in np.flatnonzero(problem.fields.grid.free.ravel()).tolist()
        if node not in kept
    ]
    one, two = int(path[place]), int(path[place + 1 + removed])
    expected = [
        piece
        for number in range(3)
        for piece in permutations(free, number)
        if all(is_move(problem, *pair) for pair in zip((one, *piece), (*piece, two), strict=True))
    ]
    assert sorted(found) == sorted(expected)
    assert tuple(path[place + 1 : place + 1 + removed].tolist()) in found
    for row, piece in enumerate(found):
        length, unsafeness = measure(terrain, np.array([one, *piece, two]))
        unsafeness -= terrain.unsafeness[one] + terrain.unsafeness[two]
        assert (pieces.lengths[row], pieces.unsafeness[row]) == pytest.approx((length, unsafeness))


@pytest.mark.parametrize("seed", range(4))
def test_a_descent_ends_where_no_exchange_helps(seed: int) -> None:
    own = planner((0.05, 2.0))
    problem = solvable((6, 5), 0.2, seed, own)
    terrain = terrain_of(own, problem)
    path, cost = descend(terrain, shortest_path(problem), Pieces.of(terrain, 2))
    assert cost == pytest.approx(path_cost(own, problem, path), rel=1e-12)
    assert better_exchanges(own, problem, path.tolist(), 2) == []


@pytest.mark.parametrize("seed", range(6))
def test_exchanges_of_single_nodes_need_no_table(seed: int) -> None:
    own, rng = planner((0.05, 2.0)), np.random.default_rng(seed)
    problem = solvable((6, 5), 0.2, seed, own)
    terrain = terrain_of(own, problem)
    pieces, some_help = Pieces.of(terrain, 1), 0
    for row in own.sample(problem, rng, 20):
        path = row[1 : row[0] + 1].astype(np.int64)
        found, expected = best_single(terrain, path), best_exchange(terrain, path, pieces)
        assert tuple(found) == tuple(expected)
        some_help += found.place >= 0
    assert some_help > 5


@pytest.mark.examples(4)
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("weights", [(0.05, 2.0), (0.3, 1.0)])
def test_improved_paths_are_nearly_always_the_best_of_all(
    weights: tuple[float, float], seed: int
) -> None:
    own = planner(weights)
    problem = solvable((4, 4), 0.35, seed, own)
    path = shortest_path(problem)
    (better,) = improve(terrain_of(own, problem), [path], 3, 2)
    cost = path_cost(own, problem, better)
    assert np.isfinite(cost) and len(set(better.tolist())) == len(better)
    assert cost <= path_cost(own, problem, path)
    least = min(path_cost(own, problem, other) for other in all_simple_paths(problem))
    assert least - 1e-12 <= cost <= 1.02 * least


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
    terrain = terrain_of(own.planner, problem)
    again, cost = descend(terrain, np.array(path), Pieces.of(terrain, 3))
    assert (again.tolist(), cost) == (path, pytest.approx(truth.cost))
