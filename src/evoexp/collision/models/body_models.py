"""A robot's bodies as the fast kernels test them, and the pairs of bodies worth testing.

There are two models: sphere sets, generated from the bodies' coal geometry (Corsépius 2001, section
5), and one capsule per body. Both cover the bodies, so a posture that is free by the model is free
on coal's geometry.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.body_table import body_table
from evoexp.collision.box_support import coal
from evoexp.collision.models.body_covers import Cover, capsule_cover, sphere_cover
from evoexp.collision.models.inner_balls import inner_balls
from evoexp.collision.models.primitive_tables import Shapes
from evoexp.collision.models.primitives import PrimitiveCollision
from evoexp.collision.motion_bounds import pair_reaches, reaches
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table
from evoexp.validation import Component, NonNegative, Positive

SAMPLES = 1000  # random postures by which pairs that always touch are found
GRID, COARSE_GRID = 128, 48  # values per joint by which pairs that never touch are proven
NO_OBSTACLES = obstacle_table(())

Pair = tuple[int, int]


class CollisionModel(Component):
    """Base of the collision models that cover bodies: sphere sets and capsules."""

    component: ClassVar[str] = "collision_model"

    def cover(self, item: Any) -> Cover:
        """Return the cover that stands for a geometry object."""
        raise NotImplementedError

    def bind(self, assembly: Assembly) -> "BodyModel":
        """Return the model of a robot.

        Raises:
            UnsupportedShape: If a body cannot be covered.
            SettingError: If covers touch in every posture although their bodies do not.
        """
        covers = [self.cover(item) for item in assembly.geometry.geometryObjects]
        shapes = cover_shapes(
            covers, [item.parentJoint for item in assembly.geometry.geometryObjects]
        )
        return BodyModel(assembly, tuple(covers), shapes, *_derived_pairs(assembly, shapes))


class SphereSets(CollisionModel):
    """Bodies as sets of spheres that cover them.

    Attributes:
        inflation: How far spheres may reach beyond a body; less takes more spheres [length unit].
    """

    component: ClassVar[str] = "sphere_sets"

    inflation: Positive

    def cover(self, item: Any) -> Cover:
        """Return spheres around a geometry object."""
        return sphere_cover(item, self.inflation)


class BodyCapsules(CollisionModel):
    """Bodies as one capsule each that covers them; balls and capsules as they are.

    Attributes:
        padding: By how much every capsule is thicker than it must be [length unit].
    """

    component: ClassVar[str] = "body_capsules"

    padding: NonNegative

    def cover(self, item: Any) -> Cover:
        """Return the capsule around a geometry object."""
        found = capsule_cover(item)
        return found._replace(
            radius=found.radius + self.padding, inflation=found.inflation + self.padding
        )


class BodyModel(NamedTuple):
    """A robot's bodies, covered.

    Attributes:
        assembly: The robot.
        covers: One per body.
        shapes: All of them; a shape's body is its index among the geometry objects.
        pairs: Pairs of bodies that are tested.
        adjacent: Pairs on one joint or on neighbouring ones, which are not.
        always: Pairs that touch in every posture sampled.
        never: Pairs that are proven never to touch.
    """

    assembly: Assembly
    covers: tuple[Cover, ...]
    shapes: Shapes
    pairs: tuple[Pair, ...]
    adjacent: tuple[Pair, ...]
    always: tuple[Pair, ...]
    never: tuple[Pair, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(item.name for item in self.assembly.geometry.geometryObjects)

    @property
    def inflation(self) -> float:
        """How far a cover reaches beyond its body at most [length unit]."""
        return max(cover.inflation for cover in self.covers)

    @property
    def num_shapes(self) -> int:
        """Spheres and capsules of all bodies."""
        return len(self.shapes.joint)

    def collision(
        self,
        obstacles: ObstacleTable,
        ignored: tuple[Pair, ...] = (),
        carried: "Carried | None" = None,
    ) -> PrimitiveCollision:
        """Return the collision model among obstacles.

        Args:
            obstacles: The obstacles.
            ignored: Pairs (body, obstacle) that may touch.
            carried: An object that is part of the robot now; its number is one past the bodies'.
        """
        shapes, pairs, arms = self.shapes, self.pairs, self.assembly.body_arms
        model = self.assembly.model
        of_joint = [-1] * model.njoints
        for arm, item in zip(arms, self.assembly.geometry.geometryObjects, strict=True):
            of_joint[item.parentJoint] = arm if item.parentJoint else -1
        if carried is not None:
            own = len(self.covers)
            extra = cover_shapes([carried.cover], [carried.joint], own)
            columns: Any = zip(shapes, extra, strict=True)
            shapes = Shapes(*(np.concatenate(both) for both in columns))
            pairs = (*pairs, *((body, own) for body in carried.watched))
        return PrimitiveCollision.build(model, shapes, obstacles, pairs, ignored, of_joint)

    def touching(
        self,
        obstacles: ObstacleTable,
        allowed: tuple[Pair, ...],
        depth: float,
        carried: "Carried | None" = None,
    ) -> PrimitiveCollision | None:
        """Return the model of the pairs that may touch: what is inside of bodies must stay free.

        Args:
            obstacles: The obstacles.
            allowed: Pairs (body, obstacle) that may touch.
            depth: How deep they may overlap [length unit].
            carried: See `collision`.

        Returns:
            A model whose clearances to obstacles are negative where a pair overlaps too deep; None
            without such pairs.
        """
        items, own = list(self.assembly.geometry.geometryObjects), len(self.covers)
        found: dict[int, Shapes] = {}
        for b in sorted({body for body, _ in allowed}):
            if b == own and carried is not None:
                found[b] = cover_shapes([carried.inner], [carried.joint], b)
                continue
            inner = inner_balls(items[b], depth)
            if inner is not None:
                found[b] = cover_shapes([inner], [items[b].parentJoint], b)
        if not found:
            return None
        columns: Any = zip(*found.values(), strict=True)
        shapes = Shapes(*(np.concatenate(column) for column in columns))
        every = ((body, k) for body in found for k in range(len(obstacles.kind)))
        ignored = tuple(pair for pair in every if pair not in allowed)
        model = self.assembly.model
        return PrimitiveCollision.build(model, shapes, obstacles, (), ignored, [0] * model.njoints)


class Carried(NamedTuple):
    """An object that became part of a robot's geometry.

    Attributes:
        joint: That moves it.
        cover: In the joint's frame.
        inner: Shapes inside it, in the joint's frame, see `inner_balls`.
        watched: Bodies of the robot that it must not touch.
    """

    joint: int
    cover: Cover
    inner: Cover
    watched: tuple[int, ...]


def cover_shapes(covers: list[Cover], joints: list[int], first: int = 0) -> Shapes:
    """Return covers as shapes, numbered from `first` on."""
    sizes = [len(cover.radius) for cover in covers]
    return Shapes(
        np.repeat(np.array(joints, dtype=np.int64), sizes),
        np.vstack([cover.start for cover in covers]),
        np.vstack([cover.end for cover in covers]),
        np.concatenate([cover.radius for cover in covers]),
        np.repeat(np.arange(first, first + len(covers)), sizes),
    )


def _derived_pairs(assembly: Assembly, shapes: Shapes) -> tuple[tuple[Pair, ...], ...]:
    """Return the pairs that are tested, that are adjacent, that always touch, that never touch."""
    items, parents = list(assembly.geometry.geometryObjects), assembly.model.parents
    adjacent: list[Pair] = []
    apart: list[Pair] = []
    for a, one in enumerate(items):
        for b, two in enumerate(items[a + 1 :], start=a + 1):
            i, j = one.parentJoint, two.parentJoint
            near = i == j or (i > 0 and parents[i] == j) or (j > 0 and parents[j] == i)
            named = frozenset((one.name, two.name)) in assembly.disabled
            (adjacent if near or named else apart).append((a, b))
    if not apart or not np.isfinite(_limits(assembly)).all():
        return tuple(apart), tuple(adjacent), (), ()
    low, high = _limits(assembly)
    rng = np.random.Generator(np.random.PCG64(0))  # no search draws from it
    q = low[:, None] + (high - low)[:, None] * rng.random((len(low), SAMPLES))
    touching = _coal_touches(assembly, apart, q)
    always = [pair for pair, hits in zip(apart, touching, strict=True) if hits.all()]
    rest = [pair for pair in apart if pair not in always]
    never = []
    for pair in rest:
        if not touching[apart.index(pair)].any() and _never_touch(assembly, shapes, pair):
            never.append(pair)
        elif _alone(assembly, shapes, pair).collides(q).all():
            names = " and ".join(items[body].name for body in pair)
            raise SettingError(
                "collision",
                f"closer to the bodies: the covers of {names} touch in every posture",
                None,
            )
    return (
        tuple(pair for pair in rest if pair not in never),
        tuple(adjacent),
        tuple(always),
        tuple(never),
    )


def _limits(assembly: Assembly) -> FloatArray:
    """Return least and greatest q, (2, nq); infinite where a joint has no limit."""
    model = assembly.model
    limits = np.array([model.lowerPositionLimit, model.upperPositionLimit])
    return np.where(np.abs(limits) < 1e6, limits, np.inf)


def _coal_touches(assembly: Assembly, pairs: list[Pair], q: FloatArray) -> np.ndarray:
    """Return which pairs touch on coal's geometry, (pairs, configurations)."""
    model, geometry = assembly.model, assembly.geometry
    data, placements = model.createData(), geometry.createData()
    shapes = [item.geometry for item in geometry.geometryObjects]
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    out = np.zeros((len(pairs), q.shape[1]), dtype=np.bool_)
    for n in range(q.shape[1]):
        pin.updateGeometryPlacements(
            model, data, geometry, placements, np.ascontiguousarray(q[:, n])
        )
        places = [coal.Transform3s(place.rotation, place.translation) for place in placements.oMg]
        for k, (a, b) in enumerate(pairs):
            result.clear()
            out[k, n] = (
                coal.collide(shapes[a], places[a], shapes[b], places[b], request, result) > 0
            )
    return out


