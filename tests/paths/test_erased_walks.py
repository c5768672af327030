"""Walks drawn, walked and measured at once, against walkers and measures that are given words."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.numeric.pcg64 import Twin
from evoexp.paths.erased_walks import Sums, follow_all, room_for_exits, walk_all
from evoexp.paths.grid_measures import Tolls, length_and_mean, measure_path
from evoexp.paths.walkers import WORDS, Walkers, choice_table
from matrix import num_cases
from paths.walked_worlds import SEEDS, SHAPES, World


@settings(max_examples=num_cases(10, 60), deadline=None)
@given(
    SHAPES,
    st.floats(0.0, 0.5),
    st.integers(1, 13),
    st.tuples(st.integers(1, 300), st.integers(1, 40)),
    SEEDS,
)
def test_paths_sums_and_the_generator_are_those_of_walkers_and_words_in_blocks(
    shape: tuple[int, ...], share: float, count: int, blocks: tuple[int, int], seed: int
) -> None:
    world, blocks = World(shape, share, seed, (1.0, 2.0)), (WORDS * blocks[0], WORDS * blocks[1])
    choices, nodes = choice_table(world.moves), world.grid.num_nodes
    unsafeness = np.random.default_rng(seed).integers(0, 99, nodes).astype(np.float64)
    # words are drawn in blocks, the rest of the last one is lost
    numpys = np.random.PCG64(seed)
    expected = np.zeros((count, nodes + 1), dtype=np.int32)
    walkers, block = Walkers(choices, world.ends, True, expected), blocks[0]
    while walkers.complete < count:
        walkers.go(np.asarray(numpys.random_raw(block)))
        block = blocks[1]
    # the same at once, in memory that was used before
    own = np.random.Generator(np.random.PCG64(seed))
    twin, exits = Twin(own), room_for_exits(count, nodes)
    exits[:] = 7
    paths, sums = np.full((count, nodes + 1), 7, dtype=np.int32), Sums(*np.empty((2, count), int))
    walk_all(twin.words, choices, world.ends, blocks, count, exits)
    tolls = Tolls.of(world.grid.kinds, unsafeness)
    longest = follow_all(exits, world.ends, tolls, paths, sums)
    twin.follow(twin.words)
    assert own.bit_generator.state == numpys.state
    assert longest == expected[:, 0].max()
    for k, path in enumerate(expected):
        np.testing.assert_array_equal(paths[k, : path[0] + 1], path[: path[0] + 1])
        assert not paths[k, path[0] + 1 : longest + 1].any()
        measured = measure_path(path, world.grid.kinds, unsafeness)
        assert length_and_mean(int(path[0]), *(int(sum_[k]) for sum_ in sums)) == measured


def test_too_many_nodes_for_exits_are_refused() -> None:
    with pytest.raises(ValueError, match="at most 65536, were 65537"):
        room_for_exits(1, 2**16 + 1)
