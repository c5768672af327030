"""Routes: which paths over a map pass the same sides of all obstacles."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray

Signature = tuple[int, ...]


class Route(NamedTuple):
    """Paths that can be bent into each other without passing over an obstacle.

    As far as signatures tell.

    Attributes:
        name: A, B, …; the most frequent one of all is A.
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
    height = before[..., 1] + (centres[:, 0] - before[..., 0]) / run * (
        after[..., 1] - before[..., 1]
    )
    above = crosses & (height > centres[:, 1])
    return tuple(int(value) for value in (above * np.sign(run)).sum(axis=0))


def inside_points(boxes: Sequence[Sequence[int]]) -> FloatArray:
    """Return a point inside each of some boxes (x0, y0, x1, y1) of nodes.

    None has the x of a node.
    """
    return np.array(
        [[0.5 * (x0 + x1) + 0.26, 0.5 * (y0 + y1)] for x0, y0, x1, y1 in boxes]
    ).reshape(-1, 2)


def routes(paths: Mapping[Any, FloatArray], centres: FloatArray) -> list[Route]:
    """Return paths grouped by signature, the most frequent route first.

    Of equals the one of the first path.

    Args:
        paths: Key → (nodes, 2).
        centres: See `signature`.
    """
    of = {key: signature(path, centres) for key, path in paths.items()}
    counts = Counter(of.values())
    return [
        Route(_name(k), tuple(key for key, own in of.items() if own == found))
        for k, (found, _) in enumerate(counts.most_common())
    ]


def _name(number: int) -> str:
    """Return A to Z, then AA and so on."""
    letters = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        letters = chr(ord("A") + rest) + letters
    return letters
