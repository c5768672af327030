"""Kernel of clearances: the least ones of bodies made of spheres and capsules, or their signs.

Eight configurations at a time, as vectors (`numeric.vectors`): forward kinematics; the centres of
balls around bodies and parts of bodies; balls against obstacles and against each other. What no
ball rules out in any of the eight is measured exactly. Bounds are widened by `MARGIN`, so rounding
rules out no contact, and the result does not depend on what was skipped.
"""

import numpy as np

from evoexp.collision.bodies.body_tables import (
    AROUND,
    FIRST_BALL,
    FIRST_CAPSULE,
    FIRST_HALF_SPACE,
    FIRST_PART,
    FIRST_RUN,
    JOINT,
    MARGIN,
    REACH,
    SELF,
    STOP_CAPSULE,
    STOP_ENTRY,
    STOP_PART,
    STOP_RUN,
    THICKNESS,
    BodyTables,
    FlatTables,
    Memory,
    Motion,
    Place,
    Row,
    between_spheres,
    distance_from_core,
    mapped_distance,
    memory_of,
    moved_point,
    named_tables,
    place_point,
    point_at,
    seen_from,
    squared_distance,
    store_point,
    turned,
)
from evoexp.collision.bodies.capsule_distances import (
    Segments,
    nearest_on_segments,
    segment_to_point,
    segment_to_segments,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import (
    LANES,
    Vector,
    any_lane,
    load,
    lower,
    magnitude,
    select,
    spread,
    store,
    upper,
)
from evoexp.records import FloatArray
from evoexp.robots.kinematics import SPATIAL_FRAME, VECTOR, U, coordinate, eight_of, spatial_frames
from evoexp.scenarios.obstacles import HALF_SPACE

ROUNDING = 1e-12  # [-] of squared coordinates, more than their errors


@kernel
def least_clearances(
    tables: FlatTables, limit: float, decide: bool, q: FloatArray, out: FloatArray
) -> None:
    """Write the least clearances of a batch of configurations.

    Args:
        tables: Of `tables.flattened`.
        limit: Above it no clearance is measured [length unit].
        decide: Whether only their sign is asked for: all rows are the same then, and negative where
            anything overlaps. The limit is 0.
        q: (nq, configurations) [rad], lengths for joints that slide; contiguous.
        out: (3, configurations), written: rows OBSTACLES, BETWEEN, SELF; NaN where q holds NaN.
    """
    named = named_tables(tables[0], tables[1])
    memory = memory_of(named, q.shape[0])
    _least_clearances(named, limit, decide, False, q.reshape(-1), q.shape[1], out, memory)


@kernel
def num_free(tables: FlatTables, q: FloatArray) -> int:
    """Return how many configurations come before the eight among which the first collides.

    All of them if none collides, or holds NaN. The search ends at the first contact that it meets,
    so configurations that are likely to collide should come first. See `least_clearances`.
    """
    named, out = named_tables(tables[0], tables[1]), np.empty((3, q.shape[1]))
    memory = memory_of(named, q.shape[0])
    return _least_clearances(named, 0.0, True, True, q.reshape(-1), q.shape[1], out, memory)


@kernel
def _least_clearances(
    tables: BodyTables,
    limit: float,
    decide: bool,
    at_first: bool,
    q: FloatArray,
    count: int,
    out: FloatArray,
    memory: Memory,
) -> int:
    """Do the work of `least_clearances` in given memory, so that no loop counts references.

    Returns the number of configurations that were decided: all of them, unless it left `at_first`.
    """
    tables, q, out, memory = borrowed((tables, q, out, memory))
    units, least = tables.units, memory.least
    for first in range(0, count, LANES):
        # frames of the joints; the limit, NaN where q holds NaN
        eight, sound = eight_of(q, first, count, memory.q), spread(limit)
        for k in range(U(len(memory.q)) // VECTOR):
            sound = sound + coordinate(eight, k) * 0.0
        spatial_frames(tables.chain, eight, 1.0, memory.frames)
        memory.placed[-1] = first
        for row in range(3):
            store(least, U(row) * VECTOR, sound)
        # from the tip, which is nearest to most obstacles, to the base
        for b in range(len(units) - 1, -1, -1):
            begin, stop = units[b, FIRST_BALL], units[b, STOP_ENTRY]
            if decide and not _may_overlap(tables, memory, b, begin, stop):
                continue
            for t in range(begin, stop):
                if not decide or _may_overlap(tables, memory, b, t, t + 1):
                    _meet_obstacle(tables, memory, b, tables.owners[t], decide)
            if _is_over(memory, decide, at_first):
                break
        for m in range(len(tables.maps)):
            line = U(0) if decide else U(SELF) * VECTOR
            _lower(memory, line, mapped_distance(tables, m, eight, memory), decide)
        is_over = _is_over(memory, decide, at_first)
        for p in range(0 if is_over else len(tables.pairs)):
            pair = tables.pairs[p]
            line = U(0) if decide else U(pair[4]) * VECTOR
            if _are_near(tables, memory, pair[0], pair[1], line):
                for t in range(pair[2], pair[3]):
                    a, b = tables.parts[t, 0], tables.parts[t, 1]
                    if _are_near(tables, memory, a, b, line):
                        _lower(memory, line, _between(tables, memory, a, b, decide), decide)
                if _is_over(memory, decide, at_first):
                    break
        for row in range(3):
            own = 0 if decide else row * LANES
            for lane in range(min(LANES, count - first)):
                out[row, first + lane] = least[own + lane]
        collides = select(load(least, U(0)) >= 0.0, spread(0.0), spread(1.0)) > 0.0
        if at_first and any_lane(collides):
            return first
    return count


@inlined
def _is_over(memory: Memory, decide: bool, at_first: bool) -> bool:
    """Return whether eight configurations need no further test: all collide, or one will do."""
    clearances = load(memory.least, U(0))
    return decide and (any_lane(clearances < 0.0) if at_first else not any_lane(clearances >= 0.0))


@inlined
def _middle(tables: BodyTables, memory: Memory, unit: int) -> Place:
    """Return the centre of a unit's ball, computed once."""
    if memory.placed[unit] != memory.placed[-1]:
        memory.placed[unit] = memory.placed[-1]
        joint = tables.units[unit, JOINT]
        place_point(memory.frames, joint, tables.balls[unit], memory.middles, U(unit))
    return point_at(memory.middles, U(unit))


@inlined
def _lower(memory: Memory, row: np.uint64, found: Vector, decide: bool) -> None:
    """Lower a row of the least clearances, to −inf where only a sign is asked for; NaN stays."""
    so_far = load(memory.least, row)
    if decide:
        found = select(found < 0.0, spread(-np.inf), found)
    store(memory.least, row, select(found < so_far, found, so_far))


@inlined
def _may_overlap(tables: BodyTables, memory: Memory, b: int, first: int, stop: int) -> bool:
    """Return whether a body's ball meets that of an obstacle, where it may be free yet."""
    entries, least, flat = tables.entries, spread(np.inf), tables.units[b, FIRST_HALF_SPACE]
    x, y, z = _middle(tables, memory, b)
    square, zero = x * x + y * y + z * z, spread(0.0)
    for t in range(first, stop):
        k = U(t)
        value = (x * entries[k, 0] + y * entries[k, 1]) + (z * entries[k, 2] + entries[k, 3])
        least = lower(least, value + (square if t < flat else zero))
    near = ROUNDING * (square + tables.scale * tables.scale)
    return any_lane(least < select(load(memory.least, U(0)) >= 0.0, near, spread(-np.inf)))


@inlined
def _is_near(tables: BodyTables, memory: Memory, unit: int, o: int) -> bool:
    """Return whether a unit's ball may be nearer to an obstacle than the clearance so far."""
    # by the obstacle's ball, then by the box that it is, or that is around it
    center, turn, core = tables.obstacles.center[o], tables.obstacles.rotation[o], tables.cores[o]
    reach, least, zero = tables.balls[unit, REACH], load(memory.least, U(0)), spread(0.0)
    middle = _middle(tables, memory, unit)
    if tables.obstacles.kind[o] == HALF_SPACE:
        level = turn[2] * center[0] + turn[5] * center[1] + turn[8] * center[2]
        height = turn[2] * middle[0] + turn[5] * middle[1] + turn[8] * middle[2] - level
        return any_lane(height < least + (reach * MARGIN + abs(level) * (MARGIN - 1.0)))
    within = upper(zero, (least + (reach + core[AROUND]) * MARGIN) * MARGIN)
    square = squared_distance(middle, (center[0], center[1], center[2]))
    if not any_lane(square < within * within):
        return False
    within = (least + (reach + core[THICKNESS]) * MARGIN) * MARGIN
    x, y, z = seen_from(center, turn, middle)
    u, v, w = magnitude(x) - core[0], magnitude(y) - core[1], magnitude(z) - core[2]
    deeper = upper(upper(u, v), w) < lower(zero, within)
    within = upper(zero, within)
    u, v, w = upper(u, zero), upper(v, zero), upper(w, zero)
    return any_lane((u * u + v * v + w * w < within * within) | deeper)


@inlined
def _meet_obstacle(tables: BodyTables, memory: Memory, b: int, o: int, decide: bool) -> None:
    """Lower the clearance from obstacles to that of a body from one; far parts are skipped."""
    units = tables.units
    if not _is_near(tables, memory, b, o):
        return
    first, stop = units[b, FIRST_PART], units[b, STOP_PART]
    for part in range(first, stop):
        if stop - first == 1 or _is_near(tables, memory, part, o):
            # the motion from the body's frame to the obstacle's
            center, turn = tables.obstacles.center[o], tables.obstacles.rotation[o]
            motion = _seen_from(
                (turn[0], turn[1], turn[2], center[0]),
                (turn[3], turn[4], turn[5], center[1]),
                (turn[6], turn[7], turn[8], center[2]),
                _frame(memory.frames, units[b, JOINT]),
            )
            _lower(memory, U(0), _from_obstacle(tables, part, o, motion), decide)


@inlined
def _from_obstacle(tables: BodyTables, unit: int, o: int, motion: Motion) -> Vector:
    """Return the clearances of a unit from an obstacle into whose frame a motion leads."""
    units, runs, spheres, capsules = tables.units, tables.runs, tables.spheres, tables.capsules
    kind, core, least = tables.obstacles.kind[o], tables.cores[o], spread(np.inf)
    for run in range(units[unit, FIRST_RUN], units[unit, STOP_RUN]):
        for i in range(runs[run, 0], runs[run, 1]):
            point = moved_point(motion, spheres[i, 0], spheres[i, 1], spheres[i, 2])
            distance = distance_from_core(kind, core, point)
            least = lower(least, distance - (core[THICKNESS] + spheres[i, 3]))
    for i in range(units[unit, FIRST_CAPSULE], units[unit, STOP_CAPSULE]):
        point = nearest_on_segments(kind, core, _moved_axis(motion, capsules[i]))
        distance = distance_from_core(kind, core, point)
        least = lower(least, distance - (core[THICKNESS] + capsules[i, 6]))
    return least


@inlined
def _are_near(tables: BodyTables, memory: Memory, one: int, two: int, row: np.uint64) -> bool:
    """Return whether the balls around two units may be nearer than the clearance so far."""
    margin = (tables.balls[one, REACH] + tables.balls[two, REACH]) * MARGIN
    within = upper(spread(0.0), (load(memory.least, row) + margin) * MARGIN)
    a, b = _middle(tables, memory, one), _middle(tables, memory, two)
    return any_lane(squared_distance(a, b) < within * within)


@inlined
def _between(tables: BodyTables, memory: Memory, one: int, two: int, decide: bool) -> Vector:
    """Return the clearances of two units; where their signs will do, up to rounding."""
    if decide and len(tables.capsules) == 0:
        # spheres in the world, which all pairs share; signs that rounding could change are left
        _place_spheres(tables, memory, one)
        _place_spheres(tables, memory, two)
        least = between_spheres(tables, memory.centers, one, two, spread(np.inf))
        x, y, z = _middle(tables, memory, one)
        scale = tables.scale + (magnitude(x) + magnitude(y) + magnitude(z))
        if not any_lane(magnitude(least) < ROUNDING * scale):
            return least
        memory.known[:] = -1.0
    return _between_in_frame(tables, memory, one, two)


@inlined
def _place_spheres(tables: BodyTables, memory: Memory, unit: int) -> None:
    """Compute the centres of a unit's spheres in the world, once."""
    units, runs = tables.units, tables.runs
    if memory.known[unit] != memory.placed[-1]:
        memory.known[unit] = memory.placed[-1]
        first, stop = units[unit, FIRST_RUN], units[unit, STOP_RUN]
        for k in range(runs[first, 0], runs[stop - 1, 1]):
            place_point(memory.frames, units[unit, JOINT], tables.spheres[k], memory.centers, U(k))


@inlined
def _between_in_frame(tables: BodyTables, memory: Memory, one: int, two: int) -> Vector:
    """Return the clearances of two units, as seen from the first one's frame."""
    units, runs, spheres, capsules = tables.units, tables.runs, tables.spheres, tables.capsules
    centers = memory.centers
    x, y, z = _frame(memory.frames, units[one, JOINT])
    motion = _seen_from(x, y, z, _frame(memory.frames, units[two, JOINT]))
    # the first's spheres as they are, the second's as seen from there
    for run in range(units[one, FIRST_RUN], units[one, STOP_RUN]):
        for i in range(runs[run, 0], runs[run, 1]):
            place = spread(spheres[i, 0]), spread(spheres[i, 1]), spread(spheres[i, 2])
            store_point(centers, U(i), place)
    for run in range(units[two, FIRST_RUN], units[two, STOP_RUN]):
        for j in range(runs[run, 0], runs[run, 1]):
            place = moved_point(motion, spheres[j, 0], spheres[j, 1], spheres[j, 2])
            store_point(centers, U(j), place)
    # the second's spheres against the first's spheres and capsules
    least = between_spheres(tables, centers, one, two, spread(np.inf))
    for i in range(units[one, FIRST_CAPSULE], units[one, STOP_CAPSULE]):
        for run in range(units[two, FIRST_RUN], units[two, STOP_RUN]):
            for j in range(runs[run, 0], runs[run, 1]):
                center = point_at(centers, U(j))
                distance = segment_to_point(_axis(capsules[i]), capsules[i, 7], center)
                least = lower(least, distance - (capsules[i, 6] + spheres[j, 3]))
    # the second's capsules against both
    for j in range(units[two, FIRST_CAPSULE], units[two, STOP_CAPSULE]):
        segments, thickness = _moved_axis(motion, capsules[j]), capsules[j, 6]
        for run in range(units[one, FIRST_RUN], units[one, STOP_RUN]):
            for i in range(runs[run, 0], runs[run, 1]):
                distance = segment_to_point(segments, capsules[j, 7], point_at(centers, U(i)))
                least = lower(least, distance - (thickness + spheres[i, 3]))
        for i in range(units[one, FIRST_CAPSULE], units[one, STOP_CAPSULE]):
            distance = segment_to_segments(capsules[i], segments, capsules[j, 7])
            least = lower(least, distance - (capsules[i, 6] + thickness))
    return least


@inlined
def _axis(capsule: FloatArray) -> Segments:
    return Segments((capsule[0], capsule[1], capsule[2]), (capsule[3], capsule[4], capsule[5]))


@inlined
def _moved_axis(motion: Motion, capsule: FloatArray) -> Segments:
    x, y, z = capsule[3], capsule[4], capsule[5]
    axis = turned(motion[0], x, y, z), turned(motion[1], x, y, z), turned(motion[2], x, y, z)
    return Segments(moved_point(motion, capsule[0], capsule[1], capsule[2]), axis)


@inlined
def _frame(frames: FloatArray, joint: int) -> Motion:
    """Return the frames of a joint, or of the world."""
    j = U(joint) * SPATIAL_FRAME
    return _frame_row(frames, j, 0), _frame_row(frames, j, 1), _frame_row(frames, j, 2)


@inlined
def _frame_row(frames: FloatArray, j: np.uint64, e: int) -> Row:
    """Return row e of frames: three numbers of the rotation, one of the origin."""
    x, origin = j + U(3 * e) * VECTOR, j + U(9 + e) * VECTOR
    return (
        load(frames, x),
        load(frames, x + VECTOR),
        load(frames, x + U(2) * VECTOR),
        load(frames, origin),
    )


@inlined
def _seen_from(x: Row, y: Row, z: Row, frame: Motion) -> Motion:
    """Return frames as seen from the frames whose rows are x, y and z, vectors or numbers."""
    shift = frame[0][3] - x[3], frame[1][3] - y[3], frame[2][3] - z[3]
    return (
        _column_seen(x[0], y[0], z[0], frame, shift),
        _column_seen(x[1], y[1], z[1], frame, shift),
        _column_seen(x[2], y[2], z[2], frame, shift),
    )


@inlined
def _column_seen(a: Vector, b: Vector, c: Vector, frame: Motion, shift: Place) -> Row:
    """Return the columns of frames and a shift, along the direction (a, b, c)."""
    x, y, z = frame
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
        a * shift[0] + b * shift[1] + c * shift[2],
    )
