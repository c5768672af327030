"""Walkers against walkers written plainly, who take the same random words in the same order."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.paths.grid_choices import choice_table
from evoexp.paths.walkers import LANES, WORDS, Walkers
from matrix import num_cases
from paths.walked_worlds import SEEDS, SHAPES, World, as_path, nodes_of


def random_words(seed: int, count: int) -> np.ndarray:
    return np.asarray(np.random.PCG64(seed).random_raw(count))


def table(world: World, count: int) -> np.ndarray:
    return np.zeros((count, world.grid.num_nodes + 1), dtype=np.int32)


def plain_trails(world: World, words: np.ndarray, count: int) -> tuple[list[list[int]], int]:
    """Every walker takes half a word in turn.

    Whoever arrives begins the next walk, and goes on if there is none.
    """
    halves = iter(half / 2**32 for word in words.tolist() for half in (word % 2**32, word // 2**32))
    trails: list[list[int]] = [[world.ends[0]] for _ in range(max(count, LANES))]
    own, begun, taken = list(range(LANES)), LANES, 0
    while any(trail[-1] != world.ends[1] for trail in trails[:count]) or begun < count:
        taken += WORDS
        for k in range(LANES):
            trails[own[k]].append(world.step(trails[own[k]][-1], next(halves)))
        for k in range(LANES):
            if trails[own[k]][-1] == world.ends[1]:
                own[k], begun = begun, begun + 1
                if own[k] >= len(trails):
                    trails.append([])
                trails[own[k]] = [world.ends[0]]
    return trails[:count], taken


@settings(max_examples=num_cases(10, 60), deadline=None)
@given(
    SHAPES,
    st.floats(0.0, 0.5),
    st.sampled_from([1.0, 2.0]),
    st.booleans(),
    st.integers(1, 3 * LANES),
    SEEDS,
)
def test_many_walks_are_those_of_walkers_that_take_turns(
    shape: tuple[int, ...], share: float, step: float, erase: bool, count: int, seed: int
) -> None:
    world = World(shape, share, seed, (1.0, 1.0 + step))
    words, paths = random_words(seed, 40_000), table(world, count)
    walkers = Walkers(choice_table(world.moves), world.ends, erase, paths)
    taken = walkers.go(words)
    trails, expected = plain_trails(world, words, count)
    assert (walkers.complete, taken) == (count, expected)
    assert [nodes_of(path) for path in paths] == [
        as_path(trail, erase, world.grid.num_nodes) for trail in trails
    ]


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.booleans(), st.lists(st.integers(1, 150), min_size=1, max_size=9), SEEDS)
def test_walks_go_on_with_more_words_as_if_they_had_been_there(
    shape: tuple[int, ...], erase: bool, blocks: list[int], seed: int
) -> None:
    world = World(shape, 0.3, seed, (1.0, 3.0))
    words, choices = random_words(seed, 40_000), choice_table(world.moves)
    at_once, piecewise = table(world, 2 * LANES + 1), table(world, 2 * LANES + 1)
    taken = Walkers(choices, world.ends, erase, at_once).go(words)
    walkers = Walkers(choices, world.ends, erase, piecewise)
    begin, end, k = 0, 0, 0
    while walkers.complete < len(piecewise):
        end, k = end + blocks[k % len(blocks)], k + 1
        begin += walkers.go(words[begin:end])
    assert begin == taken
    assert np.array_equal(at_once, piecewise)


def test_a_walk_to_where_it_begins_is_one_node() -> None:
    world = World((4, 4), 0.0, 0, (1.0, 3.0))
    paths = table(world, 3)
    walkers = Walkers(choice_table(world.moves), (world.ends[1], world.ends[1]), True, paths)
    assert (walkers.complete, walkers.go(random_words(0, 8))) == (3, 0)
    assert [nodes_of(path) for path in paths] == [[world.ends[1]]] * 3
