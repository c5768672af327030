"""Paths measured by whole numbers, against sums node by node."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.numeric.compilation import kernel
from evoexp.paths.grid_measures import Tolls, measure_by_tolls, measure_path
from paths.walked_worlds import SEEDS, SHAPES, World


@settings(max_examples=40, deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), SEEDS)
def test_tolls_measure_paths_to_the_same_bits(
    shape: tuple[int, ...], share: float, seed: int
) -> None:
    world, rng = World(shape, share, seed, (1.0, 3.0)), np.random.default_rng(seed)
    unsafeness = rng.integers(0, 11, world.grid.num_nodes).astype(np.float64)
    trail = world.trail(iter(rng.random(20_000).tolist()))
    path = np.array([len(trail), *trail], dtype=np.int32)
    tolls = Tolls.of(world.grid.kinds, unsafeness)
    assert _by_tolls(path, tolls) == measure_path(path, world.grid.kinds, unsafeness)


@kernel
def _by_tolls(path: np.ndarray, tolls: Tolls) -> tuple[float, float]:
    return measure_by_tolls(path, tolls)


def test_what_is_no_whole_number_has_no_tolls() -> None:
    kinds = World((3, 3), 0.0, 0, (1.0, 3.0)).grid.kinds
    for unsafeness in ([1.0, 2.5], [1.0, -1.0], [0.0, 2.0**40], [1.0, np.nan]):
        assert len(Tolls.of(kinds, np.array(unsafeness)).of_node) == 0
    assert Tolls.of(kinds, np.array([3.0, 0.0])).of_node.tolist() == [3, 0]
