"""Robots as spheres and capsules in space, among obstacles of all kinds.

Any Pinocchio model whose joints have one coordinate, any number of arms; planar arms are trees with
z = 0. A body is all shapes that move with one joint, unless the shapes name their bodies. Angles
are radians here, as in Pinocchio.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numba
import numpy as np

from evoexp.collision.bodies.body_shapes import Pairs, Shapes, arms_of_joints, default_pairs
from evoexp.collision.bodies.body_tables import FlatTables, flattened, named_tables
from evoexp.collision.bodies.clearance_kernels import least_clearances
from evoexp.collision.bodies.contact_kernels import find_contacts
from evoexp.collision.bodies.packing import pack_tables
from evoexp.numeric.compilation import KernelAddress, kernel
from evoexp.numeric.vectors import LANES
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.kinematics import KinematicTable, kinematic_table
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


@kernel
def num_free(tables: FlatTables, q: FloatArray) -> int:
    """Return how many configurations come before the eight among which the first collides.

    All of them if none collides. A robot made of spheres alone is tested until a contact is met, so
    configurations that are likely to collide should come first; others are tested to the end.

    Args:
        tables: Of `flattened`.
        q: (nq, configurations) [rad], lengths for joints that slide; contiguous.
    """
    count = q.shape[1]
    if len(named_tables(tables[0], tables[1]).capsules) == 0:
        answer = find_contacts(tables, True, q, np.empty(count, dtype=np.bool_))
        if answer <= 0:
            return count if answer == 0 else -1 - answer
    rows = np.empty((3, count))
    least_clearances(tables, 0.0, True, q, rows)
    return leading_free(~(rows[0] >= 0.0))


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


@functools.cache
def _address(function: Callable[..., int], kinds: Any) -> KernelAddress:
    return KernelAddress(function, kinds)


class BodyCollision(NamedTuple):
    """Spheres and capsules on one robot, the obstacles around it, and the pairs to be checked."""

    table: KinematicTable  # the kinematic table of the model
    tables: FlatTables  # robot, obstacles and pairs, as kernels take them
    only_spheres: bool  # whether no shape is a capsule

    @classmethod
    def build(
        cls,
        model: Any,
        shapes: Shapes,
        obstacles: ObstacleTable,
        pairs: Pairs | None = None,
        ignored: Pairs = (),
        arms: Sequence[int] | None = None,
        table: KinematicTable | None = None,
    ) -> "BodyCollision":
        """Return the collision model of a robot among obstacles, ready for batches.

        Args:
            model: `pin.Model` whose joints have one coordinate each.
            shapes: Its spheres and capsules; those of the world (a pedestal) are checked against
                bodies only.
            pairs: Bodies that are checked against each other, by their numbers (the joints', unless
                shapes have others); `default_pairs` if not given.
            ignored: Pairs (body, obstacle) that are not checked: the floor that the first link
                stands on.
            arms: Which arm each joint of the model belongs to, the world included; `arms_of_joints`
                if not given. Negative numbers belong to every arm.
            table: The model's kinematic table, if it is known.

        Raises:
            UnsupportedJoint: If a joint has not exactly one coordinate.
            ValueError: If shapes, pairs or arms do not fit the model.
        """
        shapes = shapes.checked(model)
        table = kinematic_table(model) if table is None else table
        chosen = default_pairs(model, shapes.joint) if pairs is None else pairs
        arm = arms_of_joints(model) if arms is None else tuple(arms)
        if len(arm) != model.njoints:
            raise ValueError(
                f"arms must have one number per joint of the model, {model.njoints}, had {len(arm)}"
            )
        packed = pack_tables(table, shapes, obstacles, tuple(chosen), tuple(ignored), arm)
        return cls(table, flattened(packed), len(packed.capsules) == 0)

    @classmethod
    def of_pair(cls, model: Any, shapes: Shapes, pair: tuple[int, int]) -> "BodyCollision":
        """Return the collision model of two bodies alone."""
        own = shapes.of(np.isin(shapes.labels, pair))
        return cls.build(model, own, obstacle_table(()), (pair,))

    def clearance(self, q: FloatArray, limit: float = np.inf) -> Clearances:
        """Return the clearances of a batch of configurations.

        They are exact, but for a capsule whose axis enters a box or a cylinder: its clearance is
        some value ≤ −radius.

        Args:
            q: (nq, configurations) [rad], lengths for prismatic joints. NaN where q holds NaN.
            limit: Above it nothing is measured: a clearance is exact where it is less, elsewhere it
                is the limit.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates, or the limit
                is NaN.
        """
        if np.isnan(limit):
            raise ValueError("limit must be a number, was nan")
        q = self._checked(q)
        out = np.empty((3, q.shape[1]))
        least_clearances(self.tables, float(limit), False, q, out)
        return Clearances(*out)

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations collide, (configurations,); true for NaN.

        The answer is the sign of `clearance`, found in less time.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        q = self._checked(q)
        if self.only_spheres:
            out = np.empty(q.shape[1], dtype=np.bool_)
            if find_contacts(self.tables, False, q, out) == 0:
                return out
        rows = np.empty((3, q.shape[1]))
        least_clearances(self.tables, 0.0, True, q, rows)
        return np.asarray(~(rows[0] >= 0.0))  # all rows are the same

    @property
    def free_test(self) -> FreeTest:
        """The test of configurations for kernels of other rooms."""
        return FreeTest.of(num_free, self.tables)

    def num_free(self, q: FloatArray) -> int:
        """Return the answer of the kernel `num_free` for a batch (nq, configurations) [rad].

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        return num_free(self.tables, self._checked(q))

    def _checked(self, q: FloatArray) -> FloatArray:
        nq = self.table.num_coordinates
        q = np.ascontiguousarray(q, dtype=np.float64)
        if q.ndim != 2 or q.shape[0] != nq:
            raise ValueError(f"q must have shape ({nq}, configurations), was {q.shape}")
        return q
