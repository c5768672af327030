"""Distances by coal at Pinocchio's placements, which decide every verdict, and searches by them."""

import threading
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.box_support import coal
from evoexp.collision.certifier.near_triangles import NearPart, mesh_of, near_triangles
from evoexp.collision.scene import Scene
from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

GJK_TOLERANCE = 1e-9
"""[-] relative: the tightest that coal keeps with all shapes (at 1e-12 some distances of ellipsoids
were 1e-2 wrong)."""

GJK_ITERATIONS = 1000

ROUNDING = 1e-9  # [-] of the scene's size: by which more than the near triangles are kept

TIME_RESOLUTION = 1e-12  # [segments] of the first contact

TINY = 1e-300  # in place of a speed of 0

WORTH = 4000  # queries times triangles, from which on near triangles are worth seeking

CLOSE = 0.5  # [-] of a distance: changes by more leave too many triangles near

WALK = 20.0  # queries of a walk, about half of them

FINER = 8.0  # a part of a motion so many times shorter is worth fewer triangles
FEW = 64  # triangles that are few enough


class QueryLimit(EvoexpError):
    """The limit of coal's queries is used up."""


class _Scratch(threading.local):
    """A thread's last `pin.Data`, which takes as long to make as two distances."""

    model: Any = None  # the model that it belongs to
    data: Any = None  # the data
    owner: object = None  # mark of the `CoalDistance` whose placements it holds


_scratch = _Scratch()


class _Body(NamedTuple):
    """A body: coal's shape, and its place."""

    number: int  # of its shape in the scene
    shape: Any  # coal's
    joint: int  # index of its Pinocchio joint; 0: the world
    local: Any  # its `pin.SE3` in the joint's frame
    num_triangles: int  # of a mesh; 0 for convex shapes


class CoalDistance:
    """Distances of a scene's pairs along a motion, counted; none is computed twice."""

    def __init__(self, scene: Scene, motion: Motion, limit: int) -> None:
        self.scene, self.motion, self.limit, self.queries = scene, motion, limit, 0
        if _scratch.model is not scene.model:
            _scratch.model, _scratch.data = scene.model, scene.model.createData()
        self._model, self._data, self._token = scene.model, _scratch.data, object()
        self._pairs: dict[int, tuple[_Body, _Body]] = {}
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()
        self._request.gjk_tolerance = GJK_TOLERANCE
        self._request.gjk_max_iterations = GJK_ITERATIONS
        self._balls: _Balls | None = None
        self._t = np.nan
        self._still: dict[int, Any] = {}  # body → coal's transform, of those that do not move
        self._moved: dict[int, Any] = {}  # and of those that do, at t
        self._known: dict[tuple[int, float], float] = {}
        self._near: list[NearPart] = []  # each within the one before it

    def __call__(self, pair: int, t: float) -> float:
        """Return the distance of a pair at t; negative where bodies overlap.

        Raises:
            QueryLimit: If that would be one query too many.
        """
        if self.queries >= self.limit:
            raise QueryLimit
        self.queries += 1
        found = self._known.get((pair, t))
        if found is None:
            found = self._known[pair, t] = self._computed(pair, t)
        return found

    def least(self, t: float) -> FloatArray:
        """Return bounds of all pairs' distances at t from below, by the balls around the bodies.

        Returns:
            (pairs,) [length unit]; −inf where one of the two has no end, such as a half-space.
        """
        self._place(t)
        if self._balls is None:
            self._balls = _balls(self.scene)
        places, balls = self._data.oMi, self._balls
        for body, joint, middle in balls.moving:
            balls.middles[body] = places[joint].act(middle)
        one, two = self.scene.pairs.T
        away = balls.middles[one] - balls.middles[two]
        found: FloatArray = np.sqrt((away * away).sum(axis=1)) - balls.reach
        return found

    def narrow(
        self, pair: int, interval: tuple[float, float], speed: float, most: float, queries: float
    ) -> None:
        """Prepare for queries in an interval in which a mesh does not touch a convex body.

        Between two meshes it saves nothing: coal descends both trees fast.

        Args:
            pair: The pair.
            interval: Begin and end.
            speed: A bound of |d distance / dt| there.
            most: An upper bound of the distance there [length unit].
            queries: How many are expected.
        """
        (begin, end), near, (one, two) = interval, self._near, self._bodies(pair)
        mesh, other = (one, two) if one.num_triangles > 0 else (two, one)
        if mesh.num_triangles == 0 or other.num_triangles > 0:
            return
        while near and not near[-1].holds(pair, begin, end):
            near.pop()
        way, count = speed * (end - begin), len(near[-1].kept) if near else mesh.num_triangles
        if near and (way * FINER > near[-1].way or count <= FEW):
            return
        if way > CLOSE * most or queries * count < WORTH:
            return
        self._place(0.5 * (begin + end))
        into = self._at(other).inverse() * self._at(mesh)
        reach = most + 0.5 * way + ROUNDING * self.scene.size
        kept = near_triangles(mesh.shape, other.shape, into, reach, near[-1].kept if near else None)
        if len(kept) > 0:
            near.append(NearPart(pair, begin, end, way, mesh_of(mesh.shape, kept), kept))

    def _computed(self, pair: int, t: float) -> float:
        self._place(t)
        one, two = self._bodies(pair)
        first, second = one.shape, two.shape
        for near in reversed(self._near):
            if near.holds(pair, t, t):
                first, second = (near.mesh, second) if one.num_triangles > 0 else (first, near.mesh)
                break
        places = self._transform(one), self._transform(two)
        self._result.clear()
        return float(
            coal.distance(first, places[0], second, places[1], self._request, self._result)
        )

    def _place(self, t: float) -> None:
        if t != self._t or _scratch.owner is not self._token:
            pin.forwardKinematics(self._model, self._data, self.motion.at(t))
            self._t, _scratch.owner = t, self._token
            self._moved.clear()

    def _bodies(self, pair: int) -> tuple[_Body, _Body]:
        if pair not in self._pairs:
            one, two = (_body(self.scene, int(k)) for k in self.scene.pairs[pair])
            self._pairs[pair] = one, two
        return self._pairs[pair]

    def _at(self, body: _Body) -> Any:
        return body.local if body.joint == 0 else self._data.oMi[body.joint] * body.local

    def _transform(self, body: _Body) -> Any:
        """Return coal's transform of a body, made once per instant; of a body that stays, once."""
        known = self._still if body.joint == 0 else self._moved
        found = known.get(body.number)
        if found is None:
            placement = self._at(body)
            found = coal.Transform3s(placement.rotation, placement.translation)
            known[body.number] = found
        return found


