"""Link ends of a planar arm along straight joint-space paths, for whole populations.

Eq. 3 below is that of Lavoie & Boudreau 2001: position j of M is `start + j/M (end − start)`.
"""

from typing import NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import atan2, sincos
from evoexp.records import FloatArray, IntArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import U

LANES = 32  # individuals per block


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
    """Return the lengths and the base of a built robot that is one planar arm.

    Raises:
        SettingError: If it is another robot.
    """
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


@kernel
def block_ends(
    starts: FloatArray,
    ends: FloatArray,
    arm: PlanarArm,
    position: int,
    num_positions: int,
    angle: FloatArray,
    at_x: FloatArray,
    at_y: FloatArray,
    x: FloatArray,
    y: FloatArray,
) -> None:
    """Write the base and the link ends of a block at one position, rows 0 … N of `LANES`.

    Args:
        starts: (N × LANES) joint angles [rad].
        ends: (N × LANES).
        arm: The arm.
        position: j of Eq. 3; at j = M the end itself is taken, without any rounding.
        num_positions: M.
        angle: (LANES,) scratch: running sums are kept apart from what is written, or the loop stays
            scalar.
        at_x: (LANES,) likewise.
        at_y: (LANES,) likewise.
        x: ((N + 1) × LANES) written.
        y: Likewise.
    """
    share, last = position / num_positions, position == num_positions
    angle[:], at_x[:], at_y[:] = arm.base_angle, arm.base_x, arm.base_y
    x[:LANES], y[:LANES] = arm.base_x, arm.base_y
    for k in range(len(arm.lengths)):
        row, length = U(k) * U(LANES), arm.lengths[k]
        for n in range(LANES):
            lane, to = U(n), row + U(LANES) + U(n)
            begin, end = starts[row + lane], ends[row + lane]
            between = begin + share * (end - begin)
            turned = angle[lane] + (end if last else between)
            s, c = sincos(turned)
            tip_x, tip_y = at_x[lane] + length * c, at_y[lane] + length * s
            angle[lane], at_x[lane], at_y[lane], x[to], y[to] = turned, tip_x, tip_y, tip_x, tip_y


@kernel
def begin_turning(
    starts: FloatArray,
    ends: FloatArray,
    arm: PlanarArm,
    position: int,
    num_positions: int,
    angle: FloatArray,
    step: FloatArray,
    turn: FloatArray,
) -> None:
    """Write the directions of the links at one position, and their turns to the next.

    Args:
        starts: (N × LANES) joint angles [rad].
        ends: (N × LANES).
        arm: See `block_ends`.
        position: j of Eq. 3.
        num_positions: M.
        angle: (LANES,) scratch.
        step: (LANES,) scratch.
        turn: (4, N × LANES) written: sine and cosine of every link's direction, and of its turn per
            position.
    """
    sine, cosine, turn_sine, turn_cosine = turn[0], turn[1], turn[2], turn[3]
    share = position / num_positions
    angle[:], step[:] = arm.base_angle, 0.0
    for k in range(len(arm.lengths)):
        for n in range(LANES):
            lane, place = U(n), U(k) * U(LANES) + U(n)
            begin, way = starts[place], ends[place] - starts[place]
            angle[lane] += begin + share * way
            step[lane] += way / num_positions
            sine[place], cosine[place] = sincos(angle[lane])
            turn_sine[place], turn_cosine[place] = sincos(step[lane])


@kernel
def turned_ends(
    arm: PlanarArm,
    at_x: FloatArray,
    at_y: FloatArray,
    turn: FloatArray,
    x: FloatArray,
    y: FloatArray,
) -> None:
    """Turn all links on by one position and write their ends, as `block_ends`, without sines.

    Every turn adds some 2e-16 to the error of a direction, so callers begin anew by
    `begin_turning` now and then.

    Args:
        arm: See `block_ends`.
        at_x: (LANES,) scratch.
        at_y: (LANES,) scratch.
        turn: See `begin_turning`, changed.
        x: ((N + 1) × LANES) written but for the base.
        y: Likewise.
    """
    sine, cosine, turn_sine, turn_cosine = turn[0], turn[1], turn[2], turn[3]
    at_x[:], at_y[:] = arm.base_x, arm.base_y
    x[:LANES], y[:LANES] = arm.base_x, arm.base_y
    for k in range(len(arm.lengths)):
        row, length = U(k) * U(LANES), arm.lengths[k]
        for n in range(LANES):
            lane, place, to = U(n), row + U(n), row + U(LANES) + U(n)
            # the angle-sum formulas
            s, c, u, v = sine[place], cosine[place], turn_sine[place], turn_cosine[place]
            next_s, next_c = s * v + c * u, c * v - s * u
            tip_x, tip_y = at_x[lane] + length * next_c, at_y[lane] + length * next_s
            sine[place], cosine[place], at_x[lane], at_y[lane] = next_s, next_c, tip_x, tip_y
            x[to], y[to] = tip_x, tip_y


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
