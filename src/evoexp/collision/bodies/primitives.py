"""Robots as spheres and capsules in space, among obstacles of all kinds.

Any Pinocchio model whose joints have one coordinate, any number of arms; the kernels are in
`primitive_kernels`. A body is all shapes that move with one joint, unless the shapes name their
bodies. Angles are radians here, as in Pinocchio.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import coal
import numpy as np

from evoexp.collision.bodies.contact_kernels import HIT, find_contacts
from evoexp.collision.bodies.contact_tables import contact_tables
from evoexp.collision.bodies.packed_shapes import (
    FIRST_LISTED,
    PackedObstacles,
    PackedShapes,
    PrimitiveTables,
    Units,
    flat_primitives,
)
from evoexp.collision.bodies.primitive_kernels import BETWEEN, SELF, primitive_clearances
from evoexp.collision.bodies.primitive_tables import (
    Pairs,
    Shapes,
    num_spheres,
    pack_obstacles,
    pack_shapes,
)
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import KinematicTable, kinematic_table
from evoexp.scenarios.obstacles import ObstacleTable


class Clearances(NamedTuple):
    """Least clearances of a batch: negative where shapes overlap, +inf where nothing is met."""

    # (configurations,) least distance of the robot's shapes to obstacles [length unit]
    to_obstacles: FloatArray
    between_arms: FloatArray  # (configurations,) least distance of shapes of two arms
    to_self: FloatArray  # (configurations,) least distance of shapes of one arm

    @property
    def least(self) -> FloatArray:
        """Smallest of the three; a configuration collides where it is negative."""
        return np.minimum(np.minimum(self.to_obstacles, self.between_arms), self.to_self)


def shapes_of_geometry(geometry: Any) -> Shapes:
    """Return the shapes of a `pin.GeometryModel` that holds coal spheres and capsules.

    Raises:
        ValueError: If an object has another shape.
    """
    joint, start, end, radius = [], [], [], []
    for one in geometry.geometryObjects:
        half = one.geometry.halfLength if isinstance(one.geometry, coal.Capsule) else 0.0
        if not isinstance(one.geometry, coal.Sphere | coal.Capsule):
            kind = type(one.geometry).__name__
            raise ValueError(
                f"geometry: object '{one.name}' must be a coal.Sphere or a coal.Capsule, is a "
                f"{kind}"
            )
        center, along = one.placement.translation, half * one.placement.rotation[:, 2]
        joint.append(int(one.parentJoint))
        start.append(center - along)
        end.append(center + along)
        radius.append(float(one.geometry.radius))
    return Shapes(np.array(joint, dtype=np.int64), np.array(start), np.array(end), np.array(radius))


def default_pairs(model: Any, joints: Iterable[int]) -> tuple[tuple[int, int], ...]:
    """Return all pairs of different joints of which neither is the other's parent."""
    own = sorted({int(joint) for joint in joints})
    apart = ((a, b) for k, a in enumerate(own) for b in own[k + 1 :])
    return tuple((a, b) for a, b in apart if model.parents[b] != a and model.parents[a] != b)


def arms_of_joints(model: Any) -> tuple[int, ...]:
    """Return the arm of each joint, the world's being −1: a tree that starts at the world each."""
    arms, count = [-1], 0
    for joint in range(1, model.njoints):
        root = model.parents[joint] == 0
        arms.append(count if root else arms[model.parents[joint]])
        count += root
    return tuple(arms)


