"""Routes: paths over a map that pass the same sides of all obstacles."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray

Signature = tuple[int, ...]


class Route(NamedTuple):
    """Paths of one signature: as far as it tells, none passes over an obstacle if bent to another.

    Attributes:
        name: A, B, …; A is the most frequent route of all.
        members: Keys of the paths.
    """

    name: str
    members: tuple[Any, ...]


def signature(path: FloatArray, centres: FloatArray) -> Signature:
    """Return how often a path passes above each obstacle, rightward minus leftward.

    Two paths with the same ends that pass the same sides of all obstacles have the same signature.

    Args:
        path: (nodes, 2).
        centres: (obstacles, 2) a point inside each obstacle, whose x is that of no node.
    """
    before, after = path[:-1, None, :], path[1:, None, :]
    crosses = (before[..., 0] < centres[:, 0]) != (after[..., 0] < centres[:, 0])
    run = np.where(crosses, after[..., 0] - before[..., 0], 1.0)
    share = (centres[:, 0] - before[..., 0]) / run
    above = crosses & (before[..., 1] + share * (after[..., 1] - before[..., 1]) > centres[:, 1])
    return tuple(int(value) for value in (above * np.sign(run)).sum(axis=0))


def inside_points(boxes: Sequence[Sequence[int]]) -> FloatArray:
    """Return a point inside each box (x0, y0, x1, y1) of nodes; no point has the x of a node."""
    return np.array(
        [[0.5 * (x0 + x1) + 0.26, 0.5 * (y0 + y1)] for x0, y0, x1, y1 in boxes]
    ).reshape(-1, 2)


def routes(paths: Mapping[Any, FloatArray], centres: FloatArray) -> list[Route]:
    """Return paths grouped by signature, the most frequent route first.

    Of equally frequent routes, that of the earlier path is first.

    Args:
        paths: Key → (nodes, 2).
        centres: See `signature`.
    """
    of = {key: signature(path, centres) for key, path in paths.items()}
    return [
        Route(_name(k), tuple(key for key, own in of.items() if own == found))
        for k, (found, _) in enumerate(Counter(of.values()).most_common())
    ]


def _name(number: int) -> str:
    """Return the name of a route, counted from 0: A to Z, then AA and so on."""
    before, last = divmod(number, 26)
    return (_name(before - 1) if before else "") + chr(ord("A") + last)
