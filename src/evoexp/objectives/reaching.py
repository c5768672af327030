"""The objective of Lavoie & Boudreau 2001 without its collisions: position error and turning."""

from typing import ClassVar

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import sincos
from evoexp.numeric.vectors import LANES, load, root, select, spread, store
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U
from evoexp.robots.planar_ends import VECTOR, PlanarArm, block_ends, load_lanes
from evoexp.validation import Component, NonNegative


class Reaching(Component):
    """Weights of Eq. 4.

    Attributes:
        position_weight: w1, of the distance between tip and target [1/length unit].
        displacement_weight: w2, of the Euclidean distance between the postures [1/rad].
    """

    component: ClassVar[str] = "reaching"

    position_weight: NonNegative
    displacement_weight: NonNegative

    @property
    def weights(self) -> tuple[float, float]:
        """As the kernel takes them."""
        return self.position_weight, self.displacement_weight


@kernel
def measure_reach(
    starts: FloatArray,
    ends: FloatArray,
    lanes: IntArray,
    count: int,
    arm: PlanarArm,
    target: FloatArray,
    box: FloatArray,
    weights: tuple[float, float],
    cost: FloatArray,
    error: FloatArray,
    displacement: FloatArray,
) -> None:
    """Write Eqs. 1, 2 and 4 of some individuals without collisions; inf if the tip is outside.

    Args:
        starts: (N, individuals) relative joint angles [rad].
        ends: (N, individuals).
        lanes: (≥ count + LANES) indices of the individuals; entries behind `count` are overwritten.
        count: Number of individuals.
        arm: See `planar_ends.block_ends`.
        target: Desired place of the tip (x, y).
        box: Least and greatest x, least and greatest y; a tip on its edge is inside.
        weights: w1, w2.
        cost: (individuals,) written: Eq. 4.
        error: (individuals,) written: Eq. 1 [length unit].
        displacement: (individuals,) written: Eq. 2 [rad].
    """
    rows = len(starts) * LANES
    begin, end = np.empty(rows), np.empty(rows)
    x, y, found = np.empty(rows + LANES), np.empty(rows + LANES), np.empty(3 * LANES)
    for first in range(0, count, LANES):
        # tips of a block
        load_lanes(starts, lanes, first, count, begin)
        load_lanes(ends, lanes, first, count, end)
        block_ends(begin, end, arm, 1, 1, x, y)
        # displacement (Eq. 2)
        squares = spread(0.0)
        for k in range(len(starts)):
            turn = load(begin, U(k) * VECTOR) - load(end, U(k) * VECTOR)
            squares = squares + turn * turn
        # position error (Eq. 1), cost (Eq. 4)
        tip_x, tip_y, outside = load(x, U(rows)), load(y, U(rows)), spread(np.inf)
        off_x, off_y = tip_x - target[0], tip_y - target[1]
        off, turned = root(off_x * off_x + off_y * off_y), root(squares)
        worth = weights[0] * off + weights[1] * turned
        worth = select(tip_x < box[0], outside, worth)
        worth = select(box[1] < tip_x, outside, worth)
        worth = select(tip_y < box[2], outside, worth)
        worth = select(box[3] < tip_y, outside, worth)
        store(found, U(0), worth)
        store(found, VECTOR, off)
        store(found, U(2) * VECTOR, turned)
        for n in range(min(LANES, count - first)):
            individual = lanes[first + n]
            cost[individual], error[individual], displacement[individual] = (
                found[n],
                found[LANES + n],
                found[2 * LANES + n],
            )


@kernel
def measure_reach_from(
    start: FloatArray,
    ends: FloatArray,
    count: int,
    arm: PlanarArm,
    target: FloatArray,
    box: FloatArray,
    weights: tuple[float, float],
    cost: FloatArray,
    error: FloatArray,
    displacement: FloatArray,
) -> None:
    """Measure a whole table of individuals from one start, bit for bit as `measure_reach` does.

    Nothing is gathered, and only the tip is computed: joint after joint, all individuals at once.

    Args:
        start: (N,) [rad].
        ends: (N, ≥ count).
        count: Number of individuals.
        arm: See `planar_ends.block_ends`.
        target: As of `measure_reach`, and so are `box` and `weights`.
        box: See there.
        weights: See there.
        cost: (≥ count,) written, and so are `error` and `displacement`.
        error: See there.
        displacement: See there.
    """
    lengths, base_x, base_y, base_angle = arm
    angle = np.empty(count)
    tip_x, tip_y, turned = cost, error, displacement  # sums, until the last joint
    for n in range(count):
        angle[n], tip_x[n], tip_y[n], turned[n] = base_angle, base_x, base_y, 0.0
    # links one after the other
    for k in range(len(start)):
        row, begin, length = ends[k], start[k], lengths[k]
        for n in range(count):
            direction, turn = angle[n] + row[n], begin - row[n]
            s, c = sincos(direction)
            tip_x[n] += length * c
            tip_y[n] += length * s
            turned[n] += turn * turn
            angle[n] = direction
    # errors and costs in place of the sums
    for n in range(count):
        x, y = tip_x[n], tip_y[n]
        off_x, off_y = x - target[0], y - target[1]
        off, way = np.sqrt(off_x * off_x + off_y * off_y), np.sqrt(turned[n])
        worth = weights[0] * off + weights[1] * way
        worth = worth if box[0] <= x else np.inf
        worth = worth if x <= box[1] else np.inf
        worth = worth if box[2] <= y else np.inf
        worth = worth if y <= box[3] else np.inf
        cost[n], error[n], displacement[n] = worth, off, way
