"""Random walks over grids against walks written plainly.

Which take the same numbers in the same order.
"""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.numeric.random_stream import Block, used_up
from evoexp.paths.grid_walks import erase_loops, measure_path, walk, weigh_all
from paths.walked_worlds import POTENTIALS, SEEDS, SHAPES, World, as_path, nodes_of, without_loops


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), POTENTIALS, st.booleans(), SEEDS)
def test_a_single_walk_is_that_of_a_single_walker(
    shape: tuple[int, ...], share: float, potentials: tuple[float, float], erase: bool, seed: int
) -> None:
    world = World(shape, share, seed, potentials)
    uniforms, taken = np.random.default_rng(seed).random(20_000), np.array([7])
    path, place = (
        np.zeros(world.grid.num_nodes + 1, dtype=np.int32),
        np.zeros(world.grid.num_nodes, dtype=np.int32),
    )
    walk(Block(uniforms, taken), world.moves, world.sums[None][:0], world.ends, erase, path, place)
    trail = world.trail(iter(uniforms[7:].tolist()))
    assert taken[0] == 7 + len(trail) - 1
    assert nodes_of(path) == as_path(trail, erase, world.grid.num_nodes)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.integers(2, 7)] * 2),
    st.floats(0.0, 0.5),
    st.tuples(st.integers(1, 3), st.integers(1, 3)),
    st.booleans(),
    SEEDS,
)
def test_a_table_of_weights_leads_to_the_same_nodes(
    shape: tuple[int, ...], share: float, steps: tuple[int, int], erase: bool, seed: int
) -> None:
    world, rng = World(shape, share, seed, (steps[0], sum(steps))), np.random.default_rng(seed)
    nodes = world.grid.num_nodes
    # numbers at the ends of the interval, at parts of a total and close below them, too
    parts = [k / total for total in range(2, 60) for k in range(total)]
    below = np.nextafter(parts[1:], 0.0)
    special = [0.0, 1.0 - 2.0**-53, *parts, *below, *np.nextafter(below, 0.0)]
    uniforms = np.where(rng.random(5000) < 0.5, rng.choice(special, 5000), rng.random(5000))
    walks = []
    for sums in (world.sums[None], world.sums[None][:0]):
        path, place = np.zeros(nodes + 1, dtype=np.int32), np.zeros(nodes, dtype=np.int32)
        draws = Block(uniforms, np.array([3]))
        walk(draws, world.moves, sums, world.ends, erase, path, place)
        walks.append((draws.taken[0], path[: path[0] + 1].tolist()))
    assert walks[0] == walks[1]


@settings(deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), POTENTIALS, SEEDS)
def test_sums_rise_by_what_permitted_moves_weigh(
    shape: tuple[int, ...], share: float, potentials: tuple[float, float], seed: int
) -> None:
    world = World(shape, share, seed, potentials)
    for node, sums in enumerate(weigh_all(world.moves)):
        weights, expected = world.weights(node), np.zeros(len(sums))
        for move, other in enumerate(world.grid.neighbours[node]):
            expected[move] = weights.get(int(other), 0.0)
        np.testing.assert_array_equal(sums, np.cumsum(expected))


def test_numbers_that_do_not_suffice_are_said() -> None:
    world = World((9, 9), 0.0, 0, (1.0, 3.0))
    path, place = (
        np.zeros(world.grid.num_nodes + 1, dtype=np.int32),
        np.zeros(world.grid.num_nodes, dtype=np.int32),
    )
    for taken in (np.array([0]), np.array([5])):
        draws = Block(np.full(5, 0.5), taken)
        walk(draws, world.moves, world.sums[None][:0], world.ends, True, path, place)
        assert used_up(draws)


@given(st.lists(st.integers(0, 9), min_size=1, max_size=40), st.booleans())
def test_loops_are_erased_in_the_order_in_which_they_close(
    nodes: list[int], in_place: bool
) -> None:
    trail = np.array([len(nodes), *nodes], dtype=np.int32)
    path = trail if in_place else np.zeros(len(nodes) + 1, dtype=np.int32)
    erase_loops(trail, len(nodes), path, np.full(10, 99, dtype=np.int32))
    assert nodes_of(path) == without_loops(nodes)


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), SEEDS)
def test_a_path_is_as_long_and_unsafe_as_its_moves_and_nodes(
    shape: tuple[int, ...], share: float, seed: int
) -> None:
    world, rng = World(shape, share, seed, (1.0, 3.0)), np.random.default_rng(seed)
    unsafeness = 10.0 * rng.random(world.grid.num_nodes)
    trail = world.trail(iter(rng.random(20_000).tolist()))
    steps = np.diff(world.grid.coordinates[trail].astype(np.float64), axis=0)
    path = np.array([len(trail), *trail], dtype=np.int32)
    distance, mean = measure_path(path, world.grid.kinds, unsafeness)
    np.testing.assert_allclose(distance, np.sqrt((steps**2).sum(axis=1)).sum(), rtol=1e-12)
    np.testing.assert_allclose(mean, unsafeness[trail].mean(), rtol=1e-12)
