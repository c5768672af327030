"""A robot's bodies as the fast kernels test them, and the pairs of bodies worth testing.

There are two models: sphere sets, generated from the bodies' coal geometry (Corsépius 2001, section
5), and one capsule per body. Both cover the bodies, so a posture that is free by the model is free
on coal's geometry.

A robot whose pairs were derived when its files were read (`derived_pairs`) brings them along. Of
other robots, pairs that never touch are proven to, and so nobody judges them.
"""

import itertools
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision import distance_maps
from evoexp.collision.bodies.body_collision import BodyCollision, Shapes
from evoexp.collision.box_support import coal
from evoexp.collision.covers import body_covers
from evoexp.collision.derived_pairs import (
    DerivedPairs,
    Pair,
    are_neighbours,
    derive_pairs,
    joint_limits,
    sampled_configurations,
)
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable
from evoexp.validation import Component, NonNegative, Positive

SLACK = 1e-6  # [length unit] by which covers are made smaller than it takes
SMALLEST = 1e-6  # [length unit] radius of a cover
SAMPLES = 1000  # random postures by which pairs that always touch are found
GRID, COARSE_GRID = 128, 48  # values per joint by which pairs that never touch are proven


class BodyPairs(NamedTuple):
    """All pairs of a robot's bodies, sorted."""

    tested: tuple[Pair, ...]  # pairs that a search tests and the certifier judges
    # pairs on one joint or on neighbouring ones, or disabled: nobody judges them
    adjacent: tuple[Pair, ...]
    always: tuple[Pair, ...] = ()  # pairs that touch in every sampled posture: nobody judges them
    never: tuple[Pair, ...] = ()  # pairs that are proven never to touch: nobody judges them
    # pairs that touch in no sampled posture: only the certifier judges them
    unseen: tuple[Pair, ...] = ()
    # pairs whose covers touch in every sampled posture although the bodies do not: only the
    # certifier judges them
    overlapping: tuple[Pair, ...] = ()
    # pairs whose covers always touch, tested by maps of their distances
    mapped: tuple[Pair, ...] = ()
    # pairs whose covers touch at the start or the goal although the bodies do not: only the
    # certifier judges them
    fitted: tuple[Pair, ...] = ()

    @property
    def judged(self) -> tuple[Pair, ...]:
        """Pairs that the certifier judges."""
        return (*self.tested, *self.unseen, *self.overlapping, *self.mapped, *self.fitted)


def body_pairs(assembly: Assembly, shapes: Shapes) -> BodyPairs:
    """Sort the pairs of a robot's bodies.

    Args:
        shapes: The covers of its bodies.
    """
    q, is_given = sampled_configurations(assembly, SAMPLES), assembly.pairs is not None
    derived = (
        derive_pairs(assembly, SAMPLES)
        if assembly.pairs is None
        else DerivedPairs.from_json(assembly.pairs)
    )
    groups = dict[str, tuple[Pair, ...]](tested=(), adjacent=())
    items = enumerate(assembly.geometry.geometryObjects)
    for (a, one), (b, two) in itertools.combinations(items, 2):
        pair, names = (a, b), frozenset((one.name, two.name))
        if names in assembly.disabled or are_neighbours(assembly, a, b):
            group = "adjacent"
        elif q is None:
            group = "tested"
        elif names in derived.always:
            group = "always"
        elif names in derived.never and is_given:
            group = "unseen"
        elif names in derived.never and _never_touch(assembly, shapes, pair):
            group = "never"
        elif BodyCollision.of_pair(assembly.table, shapes, pair).collides(q).all():
            group = "overlapping"
        else:
            group = "tested"
        groups[group] = (*groups.get(group, ()), pair)
    return BodyPairs(**groups)


def _never_touch(assembly: Assembly, shapes: Shapes, pair: Pair) -> bool:
    """Return whether two bodies are proven to stay apart.

    The proof takes a grid over the joints between them and a bound of their motion within a step.
    The distances are those of the covers or, where these are too close, coal's on a coarser grid.
    Pairs with more than two joints between them are never proven, and so always tested.
    """
    way = distance_maps.approach_speeds(assembly, pair)
    moving = np.flatnonzero(way > 0.0)
    if len(moving) > 2:
        return False
    q, slack = _grid(assembly, moving, way, GRID)
    if float(BodyCollision.of_pair(assembly.table, shapes, pair).clearance(q).least.min()) > slack:
        return True
    q, slack = _grid(assembly, moving, way, COARSE_GRID)
    return bool(distance_maps.coal_distances(assembly, pair, q).min() > slack)


