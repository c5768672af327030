"""Robots as spheres and capsules in space, among obstacles of all kinds.

Any Pinocchio model whose joints have one coordinate, any number of arms; planar arms are trees with
z = 0. Angles are radians here, as in Pinocchio.
"""

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numba
import numpy as np

from evoexp.collision.bodies.body_tables import FlatTables, flattened
from evoexp.collision.bodies.clearance_kernels import least_clearances, num_free
from evoexp.collision.bodies.packing import BodyPair, Shapes, pack_tables
from evoexp.collision.distance_maps import DistanceMap
from evoexp.numeric.compilation import KernelAddress, kernel
from evoexp.numeric.vectors import LANES
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.kinematics import KinematicTable
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table


class Clearances(NamedTuple):
    """Least clearances of a batch: negative where shapes overlap, +inf where nothing is met."""

    # (configurations,) least distance of the robot's shapes to obstacles [length unit]
    to_obstacles: FloatArray
    between_arms: FloatArray  # (configurations,) least distance of shapes of two arms
    # (configurations,) least distance of shapes of one arm; +inf where those are no pairs, or
    # count as two arms
    to_self: FloatArray | float = np.inf

    @property
    def least(self) -> FloatArray:
        """Smallest of the three; a configuration collides where it is negative."""
        return np.minimum(np.minimum(self.to_obstacles, self.between_arms), self.to_self)


@kernel
def leading_free(hits: BoolArray) -> int:
    """Return how many configurations come before the eight of the first hit; all without any."""
    for k in range(len(hits)):
        if hits[k]:
            return k // LANES * LANES
    return len(hits)


class FreeTest(NamedTuple):
    """A collision model as kernels of other rooms ask it: a kernel's address, and its tables.

    The kernel takes the tables and a contiguous batch (nq, configurations) [rad], and answers as
    `num_free` does.
    """

    num_free: KernelAddress
    tables: Any

    @classmethod
    def of(cls, function: Callable[..., int], tables: Any) -> "FreeTest":
        """Return the test of a kernel that is compiled for tables like these."""
        kinds = numba.int64(numba.typeof(tables), numba.float64[:, ::1])
        return cls(_address(function, kinds), tables)


_address = functools.cache(KernelAddress)


class BodyCollision(NamedTuple):
    """Spheres and capsules on one robot, the obstacles around it, and the pairs to be checked."""

    tables: FlatTables  # robot, obstacles and pairs, as kernels take them
    nq: int  # coordinates of the robot

    @classmethod
    def build(
        cls,
        table: KinematicTable,
        shapes: Shapes,
        obstacles: ObstacleTable,
        pairs: Iterable[BodyPair],
        ignored: Iterable[BodyPair] = (),
        arms: Sequence[int] = (),
        maps: Sequence[DistanceMap] = (),
    ) -> "BodyCollision":
        """Return the collision model of a robot among obstacles, ready for batches.

        Args:
            table: The robot's kinematic table.
            shapes: Its spheres and capsules; those of the world (a pedestal) are checked against
                bodies only.
            pairs: Numbers of bodies that are checked against each other.
            ignored: Pairs (body, obstacle) that are not checked: the floor that the first link
                stands on.
            arms: Which arm each joint of the model belongs to, the world included; all to one if
                empty. Negative numbers belong to every arm.
            maps: Distances of pairs that their shapes do not tell.
        """
        packed = pack_tables(table, shapes, obstacles, pairs, ignored, arms, maps)
        return cls(flattened(packed), table.num_coordinates)

    @classmethod
    def of_pair(
        cls, table: KinematicTable, shapes: Shapes, pair: tuple[int, int]
    ) -> "BodyCollision":
        """Return the collision model of two bodies alone."""
        return cls.build(table, shapes.of(np.isin(shapes.body, pair)), obstacle_table(()), (pair,))

    def clearance(self, q: FloatArray) -> Clearances:
        """Return the clearances of a batch of configurations.

        They are exact, but for a capsule whose axis enters a box or a cylinder: its clearance is
        some value ≤ −radius.

        Args:
            q: (nq, configurations) [rad], lengths for prismatic joints. NaN where q holds NaN.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        return Clearances(*self._measured(q, np.inf))

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations collide, (configurations,); true for NaN.

        The answer is the sign of `clearance`, found in less time.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        return np.asarray(~(self._measured(q, 0.0)[0] >= 0.0))  # all rows are the same

    def _measured(self, q: FloatArray, limit: float) -> FloatArray:
        """Return clearances (3, configurations) up to a limit; at a limit of 0 their signs only."""
        q = contiguous_batch(q, self.nq)
        out = np.empty((3, q.shape[1]))
        least_clearances(self.tables, limit, limit == 0.0, q, out)
        return out

    @property
    def free_test(self) -> FreeTest:
        """The test of configurations for kernels of other rooms."""
        return FreeTest.of(num_free, self.tables)


def contiguous_batch(q: FloatArray, nq: int) -> FloatArray:
    """Return configurations (nq, configurations) as kernels take them.

    Raises:
        ValueError: If q has another shape.
    """
    q = np.ascontiguousarray(q, dtype=np.float64)
    if q.ndim != 2 or q.shape[0] != nq:
        raise ValueError(f"q must have shape ({nq}, configurations), was {q.shape}")
    return q
