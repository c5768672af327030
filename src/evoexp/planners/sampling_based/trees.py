"""Two trees that grow toward each other, and edges that are tested for contact."""

import itertools
from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.covered_bodies import CoveredCollision
from evoexp.collision.bodies.touching_spheres import SphereCollision
from evoexp.collision.planar.link_ellipses import EllipseConfigurations
from evoexp.planners.proofs import Proofs
from evoexp.planners.sampling_based.kernels import (
    LANES,
    nearest_node,
    step_toward,
    tested_configurations,
)
from evoexp.records import FloatArray, IntArray

ROOM = 256  # nodes that a tree has room for at first


class EdgeTest:
    """Tests straight edges, and counts the configurations that were asked for.

    Attributes:
        queries: Configurations looked at so far: none behind the eight of an edge's first contact.
    """

    def __init__(
        self,
        collision: SphereCollision | CoveredCollision | EllipseConfigurations,  # the model
        resolution: float,  # greatest distance of configurations that are tested [deg]
        # judge the edges of paths that the model calls free; None: the model is trusted
        proofs: Proofs | None = None,
    ) -> None:
        """Begin with no query."""
        self._collision, self.resolution, self.queries = collision, resolution, 0
        self._proofs = proofs

    def is_free(self, one: FloatArray, two: FloatArray) -> bool:
        """Whether an edge is free at the configurations tested; its first end is known to be.

        They are asked for eight at a time, up to the first contact; the second end is the first.
        """
        return self._are_free(tested_configurations(one, two, self.resolution))

    def unproven(self, path: FloatArray) -> int:
        """Return the first edge of a path (nodes, nq) [deg] that is not proven; −1 if all are.

        All are where no proof is asked for. An edge that was judged before is not judged again.
        """
        if self._proofs is not None:
            for k in range(len(path) - 1):
                if not self._proofs.is_proven(path[k : k + 2].ravel()):
                    return k
        return -1

    def certificates(self) -> dict[str, float]:
        """Return how many paths and edges were judged as a term; none where none are."""
        return (
            {} if self._proofs is None else {"certificates": float(self._proofs.num_certificates)}
        )

    def is_free_at(self, q: FloatArray) -> bool:
        """Whether one configuration (nq,) [deg] is free."""
        return self._are_free(np.ascontiguousarray(q[:, None]))

    def _are_free(self, q: FloatArray) -> bool:
        """Whether configurations (nq, configurations) [deg] are free."""
        num_free = self._collision.num_free(q)
        self.queries += min(q.shape[1], num_free + LANES)
        return bool(num_free == q.shape[1])

    def num_contacts(self, path: FloatArray) -> int:
        """Return how many of the configurations tested on a path (nodes, nq) collide."""
        edges = itertools.pairwise(path)
        tested = [tested_configurations(one, two, self.resolution) for one, two in edges]
        if not tested:
            return 0
        q = np.concatenate(tested, axis=1)
        self.queries += q.shape[1]
        return int(np.count_nonzero(self._collision.collides(q)))


