"""How fast bodies can move: bounds that hold for every configuration of a motion.

A point p on joints j moves at most at Σ |q̇_j| × (distance of p from axis j), a prismatic joint
adding |q̇_j| itself. `reaches` bounds these distances for all points of a body, whatever the
configuration; a pair of bodies can approach at most at the sum over the joints that carry one of
the two and not the other: what carries both moves neither against the other.
"""

import numpy as np

from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.elementary import sincos

FRAME = 12
"""Numbers of a frame: nine of its rotation, row by row, three of its origin."""

# [-] an axis is parallel to its parent's if the cosine between them differs from ±1 by less
PARALLEL = 1e-12


@inlined
def configuration(coefficients, u, q):  # type: ignore[no-untyped-def]
    """Write q (nq,) at u on the segment of `coefficients` (4, nq)."""
    for k in range(len(q)):
        c1, c2, c3 = coefficients[1, k], coefficients[2, k], coefficients[3, k]
        q[k] = coefficients[0, k] + u * (c1 + u * (c2 + u * c3))


@inlined
def joint_frames(table, q, frames):  # type: ignore[no-untyped-def]
    """Write the frames (joints, FRAME) of a kinematic table's joints at one configuration."""
    parent, index_q, prismatic, turned, rotation, translation = table
    for k in range(len(parent)):
        p, value = parent[k], q[index_q[k]]
        s, c = (0.0, 1.0) if prismatic[k] else sincos(value)
        slide = value if prismatic[k] else 0.0
        dx, dy, dz = translation[k, 0], translation[k, 1], translation[k, 2]
        for e in range(3):
            if p < 0:
                x, y, z = rotation[k, 3 * e], rotation[k, 3 * e + 1], rotation[k, 3 * e + 2]
                origin = translation[k, e]
            else:
                a, b, g = frames[p, 3 * e], frames[p, 3 * e + 1], frames[p, 3 * e + 2]
                origin = frames[p, 9 + e] + (a * dx + b * dy + g * dz)
                x, y, z = a, b, g
                if turned[k]:
                    x = a * rotation[k, 0] + b * rotation[k, 3] + g * rotation[k, 6]
                    y = a * rotation[k, 1] + b * rotation[k, 4] + g * rotation[k, 7]
                    z = a * rotation[k, 2] + b * rotation[k, 5] + g * rotation[k, 8]
            frames[k, 3 * e] = x * c + y * s
            frames[k, 3 * e + 1] = y * c - x * s
            frames[k, 3 * e + 2] = z
            frames[k, 9 + e] = origin + z * slide


@inlined
def joint_twists(table, coefficients, u, frames, twists):  # type: ignore[no-untyped-def]
    """Write how joints' frames move (joints, 6) per u.

    Turning ω, and the velocity of what is at the world's origin.

    A point x moves at that velocity + ω × x.
    """
    parent, index_q, prismatic = table[0], table[1], table[2]
    for k in range(len(parent)):
        p, j = parent[k], index_q[k]
        rate = coefficients[1, j] + u * (2.0 * coefficients[2, j] + u * 3.0 * coefficients[3, j])
        zx, zy, zz = rate * frames[k, 2], rate * frames[k, 5], rate * frames[k, 8]
        x, y, z = frames[k, 9], frames[k, 10], frames[k, 11]
        for e in range(6):
            twists[k, e] = twists[p, e] if p >= 0 else 0.0
        if prismatic[k]:
            twists[k, 3] += zx
            twists[k, 4] += zy
            twists[k, 5] += zz
        else:
            twists[k, 0] += zx
            twists[k, 1] += zy
            twists[k, 2] += zz
            twists[k, 3] += y * zz - z * zy
            twists[k, 4] += z * zx - x * zz
            twists[k, 5] += x * zy - y * zx


@kernel
def moved_by_one(table, joint, pairs):  # type: ignore[no-untyped-def]
    """(pairs,) true where no joint carries both bodies."""
    out = np.ones(len(pairs), dtype=np.bool_)
    for pair in range(len(pairs)):
        a = joint[pairs[pair, 0]]
        while a >= 0:
            b = joint[pairs[pair, 1]]
            while b >= 0:
                if a == b:
                    out[pair] = False
                b = table[0][b]
            a = table[0][a]
    return out


