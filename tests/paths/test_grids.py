"""Grids beside the rule spelled out, fronts and walks beside plain ones."""

import itertools
from collections import deque
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.numeric.random_stream import Block, used_up
from evoexp.paths import grids
from matrix import num_cases
from references.chen_python import without_loops

Node = tuple[int, ...]
SHAPES = st.sampled_from([(1, 1), (1, 5), (2, 2), (4, 6), (7, 3), (2, 3, 4), (3, 3, 3)])


def maps(shape: Node, share: float, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random(shape) < share


def free(blocked: np.ndarray, node: Node) -> bool:
    inside = all(0 <= a < n for a, n in zip(node, blocked.shape, strict=True))
    return inside and not blocked[node]


def joined_laterally(blocked: np.ndarray, one: Node, two: Node) -> bool:
    """Whether lateral moves, each toward the other node, lead from one to it over free nodes."""
    if one == two:
        return True
    steps = [k for k in range(len(one)) if one[k] != two[k]]
    nearer = [tuple(two[k] if k == step else one[k] for k in range(len(one))) for step in steps]
    return any(free(blocked, node) and joined_laterally(blocked, node, two) for node in nearer)


@given(SHAPES, st.floats(0.0, 0.7), st.integers(0, 2**32))
def test_moves_are_those_of_the_rule(shape: Node, share: float, seed: int) -> None:
    blocked = maps(shape, share, seed)
    own = grids.grid(blocked)
    for node in itertools.product(*map(range, shape)):
        around = itertools.product(*(range(a - 1, a + 2) for a in node))
        targets = {
            other
            for other in around
            if other != node and free(blocked, other) and free(blocked, node)
            if joined_laterally(blocked, node, other)
        }
        index = own.index_of(node)
        found = [int(k) for k in own.neighbours[index] if k >= 0]
        assert {tuple(own.coordinates[k].tolist()) for k in found} == targets
        for k in found:
            away = np.abs(own.coordinates[k] - own.coordinates[index]).sum()
            assert own.kinds[abs(k - index)] == away


def test_there_are_2m_lateral_moves_first() -> None:
    for shape, lateral, everything in (((3, 3), 4, 8), ((3, 3, 3), 6, 26)):
        own = grids.grid(np.zeros(shape, dtype=bool))
        assert own.moves_within(1) == lateral
        assert own.moves_within(len(shape)) == everything == len(own.changes)


@given(SHAPES, st.floats(0.0, 0.6), st.integers(1, 2), st.integers(0, 2**32))
def test_a_front_counts_steps(shape: Node, share: float, neighbourhood: int, seed: int) -> None:
    blocked = maps(shape, share, seed)
    blocked.flat[0] = False
    own = grids.grid(blocked)
    source = own.index_of((0,) * len(shape))
    steps, queue = {source: 0}, deque([source])
    while queue:
        node = queue.popleft()
        for other in own.neighbours[node][own.changes <= neighbourhood].tolist():
            if other >= 0 and other not in steps:
                steps[other] = steps[node] + 1
                queue.append(other)
    found = grids.front(own, np.array([source]), neighbourhood)
    assert {k: int(v) for k, v in enumerate(found) if v != grids.UNREACHED} == steps


SEEDS = st.integers(0, 2**32)
FLOORS = st.sampled_from([(1, 2), (3, 3), (6, 5), (9, 9), (3, 3, 3)])
SHARES = st.floats(0.0, 0.5)


class World:
    """A grid whose last node can be reached from its first one, with moves toward it."""

    def __init__(self, shape: tuple[int, ...], share: float, seed: int, step: float) -> None:
        height = np.random.default_rng(seed).random(shape)
        height.flat[[0, -1]] = 1.0
        first, last = (0,) * len(shape), tuple(size - 1 for size in shape)
        while True:
            self.grid = grids.grid(height < share)
            self.ends = self.grid.index_of(first), self.grid.index_of(last)
            steps = grids.front(self.grid, np.array([self.ends[1]]), 1)
            if steps[self.ends[0]] != grids.UNREACHED:
                break
            share *= 0.8
        nodes = range(self.grid.num_nodes)
        self.potentials = np.array([0.0, *(1.0 + step * k for k in nodes)])
        self.moves = grids.Moves(self.grid.neighbours, self.potentials, steps)
        self.sums = grids.weigh_all(self.moves).astype(np.uint16)

    def step(self, node: int, uniform: float) -> int:
        """Draw a move by its weight (Chen & Zalzala 1995, section 2.3)."""
        others = [int(other) for other in self.grid.neighbours[node] if other >= 0]
        potentials = [float(self.potentials[self.moves.steps[other]]) for other in others]
        weights = [max(potentials) - potential + 1.0 for potential in potentials]
        left = uniform * sum(weights)
        for other, weight in zip(others, weights, strict=True):
            left -= weight
            if left < 0.0:
                return other
        return others[-1]

    def rows(self, count: int) -> np.ndarray:
        return np.zeros((count, self.grid.num_nodes + 1), dtype=np.int32)

    def as_path(self, trail: list[int], erase: bool) -> list[int]:
        """A walk without loops, or without those that it had whenever it became too long."""
        if erase:
            return without_loops(trail)
        path: list[int] = []
        for node in trail:
            path = [*(without_loops(path) if len(path) == self.grid.num_nodes else path), node]
        return path


def random_words(seed: int) -> np.ndarray:
    return np.asarray(np.random.PCG64(seed).random_raw(40_000))


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.integers(2, 7)] * 2), SHARES, st.integers(1, 3), st.booleans(), SEEDS)
def test_a_table_of_weights_leads_to_the_same_nodes(
    shape: tuple[int, ...], share: float, step: int, erase: bool, seed: int
) -> None:
    world, rng = World(shape, share, seed, step), np.random.default_rng(seed)
    # numbers at the ends of the interval, at parts of a total and close below them, too
    parts = [k / total for total in range(2, 60) for k in range(total)]
    below = np.nextafter(parts[1:], 0.0)
    special = [0.0, 1.0 - 2.0**-53, *parts, *below, *np.nextafter(below, 0.0)]
    uniforms = np.where(rng.random(5000) < 0.5, rng.choice(special, 5000), rng.random(5000))
    walks = []
    for sums in (world.sums[None], world.sums[None][:0]):
        (path, place), draws = world.rows(2), Block(uniforms, np.array([3]))
        grids.walk(draws, world.moves, sums, world.ends, erase, path, place)
        walks.append((draws.taken[0], path[: path[0] + 1].tolist()))
    assert walks[0] == walks[1]


