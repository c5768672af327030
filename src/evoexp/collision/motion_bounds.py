"""Bounds of the speed of bodies that hold for every configuration of a motion.

A point p that the joints j carry moves at most at Σ |q̇_j| × (distance of p from axis j), a
prismatic joint adding |q̇_j| itself. `reaches` bounds these distances for all points of a body and
all configurations. Two bodies approach each other at most at the sum over the joints that carry one
of them; a joint that carries both moves neither against the other.
"""

import numpy as np

from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.elementary import sincos
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import KinematicChain

# [-] an axis is parallel to its parent's if the cosine between them differs from ±1 by less
PARALLEL = 1e-12


@inlined
def joint_frames(chain: KinematicChain, q: FloatArray, frames: FloatArray) -> None:
    """Write the frames of all joints (joints, 12) at one configuration q (nq,)."""
    rotation, translation = chain.rotation, chain.translation
    for k in range(len(chain.parent)):
        p, value = chain.parent[k], chain.rule[k, 0] * q[chain.index_q[k]] + chain.rule[k, 1]
        s, c = (0.0, 1.0) if chain.prismatic[k] else sincos(value)
        slide = value if chain.prismatic[k] else 0.0
        dx, dy, dz = translation[k, 0], translation[k, 1], translation[k, 2]
        for e in range(3):
            # row e of the placement, seen from the world
            if p < 0:
                x, y, z = rotation[k, 3 * e], rotation[k, 3 * e + 1], rotation[k, 3 * e + 2]
                origin = translation[k, e]
            else:
                a, b, g = frames[p, 3 * e], frames[p, 3 * e + 1], frames[p, 3 * e + 2]
                origin = frames[p, 9 + e] + (a * dx + b * dy + g * dz)
                x, y, z = a, b, g
                if chain.turned[k]:
                    x = a * rotation[k, 0] + b * rotation[k, 3] + g * rotation[k, 6]
                    y = a * rotation[k, 1] + b * rotation[k, 4] + g * rotation[k, 7]
                    z = a * rotation[k, 2] + b * rotation[k, 5] + g * rotation[k, 8]
            # the joint turned about z, or moved along it
            frames[k, 3 * e] = x * c + y * s
            frames[k, 3 * e + 1] = y * c - x * s
            frames[k, 3 * e + 2] = z
            frames[k, 9 + e] = origin + z * slide


@inlined
def joint_twists(
    chain: KinematicChain,
    coefficients: FloatArray,
    u: float,
    frames: FloatArray,
    twists: FloatArray,
) -> None:
    """Write the twists of the joints' frames (joints, 6), per u: turning ω, then a velocity v.

    v is the velocity of the point of the frame that is at the world's origin; a point x of the
    frame moves at v + ω × x. The frames are those of `joint_frames` at u in [0, 1].
    """
    for k in range(len(chain.parent)):
        p, j = chain.parent[k], chain.index_q[k]
        rate = coefficients[1, j] + u * (2.0 * coefficients[2, j] + u * 3.0 * coefficients[3, j])
        rate *= chain.rule[k, 0]
        zx, zy, zz = rate * frames[k, 2], rate * frames[k, 5], rate * frames[k, 8]
        x, y, z = frames[k, 9], frames[k, 10], frames[k, 11]
        for e in range(6):
            twists[k, e] = twists[p, e] if p >= 0 else 0.0
        # the joint's own turn about its axis, or slide along it
        if chain.prismatic[k]:
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
def moved_by_one(chain: KinematicChain, joint: IntArray, pairs: IntArray) -> BoolArray:
    """Return (pairs,) true where no joint carries both bodies of a pair; see `reaches`."""
    out = np.ones(len(pairs), dtype=np.bool_)
    for pair in range(len(pairs)):
        a = joint[pairs[pair, 0]]
        while a >= 0:
            b = joint[pairs[pair, 1]]
            while b >= 0:
                if a == b:
                    out[pair] = False
                b = chain.parent[b]
            a = chain.parent[a]
    return out


