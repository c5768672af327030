"""Edges that are tested for contact, two trees that grow toward each other, and shorter paths.

Shortcuts lead between random places (Geraerts & Overmars 2007, section 4). Corners are cut at a
quarter of their segments (Chaikin 1974), which tends to a smooth curve.
"""

import itertools

import numpy as np

from evoexp.collision.bodies.covered_bodies import ArmCollision
from evoexp.collision.planar.link_ellipses import EllipseCollision
from evoexp.planners.answers import Proofs
from evoexp.planners.sampling_based import kernels
from evoexp.records import FloatArray

CUT = 0.25  # [-] of a segment, from a corner to where it is cut
ROOM = 256  # nodes that a tree has room for at first


class EdgeTest:
    """Tests straight edges, and counts the configurations asked for, up to the first contact."""

    def __init__(
        self,
        collision: ArmCollision | EllipseCollision,  # the model
        resolution: float,  # greatest distance of configurations that are tested [deg]
        # judge the edges of paths that the model calls free; None: the model is trusted
        proofs: Proofs | None = None,
    ) -> None:
        self._collision, self._proofs, self.queries = collision, proofs, 0
        self.space = kernels.FreeSpace(*collision.free_test, resolution)
        self._is_doubtful = False  # whether the last path was refuted

    def is_free(self, one: FloatArray, two: FloatArray) -> bool:
        """Whether an edge is free at the configurations tested; its first end is known to be."""
        is_free, asked = kernels.edge_is_free(self.space, one, two)
        self.queries += asked
        return bool(is_free)

    def is_free_at(self, q: FloatArray) -> bool:
        """Whether one configuration (nq,) [deg] is free."""
        return self.is_free(q, q)

    def unproven(self, path: FloatArray) -> FloatArray | None:
        """Return a node (1, nq) or an edge (2, nq) of a path that is not proven; None if all are.

        A path (nodes, nq) [deg] is judged whole, but by pieces behind one that was refuted. Nodes
        come first: a contact that the model does not see mostly lasts longer than an edge, and a
        node costs less.
        """
        if self._proofs is None or (not self._is_doubtful and self._proofs.is_proven(path.ravel())):
            return None
        self._is_doubtful = True
        nodes = [path[k : k + 1] for k in range(1, len(path) - 1)]
        for piece in (*nodes, *(path[k : k + 2] for k in range(len(path) - 1))):
            if not self._proofs.is_proven(piece[[0, -1]].ravel()):
                return piece
        self._is_doubtful = False
        return None

    def certificates(self) -> dict[str, float]:
        """Return how many paths and edges were judged as a term; none where none are."""
        return {"certificates": float(self._proofs.num_certificates)} if self._proofs else {}

    def num_contacts(self, path: FloatArray) -> int:
        """Return how many of the configurations tested on a path (nodes, nq) collide."""
        edges, resolution = itertools.pairwise(path), self.space.resolution
        tested = [kernels.tested_configurations(one, two, resolution) for one, two in edges]
        if not tested:
            return 0
        q = np.concatenate(tested, axis=1)
        self.queries += q.shape[1]
        return int(np.count_nonzero(self._collision.collides(q)))


