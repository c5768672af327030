"""Random walks over grids against walks written plainly, which take the same numbers in the same order."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.paths import grid_walks
from evoexp.paths.grid_walks import LANES, MAX_SLOTS, choice_table, erase_loops, walk, walk_all
from evoexp.paths.grids import UNREACHED, Grid, front, grid

SEEDS = st.integers(0, 2**32)
SHAPES = st.sampled_from([(1, 2), (3, 3), (6, 5), (9, 9), (3, 3, 3)])
POTENTIALS = st.sampled_from([(1.0, 3.0), (1.0, 2.0), (0.5, 1.75), (1.0, 500.0)])


class World:
    """A grid whose last node can be reached from its first one."""

    def __init__(self, shape: tuple[int, ...], share: float, seed: int, potentials: tuple[float, float]) -> None:
        height = np.random.default_rng(seed).random(shape)
        first, last = (0,) * len(shape), tuple(size - 1 for size in shape)
        height[first] = height[last] = 1.0
        while True:
            self.grid: Grid = grid(height < share)
            self.ends = self.grid.index_of(first), self.grid.index_of(last)
            self.steps = front(self.grid, np.array([self.ends[1]]), 1)
            if self.steps[self.ends[0]] != UNREACHED:
                break
            share *= 0.8
        one, two = potentials
        self.potentials = np.array([0.0, *(one + (two - one) * k for k in range(self.grid.num_nodes))])
        self.moves = self.grid.neighbours, self.potentials, self.steps
        self.choices = choice_table(*self.moves)

    def weights(self, node: int) -> dict[int, float]:
        """Where moves lead to, in their order, and what they weigh (Chen & Zalzala 1995, section 2.3)."""
        others = [int(other) for other in self.grid.neighbours[node] if other >= 0]
        potential = {other: float(self.potentials[self.steps[other]]) for other in others}
        return {other: max(potential.values()) - potential[other] + 1.0 for other in others}

    def step(self, node: int, uniform: float) -> int:
        weights = self.weights(node)
        left = uniform * sum(weights.values())
        for other, weight in weights.items():
            left -= weight
            if left < 0.0:
                return other
        return other

    def trails(self, uniforms: np.ndarray, count: int, lanes: int) -> tuple[list[list[int]], int]:
        """Walks by a queue of `lanes` walkers, each of which takes its next step in turn."""
        numbers, done = iter(enumerate(uniforms.tolist(), start=1)), []
        taken, (start, target) = 0, self.ends
        for first in range(0, count, lanes):
            group = [[start] for _ in range(min(lanes, count - first))]
            while any(trail[-1] != target for trail in group):
                for trail in group:
                    if trail[-1] != target:
                        taken, uniform = next(numbers)
                        trail.append(self.step(trail[-1], uniform))
            done += group
        return done, taken


def without_loops(nodes: list[int]) -> list[int]:
    """The obvious way: cut out the first loop that closes, and look again."""
    for k, node in enumerate(nodes):
        if node in nodes[:k]:
            return without_loops(nodes[: nodes.index(node)] + nodes[k:])
    return nodes


def as_path(trail: list[int], erase: bool, longest: int) -> list[int]:
    """A walk as a path: without loops, or without those that it had whenever it became too long."""
    if erase:
        return without_loops(trail)
    path: list[int] = []
    for node in trail:
        path = [*(without_loops(path) if len(path) == longest else path), node]
    return path


def nodes_of(path: np.ndarray) -> list[int]:
    return [int(node) for node in path[1 : path[0] + 1]]


@settings(max_examples=60, deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), POTENTIALS, st.booleans(), st.integers(1, 3 * LANES), SEEDS)
def test_many_walks_are_those_of_walkers_that_take_turns(
    shape: tuple[int, ...], share: float, potentials: tuple[float, float], erase: bool, count: int, seed: int
) -> None:
    world = World(shape, share, seed, potentials)
    uniforms = np.random.default_rng(seed).random(40_000)
    nodes = world.grid.num_nodes
    paths = np.zeros((count, nodes + 1), dtype=np.int32)
    complete, taken = walk_all(uniforms, world.moves, world.choices, world.ends, erase, 0, paths)
    trails, used = world.trails(uniforms, count, LANES)
    assert (complete, taken) == (count, used)
    assert [nodes_of(path) for path in paths] == [as_path(trail, erase, nodes) for trail in trails]


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), POTENTIALS, st.booleans(), SEEDS)
def test_a_single_walk_is_that_of_a_single_walker(
    shape: tuple[int, ...], share: float, potentials: tuple[float, float], erase: bool, seed: int
) -> None:
    world = World(shape, share, seed, potentials)
    uniforms, taken = np.random.default_rng(seed).random(20_000), np.array([7])
    path, place = np.zeros(world.grid.num_nodes + 1, dtype=np.int32), np.zeros(world.grid.num_nodes, dtype=np.int32)
    walk((uniforms, taken), world.moves, world.ends, erase, path, place)
    (trail,), used = world.trails(uniforms[7:], 1, 1)
    assert taken[0] == 7 + used
    assert nodes_of(path) == as_path(trail, erase, world.grid.num_nodes)


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.booleans(), st.lists(st.integers(1, 300), min_size=1, max_size=9), SEEDS)
def test_walks_go_on_with_more_numbers_as_if_they_had_been_there(
    shape: tuple[int, ...], erase: bool, blocks: list[int], seed: int
) -> None:
    world = World(shape, 0.3, seed, (1.0, 3.0))
    uniforms = np.random.default_rng(seed).random(40_000)
    at_once, piecewise = np.zeros((2, 2 * LANES + 1, world.grid.num_nodes + 1), dtype=np.int32)
    arguments: Any = world.moves, world.choices, world.ends, erase
    _, taken = walk_all(uniforms, *arguments, 0, at_once)
    begin, end, complete, k = 0, 0, 0, 0
    while complete < len(piecewise):
        end, k = end + blocks[k % len(blocks)], k + 1
        complete, used = walk_all(uniforms[begin:end], *arguments, complete, piecewise)
        begin += used
    assert begin == taken
    assert np.array_equal(at_once, piecewise)


def test_numbers_that_do_not_suffice_are_said() -> None:
    world = World((9, 9), 0.0, 0, (1.0, 3.0))
    path, place = np.zeros(world.grid.num_nodes + 1, dtype=np.int32), np.zeros(world.grid.num_nodes, dtype=np.int32)
    for taken in (np.array([0]), np.array([5])):
        draws = np.full(5, 0.5), taken
        walk(draws, world.moves, world.ends, True, path, place)
        assert grid_walks.used_up(draws)


def test_a_walk_to_where_it_begins_is_one_node() -> None:
    world = World((4, 4), 0.0, 0, (1.0, 3.0))
    ends = (world.ends[1], world.ends[1])
    paths = np.zeros((3, world.grid.num_nodes + 1), dtype=np.int32)
    assert walk_all(np.empty(0), world.moves, world.choices, ends, True, 0, paths) == (3, 0)
    assert [nodes_of(path) for path in paths] == [[ends[0]]] * 3


@settings(deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), POTENTIALS, SEEDS)
def test_a_table_has_every_move_as_often_as_it_weighs(
    shape: tuple[int, ...], share: float, potentials: tuple[float, float], seed: int
) -> None:
    world = World(shape, share, seed, potentials)
    totals, slots = world.choices
    weights = [world.weights(node) for node in range(world.grid.num_nodes)]
    assert totals.tolist() == pytest.approx([sum(row.values()) for row in weights])
    whole = all(weight.is_integer() for row in weights for weight in row.values())
    assert (len(slots) > 0) == (whole and totals.max() <= MAX_SLOTS)
    for row, total, expected in zip(slots, totals, weights, strict=False):
        found = row[: int(total)].tolist()
        assert found == [other for other, weight in expected.items() for _ in range(int(weight))]


@given(st.lists(st.integers(0, 9), min_size=1, max_size=40), st.booleans())
def test_loops_are_erased_in_the_order_in_which_they_close(nodes: list[int], in_place: bool) -> None:
    trail = np.array([len(nodes), *nodes], dtype=np.int32)
    path = trail if in_place else np.zeros(len(nodes) + 1, dtype=np.int32)
    erase_loops(trail, len(nodes), path, np.full(10, 99, dtype=np.int32))
    assert nodes_of(path) == without_loops(nodes)
