"""The objective of Lavoie & Boudreau 2001 without its collisions: position error and turning."""

from typing import ClassVar

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.vectors import LANES, load, root, select, spread, store
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import VECTOR, U
from evoexp.robots.planar_ends import PlanarArm, block_ends, load_lanes
from evoexp.validation import Component, NonNegative


class Reaching(Component):
    """Weights of Eq. 4."""

    component: ClassVar[str] = "reaching"

    position_weight: NonNegative  # w1, of the distance between tip and target [1/length unit]
    displacement_weight: NonNegative  # w2, of the Euclidean distance between the postures [1/rad]

    @property
    def weights(self) -> tuple[float, float]:
        """As the kernel takes them."""
        return self.position_weight, self.displacement_weight


@kernel
def measure_reach(
    starts: FloatArray,  # (N, individuals) relative joint angles [rad]
    ends: FloatArray,  # (N, individuals) [rad]
    lanes: IntArray,  # (≥ count + LANES) indices of the individuals; behind `count` overwritten
    count: int,
    arm: PlanarArm,
    target: FloatArray,  # (2,) desired place of the tip [length unit]
    box: FloatArray,  # least and greatest x, least and greatest y; a tip on its edge is inside
    weights: tuple[float, float],  # w1, w2
    cost: FloatArray,  # (individuals,) written: Eq. 4
    error: FloatArray,  # (individuals,) written: Eq. 1 [length unit]
    displacement: FloatArray,  # (individuals,) written: Eq. 2 [rad]
) -> None:
    """Write Eqs. 1, 2 and 4 of some individuals without collisions; inf if the tip is outside."""
    rows = len(starts) * LANES
    begin, end, outside = np.empty(rows), np.empty(rows), spread(np.inf)
    x, y, found = np.empty(rows + LANES), np.empty(rows + LANES), np.empty(3 * LANES)
    for first in range(0, count, LANES):
        # tips of a block
        load_lanes(starts, lanes, first, count, begin)
        load_lanes(ends, lanes, first, count, end)
        block_ends(begin, end, arm, 1, 1, x, y)
        # displacement (Eq. 2), position error (Eq. 1), cost (Eq. 4)
        squares = spread(0.0)
        for k in range(len(starts)):
            turn = load(begin, U(k) * VECTOR) - load(end, U(k) * VECTOR)
            squares = squares + turn * turn
        tip_x, tip_y = load(x, U(rows)), load(y, U(rows))
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