def _grid(
    assembly: Assembly, moving: np.ndarray, way: FloatArray, size: int
) -> tuple[FloatArray, float]:
    """Return configurations (nq, n) on a grid over some coordinates, `size` values of each.

    Also a bound of a distance's change within half a step, from that of |d distance / dq|, (nq,).
    """
    low, high = joint_limits(assembly)
    step = (high[moving] - low[moving]) / size
    values = [low[c] + s * (np.arange(size) + 0.5) for c, s in zip(moving, step, strict=True)]
    grid = np.meshgrid(*values, indexing="ij") if len(moving) else []
    q = np.repeat(0.5 * (low + high)[:, None], grid[0].size if grid else 1, axis=1)
    for column, value in zip(moving, grid, strict=True):
        q[column] = value.ravel()
    return q, float(np.sum(way[moving] * 0.5 * step))


class CollisionModel(Component, is_base=True):
    """Base of the collision models that cover bodies: sphere sets and capsules."""

    def cover(self, item: Any, given: FloatArray | None = None) -> body_covers.Cover:
        """Return the cover that stands for a geometry object, for which spheres may be given."""
        raise NotImplementedError

    def bind(self, assembly: Assembly) -> "BodyModel":
        """Return the model of a robot."""
        items, given = list(assembly.geometry.geometryObjects), assembly.spheres or {}
        covers = tuple(self.cover(item, given.get(item.name)) for item in items)
        bodies = zip(covers, (item.parentJoint for item in items), strict=True)
        shapes = Shapes.joined(_shapes(*body, number) for number, body in enumerate(bodies))
        pairs, asked = body_pairs(assembly, shapes), getattr(self, "inflation", np.inf)
        return BodyModel(assembly, covers, shapes, pairs, asked)


class SphereSets(CollisionModel):
    """Bodies as sets of spheres that cover them."""

    # how far spheres may reach beyond a body; less takes more spheres [length unit]
    inflation: Positive

    def cover(self, item: Any, given: FloatArray | None = None) -> body_covers.Cover:
        """Return the given spheres, or else spheres around a geometry object."""
        if given is None or len(given) == 0:
            return body_covers.kept_sphere_cover(item, self.inflation)
        return body_covers.given_cover(item, given)


class BodyCapsules(CollisionModel):
    """Bodies as one capsule each that covers them; balls and capsules as they are."""

    padding: NonNegative  # by how much every capsule is thicker than it must be [length unit]
    # whether the capsule of a cylinder is as thick as the cylinder and reaches beyond its
    # faces, or lies along its longest edge and is thicker: what moves upright over a floor is
    # covered best by the first
    around_cylinders: bool = False

    def cover(self, item: Any, given: FloatArray | None = None) -> body_covers.Cover:
        """Return the capsule around a geometry object."""
        is_around = self.around_cylinders and isinstance(item.geometry, coal.Cylinder)
        found = body_covers.around_cylinder(item) if is_around else body_covers.capsule_cover(item)
        return found._replace(
            radius=found.radius + self.padding, inflation=found.inflation + self.padding
        )


