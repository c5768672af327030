"""The truth about grid paths.

Against all paths of small grids, and against what walks cannot be below.
"""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy

from evoexp.errors import SettingError
from evoexp.references.grid_frontier import (
    GridFrontier,
    arrivals_of,
    best_walk,
    best_walks,
    frontier,
    network_of,
)
from planners.grid_samples import planner, robot, scenario, solvable
from references.all_paths import all_simple_paths, path_cost
from shipped_conditions import expanded

SETTINGS = {
    "num_weights": 40,
    "least_weight": 1e-3,
    "greatest_weight": 10.0,
    "max_nodes": 60,
}


@pytest.mark.parametrize("seed", range(6))
def test_the_shortest_path_is_the_shortest_of_all(seed: int) -> None:
    own = planner((1.0, 0.0))
    problem = solvable((4, 4), 0.4, seed, own)
    truth = GridFrontier(planner=own, **SETTINGS).truth(problem)
    everything = [path_cost(own, problem, path) for path in all_simple_paths(problem)]
    assert truth.cost == pytest.approx(min(everything), abs=1e-12)
    assert truth.terms["bound_is_reached"]


@pytest.mark.examples(2)
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("weights", [(0.3, 1.0), (1.0, 0.3)])
def test_no_path_is_below_the_bound_and_the_best_known_is_a_path(
    weights: tuple[float, float], seed: int
) -> None:
    own = planner(weights)
    problem = solvable((4, 4), 0.4, seed, own)
    truth = GridFrontier(planner=own, **SETTINGS).truth(problem)
    everything = [path_cost(own, problem, path) for path in all_simple_paths(problem)]
    assert truth.terms["lower_bound"] <= min(everything) + 1e-12
    assert truth.cost >= min(everything) - 1e-12
    assert truth.cost <= truth.arrays["frontier"][:, 4].min()
    if truth.terms["bound_is_reached"]:
        assert truth.cost == pytest.approx(min(everything))


def costs_of_all_walks(problem: Any, epsilon: float, lam: float, most: int) -> list[float]:
    """Return the cost of the best walk of 2 … most nodes, over all walks."""
    own, unsafeness = problem.fields.grid, problem.fields.unsafeness
    start, goal = problem.ends
    level: dict[int, set[tuple[int, int, float]]] = {
        start: {(0, 0, float(unsafeness[start]))}
    }  # lateral, diagonal, ΣS
    costs = []
    for count in range(2, most + 1):
        following: dict[int, set[tuple[int, int, float]]] = {}
        for node, states in level.items():
            for move, other in enumerate(own.neighbours[node]):
                if other >= 0:
                    step = (1, 0) if own.changes[move] == 1 else (0, 1)
                    following.setdefault(int(other), set()).update(
                        (a + step[0], b + step[1], s + float(unsafeness[other]))
                        for a, b, s in states
                    )
        level = following
        ends = [epsilon * (a + b * np.sqrt(2)) + lam * s / count for a, b, s in level.get(goal, ())]
        costs.append(min(ends, default=np.inf))
    return costs


@pytest.mark.parametrize("weights", [(0.05, 2.0), (0.2, 1.0)])
def test_the_best_walk_is_the_best_of_all_walks(weights: tuple[float, float]) -> None:
    own = planner(weights, revisits=True)
    blocked = np.zeros((6, 6), dtype=bool)
    blocked[0, 2] = blocked[3, 1] = True
    problem = own.prepare(robot(), scenario(blocked))
    expected = costs_of_all_walks(problem, *weights, 24)
    walks, walk = best_walk(network_of(problem), *weights, 1e3, 24)
    assert walks[:, 1].min() == pytest.approx(min(expected), rel=1e-12)
    for count, found in walks:
        assert found == pytest.approx(expected[int(count) - 2], rel=1e-12)
    assert path_cost(own, problem, walk) == pytest.approx(min(expected), rel=1e-12)
    assert GridFrontier(planner=own, **(SETTINGS | {"max_nodes": 24})).truth(
        problem
    ).cost == pytest.approx(min(expected))


def dear_ends(problem: Any) -> Any:
    """Return the moves of a grid whose start and goal alone are unsafe: long paths dilute them."""
    network = network_of(problem)
    unsafeness = np.zeros(len(network.unsafeness))
    unsafeness[list(network.ends)] = 1.0
    return network._replace(unsafeness=unsafeness)


@pytest.mark.parametrize("most", [11, 13, 15])
def test_walks_of_the_last_number_of_nodes_count(most: int) -> None:
    """The best walk has as many nodes as are searched, no multiple of those bounded together."""
    weights, own = (1e-4, 2.0), planner(revisits=True)
    network = dear_ends(own.prepare(robot(), scenario(np.zeros((3, 3), dtype=bool))))
    expected = [
        slow_walk_costs(network, weights[0], weights[1] / n, n)[n] for n in range(2, most + 1)
    ]
    assert int(np.argmin(expected)) + 2 == most
    walks, walk = best_walk(network, *weights, 1e3, most)
    assert walks[-1] == pytest.approx((most, expected[-1]))
    assert len(walk) == most
    reference = GridFrontier(planner=own, **SETTINGS | {"max_nodes": most})
    floors, _ = reference.floors(network, 1e3, walks)
    assert (len(floors), floors[-1]) == (most + 1, pytest.approx(expected[-1]))


