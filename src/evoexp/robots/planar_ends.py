"""Link ends of a planar arm along straight joint-space paths, eight individuals at a time.

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
from evoexp.robots.kinematics import U

VECTOR = U(LANES)


class PlanarArm(NamedTuple):
    """One arm of revolute joints in the plane z = 0, its links straight from joint to joint."""

    lengths: FloatArray  # (N,) of the links [length unit]
    base_x: float  # of the first joint
    base_y: float  # likewise
    base_angle: float  # direction of the first link at angle 0 [rad]


def planar_arm(assembly: Assembly) -> PlanarArm:
    """Return the lengths and the base of a built robot that is one planar arm."""
    table, links = assembly.table, assembly.links
    straight = all(not link.start.any() and not link.end[1:].any() for link in links)
    chained = table.planar and np.array_equal(table.parent, np.arange(len(table.parent)) - 1)
    bent = bool(table.turned[1:].any()) or bool(table.translation[:, 2].any())
    if (
        assembly.num_arms != 1
        or not straight
        or not chained
        or bent
        or len(links) != len(table.parent)
    ):
        raise SettingError(
            "robot",
            "one planar arm in the plane z = 0",
            ", ".join(f"{stop - first} joints" for first, stop in assembly.arm_slices),
        )
    x, y, _ = table.translation[0]
    angle = float(atan2(table.rotation[0][3], table.rotation[0][0]))
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
