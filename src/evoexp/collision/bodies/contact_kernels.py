"""Kernel of yes and no: which configurations of a robot made of spheres collide.

Eight configurations at a time, as vectors (`numeric.vectors`) in registers or in the first-level
cache: forward kinematics; balls around bodies against balls around obstacles, and against each
other; spheres where a ball is met in any lane that is not yet known to collide. Answers that
rounding errors could change are left in doubt, and measured by `clearance_kernels`: so the
answer is the sign of its clearance, whatever the order of operations here.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.body_tables import (
    FIRST_BALL,
    FIRST_HALF_SPACE,
    FIRST_PART,
    FIRST_RUN,
    JOINT,
    REACH,
    STOP_ENTRY,
    STOP_PART,
    STOP_RUN,
    BodyTables,
    FlatTables,
    named_tables,
)
from evoexp.collision.bodies.distances import (
    MARGIN,
    Memory,
    between_spheres,
    mapped_distance,
    memory_of,
    nearest_to_obstacle,
    place_point,
    point_at,
    squared_distance,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import (
    LANES,
    Vector,
    any_lane,
    lower,
    magnitude,
    select,
    spread,
    store,
)
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.forward_kinematics import (
    Eight,
    coordinate,
    eight_of,
    spatial_frames,
)
from evoexp.robots.kinematics import U
from evoexp.scenarios.obstacles import SPHERE

ROUNDING = 1e-12
"""Clearances below this times the scale are in doubt: rounding errors are a hundredth of it."""

LARGEST_Q = 1e6
"""[rad] or [length unit]; beyond it nothing is sure, nor with NaN."""


class Limits(NamedTuple):
    """Bounds of the clearances that are in doubt, lane by lane."""

    slack: Vector  # clearances between ± this are in doubt [length unit]; inf where q is not sound
    wide: Vector  # the same of squares [length unit²]


@kernel
def find_contacts(tables: FlatTables, at_first: bool, q: FloatArray, out: BoolArray) -> int:
    """Decide which configurations collide.

    Args:
        tables: Of `tables.flattened`, without capsules.
        at_first: Whether to leave as soon as one is sure to collide.
        q: (nq, configurations) [rad], lengths for joints that slide; contiguous.
        out: (configurations,) written: whether each collides, true for those in doubt.

    Returns:
        How many are in doubt; −1 − the first of the eight among which one is sure to collide, if it
        left there.
    """
    scene = named_tables(tables[0], tables[1])
    memory = memory_of(scene, q.shape[0])
    return _find_contacts(scene, at_first, q.reshape(-1), q.shape[1], out, memory)


@kernel
def _find_contacts(
    scene: BodyTables, at_first: bool, q: FloatArray, count: int, out: BoolArray, memory: Memory
) -> int:
    """Do the work of `find_contacts` in given memory, so that no loop counts references."""
    scene, q, out, memory = borrowed((scene, q, out, memory))
    doubts = 0
    for first in range(0, count, LANES):
        eight, time = eight_of(q, first, count, memory.q), float(first)
        limits = _limits(scene, eight)
        spatial_frames(scene.chain, eight, 1.0, memory.frames)
        # obstacles, then pairs of bodies, until all eight are known to collide
        least = _meet_obstacles(scene, memory, time, limits, at_first)
        for m in range(len(scene.maps)):
            least = lower(least, mapped_distance(scene, m, eight, memory))
        if not _is_over(least, limits, at_first):
            least = _meet_each_other(scene, memory, time, limits, at_first, least)
        hits = least < -1.0 * limits.slack
        if at_first and any_lane(hits):
            return -1 - first
        # 0: free, 1: in doubt, 2: collides
        state = select(hits, spread(2.0), select(limits.slack < least, spread(0.0), spread(1.0)))
        store(memory.middles, U(0), state)
        for lane in range(min(LANES, count - first)):
            found = memory.middles[U(lane)]
            out[U(first + lane)] = found > 0.0
            doubts += found == 1.0
    return doubts


@inlined
def _limits(scene: BodyTables, eight: Eight) -> Limits:
    """Return the limits of eight configurations."""
    chain, scale, total = scene.chain, spread(scene.scale), spread(0.0)
    for k in range(len(chain.parent)):
        moved = magnitude(coordinate(eight, chain.index_q[k]))
        if chain.rule[k, 0] != 1.0 or chain.rule[k, 1] != 0.0:
            moved = moved * abs(chain.rule[k, 0]) + abs(chain.rule[k, 1])
        total = total + moved
        if chain.prismatic[k]:
            scale = scale + moved
    scale = select(total < LARGEST_Q, scale, spread(np.inf))
    return Limits(ROUNDING * scale, ROUNDING * scale * scale)


@inlined
def _is_over(least: Vector, limits: Limits, at_first: bool) -> bool:
    """Return whether eight configurations need no further test."""
    sure = -1.0 * limits.slack
    return any_lane(least < sure) if at_first else not any_lane(sure < least)


@inlined
def _near(least: Vector, limits: Limits) -> Vector:
    """Return the value below which a lane must be looked at: none once it is known to collide."""
    near: Vector = select(least < -1.0 * limits.slack, spread(-np.inf), limits.wide)
    return near


@inlined
def _place(scene: BodyTables, memory: Memory, unit: int, time: float) -> None:
    """Compute the centre of a unit's ball, once."""
    if memory.placed[unit] != time:
        memory.placed[unit] = time
        joint, ball = scene.units[unit, JOINT], scene.balls[unit]
        place_point(memory.frames, joint, ball, memory.middles, U(unit))


