"""Distances by coal at Pinocchio's placements, which decide every verdict, and searches by them."""

import threading
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.box_support import coal
from evoexp.collision.scene import Scene
from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion

GJK_TOLERANCE = 1e-9
"""[-] relative: the tightest that coal keeps with all shapes (at 1e-12 some distances of ellipsoids
were 1e-2 wrong)."""

GJK_ITERATIONS = 1000

TIME_RESOLUTION = 1e-12  # [segments] of the first contact

TINY = 1e-300  # in place of a speed of 0


class QueryLimit(EvoexpError):
    """The limit of coal's queries is used up."""


class _Scratch(threading.local):
    """A thread's last `pin.Data`, which takes as long to make as two distances.

    Attributes:
        model: The model that it belongs to.
        data: The data.
        owner: Mark of the `CoalDistance` whose placements it holds.
    """

    model: Any = None
    data: Any = None
    owner: object = None


_scratch = _Scratch()


class CoalDistance:
    """Distances of a scene's pairs along a motion, counted."""

    def __init__(self, scene: Scene, motion: Motion, limit: int) -> None:
        self.scene, self.motion, self.limit, self.queries = scene, motion, limit, 0
        if _scratch.model is not scene.model:
            _scratch.model, _scratch.data = scene.model, scene.model.createData()
        self._model, self._data, self._token = scene.model, _scratch.data, object()
        self._shapes = scene.shapes
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()
        self._request.gjk_tolerance = GJK_TOLERANCE
        self._request.gjk_max_iterations = GJK_ITERATIONS
        self._t = np.nan

    def __call__(self, pair: int, t: float) -> float:
        """Return the distance of a pair at t; negative where bodies overlap.

        Raises:
            QueryLimit: If that would be one query too many.
        """
        if self.queries >= self.limit:
            raise QueryLimit
        self.queries += 1
        if t != self._t or _scratch.owner is not self._token:
            pin.forwardKinematics(self._model, self._data, self.motion.at(t))
            self._t, _scratch.owner = t, self._token
        (one, first), (two, second) = (self._placed(int(body)) for body in self.scene.pairs[pair])
        self._result.clear()
        return float(coal.distance(one, first, two, second, self._request, self._result))

    def _placed(self, body: int) -> tuple[Any, Any]:
        shape, joint, local = self._shapes[body]
        placement = self._data.oMi[joint] * local
        return shape, coal.Transform3s(placement.rotation, placement.translation)


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
    """Coal's findings on an interval for one pair.

    Attributes:
        least: Least distance [length unit].
        at: t of it.
        first: t of the first distance at or below the level; inf if none.
        proven: Lower bound before `first`.
    """

    least: float
    at: float
    first: float
    proven: float


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
            d = distance(pair, middle)
            least, at = min((least, at), (d, middle))
            if d > goals.level:
                stack.append(((middle, d), (b, d_b)))
            else:
                stack.clear()  # later intervals do not matter any more
            stack.append(((a, d_a), (middle, d)))
    return Leaf(least, at, np.inf, proven)


class LeafGoals(NamedTuple):
    """The question that coal answers on an interval.

    Attributes:
        goal: Distance that is to be proven at least.
        level: The first instant is wanted at which the distance is at or below it.
        slack: Coal's error.
        known: An upper bound of the least distance of the scene.
        resolution: See `Goal`.
        floor: See `Goal`.
    """

    goal: float
    level: float
    slack: float
    known: float
    resolution: float
    floor: float

    def target(self, upper: float) -> float:
        """Return the lower bound that is enough while `upper` is the least distance found."""
        if not 0.0 < upper < np.inf or self.resolution == np.inf:
            return self.goal
        return max(self.goal, upper - min(max(self.resolution * upper, self.floor), 0.5 * upper))
