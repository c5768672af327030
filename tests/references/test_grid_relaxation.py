"""Bounds by Lagrangian relaxation: below all paths of small grids, against slow walks."""

from collections import Counter
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.references.grid_frontier import GridFrontier
from evoexp.references.grid_networks import arrivals_of, moves_of, network_of
from evoexp.references.grid_relaxation import Walks, count_excess, find_walks, relaxed_bounds
from planners.grid_samples import planner, solvable
from references.all_paths import all_simple_paths, path_cost
from references.test_grid_frontier import SETTINGS


def all_walks(problem: Any, number: int) -> list[list[int]]:
    """Return the walks of a number of nodes that never go straight back, nor past the ends."""
    start, goal = problem.ends
    walks = [[start]]
    for _ in range(number - 1):
        walks = [
            [*walk, int(other)]
            for walk in walks
            if walk[-1] != goal
            for other in problem.fields.grid.neighbours[walk[-1]]
            if other >= 0 and other != start and (len(walk) < 2 or other != walk[-2])
        ]
    return [walk for walk in walks if walk[-1] == goal]


@pytest.mark.parametrize("seed", range(3))
def test_walks_are_the_best_of_all_that_never_go_straight_back(seed: int) -> None:
    epsilon, most, rng = 0.3, 8, np.random.default_rng(seed)
    problem = solvable((4, 3), 0.2, seed, planner())
    network = network_of(problem)
    moves = moves_of(arrivals_of(network, epsilon))
    weights = rng.uniform(0.0, 2.0, len(network.unsafeness))
    walks = Walks.of(most, len(network.unsafeness))
    find_walks(moves, weights, most, walks)
    lengths = dict(
        zip(zip(network.tails, network.heads, strict=True), network.lengths, strict=True)
    )
    for number in range(2, most + 1):
        costs = {
            tuple(walk): sum(weights[node] for node in walk)
            + epsilon * sum(lengths[pair] for pair in zip(walk, walk[1:], strict=False))
            for walk in all_walks(problem, number)
        }
        least = min(costs.values(), default=np.inf)
        assert walks.costs[number] == pytest.approx(least)
        if number == most:
            # the excess of visits is that of the best walk
            excess = np.empty(len(weights))
            count_excess(moves, walks, most, np.ones(len(weights)), excess)
            visits = Counter(min(costs, key=lambda walk: costs[walk]))
            expected = [visits[node] - 1.0 for node in range(len(weights))]
            np.testing.assert_array_equal(excess, expected)


@pytest.mark.parametrize("seed", range(3))
def test_any_multipliers_give_a_bound_for_every_number_of_nodes(seed: int) -> None:
    weights, most = (0.1, 2.0), 12
    own = planner(weights)
    problem = solvable((4, 4), 0.2, seed, own)
    network, rng = network_of(problem), np.random.default_rng(seed)
    multipliers = rng.exponential(0.1, len(network.unsafeness))
    moves = moves_of(arrivals_of(network, weights[0]))
    walks = Walks.of(most, len(network.unsafeness))
    passing = weights[1] / most * network.unsafeness + multipliers
    find_walks(moves, passing, most, walks)
    bounds = walks.costs - multipliers.sum()
    for path in all_simple_paths(problem):
        if len(path) <= most:
            assert bounds[len(path)] <= path_cost(own, problem, path) + 1e-12


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
    network, floors = network_of(problem), np.full(40, 0.5)
    arguments = arrivals_of(network, 0.05), 2.0, 10.0, 10.0, floors
    np.testing.assert_array_equal(relaxed_bounds(*arguments, 0), floors)
    raised = relaxed_bounds(*arguments, 1)
    assert (raised >= floors).all() and (raised[10:] > floors[10:]).all()


@pytest.mark.matrix
@pytest.mark.parametrize(("label", "least"), [("(b), exact", 31.540), ("(c), exact", 55.998)])
def test_the_truth_of_the_papers_workspace_is_known_within_one_per_cent(
    label: str, least: float
) -> None:
    own, problem = composed("experiment=chen_path", label=label).prepare()
    truth = own.truth(problem)
    assert least < truth.terms["lower_bound"] <= truth.cost
    assert truth.cost <= 1.01 * truth.terms["lower_bound"]


@pytest.mark.parametrize("seed", range(4))
def test_walks_in_memory_of_others_are_those_of_new_memory(seed: int) -> None:
    """Memory that was used before keeps old moves, which no walk may take."""
    most, rng = 30, np.random.default_rng(seed)
    network = network_of(solvable((9, 8), 0.25, seed, planner()))
    moves = moves_of(arrivals_of(network, 0.3))
    used, excesses = Walks.of(most, len(network.unsafeness)), np.empty((2, len(network.unsafeness)))
    for number in (most, 17, 25, 12, 26):
        weights = rng.uniform(0.0, 2.0, len(network.unsafeness))
        fresh = Walks.of(most, len(network.unsafeness))
        for walks, excess in zip((used, fresh), excesses, strict=True):
            find_walks(moves, weights, number, walks)
            count_excess(moves, walks, number, np.ones(len(excess)), excess)
        np.testing.assert_array_equal(used.costs[: number + 1], fresh.costs[: number + 1])
        np.testing.assert_array_equal(*excesses)
        # a walk of so many nodes that costs as much, written plainly, level by level
        plain = plain_costs(network, weights, number)
        np.testing.assert_array_equal(fresh.costs[: number + 1], plain)


def plain_costs(network: Any, weights: np.ndarray, number: int) -> list[float]:
    """Return the costs of the best walks to the goal by numbers of nodes: one edge at a time."""
    start, goal = network.ends
    edges = list(
        zip(network.tails.tolist(), network.heads.tolist(), network.lengths.tolist(), strict=True)
    )
    at: dict[tuple[int, int], float] = {(start, -1): weights[start]}  # by node and the one before
    costs = [np.inf, np.inf]
    for _ in range(2, number + 1):
        following: dict[tuple[int, int], float] = {}
        for (node, before), cost in at.items():
            for tail, head, length in edges:
                if tail == node != goal and head not in (before, start):
                    value = (cost + 0.3 * length) + weights[head]
                    key = (head, node)
                    following[key] = min(value, following.get(key, np.inf))
        at = following
        costs.append(min((c for (node, _), c in at.items() if node == goal), default=np.inf))
    return costs