@inlined
def _place_spheres(scene: BodyTables, memory: Memory, unit: int, time: float) -> None:
    """Compute the centres of a unit's spheres, once."""
    units, runs = scene.units, scene.runs
    if memory.known[unit] != time:
        memory.known[unit] = time
        first, stop = units[unit, FIRST_RUN], units[unit, STOP_RUN]
        for k in range(runs[first, 0], runs[stop - 1, 1]):
            place_point(memory.frames, units[unit, JOINT], scene.spheres[k], memory.centers, U(k))


@inlined
def _from_obstacles(
    entries: FloatArray, first: int, stop: int, square: Vector, x: Vector, y: Vector, z: Vector
) -> Vector:
    """Return the least value of some entries at a ball's centre; see `packing`."""
    least = spread(np.inf)
    for t in range(first, stop):
        k = U(t)
        value = (x * entries[k, 0] + y * entries[k, 1]) + (z * entries[k, 2] + entries[k, 3])
        least = lower(least, value)
    return square + least  # rounding keeps the order


@inlined
def _meet_obstacles(
    scene: BodyTables, memory: Memory, time: float, limits: Limits, at_first: bool
) -> Vector:
    """Return the least clearance from obstacles that were looked at."""
    units, entries = scene.units, scene.entries
    least, near = spread(np.inf), limits.wide
    # from the tip, which is nearest to most obstacles, to the base
    for b in range(len(units) - 1, -1, -1):
        first, flat, stop = units[b, FIRST_BALL], units[b, FIRST_HALF_SPACE], units[b, STOP_ENTRY]
        if first == stop:
            continue
        _place(scene, memory, b, time)
        x, y, z = point_at(memory.middles, U(b))
        square, nothing = x * x + y * y + z * z, spread(0.0)
        value = lower(
            _from_obstacles(entries, first, flat, square, x, y, z),
            _from_obstacles(entries, flat, stop, nothing, x, y, z),
        )
        if not any_lane(value < near):
            continue
        # those obstacles that are near, part by part
        for t in range(first, stop):
            base = square if t < flat else nothing
            if any_lane(_from_obstacles(entries, t, t + 1, base, x, y, z) < near):
                least = _measure_obstacle(scene, memory, b, scene.owners[t], time, limits, least)
                near = _near(least, limits)
        if _is_over(least, limits, at_first):
            break
    return least


@inlined
def _is_near(
    scene: BodyTables, memory: Memory, unit: int, o: int, time: float, limits: Limits, least: Vector
) -> bool:
    """Return whether a unit's ball meets an obstacle in a lane that may be free yet, or nearly."""
    _place(scene, memory, unit, time)
    middle = nearest_to_obstacle(scene, o, memory.middles, U(unit), U(unit) + U(1))
    near = select(least < -1.0 * limits.slack, spread(-np.inf), limits.slack)
    return any_lane(middle - scene.balls[unit, REACH] * MARGIN < near)


@inlined
def _measure_obstacle(
    scene: BodyTables, memory: Memory, b: int, o: int, time: float, limits: Limits, least: Vector
) -> Vector:
    """Lower a clearance to that of a body's spheres from an obstacle; far parts are skipped."""
    units, runs = scene.units, scene.runs
    first, stop = units[b, FIRST_PART], units[b, STOP_PART]
    # the ball around a sphere was tested exactly; that around a box is large
    coarse = scene.obstacles.kind[o] != SPHERE and stop - first > 1
    if coarse and not _is_near(scene, memory, b, o, time, limits, least):
        return least
    for part in range(first, stop):
        if _is_near(scene, memory, part, o, time, limits, least):
            _place_spheres(scene, memory, part, time)
            for run in range(units[part, FIRST_RUN], units[part, STOP_RUN]):
                i, end = U(runs[run, 0]), U(runs[run, 1])
                distance = nearest_to_obstacle(scene, o, memory.centers, i, end)
                least = lower(least, distance - scene.spheres[i, 3])
    return least


@inlined
def _meet_each_other(
    scene: BodyTables, memory: Memory, time: float, limits: Limits, at_first: bool, least: Vector
) -> Vector:
    """Lower a clearance to the least one of pairs of bodies that were looked at."""
    pairs, parts, near = scene.pairs, scene.parts, _near(least, limits)
    for p in range(len(pairs)):
        if not _meet(scene, memory, pairs[p, 0], pairs[p, 1], time, near):
            continue
        for t in range(pairs[p, 2], pairs[p, 3]):
            one, two = parts[t, 0], parts[t, 1]
            if _meet(scene, memory, one, two, time, near):
                _place_spheres(scene, memory, one, time)
                _place_spheres(scene, memory, two, time)
                least = between_spheres(scene, memory.centers, one, two, least)
                near = _near(least, limits)
        if _is_over(least, limits, at_first):
            break
    return least


@inlined
def _meet(scene: BodyTables, memory: Memory, one: int, two: int, time: float, near: Vector) -> bool:
    """Return whether the balls around two units meet in any lane, or nearly so."""
    reach = (scene.balls[one, REACH] + scene.balls[two, REACH]) * MARGIN
    _place(scene, memory, one, time)
    _place(scene, memory, two, time)
    a, b = point_at(memory.middles, U(one)), point_at(memory.middles, U(two))
    return any_lane(squared_distance(a, b) - reach * reach < near)
