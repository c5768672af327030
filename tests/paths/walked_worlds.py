"""Grids to walk over, and walks over them written plainly."""

from collections.abc import Iterator

import numpy as np
from hypothesis import strategies as st

from evoexp.paths.grid_walks import weigh_all
from evoexp.paths.grids import UNREACHED, Grid, Moves, front, grid

SEEDS = st.integers(0, 2**32)
SHAPES = st.sampled_from([(1, 2), (3, 3), (6, 5), (9, 9), (3, 3, 3)])
POTENTIALS = st.sampled_from([(1.0, 3.0), (1.0, 2.0), (0.5, 1.75), (1.0, 500.0)])


class World:
    """A grid whose last node can be reached from its first one."""

    def __init__(
        self, shape: tuple[int, ...], share: float, seed: int, potentials: tuple[float, float]
    ) -> None:
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
        self.potentials = np.array(
            [0.0, *(one + (two - one) * k for k in range(self.grid.num_nodes))]
        )
        self.moves = Moves(self.grid.neighbours, self.potentials, self.steps)
        self.sums = weigh_all(self.moves).astype(np.uint16)

    def weights(self, node: int) -> dict[int, float]:
        """Where moves lead to, in their order, and what they weigh.

        Chen & Zalzala 1995, section 2.3.
        """
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

    def trail(self, numbers: Iterator[float]) -> list[int]:
        """One walk, which takes a number per step."""
        trail = [self.ends[0]]
        while trail[-1] != self.ends[1]:
            trail.append(self.step(trail[-1], next(numbers)))
        return trail


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
