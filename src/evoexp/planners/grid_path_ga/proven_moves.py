"""Grids whose every move the exact certifier proves, so that every path over them is proven.

A platform does not turn, and a path consists of straight moves: it is free of contact if each of
its moves is. Moves are judged once, before the search, a whole line of them at a time.
"""

from collections.abc import Iterator

import numpy as np

from evoexp.collision.certifier.certificate import is_proven
from evoexp.collision.scene import Part, Scene
from evoexp.paths.grids import Grid, NodeArray
from evoexp.paths.motion import Motion


def only_proven(grid: Grid, scene: Scene, security_margin: float, by_margin: bool) -> Grid:
    """Return a grid without the moves that the certifier does not prove, in either direction.

    A length unit lies between its nodes. With `by_margin` moves must keep the security margin.
    """
    neighbours = grid.neighbours.copy()

    def judge(line: NodeArray, move: int) -> None:
        """Forbid the moves of a line of nodes that are not proven."""
        ends = Motion(grid.coordinates[line[[0, -1]]].astype(np.float64))
        if is_proven((Part(scene, 0, 1),), ends, security_margin, by_margin):
            return
        if len(line) > 2:
            middle = len(line) // 2
            judge(line[: middle + 1], move)
            judge(line[middle:], move)
            return
        neighbours[line[0], move] = -1
        neighbours[line[1], neighbours[line[1]] == line[0]] = -1

    for move, targets in enumerate(grid.neighbours.T):
        # moves to nodes of greater index; the others are their ways back
        first = np.flatnonzero(targets >= 0)[:1]
        if len(first) and targets[first[0]] > first[0]:
            for line in _lines(targets):
                judge(line, move)
    return grid._replace(neighbours=neighbours)


def _lines(targets: NodeArray) -> Iterator[NodeArray]:
    """Yield the nodes of each longest line of one move, which leads to `targets` (nodes,) or −1."""
    is_target = np.zeros(len(targets), dtype=bool)
    is_target[targets[targets >= 0]] = True
    for node in np.flatnonzero((targets >= 0) & ~is_target):
        line = [int(node)]
        while targets[line[-1]] >= 0:
            line.append(int(targets[line[-1]]))
        yield np.array(line, dtype=np.int32)
