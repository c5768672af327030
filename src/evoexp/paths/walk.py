"""New strings of via-points by a random walk to the goal (Rana & Zalzala 1995, section 3.3)."""

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray, IntArray


def num_uniforms(arm_slices: np.ndarray, num_via_points: int) -> int:
    """Return the number of uniform numbers of one string: N − 1 times the arm's joints less one."""
    return int(sum((num_via_points - 1) * (stop - first - 1) for first, stop in arm_slices))


@kernel
def walk_strings(
    via_points: FloatArray,  # (nq, N + 1, lanes), written in the given lanes
    lanes: IntArray,  # (strings,) where to write
    uniforms: FloatArray,  # (strings, num_uniforms) in [0, 1)
    start: FloatArray,  # (nq,)
    goal: FloatArray,  # (nq,)
    arm_slices: IntArray,  # (arms, 2) rows of each arm
    step: float,  # step length in units of D / N
    max_turn: float,  # turns are uniform in ± this [rad]
) -> None:
    """Write new strings into some lanes.

    Every arm takes N − 1 steps of length step · D / N, D its straight distance from start to goal.
    A step goes in the direction of the goal, each of whose angles is turned by a uniform random
    angle: in the plane of two joints the one angle, in space azimuth and elevation, and so on. The
    goal itself is the last point. An arm of one joint has no angle to turn.
    """
    via_points, lanes, uniforms = borrowed((via_points, lanes, uniforms))
    num, here, direction = via_points.shape[1] - 1, np.empty(len(start)), np.empty(len(start))
    for s in range(len(lanes)):
        lane, taken = lanes[s], 0
        via_points[:, 0, lane], via_points[:, num, lane] = start, goal
        here[:] = start
        for arm in range(len(arm_slices)):
            first, stop = arm_slices[arm, 0], arm_slices[arm, 1]
            squared = 0.0
            for j in range(first, stop):
                squared += (goal[j] - start[j]) * (goal[j] - start[j])
            length = step * np.sqrt(squared) / num
            for i in range(1, num):
                # the direction of the goal, turned; one angle less than joints
                for j in range(first, stop):
                    direction[j] = goal[j] - here[j]
                scale = length * _turn(direction, first, stop, uniforms[s], taken, max_turn)
                taken += stop - first - 1
                for j in range(first, stop):
                    here[j] = here[j] + scale * direction[j]
                    via_points[j, i, lane] = here[j]


@inlined
def _turn(
    direction: FloatArray,
    first: int,
    stop: int,
    uniforms: FloatArray,
    taken: int,  # place of the first number
    max_turn: float,
) -> float:
    """Turn the hyperspherical angles of an arm's direction; return the factor to unit length.

    The azimuth is turned first. The angle of coordinate k stands between the axis k and the vector
    of the coordinates before it, of length `below`. Turning it takes (below, direction[k]) around;
    the coordinates before keep their proportions. A direction straight along a later axis has
    azimuth 0.
    """
    x = direction[first]
    if stop - first == 1:
        return 0.0 if x == 0.0 else 1.0 / abs(x)
    y = direction[first + 1]
    sine, cosine = sincos((2.0 * uniforms[taken] - 1.0) * max_turn)
    below = np.sqrt(x * x + y * y)
    one, two = x * cosine - y * sine, x * sine + y * cosine
    direction[first], direction[first + 1] = one, two
    one, two = (one / below, two / below) if below != 0.0 else (cosine, sine)
    for k in range(first + 2, stop):
        sine, cosine = sincos((2.0 * uniforms[taken + k - first - 1] - 1.0) * max_turn)
        turned = below * cosine - direction[k] * sine
        beyond = below * sine + direction[k] * cosine
        for j in range(first, k):
            alone = direction[j]
            if j < first + 2:
                alone = turned * (one if j == first else two)
            direction[j] = alone if below == 0.0 else direction[j] * (turned / below)
        direction[k] = beyond
        below = np.sqrt(turned * turned + beyond * beyond)
    return 0.0 if below == 0.0 else float(1.0 / below)
