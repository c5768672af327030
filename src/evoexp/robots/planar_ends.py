"""Where the link ends of one planar arm are along straight joint-space paths, for whole populations."""

from typing import NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numerics import atan2, kernel, sincos
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import U

LANES = 64  # individuals per block


class PlanarArm(NamedTuple):
    """One arm of revolute joints in the plane z = 0, its links straight from joint to joint.

    Attributes:
        lengths: (N,) of the links [length unit].
        base_x: Of the first joint.
        base_y: Likewise.
        base_angle: Direction of the first link at angle 0 [rad].
    """

    lengths: FloatArray
    base_x: float
    base_y: float
    base_angle: float


def planar_arm(assembly: Assembly) -> PlanarArm:
    """Return a built robot as a planar arm.

    Raises:
        SettingError: If it is none.
    """
    table, links = assembly.table, assembly.links
    straight = all(not link.start.any() and not link.end[1:].any() for link in links)
    chained = table.planar and np.array_equal(table.parent, np.arange(len(table.parent)) - 1)
    bent = bool(table.turned[1:].any()) or bool(table.translation[:, 2].any())
    if assembly.num_arms != 1 or not straight or not chained or bent or len(links) != len(table.parent):
        joints = ", ".join(f"{stop - first} joints" for first, stop in assembly.arm_slices)
        raise SettingError("robot", "one planar arm in the plane z = 0", joints)
    x, y, _ = table.translation[0]
    angle = float(atan2(table.rotation[0][3], table.rotation[0][0]))
    return PlanarArm(np.array([link.end[0] for link in links]), float(x), float(y), angle)


@kernel
def block_ends(starts, ends, arm, position, num_positions, angle, x, y):  # type: ignore[no-untyped-def]
    """Write the base and the link ends of a block at one position, rows 0 … N of `LANES`.

    Args:
        starts: (N × LANES) joint angles [rad].
        ends: (N × LANES).
        arm: (N,) link lengths; base x, base y, direction of the first link at angle 0 [rad].
        position: j of Eq. 3; at j = M the end itself is taken, without any rounding.
        num_positions: M.
        angle: (LANES,) scratch; afterwards the last link's direction.
        x: ((N + 1) × LANES) written.
        y: Likewise.
    """
    lengths, base_x, base_y, base_angle = arm
    share, last = position / num_positions, position == num_positions
    angle[:] = base_angle
    x[:LANES], y[:LANES] = base_x, base_y
    for k in range(len(lengths)):
        row, length = U(k) * U(LANES), lengths[k]
        for n in range(LANES):
            lane = U(n)
            begin, end = starts[row + lane], ends[row + lane]
            between = begin + share * (end - begin)
            turned = angle[lane] + (end if last else between)
            s, c = sincos(turned)
            angle[lane] = turned
            x[row + U(LANES) + lane] = x[row + lane] + length * c
            y[row + U(LANES) + lane] = y[row + lane] + length * s


@kernel
def load_lanes(q, lanes, first, count, block):  # type: ignore[no-untyped-def]
    """Gather a block of individuals (N × LANES); what is missing is filled with the last one."""
    for k in range(len(q)):
        source = q[k]
        for n in range(LANES):
            block[k * LANES + n] = source[lanes[min(first + n, count - 1)]]