class TreePair:
    """RRT-Connect (Kuffner & LaValle 2000, Figs. 2 and 5), one iteration at a time."""

    def __init__(self, start: FloatArray, goal: FloatArray, edges: EdgeTest, step: float) -> None:
        """Plant both trees, at start and goal (nq,); a step is as long as the paper's ε [deg]."""
        self._edges, self._step, self.num_iterations = edges, step, 0
        nodes, parents = np.empty((2, len(start), ROOM)), np.full((2, ROOM), -1)
        nodes[:, :, 0] = start, goal
        self._trees = kernels.Trees(nodes, parents, np.ones(2, dtype=np.int64))

    @property
    def nodes(self) -> FloatArray:
        """(nodes, nq) those of the start's tree, then the goal's, each as they grew [deg]."""
        each = zip(self._trees.nodes, self._trees.counts, strict=True)
        return np.concatenate([nodes[:, :count].T for nodes, count in each])

    def iterate(self, target: FloatArray) -> FloatArray | None:
        """Let one tree step toward q_rand (nq,) [deg], the other connect to its end; by turns.

        Returns the path from start to goal (nodes, nq) if the trees have met and it is proven,
        where that is asked for; else None, and the node or edge that is not proven is cut from its
        tree.
        """
        turn = self.num_iterations % 2
        self.num_iterations += 1
        edges = self._edges
        grown = kernels.grow(edges.space, self._trees, turn, target, self._step)
        self._trees, end, met, asked = grown
        edges.queries += asked
        if met < 0:
            return None
        # both branches end at the same configuration, which stays once
        branches = self._branch(turn, end), self._branch(1 - turn, met)
        first, last = branches if turn == 0 else branches[::-1]
        path = np.concatenate([first, last[-2::-1]])
        piece = edges.unproven(path)
        if piece is None:
            return path
        for tree in range(2):
            self._cut(tree, piece)
        return None

    def _branch(self, tree: int, index: int) -> FloatArray:
        branch = []
        while index >= 0:
            branch.append(index)
            index = int(self._trees.parents[tree, index])
        return np.ascontiguousarray(self._trees.nodes[tree][:, branch[::-1]].T)

    def _cut(self, tree: int, piece: FloatArray) -> None:
        """Remove a node (1, nq) or an edge (2, nq), if it is there, and all that grew behind it."""
        count = self._trees.counts[tree]
        nodes, parents = self._trees.nodes[tree][:, :count], self._trees.parents[tree, :count]
        is_first, is_last = ((nodes == piece[k, :, None]).all(axis=0) for k in (0, -1))
        cut = (is_first & is_last[parents]) | (is_last & is_first[parents])
        if len(piece) == 1:
            cut = is_first
        stays = np.ones(count, dtype=np.bool_)
        for k in range(1, count):
            stays[k] = stays[parents[k]] and not cut[k]
        places = np.cumsum(stays) - 1
        parents = np.where(parents < 0, -1, places[parents])[stays]
        self._trees.counts[tree] = len(parents)
        self._trees.nodes[tree][:, : len(parents)] = nodes[:, stays]
        self._trees.parents[tree, : len(parents)] = parents


class ShortenedPath:
    """A path that becomes shorter, attempt by attempt; its `nodes` are never changed in place.

    A shortcut begins and ends at configurations that were tested on the path: only the line between
    them is new. Where edges are proven, too, paths are taken by the model first; `settle` judges
    the last.
    """

    def __init__(self, nodes: FloatArray, edges: EdgeTest) -> None:
        """Begin with a path (nodes, nq) that is free."""
        self.nodes, self.lengths = nodes, kernels.lengths_along(nodes)
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
        self._before, self.lengths = [], kernels.lengths_along(self.nodes)

    def improve(self, num_shortcuts: int, rng: np.random.Generator, most: int) -> FloatArray:
        """Try some shortcuts, `most` at most, or cut the corners where all were tried.

        Returns the length of the path after each attempt [deg].
        """
        left = num_shortcuts - self.num_attempts
        if left > 0:
            return self.attempt(rng.random((min(left, most), 2)))
        self.cut_corners()
        return self.lengths[-1:]

    def attempt(self, uniforms: FloatArray) -> FloatArray:
        """Try lines between shares (attempts, 2) of the path; return its length after each."""
        edges = self._edges
        nodes, sizes, after, asked = kernels.shortcuts(edges.space, self.nodes, uniforms)
        edges.queries += asked
        for path in np.split(nodes, np.cumsum(sizes)[:-1]) if len(sizes) else []:
            self._before.append(self.nodes)
            self.nodes = path
        self.lengths = kernels.lengths_along(self.nodes)
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
        lengths = kernels.lengths_along(found)
        if lengths[-1] < self.length and all(self._edges.is_free(a, b) for a, b in left):
            self._before.append(self.nodes)
            self.nodes, self.lengths = found, lengths
