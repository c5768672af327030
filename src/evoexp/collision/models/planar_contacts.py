"""Kernel of yes and no for touching circles in the plane, links as equal steps along lines.

Of two links whose circles stand at equal steps along lines, the circle of one that is nearest to a
given circle of the other follows by rounding: |d + i e − j f|² is a parabola in j. So a link of n
circles and one of m take n steps instead of n · m. The angles of a chain are summed, not its
rotations multiplied. Each step of the way is done for several vectors of eight configurations
before the next: neighbouring operations wait for no result of each other.

Answers that rounding errors could change are left to the kernel `clearances`, and so are robots in
space or among obstacles: the answer is the sign of its clearance.
"""

from typing import Any

import numpy as np

from evoexp.collision.models.obstacle_kernels import MARGIN
from evoexp.collision.models.sphere_kernels import (
    LinkLines,
    Memory,
    SphereTables,
    memory_for,
    named_tables,
    write_clearances,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import DEGREE, sincos
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
from evoexp.records import FloatArray, IntArray
from evoexp.robots.forward_kinematics import PLANAR_FRAME, VECTOR, Eight, eight_of
from evoexp.robots.kinematics import KinematicChain, U

BLOCK = 8
"""Vectors that go through each step together."""

ROUNDING = 1e-12
"""Squared distances that differ from the limit by less, times the squared scale, are in doubt."""

LARGEST_Q = 1e4
"""[deg] beyond it everything is in doubt, and NaN."""

_ROUND = 1.5 * 2.0**52  # adding it rounds to an integer

LINE = U(4) * VECTOR
"""Numbers of a line of eight configurations: first centre, step."""

OF_JOINT, OF_LINE = U(BLOCK) * PLANAR_FRAME, U(BLOCK) * LINE
"""The same of a block."""


@kernel
def contacts(tables: tuple[Any, ...], q: FloatArray, start: int, out: FloatArray) -> None:
    """Decide which configurations collide.

    Args:
        tables: See `clearances`.
        q: (nq, configurations) [deg], contiguous.
        start: The first one that is asked for.
        out: (configurations − start,) written: negative where spheres overlap.
    """
    named = named_tables(tables)
    memory, count, flat = memory_for(named), q.shape[1], q.reshape(-1)
    if named.space is None and len(named.obstacles.kind) == 0 and named.lines.scale < np.inf:
        frames = np.empty(U(len(named.chain.parent)) * OF_JOINT)
        lines = np.empty(U(len(named.bounds.joint)) * OF_LINE)
        least = np.empty(BLOCK * LANES)
        _contacts(named, flat, count, start, out, memory, frames, lines, least)
    else:
        _exact_contacts(named, flat, count, start, count, out, memory)


@kernel
def _contacts(
    tables: SphereTables,
    q: FloatArray,
    count: int,
    start: int,
    out: FloatArray,
    memory: Memory,
    frames: FloatArray,
    lines: FloatArray,
    least: FloatArray,
) -> None:
    """Do the work of `contacts` in given memory, so that inner loops count no references."""
    tables, q, out, memory, frames, lines, least = borrowed(
        (tables, q, out, memory, frames, lines, least)
    )
    limit = 4.0 * tables.spheres.radius * tables.spheres.radius
    slack = ROUNDING * tables.lines.scale * tables.lines.scale
    reach = np.sqrt(limit + 2.0 * slack) * MARGIN
    first = start
    while first < count:
        vectors = min(BLOCK, max((count - first) // LANES, 1))
        eight = eight_of(q, first, count, memory.q)
        _sum_angles(tables.chain, tables.lines.turn, eight, vectors, frames, least)
        _place_joints(tables.chain, vectors, frames)
        _place_lines(tables.bounds.joint, tables.lines.line, vectors, frames, lines)
        # squared distances of the arms, as far as they are below the limit
        for v in range(vectors):
            own = U(v) * VECTOR
            sound = load(least, own) < LARGEST_Q
            store(least, own, select(sound, spread(limit + 2.0 * slack), spread(limit)))
        _between_arms(tables.bounds.arm_links, tables.lines, reach, vectors, lines, least)
        for v in range(vectors):
            begin, found = first + v * LANES, load(least, U(v) * VECTOR)
            sure = select(spread(slack) < magnitude(found - limit), spread(1.0), spread(0.0))
            if any_lane(sure < 1.0) or begin + LANES > count:
                stop = min(begin + LANES, count)
                _exact_contacts(tables, q, count, begin, stop, out[begin - start :], memory)
            else:
                store(out, U(begin - start), found - limit)
        first += vectors * LANES


@kernel
def _exact_contacts(
    tables: SphereTables,
    q: FloatArray,
    count: int,
    start: int,
    stop: int,
    out: FloatArray,
    memory: Memory,
) -> None:
    """Write the clearances of configurations start … stop − 1, as far as they are below 0."""
    both = np.empty(2 * (stop - start))
    write_clearances(tables, 0.0, False, q, count, start, stop, both, memory)
    for n in range(stop - start):
        out[n] = min(both[n], both[stop - start + n])


@inlined
def _sum_angles(
    chain: KinematicChain,
    turn: FloatArray,
    eight: Eight,
    vectors: int,
    frames: FloatArray,
    total: FloatArray,
) -> None:
    """Write sines, cosines and angles of all joints, and the sum of |q|, of neighbouring eights."""
    for k in range(len(chain.parent)):
        own, before = U(k) * OF_JOINT, U(chain.parent[k]) * OF_JOINT
        place, added = U(chain.index_q[k]) * eight.stride + eight.place, turn[k]
        for v in range(vectors):
            at, frame = U(v) * VECTOR, U(v) * PLANAR_FRAME
            q = load(eight.q, place + at)
            angle = q * DEGREE + added
            if chain.parent[k] >= 0:
                angle = angle + load(frames, before + frame + U(2) * VECTOR)
            s, c = sincos(angle)
            store(frames, own + frame, s)
            store(frames, own + frame + VECTOR, c)
            store(frames, own + frame + U(2) * VECTOR, angle)
            store(total, at, magnitude(q) + (load(total, at) if k > 0 else spread(0.0)))


@inlined
def _place_joints(chain: KinematicChain, vectors: int, frames: FloatArray) -> None:
    """Write x and y of all joints over their angles."""
    for k in range(len(chain.parent)):
        own, before = U(k) * OF_JOINT, U(chain.parent[k]) * OF_JOINT
        dx, dy = chain.translation[k, 0], chain.translation[k, 1]
        for v in range(vectors):
            frame = U(v) * PLANAR_FRAME
            x, y = spread(dx), spread(dy)
            if chain.parent[k] >= 0:
                s, c = load(frames, before + frame), load(frames, before + frame + VECTOR)
                x = load(frames, before + frame + U(2) * VECTOR) + (c * dx - s * dy)
                y = load(frames, before + frame + U(3) * VECTOR) + (s * dx + c * dy)
            store(frames, own + frame + U(2) * VECTOR, x)
            store(frames, own + frame + U(3) * VECTOR, y)


@inlined
def _place_lines(
    joint: IntArray, line: FloatArray, vectors: int, frames: FloatArray, lines: FloatArray
) -> None:
    """Write the first centre of every link, and the step to the next."""
    for k in range(len(joint)):
        x, y, ex, ey = line[k, 0], line[k, 1], line[k, 3], line[k, 4]
        for v in range(vectors):
            j = U(joint[k]) * OF_JOINT + U(v) * PLANAR_FRAME
            s, c = load(frames, j), load(frames, j + VECTOR)
            own = U(k) * OF_LINE + U(v) * LINE
            store(lines, own, load(frames, j + U(2) * VECTOR) + (c * x - s * y))
            store(lines, own + VECTOR, load(frames, j + U(3) * VECTOR) + (s * x + c * y))
            store(lines, own + U(2) * VECTOR, c * ex - s * ey)
            store(lines, own + U(3) * VECTOR, s * ex + c * ey)


@inlined
def _between_arms(
    arm_links: IntArray,
    links: LinkLines,
    reach: float,
    vectors: int,
    lines: FloatArray,
    least: FloatArray,
) -> None:
    """Lower squared distances to the least ones of circles of two arms."""
    for a in range(len(arm_links)):
        for b in range(a + 1, len(arm_links)):
            for one in range(arm_links[a, 0], arm_links[a, 1]):
                for two in range(arm_links[b, 0], arm_links[b, 1]):
                    for v in range(vectors):
                        i = U(one) * OF_LINE + U(v) * LINE
                        j = U(two) * OF_LINE + U(v) * LINE
                        found = load(least, U(v) * VECTOR)
                        found = _nearest_steps(links.line, one, two, lines, i, j, reach, found)
                        store(least, U(v) * VECTOR, found)


@inlined
def _nearest_steps(
    line: FloatArray,
    one: int,
    two: int,
    lines: FloatArray,
    i: np.uint64,
    j: np.uint64,
    reach: float,
    least: Vector,
) -> Vector:
    """Lower a squared distance to the least one of two links' circles, if that is below reach²."""
    n, m, inverse = line[one, 6], line[two, 6], line[two, 7]
    e2, f2, within = line[one, 8], line[two, 8], reach + line[one, 9] + line[two, 9]
    dx, dy = load(lines, i) - load(lines, j), load(lines, i + VECTOR) - load(lines, j + VECTOR)
    ex, ey = load(lines, i + U(2) * VECTOR), load(lines, i + U(3) * VECTOR)
    fx, fy = load(lines, j + U(2) * VECTOR), load(lines, j + U(3) * VECTOR)
    # the balls around both links
    x, y = dx + (ex * (0.5 * n) - fx * (0.5 * m)), dy + (ey * (0.5 * n) - fy * (0.5 * m))
    if not any_lane(x * x + y * y < within * within):
        return least
    # in units of the other's step: |d + i e|² is the squared distance from its first centre, and
    # u the place on its line that is nearest, which is rounded to a step
    square, p = (dx * dx + dy * dy) * inverse, (ex * dx + ey * dy) * (2.0 * inverse)
    w, g, e2 = (fx * dx + fy * dy) * inverse, (ex * fx + ey * fy) * inverse, e2 * inverse
    # from step to step u, the square and its increase grow by sums
    u, increase, twice = w, p + e2, e2 + e2
    found, nothing, last = spread(np.inf), spread(0.0), spread(m)
    for _ in range(int(n) + 1):
        nearest = lower(upper((u + _ROUND) - _ROUND, nothing), last)
        found = lower(found, square + nearest * (nearest - (u + u)))
        u, square, increase = u + g, square + increase, increase + twice
    return lower(least, found * f2)
