"""Kernels of encounters: the shapes of a body against obstacles, or against those of another body.

An encounter is gathered from the frames of its configuration; what is measured is in
`primitive_distances` and `segment_distances`.
"""

import numpy as np

from evoexp.collision.models.primitive_distances import (
    AXES,
    BASE,
    CENTERS,
    CORE,
    FRAME,
    MOTION,
    STARTS,
    VALUE,
    W,
    move,
    spheres_to_boxes,
    spheres_to_cylinders,
    spheres_to_half_spaces,
    spheres_to_spheres,
)
from evoexp.collision.models.segment_distances import (
    segment_to_boxes,
    segment_to_cylinders,
    segment_to_half_spaces,
    segment_to_points,
    segment_to_segments,
    segments_to_point,
)
from evoexp.numeric.compilation import kernel
from evoexp.robots.kinematics import BLOCK, SPATIAL_ROWS, U

BOXES, CYLINDERS, HALF_SPACES = range(3)
"""Classes of obstacles; spheres and capsules are thickened boxes."""


@kernel
def body_meets_obstacles(width, c, unit, units, shapes, obstacles, near, frames, place, work, best):  # type: ignore[no-untyped-def]
    """Lower `best` to the clearances of a body from obstacles of one class.

    Args:
        width: Encounters.
        c: Class of the obstacles.
        unit: The body.
        units: Of `PrimitiveCollision.tables`, as the next two.
        shapes: See there.
        obstacles: See there.
        near: Lanes and obstacles of the encounters.
        frames: Of all joints and blocks.
        place: Offset of each lane in `frames`.
        work: Scratch.
        best: Lowered.
    """
    runs, spheres, capsules, _ = shapes
    lane_of, obstacle_of = near
    data, whole = obstacles[0], units[0]
    _gather(width, whole[unit, 0], lane_of, frames, place, FRAME, work)
    for n in range(width):
        o, k = obstacle_of[U(n)], U(n)
        for row in range(9):
            work[BASE + U(row) * W + k] = data[o, 3 + row]
        for row in range(3):
            work[BASE + U(9 + row) * W + k] = data[o, row]
        for row in range(4):
            work[CORE + U(row) * W + k] = data[o, 12 + row]
    _relative(width, work)
    first, stop = whole[unit, 1], whole[unit, 2]
    if first < stop:
        if c == BOXES:
            spheres_to_boxes(width, runs, spheres, first, stop, work)
        elif c == CYLINDERS:
            spheres_to_cylinders(width, runs, spheres, first, stop, work)
        else:
            spheres_to_half_spaces(width, runs, spheres, first, stop, work)
    for i in range(whole[unit, 3], whole[unit, 4]):
        _move_segment(width, capsules[i], work)
        if c == BOXES:
            segment_to_boxes(width, capsules[i, 6], work)
        elif c == CYLINDERS:
            segment_to_cylinders(width, capsules[i, 6], work)
        else:
            segment_to_half_spaces(width, capsules[i, 6], work)
    for n in range(width):
        lane = lane_of[U(n)]
        best[lane] = min(best[lane], work[VALUE + U(n)])


@kernel
def body_meets_body(width, one, two, units, shapes, lane_of, frames, place, work):  # type: ignore[no-untyped-def]
    """Write the clearances of two bodies to VALUE, as seen from the first one's frame.

    Args:
        width: Encounters.
        one: First unit, whose shapes are constants.
        two: Second unit.
        units: See `body_meets_obstacles`.
        shapes: See there.
        lane_of: Lanes of the encounters.
        frames: See there.
        place: See there.
        work: Scratch.
    """
    runs, spheres, capsules, _ = shapes
    whole = units[0]
    _gather(width, whole[one, 0], lane_of, frames, place, BASE, work)
    _gather(width, whole[two, 0], lane_of, frames, place, FRAME, work)
    _relative(width, work)
    first, stop = whole[two, 1], whole[two, 2]
    begin, end = (runs[first, 0], runs[stop - 1, 1]) if first < stop else (0, 0)
    for j in range(begin, end):
        move(
            width,
            spheres[j, 0],
            spheres[j, 1],
            spheres[j, 2],
            1.0,
            CENTERS + U(j - begin) * U(3) * W,
            work,
        )
    for run in range(whole[one, 1], whole[one, 2]):
        spheres_to_spheres(width, runs, spheres, run, first, stop, work)
    for i in range(whole[one, 3], whole[one, 4]):
        for j in range(begin, end):
            both = capsules[i, 6] + spheres[j, 3]
            segment_to_points(width, capsules[i], CENTERS + U(j - begin) * U(3) * W, both, work)
    for j in range(whole[two, 3], whole[two, 4]):
        _move_segment(width, capsules[j], work)
        for run in range(whole[one, 1], whole[one, 2]):
            for i in range(runs[run, 0], runs[run, 1]):
                segments_to_point(
                    width, spheres[i], capsules[j, 7], capsules[j, 6] + spheres[i, 3], work
                )
        for i in range(whole[one, 3], whole[one, 4]):
            segment_to_segments(
                width, capsules[i], capsules[j, 7], capsules[i, 6] + capsules[j, 6], work
            )


@kernel
def _move_segment(width, capsule, work):  # type: ignore[no-untyped-def]
    move(width, capsule[0], capsule[1], capsule[2], 1.0, STARTS, work)
    move(width, capsule[3], capsule[4], capsule[5], 0.0, AXES, work)


@kernel
def _gather(width, joint, lane_of, frames, place, target, work):  # type: ignore[no-untyped-def]
    """The frames of one joint in the encounters' configurations."""
    j = U(joint) * U(SPATIAL_ROWS * BLOCK)
    for n in range(width):
        begin, o = place[lane_of[U(n)]] + j, target + U(n)
        for row in range(SPATIAL_ROWS):
            work[o + U(row) * W] = frames[begin + U(row * BLOCK)]


@kernel
def _relative(width, work):  # type: ignore[no-untyped-def]
    """Write MOTION: FRAME as seen from BASE; and begin VALUE with +inf."""
    for row in range(3):
        a, b, c = BASE + U(row) * W, BASE + U(3 + row) * W, BASE + U(6 + row) * W
        for column in range(3):
            o, x = MOTION + U(3 * row + column) * W, FRAME + U(column) * W
            for n in range(width):
                k = U(n)
                y, z = x + U(3) * W + k, x + U(6) * W + k
                work[o + k] = (
                    work[a + k] * work[x + k] + work[b + k] * work[y] + work[c + k] * work[z]
                )
        o = MOTION + U(9 + row) * W
        for n in range(width):
            k = U(n)
            x = work[FRAME + U(9) * W + k] - work[BASE + U(9) * W + k]
            y = work[FRAME + U(10) * W + k] - work[BASE + U(10) * W + k]
            z = work[FRAME + U(11) * W + k] - work[BASE + U(11) * W + k]
            work[o + k] = work[a + k] * x + work[b + k] * y + work[c + k] * z
    for n in range(width):
        work[VALUE + U(n)] = np.inf