class BodyModel(NamedTuple):
    """A robot's bodies, covered."""

    assembly: Assembly  # the robot
    covers: tuple[body_covers.Cover, ...]  # one per body
    shapes: Shapes  # all of them; a shape's body is its index among the geometry objects
    sorted_pairs: BodyPairs  # pairs of bodies, by who judges them
    asked: float = np.inf  # how far covers are asked to reach beyond bodies at most [length unit]
    # bodies whose covers were made smaller (`fitted`), and by how much
    shrunk: tuple[tuple[int, float], ...] = ()
    # of pairs whose covers always touch; a search tests those of `sorted_pairs.mapped`
    maps: tuple[distance_maps.DistanceMap, ...] = ()

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Pairs of bodies that a search tests."""
        return self.sorted_pairs.tested

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(item.name for item in self.assembly.geometry.geometryObjects)

    @property
    def inflation(self) -> float:
        """How far a cover reaches beyond its body, or a mesh's convex hull, at most."""
        return max(cover.inflation for cover in self.covers)

    def notes(self, unit: str, is_complete: bool = False) -> list[str]:
        """Describe the covers [unit], and the pairs that only the certifier judges, or nobody."""
        items, names = self.assembly.geometry.geometryObjects, self.names
        # how many covers there are, and how far they reach
        meshes = any(isinstance(item.geometry, coal.BVHModelBase) for item in items)
        beyond = "them, or the convex hulls of meshes" if meshes else "them"
        lines = [
            f"{len(names)} bodies covered by {self.num_shapes} spheres and capsules, which "
            f"reach at most {self.inflation:.3g} {unit} beyond {beyond}"
        ]
        named, most = list(zip(names, self.covers, strict=True)), self.asked * (1.0 + 1e-6)
        if out := [f"{name} {c.uncovered:.3g}" for name, c in named if c.uncovered > 0.0]:
            sizes = ", ".join(out)
            lines.append(f"given spheres do not contain all bodies; uncovered [{unit}]: {sizes}")
        if wide := [f"{name} {c.inflation:.3g}" for name, c in named if c.inflation > most]:
            sizes = ", ".join(wide)
            if self.assembly.frames is not None:  # out of a URDF
                sizes += "; robot.decomposition or robot.spheres give closer covers"
            must = f"the requested {self.asked:g} {unit}"
            lines.append(f"covers that reach beyond {must}: {sizes}")
        # pairs of bodies, and covers made smaller
        pairs, where = self.sorted_pairs, "the start or the goal"
        unjudged = {
            "neighbours or disabled, not tested": pairs.adjacent,
            "always touch, not tested": pairs.always,
            "never touch, not tested": pairs.never,
        }
        covers = "covers touch in every sampled posture"
        groups = (unjudged if is_complete else {}) | {
            "touch in no sampled posture, judged by the certifier only": pairs.unseen,
            f"{covers}, judged by the certifier only": pairs.overlapping,
            f"{covers}, tested by maps of exact distances": pairs.mapped,
        }
        lines += _listed(groups, names)
        if self.shrunk:
            sizes = ", ".join(f"{names[body]} by {size:.3g} {unit}" for body, size in self.shrunk)
            lines.append(
                f"covers made smaller, since they touch an obstacle at {where} where the bodies do "
                f"not: {sizes}"
            )
        return lines + _listed(
            {f"covers touch at {where}, left to the certifier": pairs.fitted}, names
        )

    @property
    def num_shapes(self) -> int:
        """Spheres and capsules of all bodies."""
        return len(self.shapes.joint)

    def collision(
        self,
        obstacles: ObstacleTable,
        ignored: tuple[Pair, ...] = (),
        carried: "Carried | None" = None,
    ) -> BodyCollision:
        """Return the collision model among obstacles, but for pairs (body, obstacle) to ignore.

        An object that is carried has the number one past the bodies'.
        """
        shapes, pairs, arms = self.shapes, self.pairs, self.assembly.body_arms
        of_joint = [-1] * self.assembly.model.njoints
        for arm, item in zip(arms, self.assembly.geometry.geometryObjects, strict=True):
            of_joint[item.parentJoint] = arm if item.parentJoint else -1
        if carried is not None:
            own = len(self.covers)
            shapes = Shapes.joined([shapes, _shapes(carried.cover, carried.joint, own)])
            pairs = (*pairs, *((body, own) for body in carried.watched))
        table = self.assembly.table
        maps = [each for each in self.maps if each.pair in self.sorted_pairs.mapped]
        return BodyCollision.build(table, shapes, obstacles, pairs, ignored, of_joint, maps)

    def with_maps(self) -> "BodyModel":
        """Return the bodies with maps of the distances of pairs whose covers always touch."""
        pairs, maps = self.sorted_pairs, dict[Pair, distance_maps.DistanceMap]()
        for pair in pairs.overlapping:
            if (of_pair := distance_maps.distance_map(self.assembly, pair)) is not None:
                maps[pair] = of_pair
        left = tuple(pair for pair in pairs.overlapping if pair not in maps)
        pairs = pairs._replace(overlapping=left, mapped=tuple(maps))
        return self._replace(maps=tuple(maps.values()), sorted_pairs=pairs)

    def touching(
        self,
        obstacles: ObstacleTable,
        allowed: tuple[Pair, ...],
        depth: float,
        carried: "Carried | None" = None,
    ) -> BodyCollision | None:
        """Return the model of pairs (body, obstacle) that may touch, by what is inside of bodies.

        Its clearances to obstacles are negative where a pair overlaps by more than the depth
        [length unit]; None without such pairs.
        """
        items, own = list(self.assembly.geometry.geometryObjects), len(self.covers)
        inner: dict[int, Shapes] = {}
        for body in sorted({body for body, _ in allowed}):
            if body == own and carried is not None:
                inner[body] = _shapes(carried.inner, carried.joint, body)
            elif (cover := body_covers.inner_balls(items[body], depth)) is not None:
                inner[body] = _shapes(cover, items[body].parentJoint, body)
        if not inner:
            return None
        shapes = Shapes.joined(inner.values())
        every = ((body, k) for body in inner for k in range(len(obstacles.kind)))
        ignored = tuple(pair for pair in every if pair not in allowed)
        return BodyCollision.build(self.assembly.table, shapes, obstacles, (), ignored)

    def fitted(
        self, obstacles: ObstacleTable, ignored: tuple[Pair, ...], q: FloatArray
    ) -> "BodyModel":
        """Return bodies whose covers do not touch at configurations where the bodies do not.

        Covers that touch an obstacle at q (nq, configurations) [rad] are made smaller; pairs of
        bodies whose covers touch are no longer tested. What a search does not see any more is left
        to the certifier.
        """
        radius, shrunk = self.shapes.radius.copy(), []
        for body in range(len(self.covers)):
            own = self.shapes.body == body
            if not self.shapes.joint[own].all():  # what stands still is not tested
                continue
            alone = self._replace(shapes=self.shapes.of(own), sorted_pairs=BodyPairs((), ()))
            skipped = tuple(pair for pair in ignored if pair[0] == body)
            least = float(alone.collision(obstacles, skipped).clearance(q).to_obstacles.min())
            if least < 0.0:
                radius[own] = np.maximum(radius[own] - (SLACK - least), SMALLEST)
                shrunk.append((body, SLACK - least))
        shapes = self.shapes._replace(radius=radius)
        touching = tuple(
            pair
            for pair in self.pairs
            if BodyCollision.of_pair(self.assembly.table, shapes, pair).collides(q).any()
        )
        tested = tuple(pair for pair in self.pairs if pair not in touching)
        mapped = tuple(each.pair for each in self.maps if (each.at(q) >= 0.0).all())
        touching += tuple(pair for pair in self.sorted_pairs.mapped if pair not in mapped)
        pairs = self.sorted_pairs._replace(tested=tested, mapped=mapped, fitted=touching)
        return self._replace(shapes=shapes, sorted_pairs=pairs, shrunk=tuple(shrunk))


def _listed(groups: dict[str, tuple[Pair, ...]], names: tuple[str, ...]) -> list[str]:
    named = {
        what: ", ".join(f"{names[a]} with {names[b]}" for a, b in pairs)
        for what, pairs in groups.items()
    }
    return [f"{what}: {text}" for what, text in named.items() if text]


class Carried(NamedTuple):
    """An object that became part of a robot's geometry."""

    joint: int  # that moves it
    cover: body_covers.Cover  # in the joint's frame
    inner: body_covers.Cover  # shapes inside it, in the joint's frame, see `inner_balls`
    watched: tuple[int, ...]  # bodies of the robot that it must not touch


def _shapes(cover: body_covers.Cover, joint: int, body: int) -> Shapes:
    joints, bodies = (np.full(len(cover.radius), number) for number in (joint, body))
    return Shapes(joints, cover.start, cover.end, cover.radius, bodies)
