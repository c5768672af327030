"""Distances by coal at Pinocchio's placements, which decide every verdict, and searches by them."""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.box_support import coal
from evoexp.collision.scene import Scene
from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

GJK_TOLERANCE = 1e-9
"""[-] relative: the tightest that coal keeps with all shapes (at 1e-12 some distances of ellipsoids
were 1e-2 wrong)."""

GJK_ITERATIONS = 1000

TIME_RESOLUTION = 1e-12  # [segments] of the first contact

TINY = 1e-300  # in place of a speed of 0


class QueryLimit(EvoexpError):
    """The limit of coal's queries is used up."""


class CoalDistance:
    """Distances of a scene's pairs along a motion, counted; none is computed twice."""

    def __init__(self, scene: Scene, motion: Motion, limit: int) -> None:
        self.scene, self.motion, self.limit, self.queries = scene, motion, limit, 0
        self._t = np.nan
        self._places: dict[int, Any] = {}  # body → coal's transform at t
        self._known: dict[tuple[int, float], float] = {}
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()
        self._request.gjk_tolerance, self._request.gjk_max_iterations = (
            GJK_TOLERANCE,
            GJK_ITERATIONS,
        )

    @cached_property
    def _data(self) -> Any:
        return self.scene.model.createData()  # most motions need no distance of coal's

    def __call__(self, pair: int, t: float) -> float:
        """Return the distance of a pair at t; negative where bodies overlap.

        Raises:
            QueryLimit: If that would be one query too many.
        """
        if self.queries >= self.limit:
            raise QueryLimit
        self.queries += 1
        distance = self._known.get((pair, t))
        if distance is None:
            self._place(t)
            solids = []
            for body in self.scene.pairs[pair].tolist():
                shape, joint, local = self.scene.shapes[body]
                if body not in self._places:
                    place = local if joint == 0 else self._data.oMi[joint] * local
                    self._places[body] = coal.Transform3s(place.rotation, place.translation)
                solids += [shape, self._places[body]]
            self._result.clear()
            distance = float(coal.distance(*solids, self._request, self._result))
            self._known[pair, t] = distance
        return distance

    def least(self, t: float) -> FloatArray:
        """Return bounds of all pairs' distances at t from below, by the balls around the bodies.

        (pairs,) [length unit]; −inf where one of the two has no end, such as a half-space.
        """
        self._place(t)
        places, (joints, locals_, radii) = self._data.oMi, self._balls
        middles = np.array(
            [places[j].act(middle) for j, middle in zip(joints, locals_, strict=True)]
        )
        one, two = self.scene.pairs.T
        away = middles[one] - middles[two]
        bounds: FloatArray = np.sqrt((away * away).sum(axis=1)) - radii[one] - radii[two]
        return bounds

    @cached_property
    def _balls(self) -> tuple[list[int], list[FloatArray], FloatArray]:
        """Joint, middle in the joint's frame (3,), and radius of the ball around each body."""
        joints, middles, radii = list[int](), list[FloatArray](), list[float]()
        for shape, joint, local in self.scene.shapes:
            shape.computeLocalAABB()
            radii.append(float(shape.aabb_radius))
            middle = shape.aabb_center if np.isfinite(radii[-1]) else np.zeros(3)
            joints.append(int(joint))
            middles.append(np.asarray(local.act(middle)))
        return joints, middles, np.array(radii)

    def _place(self, t: float) -> None:
        if t != self._t:
            pin.forwardKinematics(self.scene.model, self._data, self.motion.at(t))
            self._t = t
            self._places.clear()


def first_contact(
    distance: CoalDistance, pair: int, t: float, level: float, wants_first: bool
) -> float | None:
    """Find the instant near t from which on a pair's distance is at or below a level.

    It is found up to `TIME_RESOLUTION`, or any near t will do; None if coal sees none there.
    """
    # forward from t until coal sees contact, too
    last = float(distance.motion.num_segments)
    touching, step = t, TIME_RESOLUTION
    while distance(pair, touching) > level:
        touching = min(t + step, last)
        step *= 10.0
        if step > 1e-4:
            return None
    if not wants_first:
        return touching
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


def walk_down(distance: CoalDistance, pair: int, t: float, step: float) -> tuple[float, float]:
    """Return t and distance of a local minimum near t, by steps halved down to 1e-9 segments."""
    last, best = float(distance.motion.num_segments), distance(pair, t)
    while step > 1e-9:
        for tried in (max(t - step, 0.0), min(t + step, last)):
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
    every known value. The interval lies within one segment; the speed bounds |d distance / dt|.
    """
    (begin, end), speed = interval, max(speed, TINY)
    ends = [(begin, distance(pair, begin)), (end, distance(pair, end))]
    least, at = min((d, t) for t, d in ends)
    proven, stack = np.inf, [(ends[0], ends[1])]
    while stack:
        (a, d_a), (b, d_b) = stack.pop()
        if d_a <= goals.level or (least <= goals.level and not goals.wants_first):
            return Leaf(least, at, a if d_a <= goals.level else at, proven)
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
    level: float  # a distance at or below it is a contact
    slack: float  # coal's error
    known: float  # an upper bound of the least distance of the scene
    resolution: float
    floor: float
    wants_first: bool = True  # whether the first instant of a contact is wanted, or any

    def target(self, upper: float) -> float:
        """Return the lower bound that is enough while `upper` is the least distance found."""
        if not 0.0 < upper < np.inf or self.resolution == np.inf:
            return self.goal
        return max(self.goal, upper - min(max(self.resolution * upper, self.floor), 0.5 * upper))
