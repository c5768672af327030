"""Tables of choices against the weights of moves, node by node."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.paths.grid_choices import MOST_SLOTS, TOTAL_BITS, Choices, choices_of
from evoexp.paths.grids import UNREACHED, front
from paths.walked_worlds import POTENTIALS, SEEDS, SHAPES, World


def tabled(choices: Choices, target: int, node: int) -> list[int]:
    """Return the nodes that the choices at a node lead to."""
    entry = int(choices.entries[target, node])
    first, total = entry >> TOTAL_BITS, entry % 2**TOTAL_BITS
    return [node + int(shift) for shift in choices.slots[first : first + total]]


@settings(deadline=None)
@given(SHAPES, st.floats(0.0, 0.5), POTENTIALS, SEEDS)
def test_every_move_has_as_many_slots_as_it_weighs(
    shape: tuple[int, ...], share: float, potentials: tuple[float, float], seed: int
) -> None:
    world = World(shape, share, seed, potentials)
    nodes = world.grid.num_nodes
    choices = choices_of(world.grid.neighbours, world.potentials, world.steps[None], nodes)
    weights = [world.weights(node) for node in range(nodes)]
    sums = [sum(row.values()) for row in weights]
    whole = all(weight.is_integer() for row in weights for weight in row.values())
    if not whole or max(sums) > MOST_SLOTS:
        assert choices.entries.shape == (0, nodes)
        return
    for node, expected in enumerate(weights):
        assert tabled(choices, 0, node) == [
            other for other, weight in expected.items() for _ in range(int(weight))
        ]


def test_tables_of_several_targets_are_those_of_each_target_alone() -> None:
    world = World((7, 6), 0.3, 3, (1.0, 3.0))
    nodes = world.grid.num_nodes
    free = np.flatnonzero((world.grid.neighbours >= 0).any(axis=1))
    fronts = np.stack([front(world.grid, np.array([node]), 1) for node in free])
    fronts[fronts == UNREACHED] = 0
    together = choices_of(world.grid.neighbours, world.potentials, fronts, 500)
    assert together.entries.shape == (len(free), nodes)
    num_choices = int((together.entries % 2**TOTAL_BITS).sum())
    assert len(together.slots) < 0.5 * num_choices  # alike nodes share their slots
    for target, steps in enumerate(fronts):
        alone = choices_of(world.grid.neighbours, world.potentials, steps[None], nodes)
        for node in range(nodes):
            assert tabled(together, target, node) == tabled(alone, 0, node)


@pytest.mark.parametrize("most", [0, 1, 5])
def test_more_patterns_than_there_is_memory_for_give_no_table(most: int) -> None:
    world = World((6, 6), 0.3, 3, (1.0, 3.0))
    own = world.grid.neighbours, world.potentials, world.steps[None]
    assert len(choices_of(*own, most).entries) == 0
    assert len(choices_of(*own, world.grid.num_nodes).entries) == 1