class Tree:
    """Configurations, each reached from its parent along a free edge.

    Attributes:
        count: Number of nodes.
    """

    def __init__(self, root: FloatArray) -> None:
        """Plant a tree at a configuration (nq,) [deg]."""
        self._nodes = np.empty((len(root), ROOM))
        self._parents = np.empty(ROOM, dtype=np.int64)
        self.count = 0
        self.add(root, -1)

    @property
    def nodes(self) -> FloatArray:
        """(count, nq) all nodes in the order of their birth, a view [deg]."""
        return self._nodes[:, : self.count].T

    @property
    def parents(self) -> IntArray:
        """(count,) the parent of each node, a view; −1: the root."""
        return self._parents[: self.count]

    def node(self, index: int) -> FloatArray:
        """Return a node as an array (nq,) of its own."""
        return np.asarray(self._nodes[:, index].copy())

    def add(self, q: FloatArray, parent: int) -> int:
        """Add a node and return its index."""
        if self.count == len(self._parents):
            self._nodes = np.concatenate([self._nodes, np.empty_like(self._nodes)], axis=1)
            self._parents = np.concatenate([self._parents, np.empty_like(self._parents)])
        index, self.count = self.count, self.count + 1
        self._nodes[:, index], self._parents[index] = q, parent
        return index

    def cut(self, one: FloatArray, two: FloatArray) -> None:
        """Remove the edge between two nodes, if there is one, and all that grew behind it."""
        ends = {one.tobytes(), two.tobytes()}
        kept = np.ones(self.count, dtype=np.bool_)
        for k in range(1, self.count):  # parents are older than their children
            parent = int(self._parents[k])
            edge = {self.node(k).tobytes(), self.node(parent).tobytes()}
            kept[k] = kept[parent] and edge != ends
        places = np.cumsum(kept) - 1
        parents = self.parents[kept]
        nodes, self.count = self._nodes[:, : self.count][:, kept], len(parents)
        self._nodes[:, : self.count] = nodes
        self._parents[: self.count] = np.where(parents < 0, -1, places[parents])

    def nearest(self, q: FloatArray) -> int:
        """Return the node that is nearest to q, the oldest among equals."""
        return nearest_node(self._nodes, self.count, q)

    def branch(self, index: int) -> FloatArray:
        """Return the nodes from the root to a node, (nodes, nq)."""
        found = []
        while index >= 0:
            found.append(index)
            index = int(self._parents[index])
        return np.ascontiguousarray(self._nodes[:, found[::-1]].T)


class Growth(NamedTuple):
    """The end of an attempt to grow toward a configuration."""

    node: int  # the last node that is new or, where none is, the nearest one
    grew: bool  # whether there is a new node, or a node at the configuration itself
    reached: bool  # whether that node is the configuration itself


class TreePair:
    """RRT-Connect (Kuffner & LaValle 2000, Figs. 2 and 5), one iteration at a time.

    Attributes:
        trees: The tree of the start, then that of the goal.
        num_iterations: Iterations so far.
    """

    def __init__(self, start: FloatArray, goal: FloatArray, edges: EdgeTest, step: float) -> None:
        """Plant both trees.

        Args:
            start: (nq,) [deg].
            goal: (nq,) [deg].
            edges: Tests edges.
            step: Length of a step, the paper's ε [deg].
        """
        self.trees = (Tree(start), Tree(goal))
        self._edges, self._step, self.num_iterations = edges, step, 0

    def iterate(self, target: FloatArray) -> FloatArray | None:
        """Let one tree make a step toward a configuration, and the other connect to its end.

        The trees take turns in making the step (SWAP).

        Args:
            target: (nq,) q_rand [deg].

        Returns:
            The path from start to goal (nodes, nq) if the trees have met and it is proven, where
            that is asked for; None if not. The first edge that is not is cut from its tree.
        """
        turn = self.num_iterations % 2
        self.num_iterations += 1
        own, other = self.trees[turn], self.trees[1 - turn]
        extended = self._extend(own, own.nearest(target), target)
        if not extended.grew:
            return None
        new = own.node(extended.node)
        met = self._connect(other, new)
        if not met.reached:
            return None
        # both branches end at the same configuration, which stays once
        branches = own.branch(extended.node), other.branch(met.node)
        first, last = branches if turn == 0 else branches[::-1]
        path = np.concatenate([first, last[-2::-1]])
        if (edge := self._edges.unproven(path)) < 0:
            return path
        for tree in self.trees:
            tree.cut(path[edge], path[edge + 1])
        return None

    def _extend(self, tree: Tree, near: int, target: FloatArray) -> Growth:
        """EXTEND from a given node: one step."""
        q = tree.node(near)
        new = step_toward(q, target, self._step)
        reached = bool((new == target).all())
        if (new == q).all():  # nothing between them
            return Growth(near, reached, reached)
        if not self._edges.is_free(q, new):
            return Growth(near, False, False)
        return Growth(tree.add(new, near), True, reached)

    def _connect(self, tree: Tree, target: FloatArray) -> Growth:
        """CONNECT: steps until the target is reached or an edge collides.

        Behind the first step no other node can be nearer than the one just added.
        """
        grown = self._extend(tree, tree.nearest(target), target)
        while grown.grew and not grown.reached:
            grown = self._extend(tree, grown.node, target)
        return grown
