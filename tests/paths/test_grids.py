"""Grids: the moves they permit, against the rule spelled out; fronts, against a plain search."""

import itertools
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.paths.grids import UNREACHED, front, grid

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
    own = grid(blocked)
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
        own = grid(np.zeros(shape, dtype=bool))
        assert own.moves_within(1) == lateral
        assert own.moves_within(len(shape)) == everything == len(own.changes)


@given(SHAPES, st.floats(0.0, 0.6), st.integers(1, 2), st.integers(0, 2**32))
def test_a_front_counts_steps(shape: Node, share: float, neighbourhood: int, seed: int) -> None:
    blocked = maps(shape, share, seed)
    blocked.flat[0] = False
    own = grid(blocked)
    source = own.index_of((0,) * len(shape))
    steps, queue = {source: 0}, deque([source])
    while queue:
        node = queue.popleft()
        for other in own.neighbours[node][own.changes <= neighbourhood].tolist():
            if other >= 0 and other not in steps:
                steps[other] = steps[node] + 1
                queue.append(other)
    found = front(own, np.array([source]), neighbourhood)
    assert {k: int(v) for k, v in enumerate(found) if v != UNREACHED} == steps


def test_a_grid_has_two_or_three_dimensions() -> None:
    with pytest.raises(ValueError, match="two or three"):
        grid(np.zeros(4, dtype=bool))
