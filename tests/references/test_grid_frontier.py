"""The truth about grid paths, against all paths of small grids; what is known of shipped maps."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy

import composed
from evoexp.errors import SettingError
from evoexp.references.grid_frontier import (
    GridFrontier,
    best_walk,
    frontier,
    known_maps,
    network_of,
)
from planners.grid_samples import planner, robot, scenario, solvable
from shipped_conditions import expanded

SETTINGS = {"num_weights": 40, "least_weight": 1e-3, "greatest_weight": 10.0, "max_nodes": 60}


def all_simple_paths(problem: Any) -> list[list[int]]:
    start, goal = problem.ends
    found, stack = [], [[start]]
    while stack:
        path = stack.pop()
        for other in problem.fields.grid.neighbours[path[-1]]:
            if other == goal:
                found.append([*path, int(other)])
            elif other >= 0 and other not in path:
                stack.append([*path, int(other)])
    return found


def path_cost(own: Any, problem: Any, path: Any) -> float:
    nodes = problem.fields.grid.coordinates[path].astype(float)
    return float(own.evaluate(problem, nodes.ravel())["cost"])


@pytest.mark.examples(4)
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("weights", [(1.0, 0.0), (0.3, 1.0), (1.0, 0.3)])
def test_no_path_is_below_the_bound_and_the_best_known_is_a_path(
    weights: tuple[float, float], seed: int
) -> None:
    own = planner(weights)
    problem = solvable((4, 4), 0.4, seed, own)
    truth = GridFrontier(planner=own, **SETTINGS).truth(problem)
    least = min(path_cost(own, problem, path) for path in all_simple_paths(problem))
    assert truth.terms["lower_bound"] <= least + 1e-12
    assert least - 1e-12 <= truth.cost <= truth.arrays["frontier"][:, 4].min()
    reached = truth.terms["bound_is_reached"]
    assert reached or weights[1], "the shortest path is the shortest of all"
    assert truth.cost == pytest.approx(least) or not reached


def least_costs(network: Any, epsilon: float, mu: Any, most: int) -> list[float]:
    """Return the least ε D + μ ΣS of walks of 0 … most nodes; μ may depend on their number."""
    sums: dict[int, set[tuple[float, float]]] = {  # node → (D, ΣS) of all walks to it
        network.ends[0]: {(0.0, float(network.unsafeness[network.ends[0]]))}
    }
    costs = [np.inf, np.inf]
    for count in range(2, most + 1):
        following: dict[int, set[tuple[float, float]]] = {}
        for tail, head, length in zip(network.tails, network.heads, network.lengths, strict=True):
            arrived = {
                (round(d + length, 9), round(s + network.unsafeness[head], 9))
                for d, s in sums.get(tail, ())
            }
            following.setdefault(head, set()).update(not_dominated(arrived))
        sums = {node: not_dominated(walks) for node, walks in following.items()}
        factor = mu(count) if callable(mu) else mu
        ends = (epsilon * d + factor * s for d, s in sums.get(network.ends[1], ()))
        costs.append(min(ends, default=np.inf))
    return costs


def not_dominated(walks: set[tuple[float, float]]) -> set[tuple[float, float]]:
    """Return the walks than which no other is both shorter and safer."""
    best, least = set(), np.inf
    for walk in sorted(walks):
        if walk[1] < least:
            best.add(walk)
            least = walk[1]
    return best


@pytest.mark.parametrize("weights", [(0.05, 2.0), (0.2, 1.0)])
def test_the_best_walk_is_the_best_of_all_walks(weights: tuple[float, float]) -> None:
    own = planner(weights, revisits=True)
    blocked = np.zeros((6, 6), dtype=bool)
    blocked[0, 2] = blocked[3, 1] = True
    problem = own.prepare(robot(), scenario(blocked))
    network = network_of(problem)
    expected = least_costs(network, weights[0], lambda count: weights[1] / count, 24)
    walks, walk = best_walk(network, *weights, 1e3, 24)
    assert walks[:, 1].min() == pytest.approx(min(expected), rel=1e-8)
    for count, found in walks:
        assert found == pytest.approx(expected[int(count)], rel=1e-8)
    assert path_cost(own, problem, walk) == pytest.approx(min(expected), rel=1e-8)
    truth = GridFrontier(planner=own, **SETTINGS | {"max_nodes": 24}).truth(problem)
    assert truth.cost == pytest.approx(min(expected))


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
    expected = least_costs(network, weights[0], lambda count: weights[1] / count, most)
    assert int(np.argmin(expected)) == most
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
    moves = zip(network.tails, network.heads, strict=True)
    lengths = dict(zip(moves, network.lengths, strict=True))
    for path in all_simple_paths(problem):
        unsafe = weights[1] / len(path) * network.unsafeness[path].sum()
        cost = unsafe + weights[0] * sum(lengths[move] for move in pairwise(path))
        least[len(path)] = min(cost, least[len(path)])
    assert min(least, key=lambda number: least[number]) == 9
    # where no path is known, the bound is that of numbers of nodes alone
    walks, _ = best_walk(network, *weights, 1e3, SETTINGS["max_nodes"])
    floors, beyond = GridFrontier(planner=own, **SETTINGS).floors(network, 1e3, walks)
    assert (len(floors), beyond) == (10, np.inf)
    assert all(floors[number] <= least[number] + 1e-12 for number in least)


def test_walks_too_short_to_arrive_are_refused() -> None:
    network = network_of(solvable((6, 6), 0.2, 1, planner()))
    refusal = r"reference\.max_nodes: must be at least the number of nodes from .*, was 3"
    with pytest.raises(SettingError, match=refusal):
        best_walk(network, 0.3, 1.0, 1e3, 3)


@pytest.mark.parametrize("mu", [1e-6, 0.1, 3.0])
def test_the_shortest_weighted_path_is_that_of_a_graph_made_anew(mu: float) -> None:
    network = network_of(solvable((12, 12), 0.3, 2, planner()))
    ((_, path),) = frontier(network, np.array([mu]))
    found = frontier(network, np.array([5.0, mu]))  # the second one with the first one's graph
    costs = network.lengths + mu * network.unsafeness[network.heads]
    sizes = (len(network.unsafeness),) * 2
    graph = scipy.sparse.csr_array((costs, (network.tails, network.heads)), shape=sizes)
    start, goal = network.ends
    least = scipy.sparse.csgraph.bellman_ford(graph, indices=start)[goal]
    moves = zip(network.tails.tolist(), network.heads.tolist(), strict=True)
    edges = dict(zip(moves, costs, strict=True))
    for nodes in (path, found[-1][1]):
        cost = sum(edges[pair] for pair in pairwise(nodes.tolist()))
        assert cost == pytest.approx(least, rel=1e-12)


@pytest.mark.matrix
def test_lingering_pays_in_the_papers_own_workspace() -> None:
    every = dict(expanded("chen_lingering", "paper").conditions)
    prepared = (every[f"(b), {how}, exact"].prepare() for how in ("revisits", "loops erased"))
    free, simple = (reference.truth(problem) for reference, problem in prepared)
    assert free.terms["bound_is_reached"]
    assert free.cost < 0.95 * simple.terms["lower_bound"]
    assert len(free.best) > 1.5 * len(simple.best)
    assert simple.terms["walk_cost"] == pytest.approx(free.cost), "that walk has loops"
    known, improved = (simple.arrays[name][:, 4] for name in ("frontier", "improved"))
    assert simple.cost == improved.min()
    assert (improved <= known + 1e-9).all()


EXPERIMENTS = ("chen_path", "chen_lingering", "chen_claims")


@pytest.fixture(scope="module")
def script() -> Any:
    return composed.script("update-grid-truths")


def reference(label: str) -> Any:
    return dict(expanded("chen_path", "paper").conditions)[f"{label}, exact"].prepare()


def test_the_best_path_of_a_shipped_map_is_a_path_and_no_bound_is_above_it() -> None:
    own, problem = reference("(b)")
    known = known_maps()[own.key(problem)]
    costs = [path_cost(own.planner, problem, path) for path in known.paths]
    assert 32.567 < min(known.bounds) <= min(costs) < 32.7304
    for path in known.paths:
        assert (path[0], path[-1]) == problem.ends and len(set(path)) == len(path)
    assert own.truth(problem).cost == pytest.approx(min(costs), rel=1e-12)
    # a map is known by all that its truth depends on
    heavier = own.planner.objective.model_copy(update={"distance_weight": 0.123})
    planner_of_another = own.planner.model_copy(update={"objective": heavier})
    for update in ({"max_nodes": own.max_nodes - 1}, {"planner": planner_of_another}):
        assert own.model_copy(update=update).key(problem) not in known_maps()


@pytest.mark.matrix
@pytest.mark.parametrize(("label", "least"), [("(b)", 31.540), ("(c)", 55.998)])
def test_the_truth_of_the_papers_workspace_is_known_within_one_per_cent(
    label: str, least: float
) -> None:
    own, problem = reference(label)
    truth = own.truth(problem)
    assert least < truth.terms["lower_bound"] <= truth.cost
    assert truth.cost <= 1.01 * truth.terms["lower_bound"]


@pytest.mark.matrix
def test_every_shipped_map_is_known_and_nothing_else(script: Any) -> None:
    keys = set()
    for name in EXPERIMENTS:
        for _, condition in expanded(name, "paper").conditions:
            own = condition.planner
            if isinstance(own, GridFrontier) and script.is_searched(own):
                own, problem = condition.prepare()
                keys.add(own.key(problem))
    assert keys == known_maps().keys()


@pytest.mark.matrix
def test_the_script_finds_what_is_stored(script: Any) -> None:
    label = "(c), exact, every other obstacle"  # the fastest map
    own, problem = dict(expanded("chen_claims", "paper").conditions)[label].prepare()
    stored, found = known_maps()[own.key(problem)], script.searched(own, problem)
    assert (found.paths, found.improved) == (stored.paths, stored.improved)
    np.testing.assert_allclose(found.bounds, stored.bounds, rtol=1e-12)
