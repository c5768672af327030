"""Kernel of yes and no for touching circles in the plane, links as equal steps along lines.

Of two links whose circles stand at equal steps along lines, the circle of one that is nearest to a
given circle of the other follows by rounding its place on the other's line. So a link of n circles
and one of m take min(n, m) steps instead of n · m. The angles of a chain are summed, not its
rotations multiplied, in quarter turns. Joints and lines are placed for several vectors of eight
configurations before the next, so that constants stay in registers and neighbouring operations wait
for no result of each other: this takes a third of what `clearance_kernels` take for two arms.

Answers that rounding errors could change are left to `least_clearances`, and so are robots in
space or among obstacles.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.bodies.clearance_kernels import least_clearances
from evoexp.collision.bodies.distances import MARGIN
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import DEGREE, atan2
from evoexp.numeric.quarter_turns import QUARTER_TURN, sincos_of_turn
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
    whole,
)
from evoexp.records import FloatArray, IntArray
from evoexp.robots.forward_kinematics import VECTOR, Eight, eight_of
from evoexp.robots.kinematics import KinematicChain, U

ROUNDING = 1e-12
"""Squared distances that differ from the limit by less, times the squared scale, are in doubt."""

LARGEST_Q = 1e4
"""[deg] beyond it everything is in doubt, and NaN."""

BLOCK = 8
"""Vectors that are placed together."""

FRAME = U(5) * VECTOR
"""Numbers of a joint of eight configurations: sine, cosine, x, y, angle in quarter turns."""

LINE = U(4) * VECTOR
"""Numbers of a line of eight configurations: middle, step."""

OF_JOINT, OF_LINE = U(BLOCK) * FRAME, U(BLOCK) * LINE
"""The same of a block."""

X, Y, STEP_X, STEP_Y, STEPS, LENGTH, HALF = range(7)
"""Columns of `LinkLines.line`."""


class LinkLines(NamedTuple):
    """Circles of every link of a planar robot as equal steps along a line."""

    joint: IntArray  # (links,) index into the kinematic table of the joint that moves each
    # (links, 7) x and y of the middle; x and y of the step from one centre to the next, (1, 0)
    # where there is none; number of steps; length of a step; half the length of all, a little more
    line: FloatArray
    arm_links: IntArray  # (arms, 2) first and one-past-last link of each arm
    turn: FloatArray  # (joints,) angle of the placement of each joint [quarter turns]
    radius: float  # of every circle [length unit]
    # bound of all coordinates [length unit]; inf where these are no equal steps in one plane
    scale: float


NO_LINES = LinkLines(
    np.empty(0, np.int64), np.empty((0, 7)), np.empty((0, 2), np.int64), np.empty(0), 0.0, np.inf
)
"""Nothing in equal steps: everything is left to `least_clearances`."""


class CircleTables(NamedTuple):
    """Tables of a robot of touching circles or spheres, or of covered bodies."""

    chain: KinematicChain  # the joints
    lines: LinkLines  # what this kernel reads
    general: tuple[Any, ...]  # tables of `least_clearances`, for all other cases


def link_lines(
    chain: KinematicChain,
    joint: IntArray,
    local: FloatArray,
    radius: float,
    links: IntArray,
    arm_links: IntArray,
) -> LinkLines:
    """Return the circles of every link as equal steps along a line.

    Args:
        joint: (circles,) index into the kinematic table.
        local: (circles, 3) centres in the table's frames [length unit].
        radius: Of every circle.
        links: (links, 2) first and one-past-last circle of each link.
        arm_links: (arms, 2) first and one-past-last link of each arm.
    """
    rows = np.zeros((len(links), HALF + 1))
    reach = np.sqrt((chain.translation**2).sum(axis=1)).sum() + 2.0 * radius
    reach += np.sqrt((local**2).sum(axis=1)).max()
    scale = 2.0 * float(reach)
    for row, (first, stop) in zip(rows, links, strict=True):
        own = local[first:stop]
        steps = len(own) - 1 if (own[-1] != own[0]).any() else 0
        step = (own[-1] - own[0]) / steps if steps else np.array([1.0, 0.0, 0.0])
        length = np.sqrt((step**2).sum())
        row[:2], row[2:4] = (own[0] + 0.5 * steps * step)[:2], step[:2]
        row[4:] = steps, length, 0.5 * steps * length * MARGIN
        places = np.arange(len(own)) if steps else np.zeros(len(own))
        if np.abs(own - (own[0] + np.outer(places, step))).max() > 1e-14 * scale:
            scale = np.inf  # nothing is sure then
    if local[:, 2].any() or chain.translation[:, 2].any():
        scale = np.inf
    turn = np.array([atan2(row[3], row[0]) / QUARTER_TURN for row in chain.rotation])
    return LinkLines(joint[links[:, 0]], rows, arm_links, turn, radius, scale)


@kernel
def contacts(tables: CircleTables, q: FloatArray, start: int, out: FloatArray) -> None:
    """Decide which configurations collide.

    Args:
        q: (nq, configurations) [deg], contiguous.
        start: The first one that is asked for.
        out: (configurations − start,) written: negative where circles overlap.
    """
    lines, count = tables.lines, q.shape[1]
    if lines.scale < np.inf:
        padded = np.empty(U(q.shape[0]) * VECTOR)
        frames = np.empty(U(len(tables.chain.parent)) * OF_JOINT)
        placed = np.empty(U(len(lines.joint)) * OF_LINE)
        total = np.empty(BLOCK * LANES)
        _contacts(tables, q, q.reshape(-1), start, out, padded, frames, placed, total)
    else:
        _general_contacts(tables, q, start, count, out)


@kernel
def _contacts(
    tables: CircleTables,
    q: FloatArray,
    flat: FloatArray,
    start: int,
    out: FloatArray,
    padded: FloatArray,
    frames: FloatArray,
    lines: FloatArray,
    total: FloatArray,
) -> None:
    """Do the work of `contacts` in given memory, so that inner loops count no references."""
    tables, q, flat, out = borrowed((tables, q, flat, out))
    padded, frames, lines, total = borrowed((padded, frames, lines, total))
    joint, line, arm_links, turn, radius, scale = tables.lines
    limit, slack, count = 4.0 * radius * radius, ROUNDING * scale * scale, q.shape[1]
    first = start
    while first < count:
        vectors = min(BLOCK, max((count - first) // LANES, 1))
        eight = eight_of(flat, first, count, padded)
        _place_joints(tables.chain, turn, eight, vectors, frames, total)
        _place_lines(joint, line, vectors, frames, lines)
        for v in range(vectors):
            begin, sound = first + v * LANES, load(total, U(v) * VECTOR) < LARGEST_Q
            # the squared distance of the arms, as far as it is below the limit, or in doubt
            least = select(sound, spread(limit + 2.0 * slack), spread(limit))
            least = _between_arms(arm_links, line, limit, slack, lines, U(v) * LINE, least)
            sure = select(spread(slack) < magnitude(least - limit), spread(1.0), spread(0.0))
            if any_lane(sure < 1.0) or begin + LANES > count:
                stop = min(begin + LANES, count)
                _general_contacts(tables, q, begin, stop, out[begin - start :])
            else:
                store(out, U(begin - start), least - limit)
        first += vectors * LANES


@kernel
def _general_contacts(
    tables: CircleTables, q: FloatArray, start: int, stop: int, out: FloatArray
) -> None:
    """Write to `out` a negative number where one of configurations start … stop − 1 collides."""
    angles, rows = np.empty((q.shape[0], stop - start)), np.empty((3, stop - start))
    for k in range(q.shape[0]):
        for n in range(stop - start):
            angles[k, n] = DEGREE * q[k, start + n]
    least_clearances(tables.general, 0.0, True, angles, rows)
    for n in range(stop - start):
        out[n] = min(rows[0, n], min(rows[1, n], rows[2, n]))


@inlined
def _place_joints(
    chain: KinematicChain,
    turn: FloatArray,
    eight: Eight,
    vectors: int,
    frames: FloatArray,
    total: FloatArray,
) -> None:
    """Write frames of all joints, and the sum of |q|, of neighbouring eights."""
    for k in range(len(chain.parent)):
        own, before = U(k) * OF_JOINT, U(chain.parent[k]) * OF_JOINT
        dx, dy = chain.translation[k, 0], chain.translation[k, 1]
        place, added = U(chain.index_q[k]) * eight.stride + eight.place, turn[k]
        moves = chain.parent[k] >= 0
        for v in range(vectors):
            at, o, b = U(v) * VECTOR, own + U(v) * FRAME, before + U(v) * FRAME
            q = load(eight.q, place + at)
            angle, x, y = q * (DEGREE / QUARTER_TURN) + added, spread(dx), spread(dy)
            if moves:
                s, c = load(frames, b), load(frames, b + VECTOR)
                x = load(frames, b + U(2) * VECTOR) + (c * dx - s * dy)
                y = load(frames, b + U(3) * VECTOR) + (s * dx + c * dy)
                angle = angle + load(frames, b + U(4) * VECTOR)
            s, c = sincos_of_turn(angle)
            store(frames, o, s)
            store(frames, o + VECTOR, c)
            store(frames, o + U(2) * VECTOR, x)
            store(frames, o + U(3) * VECTOR, y)
            store(frames, o + U(4) * VECTOR, angle)
            store(total, at, magnitude(q) + (load(total, at) if k > 0 else spread(0.0)))


@inlined
def _place_lines(
    joint: IntArray, line: FloatArray, vectors: int, frames: FloatArray, lines: FloatArray
) -> None:
    """Write the middle of every link's circles, and the step from one to the next."""
    for k in range(len(joint)):
        x, y, step_x, step_y = line[k, X], line[k, Y], line[k, STEP_X], line[k, STEP_Y]
        for v in range(vectors):
            j, own = U(joint[k]) * OF_JOINT + U(v) * FRAME, U(k) * OF_LINE + U(v) * LINE
            s, c = load(frames, j), load(frames, j + VECTOR)
            mx, my, ex, ey = c * x, s * x, c * step_x, s * step_x
            if y != 0.0 or step_y != 0.0:  # a link that is not along its frame's x axis
                mx, my, ex, ey = mx - s * y, my + c * y, ex - s * step_y, ey + c * step_y
            store(lines, own, load(frames, j + U(2) * VECTOR) + mx)
            store(lines, own + VECTOR, load(frames, j + U(3) * VECTOR) + my)
            store(lines, own + U(2) * VECTOR, ex)
            store(lines, own + U(3) * VECTOR, ey)


