"""Numerical potential fields over a grid by wave fronts: toward the goal, and away from obstacles.

Chen & Zalzala 1995, section 2.1, after Barraquand & Latombe 1991. The paper calls the potential of
the obstacles the unsafeness of a node; it is the collision model by which its paths are planned.
"""

from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.errors import demand
from evoexp.paths.grids import UNREACHED, Grid, front, grid
from evoexp.records import FloatArray
from evoexp.validation import Component, Count, Positive, Vector


class Fields(NamedTuple):
    """The potential fields of an occupancy grid."""

    grid: Grid  # its free nodes and permitted moves; nodes that are too unsafe are not free
    # (nodes,) S_i of every node: potential of the nearest obstacle or boundary
    unsafeness: FloatArray
    potentials: FloatArray  # (nodes,) potential toward a goal after so many steps of its front
    neighbourhood: int  # p of the fronts

    @property
    def num_moves(self) -> int:
        """Number of the grid's moves that the front of a goal makes."""
        return self.grid.moves_within(self.neighbourhood)

    def steps_to(self, node: int) -> np.ndarray:
        """Return the steps from every node to one (nodes,); `grids.UNREACHED` without a way."""
        return front(self.grid, np.array([node]), self.neighbourhood)

    def goal_field(self, node: int) -> FloatArray:
        """Return the potential of every node toward a goal (nodes,); NaN without a way."""
        steps = self.steps_to(node)
        return np.where(steps == UNREACHED, np.nan, self.potentials[steps])


class PotentialFields(Component):
    """Potentials after so many steps of the wave fronts."""

    neighbourhood: Count  # p: a step of a front changes at most so many coordinates
    # d_1, d_2, … after 1, 2, … steps from the goal, where it is 0; goes on with the last
    # difference
    goal_potentials: Annotated[tuple[Positive, ...], Field(min_length=2)]
    # o_0, o_1, … after 0, 1, … steps from obstacles and from the ring of nodes around the
    # grid; all further steps have the last of these potentials
    obstacle_potentials: Annotated[Vector, Field(min_length=1)]
    # S_* of Eq. 3: no path may pass a node of a greater one; None: any
    max_unsafeness: float | None = None

    def _check(self) -> None:
        goal, obstacle = list(self.goal_potentials), list(self.obstacle_potentials)
        rises = all(a < b for a, b in pairwise(goal))
        demand(rises, "goal_potentials", "ascending: d1 < d2 < …", goal)
        falls = all(a >= b for a, b in pairwise(obstacle))
        demand(falls, "obstacle_potentials", "descending: o0 ≥ o1 ≥ …", obstacle)

    def bind(self, blocked: np.ndarray) -> Fields:
        """Return the fields of an occupancy grid (nodes along x, y[, z]), true for obstacles."""
        must, most = f"at most the grid's number of dimensions ({blocked.ndim})", blocked.ndim
        demand(self.neighbourhood <= most, "collision.neighbourhood", must, self.neighbourhood)
        unsafeness = self._unsafeness(blocked)
        most_unsafe = np.inf if self.max_unsafeness is None else self.max_unsafeness
        own = grid(blocked | (unsafeness > most_unsafe))
        around = np.pad(unsafeness, 1, constant_values=self.obstacle_potentials[0])
        # the goal's potentials go on with the last difference
        first = np.array([0.0, *self.goal_potentials])
        steps = np.arange(1.0, max(own.num_nodes - len(first), 0) + 1.0)
        potentials = np.append(first, steps * (first[-1] - first[-2]) + first[-1])
        return Fields(own, around.ravel(), potentials, self.neighbourhood)

    def _unsafeness(self, blocked: np.ndarray) -> FloatArray:
        """Return the unsafeness of every node, in the shape of the grid."""
        # "obstacles (including the natural boundaries)"
        sources = np.pad(blocked, 1, constant_values=True)
        everywhere = grid(np.zeros(sources.shape, dtype=bool))
        starts = np.flatnonzero(np.pad(sources, 1))
        steps = everywhere.inner(front(everywhere, starts, self.neighbourhood))
        table = np.array(self.obstacle_potentials)
        inside = (slice(1, -1),) * blocked.ndim
        return np.asarray(table[np.minimum(steps[inside], len(table) - 1)])
