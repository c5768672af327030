"""Walkers against walkers written plainly, who take the same random words in the same order."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.paths.grid_walks import LANES, WORDS, walk_all
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
    own = world.grid.neighbours, world.sums, world.ends, erase
    taken = walk_all(words, WORDS, WORDS, *own, paths)
    trails, expected = plain_trails(world, words, count)
    assert taken == expected
    assert [nodes_of(path) for path in paths] == [
        as_path(trail, erase, world.grid.num_nodes) for trail in trails
    ]


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.booleans(), st.integers(1, 40), st.integers(1, 40), SEEDS)
def test_words_are_drawn_in_whole_portions_as_far_as_there_are_as_many(
    shape: tuple[int, ...], erase: bool, first: int, more: int, seed: int
) -> None:
    world = World(shape, 0.3, seed, (1.0, 3.0))
    words = random_words(seed, 40_000)
    own = world.grid.neighbours, world.sums, world.ends, erase
    one_by_one, portioned = table(world, 2 * LANES + 1), table(world, 2 * LANES + 1)
    taken = walk_all(words, WORDS, WORDS, *own, one_by_one)
    counts = WORDS * first, WORDS * more
    drawn = walk_all(words, *counts, *own, portioned)
    assert np.array_equal(one_by_one, portioned)
    assert drawn == counts[0] + counts[1] * max(0, -(-(taken - counts[0]) // counts[1]))
    assert walk_all(words[: drawn - 1], *counts, *own, portioned) == -1
