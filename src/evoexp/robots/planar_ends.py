"""Link ends of a planar arm along joint-space paths, and postures whose tip is at a place.

Eq. 3 below is that of Lavoie & Boudreau 2001: position j of M is `start + j/M (end − start)`.
"""

from typing import NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.elementary import atan2, sincos
from evoexp.numeric.vectors import LANES, load, spread, store
from evoexp.records import FloatArray, IntArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import VECTOR, U

DAMPING = 1e-3  # [-] of a step, in units of the squared length of the arm
CLOSE = 1e-9  # [-] of the arm's length: the tip is there
MOST_STEPS = 200


class PlanarArm(NamedTuple):
    """One arm of revolute joints in the plane z = 0, its links straight from joint to joint."""

    lengths: FloatArray  # (N,) of the links [length unit]
    base_x: float  # of the first joint
    base_y: float  # likewise
    base_angle: float  # direction of the first link at angle 0 [rad]


def planar_arm(assembly: Assembly) -> PlanarArm:
    """Return the lengths and the base of a built robot that is one planar arm."""
    chain, links = assembly.table.chain, assembly.links
    straight = all(not link.start.any() and not link.end[1:].any() for link in links)
    in_a_row = np.array_equal(chain.parent, np.arange(len(chain.parent)) - 1)
    bent = bool(chain.turned[1:].any()) or bool(chain.translation[:, 2].any())
    is_complete = assembly.num_arms == 1 and len(links) == len(chain.parent)
    if not (assembly.table.planar and straight and in_a_row and is_complete) or bent:
        was = ", ".join(f"{stop - first} joints" for first, stop in assembly.arm_slices)
        raise SettingError("robot", "one planar arm in the plane z = 0", was)
    x, y, _ = chain.translation[0]
    angle = float(atan2(chain.rotation[0][3], chain.rotation[0][0]))
    return PlanarArm(np.array([link.end[0] for link in links]), float(x), float(y), angle)


@inlined
def block_ends(
    starts: FloatArray,
    ends: FloatArray,
    arm: PlanarArm,
    position: int,
    num_positions: int,
    x: FloatArray,
    y: FloatArray,
) -> None:
    """Write the base and the link ends of a block at one position, rows 0 … N of `LANES`.

    Args:
        starts: (N × LANES) joint angles [rad].
        ends: (N × LANES).
        position: j of Eq. 3; at j = M the end itself is taken, without any rounding.
        num_positions: M.
        x: ((N + 1) × LANES) written.
    """
    share, last = position / num_positions, position == num_positions
    angle, at_x, at_y = spread(arm.base_angle), spread(arm.base_x), spread(arm.base_y)
    store(x, U(0), at_x)
    store(y, U(0), at_y)
    for k in range(len(arm.lengths)):
        row = U(k) * VECTOR
        begin, end = load(starts, row), load(ends, row)
        angle = angle + (end if last else begin + share * (end - begin))
        s, c = sincos(angle)
        at_x, at_y = at_x + arm.lengths[k] * c, at_y + arm.lengths[k] * s
        store(x, row + VECTOR, at_x)
        store(y, row + VECTOR, at_y)


@kernel
def load_lanes(q: FloatArray, lanes: IntArray, first: int, count: int, block: FloatArray) -> None:
    """Gather a block of individuals (N × LANES), and fill it with the last one where too few are.

    Args:
        q: (N, individuals).
        lanes: (≥ first + LANES) indices of individuals; those behind `count` are overwritten.
        first: Where the block begins among the indices.
        count: How many indices there are.
        block: Written.
    """
    for n in range(count, first + LANES):
        lanes[n] = lanes[count - 1]
    for k in range(len(q)):
        source = q[k]
        for n in range(LANES):
            block[U(k) * U(LANES) + U(n)] = source[U(lanes[U(first) + U(n)])]


@kernel
def tip(q: FloatArray, arm: PlanarArm) -> tuple[float, float]:
    """Return x and y of the tip at q (N,) [rad]."""
    angle, x, y = arm.base_angle, arm.base_x, arm.base_y
    for k in range(len(q)):
        angle += q[k]
        s, c = sincos(angle)
        x += arm.lengths[k] * c
        y += arm.lengths[k] * s
    return x, y


@kernel
def bring_tip_to(q: FloatArray, target: FloatArray, limits: FloatArray, arm: PlanarArm) -> bool:
    """Turn the joints until the tip is at a place: damped least squares (Nakamura & Hanafusa 1986).

    A step is Jᵀ (J Jᵀ + λ)⁻¹ e, put back within the limits of the joints.

    Args:
        q: (N,) posture to begin with [rad], within its limits; changed.
        target: (2,) where the tip shall be.
        limits: (N, 2) of the joints [rad].

    Returns:
        Whether it is there; if not, q is where the last step ended.
    """
    count, reach = len(q), 0.0
    for k in range(count):
        reach += arm.lengths[k]
    damping, close = DAMPING * reach * reach, CLOSE * reach
    x, y = np.empty(count + 1), np.empty(count + 1)
    for _ in range(MOST_STEPS):
        # joints and tip
        angle = arm.base_angle
        x[0], y[0] = arm.base_x, arm.base_y
        for k in range(count):
            angle += q[k]
            s, c = sincos(angle)
            x[k + 1] = x[k] + arm.lengths[k] * c
            y[k + 1] = y[k] + arm.lengths[k] * s
        off_x, off_y = target[0] - x[count], target[1] - y[count]
        if off_x * off_x + off_y * off_y <= close * close:
            return True
        # J Jᵀ + λ; joint k moves the tip by (−(y − y_k), x − x_k)
        a, b, d = damping, 0.0, damping
        for k in range(count):
            u, v = y[k] - y[count], x[count] - x[k]
            a += u * u
            b += u * v
            d += v * v
        determinant = a * d - b * b
        first = (d * off_x - b * off_y) / determinant
        second = (a * off_y - b * off_x) / determinant
        for k in range(count):
            turned = q[k] + (y[k] - y[count]) * first + (x[count] - x[k]) * second
            q[k] = min(max(turned, limits[k, 0]), limits[k, 1])
    return False