def _body(scene: Scene, index: int) -> _Body:
    shape, joint, local = scene.shapes[index]
    return _Body(index, shape, joint, local, getattr(shape, "num_tris", 0))


class _Balls(NamedTuple):
    """The balls around the bodies of a scene."""

    # index, joint, and middle in the joint's frame, of each body that moves
    moving: list[tuple[int, int, FloatArray]]
    middles: FloatArray  # (bodies, 3) in the world; those of moving bodies are set at every instant
    reach: FloatArray  # (pairs,) sums of both radii


def _balls(scene: Scene) -> _Balls:
    moving, middles, radii = [], [], []
    for index, (shape, joint, local) in enumerate(scene.shapes):
        shape.computeLocalAABB()
        radii.append(float(shape.aabb_radius))
        middle = shape.aabb_center if np.isfinite(radii[-1]) else np.zeros(3)
        middles.append(np.asarray(local.act(middle)))
        if joint != 0:
            moving.append((index, int(joint), middles[-1]))
    one, two = scene.pairs.T
    return _Balls(moving, np.array(middles), np.array(radii)[one] + np.array(radii)[two])


def first_contact(distance: CoalDistance, pair: int, t: float, level: float) -> float | None:
    """Find the instant near t from which on a pair's distance is at or below a level.

    Args:
        distance: Coal's.
        pair: The pair.
        t: Where the sweep saw it first.
        level: The distance.

    Returns:
        The instant up to `TIME_RESOLUTION`; None if coal sees no such distance there.
    """
    # forward from t until coal sees contact, too
    last = float(distance.motion.num_segments)
    touching, step = t, TIME_RESOLUTION
    while distance(pair, touching) > level:
        touching = min(t + step, last)
        step *= 10.0
        if step > 1e-4:
            return None
    # backward until the pair is free
    free, step = touching, 16.0 * TIME_RESOLUTION
    while free > 0.0 and distance(pair, free) <= level:
        free, touching = max(touching - step, 0.0), free
        step *= 16.0
    if free == 0.0 and distance(pair, 0.0) <= level:
        return 0.0
    # bisection
    while touching - free > TIME_RESOLUTION:
        middle = 0.5 * (free + touching)
        if distance(pair, middle) <= level:
            touching = middle
        else:
            free = middle
    return touching