def test_numbers_that_do_not_suffice_are_said() -> None:
    world = World((9, 9), 0.0, 0, 2.0)
    for taken in (0, 5):
        (path, place), draws = world.rows(2), Block(np.full(5, 0.5), np.array([taken]))
        grids.walk(draws, world.moves, world.sums[None][:0], world.ends, True, path, place)
        assert used_up(draws)


def plain_trails(world: World, words: np.ndarray, count: int) -> tuple[list[list[int]], int]:
    """Every walker takes half a word in turn; whoever arrives begins the next walk, if any."""
    halves = iter(half / 2**32 for word in words.tolist() for half in (word % 2**32, word // 2**32))
    trails: list[list[int]] = [[world.ends[0]] for _ in range(max(count, grids.LANES))]
    own, begun, taken = list(range(grids.LANES)), grids.LANES, 0
    while any(trail[-1] != world.ends[1] for trail in trails[:count]) or begun < count:
        taken += grids.WORDS
        for k in range(grids.LANES):
            trails[own[k]].append(world.step(trails[own[k]][-1], next(halves)))
        for k in range(grids.LANES):
            if trails[own[k]][-1] == world.ends[1]:
                own[k], begun = begun, begun + 1
                if own[k] >= len(trails):
                    trails.append([])
                trails[own[k]] = [world.ends[0]]
    return trails[:count], taken


@settings(max_examples=num_cases(10, 60), deadline=None)
@given(
    FLOORS, SHARES, st.sampled_from([1, 2]), st.booleans(), st.integers(1, 3 * grids.LANES), SEEDS
)
def test_many_walks_are_those_of_walkers_that_take_turns(
    shape: tuple[int, ...], share: float, step: int, erase: bool, count: int, seed: int
) -> None:
    world, words = World(shape, share, seed, step), random_words(seed)
    paths = world.rows(count)
    own = world.grid.neighbours, world.sums, world.ends, erase
    taken = grids.walk_all(words, grids.WORDS, grids.WORDS, *own, paths)
    trails, expected = plain_trails(world, words, count)
    assert taken == expected
    for path, trail in zip(paths.tolist(), trails, strict=True):
        assert path[1 : path[0] + 1] == world.as_path(trail, erase)


@settings(max_examples=40, deadline=None)
@given(FLOORS, st.booleans(), st.integers(1, 40), st.integers(1, 40), SEEDS)
def test_words_are_drawn_in_whole_portions_as_far_as_there_are_as_many(
    shape: tuple[int, ...], erase: bool, first: int, more: int, seed: int
) -> None:
    world, words = World(shape, 0.3, seed, 2.0), random_words(seed)
    own: Any = world.grid.neighbours, world.sums, world.ends, erase
    one_by_one, portioned = world.rows(2 * grids.LANES + 1), world.rows(2 * grids.LANES + 1)
    taken = grids.walk_all(words, grids.WORDS, grids.WORDS, *own, one_by_one)
    counts = grids.WORDS * first, grids.WORDS * more
    drawn = grids.walk_all(words, *counts, *own, portioned)
    assert np.array_equal(one_by_one, portioned)
    assert drawn == counts[0] + counts[1] * max(0, -(-(taken - counts[0]) // counts[1]))
    assert grids.walk_all(words[: drawn - 1], *counts, *own, portioned) == -1
