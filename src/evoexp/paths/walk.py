"""New strings of via-points by a random walk from start to goal (Rana & Zalzala 1995, section 3.3)."""

import numpy as np

from evoexp.numerics import kernel, sincos
from evoexp.records import FloatArray


def num_uniforms(arm_slices: np.ndarray, num_via_points: int) -> int:
    """Return how many uniform numbers one string takes: per step an angle fewer than the arm has joints."""
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

    Every arm takes N − 1 steps of length step · D / N, D its straight distance from start to goal. A step goes in the
    direction of the goal, each of whose angles is turned by a uniform random angle: in the plane of two joints the one
    angle, in space azimuth and elevation, and so on. The goal itself is the last point. An arm of one joint has no angle.

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
    expected = (len(lanes), num_uniforms(arm_slices, via_points.shape[1] - 1))
    if uniforms.shape != expected:
        raise ValueError(f"uniforms must have shape {expected}, was {uniforms.shape}")
    if len(lanes) and not 0 <= lanes.min() <= lanes.max() < via_points.shape[2]:
        raise ValueError(f"lanes must lie within 0..{via_points.shape[2] - 1}")
    _walk(via_points, lanes, uniforms, start, goal, arm_slices, step, max_turn)


@kernel
def _walk(via_points, lanes, uniforms, start, goal, arm_slices, step, max_turn):  # type: ignore[no-untyped-def]
    num = via_points.shape[1] - 1
    most = np.max(arm_slices[:, 1] - arm_slices[:, 0])
    here, direction = np.empty(most), np.empty(most)
    for s in range(len(lanes)):
        lane, taken = lanes[s], 0
        for arm in range(len(arm_slices)):
            first, joints = arm_slices[arm, 0], arm_slices[arm, 1] - arm_slices[arm, 0]
            squared = 0.0
            for j in range(joints):
                here[j] = start[first + j]
                squared += (goal[first + j] - here[j]) * (goal[first + j] - here[j])
                via_points[first + j, 0, lane] = here[j]
                via_points[first + j, num, lane] = goal[first + j]
            length = step * np.sqrt(squared) / num
            for i in range(1, num):
                for j in range(joints):
                    direction[j] = goal[first + j] - here[j]
                _turn(direction[:joints], uniforms[s, taken : taken + joints - 1], max_turn)
                taken += joints - 1
                for j in range(joints):
                    here[j] += length * direction[j]
                    via_points[first + j, i, lane] = here[j]


@kernel
def _turn(direction, uniforms, max_turn):  # type: ignore[no-untyped-def]
    """Make a unit vector of a direction and turn its hyperspherical angles, the azimuth first.

    The angle of coordinate k stands between the axis k and what coordinates 0 … k − 1 make up, of length `below`. Turning
    it takes (below, direction[k]) around; the coordinates below keep their proportions.
    """
    if len(direction) == 1:
        direction[0] = 1.0 if direction[0] > 0.0 else (-1.0 if direction[0] < 0.0 else 0.0)
        return
    squared = 0.0
    for k in range(len(direction)):
        squared += direction[k] * direction[k]
    length = np.sqrt(squared)
    if length == 0.0:
        return
    for k in range(len(direction)):
        direction[k] /= length
    s, c = sincos((2.0 * uniforms[0] - 1.0) * max_turn)
    x, y = direction[0], direction[1]
    below = np.sqrt(x * x + y * y)
    if below == 0.0:  # straight along a later axis: its azimuth is taken as 0
        x, y = 1.0, 0.0
    else:
        x, y = x / below, y / below
    unit_x, unit_y = x * c - y * s, x * s + y * c
    direction[0], direction[1] = below * unit_x, below * unit_y
    for k in range(2, len(direction)):
        s, c = sincos((2.0 * uniforms[k - 1] - 1.0) * max_turn)
        here = direction[k]
        turned = below * c - here * s
        direction[k] = below * s + here * c
        if below == 0.0:
            direction[0], direction[1] = turned * unit_x, turned * unit_y
        else:
            for j in range(k):
                direction[j] *= turned / below
        below = np.sqrt(turned * turned + direction[k] * direction[k])