def _alone(assembly: Assembly, shapes: Shapes, pair: Pair) -> PrimitiveCollision:
    """Return the model of two bodies alone."""
    kept = np.isin(shapes.labels, pair)
    own = Shapes(
        shapes.joint[kept],
        shapes.start[kept],
        shapes.end[kept],
        shapes.radius[kept],
        shapes.labels[kept],
    )
    return PrimitiveCollision.build(assembly.model, own, NO_OBSTACLES, (pair,))


def _never_touch(assembly: Assembly, shapes: Shapes, pair: Pair) -> bool:
    """Return whether two bodies are proven to stay apart.

    The proof takes a grid over the joints between them and a bound of their motion within a step.
    The distances are those of the covers or, where these are too close, coal's on a coarser grid.
    Pairs with more than two joints between them are never proven, and so always tested.
    """
    items, table = list(assembly.geometry.geometryObjects), assembly.table
    bodies = body_table(table, [items[body] for body in pair])
    strokes = np.abs(_limits(assembly)).max(axis=0)
    reach = reaches(table.chain, bodies.joint, bodies.from_origin, bodies.from_axis, strokes)
    way = pair_reaches(np.array([[0, 1]], dtype=np.int64), reach)[0]  # (joints,)
    moving = np.flatnonzero(way > 0.0)
    if len(moving) > 2:
        return False
    q, slack = _grid(assembly, moving, way, GRID)
    if float(_alone(assembly, shapes, pair).clearance(q).least.min()) > slack:
        return True
    q, slack = _grid(assembly, moving, way, COARSE_GRID)
    return bool(_coal_distances(assembly, pair, q).min() > slack)


