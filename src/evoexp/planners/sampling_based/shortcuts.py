"""Shortcuts of paths between random places (Geraerts & Overmars 2007, section 4), and corners cut.

Corners are cut at a quarter of their segments (Chaikin 1974), which tends to a smooth curve.
"""

import itertools

import numpy as np

from evoexp.planners.sampling_based.kernels import lengths_along, shortcuts
from evoexp.planners.sampling_based.settings import EdgeSettings
from evoexp.planners.sampling_based.trees import EdgeTest
from evoexp.records import FloatArray

CUT = 0.25  # [-] of a segment, from a corner to where it is cut


class ShortenedPath:
    """A path that becomes shorter, attempt by attempt; its `nodes` are never changed in place.

    A shortcut begins and ends at configurations that were tested on the path: so only the line
    between them is new, and what is left of the segments that it cuts in two is known to be free.

    Where edges are proven, too, shorter paths are taken by the model first; `settle` judges the
    one in hand.
    """

    def __init__(self, nodes: FloatArray, edges: EdgeTest) -> None:
        """Begin with a path (nodes, nq) that is free."""
        self.nodes, self.lengths = nodes, lengths_along(nodes)
        self._edges, self.num_attempts = edges, 0
        self._before: list[FloatArray] = []  # the paths since the last one that was judged

    @property
    def length(self) -> float:
        """Length of the path [deg]."""
        return float(self.lengths[-1])

    def settle(self) -> None:
        """Go back to the last path that is proven, if the one in hand is not."""
        while self._before and self._edges.unproven(self.nodes) is not None:
            self.nodes = self._before.pop()
        self._before, self.lengths = [], lengths_along(self.nodes)

    def improve(self, settings: EdgeSettings, rng: np.random.Generator, most: int) -> FloatArray:
        """Try some shortcuts, `most` at most, or cut the corners where all were tried.

        Returns the length of the path after each attempt [deg].
        """
        left = settings.num_shortcuts - self.num_attempts
        if left > 0:
            return self.attempt(rng.random((min(left, most), 2)))
        self.cut_corners()
        return self.lengths[-1:]

    def attempt(self, uniforms: FloatArray) -> FloatArray:
        """Try straight lines between places (attempts, 2), shares of the path's length [0, 1).

        Return its length after each [deg].
        """
        edges = self._edges
        nodes, sizes, after, asked = shortcuts(*edges.test, self.nodes, uniforms, edges.resolution)
        edges.queries += asked
        for path in np.split(nodes, np.cumsum(sizes)[:-1]) if len(sizes) else []:
            self._before.append(self.nodes)
            self.nodes = path
        self.lengths = lengths_along(self.nodes)
        self.num_attempts += len(uniforms)
        return after

    def cut_corners(self) -> None:
        """Cut every corner whose cut is free, if all that is left of the segments is free, too."""
        self.num_attempts += 1
        nodes, kept, tested = self.nodes, [self.nodes[0]], set[bytes]()
        for before, corner, behind in zip(nodes, nodes[1:], nodes[2:], strict=False):
            one, two = corner + CUT * (before - corner), corner + CUT * (behind - corner)
            is_free = self._edges.is_free(one, two)
            kept += [one, two] if is_free else [corner]
            tested.add(one.tobytes() + two.tobytes())
        found = np.array([*kept, nodes[-1]])
        tested |= {a.tobytes() + b.tobytes() for a, b in itertools.pairwise(nodes)}
        edges = itertools.pairwise(found)
        left = [(a, b) for a, b in edges if a.tobytes() + b.tobytes() not in tested]
        lengths = lengths_along(found)
        if lengths[-1] < self.length and all(self._edges.is_free(a, b) for a, b in left):
            self._before.append(self.nodes)
            self.nodes, self.lengths = found, lengths