@kernel
def reaches(table, joint, from_origin, from_axis, strokes):  # type: ignore[no-untyped-def]
    """How far any point of each body can be from each joint's axis.

    1 for prismatic joints, 0 for those not above it.

    Args:
        table: The kinematic table's first six fields.
        joint: (bodies,) index into the table of the joint that carries a body, −1 for none.
        from_origin: (bodies,) greatest distance of a body's points from the origin of that joint.
        from_axis: (bodies,) the same from its axis.
        strokes: (nq,) greatest |q| in the motion.

    Returns:
        (bodies, joints).
    """
    parent, index_q, prismatic, _, rotation, translation = table
    out = np.zeros((len(joint), len(parent)))
    for body in range(len(joint)):
        k, ball, turn = joint[body], from_origin[body], from_axis[body]
        while k >= 0:
            out[body, k] = 1.0 if prismatic[k] else turn
            x, y, z = translation[k, 0], translation[k, 1], translation[k, 2]
            slide = strokes[index_q[k]] if prismatic[k] else 0.0
            beside = np.sqrt(x * x + y * y)
            parallel = (
                abs(abs(rotation[k, 8]) - 1.0) < PARALLEL
            )  # then the joint moves nothing away from its own axis
            turn = beside + (turn if parallel else ball + slide)
            ball = np.sqrt(x * x + y * y + z * z) + ball + slide
            k = parent[k]
    return out


@kernel
def pair_reaches(pairs, reach):  # type: ignore[no-untyped-def]
    """(pairs, joints): how much each joint's speed can change the distance of a pair."""
    out = np.zeros((len(pairs), reach.shape[1]))
    for pair in range(len(pairs)):
        one, two = pairs[pair, 0], pairs[pair, 1]
        for k in range(reach.shape[1]):
            if reach[one, k] == 0.0 or reach[two, k] == 0.0:
                out[pair, k] = reach[one, k] + reach[two, k]
    return out


@inlined
def approach_bounds(table, coefficients, begin, end, by_joint, out, above):  # type: ignore[no-untyped-def]
    """Write bounds (2, pairs) of |d distance / du| and of points' |accelerations| on [begin.

    End] of a segment.

    Joint j adds to the acceleration of what it carries, at a distance r from its axis, at most r
    (|q̈_j| + q̇_j² + 2 |q̇_j| Σ |q̇_i|) over the turning joints i that carry it: centripetal and
    Coriolis.

    Args:
        table: The kinematic table.
        coefficients: (4, nq) of the segment.
        begin: Of the interval.
        end: Of the interval.
        by_joint: (pairs, joints) from `pair_reaches`; accelerations hold for pairs that are
            `moved_by_one` only.
        out: (2, pairs), written.
        above: (joints,) scratch: the sum of |q̇| of the turning joints up to each.
    """
    parent, index_q, prismatic = table[0], table[1], table[2]
    out[:] = 0.0
    for k in range(len(parent)):
        j, p = index_q[k], parent[k]
        c1, c2, c3 = coefficients[1, j], 2.0 * coefficients[2, j], 3.0 * coefficients[3, j]
        first, last = abs(c1 + begin * (c2 + begin * c3)), abs(c1 + end * (c2 + end * c3))
        speed = max(first, max(last, abs(c1 + 0.5 * c2 * (begin + end) + c3 * begin * end)))
        carried = above[p] if p >= 0 else 0.0
        turning = 0.0 if prismatic[k] else speed
        above[k] = carried + turning
        change = max(abs(c2 + 2.0 * c3 * begin), abs(c2 + 2.0 * c3 * end))
        change += speed * (turning + 2.0 * carried)
        if speed > 0.0 or change > 0.0:
            for pair in range(out.shape[1]):
                out[0, pair] += speed * by_joint[pair, k]
                out[1, pair] += change * by_joint[pair, k]