def _grid(
    assembly: Assembly, moving: np.ndarray, way: FloatArray, size: int
) -> tuple[FloatArray, float]:
    """Return configurations on a grid, and a bound of a distance's change within half a step.

    Args:
        assembly: The robot.
        moving: Indices of the joints that the grid spans.
        way: (joints,) bound of |d distance / dq| by joint.
        size: Values per joint.

    Returns:
        (nq, n) configurations, and the bound [length unit].
    """
    low, high = _limits(assembly)
    columns = assembly.table.index_q[moving]
    step = (high[columns] - low[columns]) / size
    values = [low[c] + s * (np.arange(size) + 0.5) for c, s in zip(columns, step, strict=True)]
    grid = np.meshgrid(*values, indexing="ij") if len(moving) else []
    q = np.repeat(0.5 * (low + high)[:, None], grid[0].size if grid else 1, axis=1)
    for column, value in zip(columns, grid, strict=True):
        q[column] = value.ravel()
    return q, float(np.sum(way[moving] * 0.5 * step))


def _coal_distances(assembly: Assembly, pair: Pair, q: FloatArray) -> FloatArray:
    """Return the distances of two bodies, (configurations,)."""
    model, data = assembly.model, assembly.model.createData()
    items = [assembly.geometry.geometryObjects[body] for body in pair]
    request, result, out = coal.DistanceRequest(), coal.DistanceResult(), np.empty(q.shape[1])
    for n in range(q.shape[1]):
        pin.forwardKinematics(model, data, np.ascontiguousarray(q[:, n]))
        places = [data.oMi[item.parentJoint] * item.placement for item in items]
        one, two = (coal.Transform3s(place.rotation, place.translation) for place in places)
        result.clear()
        out[n] = coal.distance(items[0].geometry, one, items[1].geometry, two, request, result)
    return out
