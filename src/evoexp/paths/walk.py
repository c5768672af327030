"""New strings of via-points by a random walk to the goal (Rana & Zalzala 1995, section 3.3)."""

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import sincos
from evoexp.numeric.vectors import LANES, Vector, load, magnitude, root, select, spread, store
from evoexp.records import FloatArray, IntArray

VECTOR, ONE = np.uint64(LANES), np.uint64(1)


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
    memory = np.empty((3, len(start) * LANES))
    ends, scratch = (start, goal), (memory[0], memory[1], memory[2])
    for first in range(0, len(lanes), LANES):
        own = slice(first, min(first + LANES, len(lanes)))
        _walk_eight(
            via_points, lanes[own], uniforms[own], ends, arm_slices, step, max_turn, scratch
        )


@kernel
def _walk_eight(
    via_points: FloatArray,
    lanes: IntArray,
    uniforms: FloatArray,
    ends: tuple[FloatArray, FloatArray],
    arm_slices: IntArray,
    step: float,
    max_turn: float,
    scratch: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    """Write up to eight strings, as vectors."""
    via_points, lanes, uniforms, ends, scratch = borrowed(
        (via_points, lanes, uniforms, ends, scratch)
    )
    (start, goal), (here, direction, drawn) = ends, scratch
    num, count, taken = via_points.shape[1] - 1, len(lanes), 0
    drawn[:] = 0.0  # for the lanes without a string
    for arm in range(len(arm_slices)):
        first, stop = np.uint64(arm_slices[arm, 0]), np.uint64(arm_slices[arm, 1])
        squared = 0.0
        for j in range(first, stop):
            store(here, j * VECTOR, spread(start[j]))
            squared += (goal[j] - start[j]) * (goal[j] - start[j])
            for s in range(count):
                via_points[j, 0, lanes[s]] = start[j]
                via_points[j, num, lanes[s]] = goal[j]
        length = step * np.sqrt(squared) / num
        for i in range(1, num):
            # one angle less than joints
            for t in range(stop - first - ONE):
                for s in range(count):
                    drawn[t * VECTOR + np.uint64(s)] = uniforms[s, taken]
                taken += 1
            # the direction of the goal, turned
            for j in range(first, stop):
                store(direction, j * VECTOR, goal[j] - load(here, j * VECTOR))
            scale = length * _turn(direction, first, stop, drawn, max_turn)
            for j in range(first, stop):
                there = load(here, j * VECTOR) + scale * load(direction, j * VECTOR)
                store(here, j * VECTOR, there)
                for s in range(count):
                    via_points[j, i, lanes[s]] = here[j * VECTOR + np.uint64(s)]


@inlined
def _turn(
    direction: FloatArray, first: np.uint64, stop: np.uint64, drawn: FloatArray, max_turn: float
) -> Vector:
    """Turn the hyperspherical angles of eight directions; return the factors to unit length.

    The azimuth is turned first. The angle of coordinate k stands between the axis k and the vector
    of the coordinates before it, of length `below`. Turning it takes (below, direction[k]) around;
    the coordinates before keep their proportions. A direction straight along a later axis has
    azimuth 0.
    """
    x, nothing = load(direction, first * VECTOR), spread(0.0)
    if stop - first == ONE:
        return select(x == nothing, nothing, 1.0 / magnitude(x))
    second = (first + ONE) * VECTOR
    y = load(direction, second)
    sine, cosine = sincos((2.0 * load(drawn, np.uint64(0)) - 1.0) * max_turn)
    flat = below = root(x * x + y * y)
    azimuth_x, azimuth_y = cosine, sine
    turned_x, turned_y = x * cosine - y * sine, x * sine + y * cosine
    store(direction, first * VECTOR, turned_x)
    store(direction, second, turned_y)
    for k in range(first + ONE + ONE, stop):
        sine, cosine = sincos((2.0 * load(drawn, (k - first - ONE) * VECTOR) - 1.0) * max_turn)
        here = load(direction, k * VECTOR)
        turned, lies_on_axis = below * cosine - here * sine, below == nothing
        store(direction, k * VECTOR, below * sine + here * cosine)
        for j in range(first, k):
            before = load(direction, j * VECTOR)
            alone = before
            if j == first:
                alone = turned * select(flat == nothing, azimuth_x, turned_x / flat)
            elif j == first + ONE:
                alone = turned * select(flat == nothing, azimuth_y, turned_y / flat)
            store(direction, j * VECTOR, select(lies_on_axis, alone, before * (turned / below)))
        beyond = load(direction, k * VECTOR)
        below = root(turned * turned + beyond * beyond)
    return select(below == nothing, nothing, 1.0 / below)
