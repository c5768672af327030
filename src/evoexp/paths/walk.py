"""New strings of via-points by a random walk to the goal (Rana & Zalzala 1995, section 3.3)."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray, IntArray


def num_uniforms(arm_slices: np.ndarray, num_via_points: int) -> int:
    """Return the number of uniform numbers of one string: N − 1 times the arm's joints less one."""
    return int(sum((num_via_points - 1) * (stop - first - 1) for first, stop in arm_slices))


def walk(
    via_points: FloatArray,
    lanes: np.ndarray,
    uniforms: FloatArray,
    start: FloatArray,
    goal: FloatArray,
    arm_slices: np.ndarray,
    step: float,
    max_turn: float,
) -> None:
    """Write new strings into some lanes.

    Every arm takes N − 1 steps of length step · D / N, D its straight distance from start to goal.
    A step goes in the direction of the goal, each of whose angles is turned by a uniform random
    angle: in the plane of two joints the one angle, in space azimuth and elevation, and so on. The
    goal itself is the last point. An arm of one joint has no angle to turn.

    Args:
        via_points: (nq, N + 1, lanes), written in the given lanes.
        lanes: (strings,) where to write.
        uniforms: (strings, num_uniforms) in [0, 1).
        start: (nq,).
        goal: (nq,).
        arm_slices: (arms, 2) rows of each arm.
        step: Step length in units of D / N.
        max_turn: Turns are uniform in ± this [rad].

    Raises:
        ValueError: If `uniforms` has another shape, or a lane lies outside.
    """
    if not walk_strings(via_points, lanes, uniforms, start, goal, arm_slices, step, max_turn):
        expected = (len(lanes), num_uniforms(arm_slices, via_points.shape[1] - 1))
        limit = via_points.shape[2]
        raise ValueError(
            f"uniforms must have shape {expected}, was {uniforms.shape}; lanes must lie within "
            f"0..{limit - 1}; start, goal and arm_slices must be of {len(via_points)} joints"
        )


@kernel
def walk_strings(
    via_points: FloatArray,
    lanes: IntArray,
    uniforms: FloatArray,
    start: FloatArray,
    goal: FloatArray,
    arm_slices: IntArray,
    step: float,
    max_turn: float,
) -> bool:
    """Run the kernel of `walk`.

    Returns:
        False, with nothing written, if the arrays do not fit.
    """
    num = via_points.shape[1] - 1
    needed = 0
    if len(start) != len(via_points) or len(goal) != len(via_points):
        return False
    for arm in range(len(arm_slices)):
        if not 0 <= arm_slices[arm, 0] < arm_slices[arm, 1] <= len(start):
            return False
        needed += (num - 1) * (arm_slices[arm, 1] - arm_slices[arm, 0] - 1)
    if uniforms.shape[0] != len(lanes) or uniforms.shape[1] != needed:
        return False
    for s in range(len(lanes)):
        if not 0 <= lanes[s] < via_points.shape[2]:
            return False
    here, direction = np.empty(len(start)), np.empty(len(start))
    for s in range(len(lanes)):
        lane, taken = lanes[s], 0
        for arm in range(len(arm_slices)):
            first, stop = arm_slices[arm, 0], arm_slices[arm, 1]
            squared = 0.0
            for j in range(first, stop):
                here[j] = start[j]
                squared += (goal[j] - start[j]) * (goal[j] - start[j])
                via_points[j, 0, lane] = start[j]
                via_points[j, num, lane] = goal[j]
            length = step * np.sqrt(squared) / num
            for i in range(1, num):
                for j in range(first, stop):
                    direction[j] = goal[j] - here[j]
                scale = _turn(direction, first, stop, uniforms, s, taken, max_turn)
                taken += stop - first - 1
                for j in range(first, stop):
                    here[j] += length * scale * direction[j]
                    via_points[j, i, lane] = here[j]
    return True


@kernel
def _turn(
    direction: FloatArray,
    first: int,
    stop: int,
    uniforms: FloatArray,
    s: int,
    taken: int,
    max_turn: float,
) -> float:
    """Turn the hyperspherical angles of a direction; return the factor to unit length.

    The azimuth is turned first. The angle of coordinate k stands between the axis k and the vector
    of the coordinates before it, of length `below`. Turning it takes (below, direction[k]) around;
    the coordinates before keep their proportions. A direction straight along a later axis has
    azimuth 0.
    """
    x = direction[first]
    if stop - first == 1:
        return 0.0 if x == 0.0 else 1.0 / abs(x)
    y = direction[first + 1]
    sine, cosine = sincos((2.0 * uniforms[s, taken] - 1.0) * max_turn)
    below = np.sqrt(x * x + y * y)
    direction[first], direction[first + 1] = x * cosine - y * sine, x * sine + y * cosine
    if below == 0.0:
        unit_x, unit_y = cosine, sine
    else:
        unit_x, unit_y = direction[first] / below, direction[first + 1] / below
    for k in range(first + 2, stop):
        sine, cosine = sincos((2.0 * uniforms[s, taken + k - first - 1] - 1.0) * max_turn)
        here = direction[k]
        turned = below * cosine - here * sine
        direction[k] = below * sine + here * cosine
        if below == 0.0:
            direction[first], direction[first + 1] = turned * unit_x, turned * unit_y
        else:
            for j in range(first, k):
                direction[j] *= turned / below
        below = np.sqrt(turned * turned + direction[k] * direction[k])
    return 0.0 if below == 0.0 else 1.0 / below
