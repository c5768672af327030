"""Grids: the moves they permit, against the rule spelled out.

Fronts, against a search written plainly.
"""

import itertools
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.paths.grids import UNREACHED, front, grid

Node = tuple[int, ...]


def maps(shape: tuple[int, ...], share: float, seed: int) -> np.ndarray:
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


SHAPES = st.sampled_from([(1, 1), (1, 5), (2, 2), (4, 6), (7, 3), (2, 3, 4), (3, 3, 3)])


@given(SHAPES, st.floats(0.0, 0.7), st.integers(0, 2**32))
def test_moves_are_those_of_the_rule(shape: tuple[int, ...], share: float, seed: int) -> None:
    blocked = maps(shape, share, seed)
    own = grid(blocked)
    for node in itertools.product(*map(range, shape)):
        targets = {
            other
            for move in itertools.product((-1, 0, 1), repeat=len(shape))
            if any(move)
            and free(blocked, other := tuple(a + b for a, b in zip(node, move, strict=True)))
            if free(blocked, node) and joined_laterally(blocked, node, other)
        }
        index = own.index_of(node)
        found = [int(k) for k in own.neighbours[index] if k >= 0]
        assert {tuple(own.coordinates[k].tolist()) for k in found} == targets
        for k in found:
            assert (
                own.kinds[abs(k - index)]
                == np.abs(own.coordinates[k] - own.coordinates[index]).sum()
            )


def test_a_diagonal_move_is_forbidden_between_two_blocked_nodes_only() -> None:
    own = grid(np.array([[False, True], [True, False]]))
    assert (own.neighbours == -1).all()
    one_corner = grid(np.array([[False, True], [False, False]]))
    assert one_corner.index_of((1, 1)) in one_corner.neighbours[one_corner.index_of((0, 0))]


def test_there_are_2m_lateral_moves_first() -> None:
    for shape, lateral, everything in (((3, 3), 4, 8), ((3, 3, 3), 6, 26)):
        own = grid(np.zeros(shape, dtype=bool))
        assert own.moves_within(1) == lateral
        assert own.moves_within(len(shape)) == everything == len(own.changes)


@given(SHAPES, st.floats(0.0, 0.6), st.integers(1, 2), st.integers(0, 2**32))
def test_a_front_counts_steps(
    shape: tuple[int, ...], share: float, neighbourhood: int, seed: int
) -> None:
    blocked = maps(shape, share, seed)
    own, source = grid(blocked), (0,) * len(shape)
    blocked[source] = False
    own = grid(blocked)
    steps, queue = {own.index_of(source): 0}, deque([own.index_of(source)])
    while queue:
        node = queue.popleft()
        for other in own.neighbours[node][own.changes <= neighbourhood]:
            if other >= 0 and int(other) not in steps:
                steps[int(other)] = steps[node] + 1
                queue.append(int(other))
    found = front(own, np.array([own.index_of(source)]), neighbourhood)
    assert {k: int(v) for k, v in enumerate(found) if v != UNREACHED} == steps


def test_a_grid_has_two_or_three_dimensions() -> None:
    with pytest.raises(ValueError, match="two or three"):
        grid(np.zeros(4, dtype=bool))
