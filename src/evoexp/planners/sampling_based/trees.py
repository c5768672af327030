"""Two trees that grow toward each other, and edges that are tested for contact."""

import itertools
from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.covered_bodies import CoveredCollision
from evoexp.collision.bodies.touching_spheres import SphereCollision
from evoexp.collision.planar.link_ellipses import EllipseConfigurations
from evoexp.planners.proofs import Proofs
from evoexp.planners.sampling_based.kernels import nearest_node, step_toward, tested_configurations
from evoexp.records import FloatArray, IntArray

ROOM = 256  # nodes that a tree has room for at first


class EdgeTest:
    """Tests straight edges, and counts the configurations that were asked for.

    Attributes:
        queries: Configurations asked for so far, also those behind the first contact of an edge.
    """

    def __init__(
        self,
        collision: SphereCollision | CoveredCollision | EllipseConfigurations,  # the model
        resolution: float,  # greatest distance of configurations that are tested [deg]
        # judge the edges that the model calls free; None: the model is trusted
        proofs: Proofs | None = None,
    ) -> None:
        """Begin with no query."""
        self._collision, self._resolution, self.queries = collision, resolution, 0
        self._proofs = proofs

    def is_free(self, one: FloatArray, two: FloatArray) -> bool:
        """Whether an edge is free at the configurations tested; its first end is known to be.

        Its second end is asked for first, and the others only if that one is free. With proofs an
        edge is free only if all that lies between its ends is proven, too.
        """
        if not self.is_free_at(two):
            return False
        inside = tested_configurations(one, two, self._resolution)[:, 1:]
        self.queries += inside.shape[1]
        if inside.size and self._collision.any_collides(np.ascontiguousarray(inside)):
            return False
        return self.is_proven(np.stack([one, two]))

    def is_proven(self, path: FloatArray) -> bool:
        """Whether the certifier proves a path (nodes, nq) [deg]; True where none is asked for."""
        return self._proofs is None or self._proofs.is_proven(path.ravel())

    def certificates(self) -> dict[str, float]:
        """Return how many paths and edges were judged as a term; none where none are."""
        return (
            {} if self._proofs is None else {"certificates": float(self._proofs.num_certificates)}
        )

    def is_free_at(self, q: FloatArray) -> bool:
        """Whether one configuration (nq,) [deg] is free."""
        self.queries += 1
        return not self._collision.any_collides(np.ascontiguousarray(q[:, None]))

    def num_contacts(self, path: FloatArray) -> int:
        """Return how many of the configurations tested on a path (nodes, nq) collide."""
        edges = itertools.pairwise(path)
        tested = [tested_configurations(one, two, self._resolution) for one, two in edges]
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
            The path from start to goal (nodes, nq) if the trees have met; None if not.
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
        return np.concatenate([first, last[-2::-1]])

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