class PrimitiveCollision(NamedTuple):
    """Spheres and capsules on one robot, the obstacles around it, and the pairs to be checked."""

    table: KinematicTable  # the kinematic table of the model
    joints: IntArray  # (bodies,) the Pinocchio joint of each body
    packed: PrimitiveTables  # bodies, obstacles and pairs as arrays
    tables: tuple[Any, ...]  # `packed` in flat arrays, for the kernel `primitive_clearances`

    @property
    def units(self) -> Units:
        """Bodies, then their parts."""
        return self.packed.units

    @property
    def shapes(self) -> PackedShapes:
        """Shapes of the units."""
        return self.packed.shapes

    @property
    def obstacles(self) -> PackedObstacles:
        """The obstacles, and which body is checked against which."""
        return self.packed.obstacles

    @property
    def pairs(self) -> IntArray:
        """(pairs, 3) two units, and the row of the result that they count for."""
        return self.packed.pairs

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
    ) -> "PrimitiveCollision":
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
        numbers, first = np.unique(shapes.labels, return_index=True)
        joints = shapes.joint[first]
        units, own, parts = pack_shapes(table, shapes, numbers, joints)
        given = default_pairs(model, joints) if pairs is None else pairs
        chosen = tuple((int(a), int(b)) for a, b in given)
        arm = arms_of_joints(model) if arms is None else tuple(arms)
        if len(arm) != model.njoints:
            raise ValueError(
                f"arms must have one number per joint of the model, {model.njoints}, had {len(arm)}"
            )
        around, lists = pack_obstacles(obstacles, numbers, joints, tuple(ignored))
        units.whole[: len(joints), FIRST_LISTED:] = lists
        rows, of_bodies = _pair_table(
            numbers, chosen, [arm[joint] for joint in joints], parts, units, own
        )
        contacts = contact_tables(
            table.chain, units, own, around.listed, obstacles, rows, of_bodies, parts
        )
        packed = PrimitiveTables(table.chain, units, own, around, rows, contacts)
        return cls(table, joints, packed, flat_primitives(packed))

    @classmethod
    def from_geometry(
        cls,
        model: Any,
        geometry: Any,
        obstacles: ObstacleTable,
        pairs: Pairs | None = None,
        ignored: Pairs = (),
        arms: Sequence[int] | None = None,
    ) -> "PrimitiveCollision":
        """Return the collision model of coal spheres and capsules in a `pin.GeometryModel`.

        See `build` for the arguments.
        """
        return cls.build(model, shapes_of_geometry(geometry), obstacles, pairs, ignored, arms)

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
        primitive_clearances(self.tables, float(limit), False, q, out)
        return Clearances(*out)

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations collide, (configurations,); true for NaN.

        The answer is the sign of `clearance`, found in less time.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        q, contacts = self._checked(q), self.packed.contacts
        if contacts.known:
            out = np.empty(q.shape[1], dtype=np.bool_)
            if find_contacts(*contacts, False, q, out) == 0:
                return out
        rows = np.empty((3, q.shape[1]))
        primitive_clearances(self.tables, 0.0, True, q, rows)
        return np.asarray(~(rows[0] >= 0.0))  # all rows say the same

    def any_collides(self, q: FloatArray) -> bool:
        """Return whether any configuration of a batch collides, as the edges of a planner's graph.

        A robot made of spheres alone is tested until one is found, eight configurations at a time:
        those that are likely to collide should come first. Others are tested to the end.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        q, contacts = self._checked(q), self.packed.contacts
        if contacts.known:
            found = find_contacts(*contacts, True, q, np.empty(q.shape[1], dtype=np.bool_))
            if found in (HIT, 0):
                return found == HIT
        return bool(self.collides(q).any())

    def _checked(self, q: FloatArray) -> FloatArray:
        nq = self.table.num_coordinates
        q = np.ascontiguousarray(q, dtype=np.float64)
        if q.ndim != 2 or q.shape[0] != nq:
            raise ValueError(f"q must have shape ({nq}, configurations), was {q.shape}")
        return q


def _pair_table(
    numbers: IntArray,
    pairs: tuple[tuple[int, int], ...],
    arms: Sequence[int],
    parts: list[list[int]],
    units: Units,
    shapes: PackedShapes,
) -> tuple[IntArray, list[tuple[int, int]]]:
    """Return all pairs of parts of the bodies that are paired, (pairs, 3), and these bodies.

    The part with more spheres comes first: it stays in its frame.
    """
    body = {int(number): k for k, number in enumerate(numbers)}
    rows: list[tuple[int, int, int]] = []
    of_bodies: list[tuple[int, int]] = []
    for one, two in pairs:
        if one not in body or two not in body or one == two:
            raise ValueError(
                f"pairs must hold two different joints of {numbers.tolist()} each, was {(one, two)}"
            )
        arm, other = arms[body[one]], arms[body[two]]
        between = arm != other and arm >= 0 and other >= 0
        for a in parts[body[one]]:
            for b in parts[body[two]]:
                keep = num_spheres(units, shapes, a) >= num_spheres(units, shapes, b)
                more, fewer = (a, b) if keep else (b, a)
                rows.append((more, fewer, BETWEEN if between else SELF))
                of_bodies.append((body[one], body[two]))
    return np.array(rows, dtype=np.int64).reshape(-1, 3), of_bodies
