"""Local search on paths over a grid: pieces of a few nodes are exchanged while the cost falls.

A piece is a run of nodes between two nodes that a path keeps; it may be empty. An exchange replaces
a piece by another one that permitted moves join to both kept nodes and whose nodes the path does
not pass elsewhere. So insertion and removal are exchanges, too, and every result is a valid path
without loops.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from evoexp.records import IntArray
from evoexp.references.grid_networks import Network

SMALLEST_GAIN = 1e-10  # of a cost: less may be rounding


class Exchanges:
    """Exchanges of pieces of at most so many nodes, judged by ε D + λ ΣS / N."""

    def __init__(self, network: Network, weights: tuple[float, float], longest: int) -> None:
        """Take the moves, ε and λ, and the number of nodes."""
        self._longest = longest
        self._unsafeness: list[float] = (weights[1] * network.unsafeness).tolist()
        # of each node: where moves lead, and ε times their lengths
        self._moves: list[dict[int, float]] = [{} for _ in self._unsafeness]
        lengths = (weights[0] * network.lengths).tolist()
        for tail, head, length in zip(
            network.tails.tolist(), network.heads.tolist(), lengths, strict=True
        ):
            self._moves[tail][head] = length

    def descend(self, path: IntArray) -> IntArray:
        """Make the best exchange until none lowers the cost."""
        nodes = path.tolist()
        while (better := self._best_exchange(nodes)) is not None:
            nodes = better
        return np.array(nodes)

    def _best_exchange(self, path: list[int]) -> list[int] | None:
        """Return a path after the exchange that lowers its cost most, if one does."""
        length, unsafe = self._measured(path)
        lowest, best = (length + unsafe / len(path)) * (1.0 - SMALLEST_GAIN), None
        for removed in range(self._longest + 1):
            for first in range(1, len(path) - removed):
                # the path without the piece and the moves to it
                head, tail = path[:first], path[first + removed :]
                old_length, _ = self._measured(path[first - 1 : first + removed + 1])
                rest_length = length - old_length
                rest_unsafe = unsafe - sum(
                    self._unsafeness[node] for node in path[first:][:removed]
                )
                # with every other piece
                for piece in self._pieces([head[-1]], tail[0], {*head, *tail}):
                    added = sum(self._unsafeness[node] for node in piece)
                    new_length, _ = self._measured([head[-1], *piece, tail[0]])
                    count = len(path) - removed + len(piece)
                    cost = rest_length + new_length + (rest_unsafe + added) / count
                    if cost < lowest:
                        lowest, best = cost, [*head, *piece, *tail]
        return best

    def _pieces(self, trail: list[int], tail: int, used: set[int]) -> Iterator[list[int]]:
        """Yield the pieces behind a kept node and the nodes of a trail, up to another kept node."""
        if tail in self._moves[trail[-1]]:
            yield trail[1:]
        if len(trail) <= self._longest:
            for node in self._moves[trail[-1]]:
                if node not in used and node not in trail:
                    yield from self._pieces([*trail, node], tail, used)

    def _measured(self, path: list[int]) -> tuple[float, float]:
        """Return ε D and λ ΣS of a path."""
        length = sum(self._moves[one][two] for one, two in pairwise(path))
        return length, sum(self._unsafeness[node] for node in path)