@kernel
def reaches(
    chain: KinematicChain,
    joint: IntArray,
    from_origin: FloatArray,
    from_axis: FloatArray,
    strokes: FloatArray,
) -> FloatArray:
    """Bound the distance of every body's points from every joint's axis.

    Args:
        joint: (bodies,) index into the table of the joint that carries a body, −1 for none.
        from_origin: (bodies,) greatest distance of a body's points from the origin of that joint.
        from_axis: (bodies,) the same from its axis.
        strokes: (nq,) greatest |q| in the motion.

    Returns:
        (bodies, joints): the bound [length unit]; 1 for prismatic joints, 0 for joints that do not
        carry the body.
    """
    out = np.zeros((len(joint), len(chain.parent)))
    for body in range(len(joint)):
        k, ball, turn = joint[body], from_origin[body], from_axis[body]
        # from the joint that carries the body down to the ground
        while k >= 0:
            out[body, k] = 1.0 if chain.prismatic[k] else turn
            x, y, z = chain.translation[k, 0], chain.translation[k, 1], chain.translation[k, 2]
            stroke = abs(chain.rule[k, 0]) * strokes[chain.index_q[k]] + abs(chain.rule[k, 1])
            slide = stroke if chain.prismatic[k] else 0.0
            beside = np.sqrt(x * x + y * y)
            # then the joint moves nothing away from its parent's axis
            parallel = abs(abs(chain.rotation[k, 8]) - 1.0) < PARALLEL
            turn = beside + (turn if parallel else ball + slide)
            ball = np.sqrt(x * x + y * y + z * z) + ball + slide
            k = chain.parent[k]
    return out


@kernel
def pair_reaches(pairs: IntArray, reach: FloatArray) -> FloatArray:
    """Bound the change of a pair's distance by the speed of each joint, (pairs, joints)."""
    out = np.zeros((len(pairs), reach.shape[1]))
    for pair in range(len(pairs)):
        one, two = pairs[pair, 0], pairs[pair, 1]
        for k in range(reach.shape[1]):
            if reach[one, k] == 0.0 or reach[two, k] == 0.0:
                out[pair, k] = reach[one, k] + reach[two, k]
    return out


@inlined
def approach_bounds(
    chain: KinematicChain,
    coefficients: FloatArray,
    begin: float,
    end: float,
    by_joint: FloatArray,
    out: FloatArray,
    above: FloatArray,
) -> None:
    """Bound |d distance / du| and the points' |accelerations| of all pairs on part of a segment.

    Joint j adds to the acceleration of what it carries, at a distance r from its axis, at most r
    (|q̈_j| + q̇_j² + 2 |q̇_j| Σ |q̇_i|) over the turning joints i that carry it: centripetal and
    Coriolis.

    Args:
        coefficients: (4, nq) of the segment.
        begin: u where the part begins.
        end: u where it ends.
        by_joint: (pairs, joints) from `pair_reaches`; accelerations hold for pairs that are
            `moved_by_one` only.
        out: (2, pairs), written.
        above: (joints,) scratch: the sum of |q̇| of the turning joints up to each.
    """
    out[:] = 0.0
    for k in range(len(chain.parent)):
        j, p = chain.index_q[k], chain.parent[k]
        # the greatest speed: at an end, or not above the third value (Bernstein coefficients)
        c1, c2, c3 = coefficients[1, j], 2.0 * coefficients[2, j], 3.0 * coefficients[3, j]
        first, last = abs(c1 + begin * (c2 + begin * c3)), abs(c1 + end * (c2 + end * c3))
        speed = max(first, max(last, abs(c1 + 0.5 * c2 * (begin + end) + c3 * begin * end)))
        speed *= abs(chain.rule[k, 0])
        carried = above[p] if p >= 0 else 0.0
        turning = 0.0 if chain.prismatic[k] else speed
        above[k] = carried + turning
        # the greatest acceleration: linear in u, then centripetal and Coriolis
        change = max(abs(c2 + 2.0 * c3 * begin), abs(c2 + 2.0 * c3 * end)) * abs(chain.rule[k, 0])
        change += speed * (turning + 2.0 * carried)
        if speed > 0.0 or change > 0.0:
            for pair in range(out.shape[1]):
                out[0, pair] += speed * by_joint[pair, k]
                out[1, pair] += change * by_joint[pair, k]