def test_the_bound_holds_for_paths_through_every_node() -> None:
    """Of all paths those of the last number of nodes, all there are, are the cheapest."""
    weights = (1e-4, 2.0)
    own = planner(weights)
    problem = own.prepare(robot(), scenario(np.zeros((3, 3), dtype=bool)))
    network, least = dear_ends(problem), dict.fromkeys(range(2, 10), np.inf)
    lengths = dict(
        zip(zip(network.tails, network.heads, strict=True), network.lengths, strict=True)
    )
    for path in all_simple_paths(problem):
        unsafe = weights[1] / len(path) * network.unsafeness[path].sum()
        cost = unsafe + weights[0] * sum(lengths[move] for move in pairwise(path))
        least[len(path)] = min(cost, least[len(path)])
    assert min(least, key=lambda number: least[number]) == 9
    # where no path is known, the bound is that of numbers of nodes alone
    reference = GridFrontier(planner=own, **SETTINGS)
    walks, _ = best_walk(network, *weights, 1e3, SETTINGS["max_nodes"])
    floors, beyond = reference.floors(network, 1e3, walks)
    assert (len(floors), beyond) == (10, np.inf)
    for number, floor in enumerate(floors[2:], 2):
        assert floor <= least[number] + 1e-12


def slow_walk_costs(network: Any, epsilon: float, mu: float, most: int) -> list[float]:
    """Return the least ε D + μ ΣS of walks of 0 … most nodes.

    One number of nodes after the other.
    """
    present = {network.ends[0]: mu * network.unsafeness[network.ends[0]]}
    costs = [np.inf, np.inf]
    for _ in range(2, most + 1):
        following: dict[int, float] = {}
        for tail, head, length in zip(network.tails, network.heads, network.lengths, strict=True):
            if tail in present:
                cost = present[tail] + epsilon * length + mu * network.unsafeness[head]
                following[head] = min(following.get(head, np.inf), cost)
        present = following
        costs.append(present.get(network.ends[1], np.inf))
    return costs


@pytest.mark.parametrize("size", [(7, 6), (4, 4, 3)])
def test_walks_of_all_numbers_of_nodes_are_those_of_each(size: tuple[int, ...]) -> None:
    network, epsilon = network_of(solvable(size, 0.3, 1, planner())), 0.3
    for mu in (0.1, 0.7, 2.0):
        arrivals = arrivals_of(network, epsilon)
        found, walk = best_walks(arrivals, mu * network.unsafeness, 20)
        np.testing.assert_allclose(found, slow_walk_costs(network, epsilon, mu, 20), rtol=1e-12)
        assert (len(walk), walk[0], walk[-1]) == (20, *network.ends)


def test_walks_too_short_to_arrive_are_refused() -> None:
    problem = solvable((6, 6), 0.2, 1, planner())
    with pytest.raises(
        SettingError, match=r"reference\.max_nodes: must be as many as a path from .*, was 3"
    ):
        best_walk(network_of(problem), 0.3, 1.0, 1e3, 3)


@pytest.mark.parametrize("mu", [1e-6, 0.1, 3.0])
def test_the_shortest_weighted_path_is_that_of_a_graph_made_anew(mu: float) -> None:
    network = network_of(solvable((12, 12), 0.3, 2, planner()))
    ((_, path),) = frontier(network, np.array([mu]))
    found = frontier(network, np.array([5.0, mu]))  # the second one with the first one's graph
    costs = network.lengths + mu * network.unsafeness[network.heads]
    least = scipy.sparse.csgraph.bellman_ford(
        scipy.sparse.csr_array(
            (costs, (network.tails, network.heads)), shape=(len(network.unsafeness),) * 2
        ),
        indices=network.ends[0],
    )[network.ends[1]]
    edges = dict(
        zip(zip(network.tails.tolist(), network.heads.tolist(), strict=True), costs, strict=True)
    )
    for nodes in (path, found[-1][1]):
        assert sum(edges[pair] for pair in pairwise(nodes.tolist())) == pytest.approx(
            least, rel=1e-12
        )


def test_the_frontier_goes_from_the_shortest_to_the_safest() -> None:
    own = planner()
    problem = solvable((16, 16), 0.25, 3, own)
    found = frontier(network_of(problem), np.geomspace(1e-4, 10.0, 50))
    terms = [
        own.evaluate(problem, problem.fields.grid.coordinates[path].astype(float).ravel())
        for _, path in found
    ]
    lengths = [term["distance"] for term in terms]
    sums = [term["unsafeness"] * term["num_nodes"] for term in terms]
    assert lengths == sorted(lengths)
    assert sums == sorted(sums, reverse=True)


@pytest.mark.matrix
def test_lingering_pays_in_the_papers_own_workspace() -> None:
    experiment = expanded("chen_lingering", "paper")
    found = {
        label: condition.prepare()
        for label, condition in experiment.conditions
        if condition.is_reference
    }
    truths = {label: planner.truth(problem) for label, (planner, problem) in found.items()}
    free, simple = truths["(b), revisits, exact"], truths["(b), loops erased, exact"]
    assert free.terms["bound_is_reached"]
    assert free.cost < 0.95 * simple.terms["lower_bound"]
    assert len(free.best) > 1.5 * len(simple.best)
    assert simple.terms["walk_cost"] == pytest.approx(free.cost), "that walk has loops"
    frontier, improved = (simple.arrays[name][:, 4] for name in ("frontier", "improved"))
    assert simple.cost == improved.min()
    assert (improved <= frontier + 1e-9).all()