def walk_down(
    distance: CoalDistance, pair: int, t: float, step: float, speed: float
) -> tuple[float, float]:
    """Return t and distance of a local minimum near t, by steps halved down to 1e-9 segments.

    Args:
        distance: Coal's.
        pair: The pair.
        t: Where the walk begins [instant].
        step: The first one [segments].
        speed: A bound of |d distance / dt| on the whole motion.
    """
    last, best = float(distance.motion.num_segments), distance(pair, t)
    while step > 1e-9:
        sides = max(t - step, 0.0), min(t + step, last)
        if (way := speed * (sides[1] - sides[0])) < best:
            distance.narrow(pair, sides, speed, best + way, WALK)
        for tried in sides:
            found = distance(pair, tried)
            if found < best:
                t, best = tried, found
                break
        else:
            step *= 0.5
    return t, best


class Leaf(NamedTuple):
    """Coal's findings on an interval for one pair."""

    least: float  # least distance [length unit]
    at: float  # t of it
    first: float  # t of the first distance at or below the level; inf if none
    proven: float  # lower bound before `first`


def search_interval(
    distance: CoalDistance,
    pair: int,
    interval: tuple[float, float],
    speed: float,
    goals: "LeafGoals",
) -> Leaf:
    """Search an interval from left to right, wherever the least distance is possible.

    Piyavskii 1972 and Shubert 1972: a function whose slope is bounded lies above the cone below
    every known value.

    Args:
        distance: Coal's.
        pair: The pair.
        interval: Its begin and end, within one segment.
        speed: A bound of |d distance / dt| there.
        goals: The distances to be proven or found.
    """
    (begin, end), speed = interval, max(speed, TINY)
    ends = [(begin, distance(pair, begin)), (end, distance(pair, end))]
    least, at = min((d, t) for t, d in ends)
    proven, stack = np.inf, [(ends[0], ends[1])]
    while stack:
        (a, d_a), (b, d_b) = stack.pop()
        if d_a <= goals.level:
            return Leaf(least, at, a, proven)
        width, way = b - a, speed * (b - a)
        low = 0.5 * (d_a + d_b - way) - goals.slack
        if low >= goals.target(min(least, goals.known)) or (
            way <= 0.25 * goals.slack and d_b > goals.level
        ):
            proven = min(proven, low)
        elif width < TIME_RESOLUTION:
            return Leaf(least, at, b, proven)
        else:
            middle = 0.5 * (a + b) + 0.5 * (d_a - d_b) / speed
            middle = min(max(middle, a + 0.1 * width), b - 0.1 * width)
            nearest = min(d_a, d_b)
            if nearest > way:
                above = max(nearest - goals.target(min(least, goals.known)), goals.slack)
                distance.narrow(pair, (a, b), speed, 0.5 * (d_a + d_b + way), way / above)
            d = distance(pair, middle)
            least, at = min((least, at), (d, middle))
            if d > goals.level:
                stack.append(((middle, d), (b, d_b)))
            else:
                stack.clear()  # later intervals do not matter any more
            stack.append(((a, d_a), (middle, d)))
    return Leaf(least, at, np.inf, proven)


class LeafGoals(NamedTuple):
    """The question that coal answers on an interval."""

    goal: float  # distance that is to be proven at least
    level: float  # the first instant is wanted at which the distance is at or below it
    slack: float  # coal's error
    known: float  # an upper bound of the least distance of the scene
    resolution: float
    floor: float

    def target(self, upper: float) -> float:
        """Return the lower bound that is enough while `upper` is the least distance found."""
        if not 0.0 < upper < np.inf or self.resolution == np.inf:
            return self.goal
        return max(self.goal, upper - min(max(self.resolution * upper, self.floor), 0.5 * upper))