@inlined
def _between_arms(
    arm_links: IntArray,
    line: FloatArray,
    limit: float,
    slack: float,
    lines: FloatArray,
    at: np.uint64,
    least: Vector,
) -> Vector:
    """Lower squared distances, of a vector in a block, to the least ones of circles of two arms."""
    reach = np.sqrt(limit + 2.0 * slack) * MARGIN
    for a in range(len(arm_links)):
        for b in range(a + 1, len(arm_links)):
            for one in range(arm_links[a, 0], arm_links[a, 1]):
                for two in range(arm_links[b, 0], arm_links[b, 1]):
                    # the circles of the link that has fewer, each beside the other's line
                    i, j = one, two
                    if line[two, STEPS] < line[one, STEPS]:
                        i, j = two, one
                    least = _nearest_steps(line, i, j, lines, at, reach, limit - slack, least)
    return least


@inlined
def _nearest_steps(
    line: FloatArray,
    one: int,
    two: int,
    lines: FloatArray,
    at: np.uint64,
    reach: float,
    sure: float,
    least: Vector,
) -> Vector:
    """Lower a squared distance to the least one of two links' circles, if that is below reach².

    Lanes whose distance is below `sure` are not looked at.
    """
    half_n, half_m, length = 0.5 * line[one, STEPS], 0.5 * line[two, STEPS], line[two, LENGTH]
    i, j, within = U(one) * OF_LINE + at, U(two) * OF_LINE + at, line[one, HALF] + line[two, HALF]
    # from middle to middle: the balls around both links
    dx, dy = load(lines, i) - load(lines, j), load(lines, i + VECTOR) - load(lines, j + VECTOR)
    within, open_ = reach + within, sure < least
    if not any_lane((dx * dx + dy * dy < within * within) & open_):
        return least
    square, inverse = length * length, 1.0 / (length * length)
    ex, ey = load(lines, i + U(2) * VECTOR), load(lines, i + U(3) * VECTOR)
    fx, fy = load(lines, j + U(2) * VECTOR) * inverse, load(lines, j + U(3) * VECTOR) * inverse
    # along the other's line and across it, in units of its step: one's step, and its middle
    g, h = ex * fx + ey * fy, ey * fx - ex * fy
    u, v = dx * fx + dy * fy, dy * fx - dx * fy
    beyond = magnitude(u) - (magnitude(g) * half_n + half_m)
    beside = magnitude(v) - magnitude(h) * half_n
    if not any_lane((upper(beyond, beside) < reach / length * MARGIN) & open_):
        return least
    # from circle to circle
    u, v = u - g * half_n + half_m, v - h * half_n
    found, nothing, last = spread(np.inf), spread(0.0), spread(2.0 * half_m)
    for _ in range(int(2.0 * half_n) + 1):
        d = u - lower(upper(whole(u), nothing), last)
        found = lower(found, d * d + v * v)
        u, v = u + g, v + h
    return lower(least, found * square)
