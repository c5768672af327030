"""Kernels of encounters: the shapes of a body against obstacles, or against another body's.

An encounter is a configuration of the batch in which a body is near an obstacle or another body.
Its frames are gathered here; its distances are measured by `primitive_distances` and
`segment_distances`.
"""

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.models.packed_shapes import (
    BOXES,
    CORE_SIZE,
    CYLINDERS,
    FIRST_CAPSULE,
    FIRST_RUN,
    JOINT,
    STOP_CAPSULE,
    STOP_RUN,
    TURN,
    PackedObstacles,
    PackedShapes,
    Units,
)
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
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import SPATIAL_FRAME, VECTOR
from evoexp.robots.kinematics import SPATIAL_ROWS, U


@kernel
def body_meets_obstacles(
    width: int,
    c: int,
    unit: int,
    units: Units,
    shapes: PackedShapes,
    obstacles: PackedObstacles,
    lane_of: NDArray[np.uint64],
    obstacle_of: NDArray[np.uint64],
    frames: FloatArray,
    place: NDArray[np.uint64],
    work: FloatArray,
    best: FloatArray,
) -> None:
    """Lower `best` to the clearances of a body from obstacles of one class.

    Args:
        width: Encounters.
        c: Class of the obstacles.
        unit: The body.
        units: Bodies and parts.
        shapes: Their shapes.
        obstacles: The obstacles.
        lane_of: (width,) lanes of the encounters.
        obstacle_of: (width,) obstacles of the encounters.
        frames: Frames of all joints and blocks.
        place: (lanes,) offset of each lane in `frames`.
        work: Scratch.
        best: Lowered.
    """
    runs, spheres, capsules = shapes.runs, shapes.spheres, shapes.capsules
    whole = units.whole
    # the body's frame and the obstacle's, and the motion from one to the other
    _gather(width, whole[unit, JOINT], lane_of, frames, place, FRAME, work)
    _gather_obstacles(width, obstacles.data, obstacle_of, work)
    _relative(width, work)
    # spheres, then capsules
    first, stop = whole[unit, FIRST_RUN], whole[unit, STOP_RUN]
    if first < stop:
        if c == BOXES:
            spheres_to_boxes(width, runs, spheres, first, stop, work)
        elif c == CYLINDERS:
            spheres_to_cylinders(width, runs, spheres, first, stop, work)
        else:
            spheres_to_half_spaces(width, runs, spheres, first, stop, work)
    for i in range(whole[unit, FIRST_CAPSULE], whole[unit, STOP_CAPSULE]):
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
def body_meets_body(
    width: int,
    one: int,
    two: int,
    units: Units,
    shapes: PackedShapes,
    lane_of: NDArray[np.uint64],
    frames: FloatArray,
    place: NDArray[np.uint64],
    work: FloatArray,
) -> None:
    """Write the clearances of two bodies to VALUE, as seen from the first one's frame.

    Args:
        width: Encounters.
        one: First unit, whose shapes are constants.
        two: Second unit.
        units: See `body_meets_obstacles`, as for the next.
        shapes: See there.
        lane_of: (width,) lanes of the encounters.
        frames: Frames of all joints and blocks.
        place: (lanes,) offset of each lane in `frames`.
        work: Scratch.
    """
    runs, spheres, capsules = shapes.runs, shapes.spheres, shapes.capsules
    whole = units.whole
    # both bodies' frames, and the motion from the second's to the first's
    _gather(width, whole[one, JOINT], lane_of, frames, place, BASE, work)
    _gather(width, whole[two, JOINT], lane_of, frames, place, FRAME, work)
    _relative(width, work)
    first, stop = whole[two, FIRST_RUN], whole[two, STOP_RUN]
    begin, end = (runs[first, 0], runs[stop - 1, 1]) if first < stop else (0, 0)
    rods, own_rods = whole[two, FIRST_CAPSULE], whole[one, FIRST_CAPSULE]
    for j in range(begin, end):
        x, y, z = spheres[j, 0], spheres[j, 1], spheres[j, 2]
        move(width, x, y, z, 1.0, CENTERS + U(j - begin) * U(3) * W, work)
    # the second's spheres against the first's spheres and capsules
    for run in range(whole[one, FIRST_RUN], whole[one, STOP_RUN]):
        spheres_to_spheres(width, runs, spheres, run, first, stop, work)
    for i in range(own_rods, whole[one, STOP_CAPSULE]):
        for j in range(begin, end):
            both = capsules[i, 6] + spheres[j, 3]
            segment_to_points(width, capsules[i], CENTERS + U(j - begin) * U(3) * W, both, work)
    # the second's capsules against both
    for j in range(rods, whole[two, STOP_CAPSULE]):
        _move_segment(width, capsules[j], work)
        inverse, thickness = capsules[j, 7], capsules[j, 6]
        for run in range(whole[one, FIRST_RUN], whole[one, STOP_RUN]):
            for i in range(runs[run, 0], runs[run, 1]):
                segments_to_point(width, spheres[i], inverse, thickness + spheres[i, 3], work)
        for i in range(own_rods, whole[one, STOP_CAPSULE]):
            segment_to_segments(width, capsules[i], inverse, capsules[i, 6] + thickness, work)


@kernel
def _move_segment(width: int, capsule: FloatArray, work: FloatArray) -> None:
    """Write a capsule's axis as MOTION sees it to STARTS and AXES."""
    move(width, capsule[0], capsule[1], capsule[2], 1.0, STARTS, work)
    move(width, capsule[3], capsule[4], capsule[5], 0.0, AXES, work)


@kernel
def _gather(
    width: int,
    joint: int,
    lane_of: NDArray[np.uint64],
    frames: FloatArray,
    place: NDArray[np.uint64],
    target: np.uint64,
    work: FloatArray,
) -> None:
    """Copy the frames of one joint in the encounters' configurations to rows at `target`."""
    j = U(joint) * SPATIAL_FRAME
    for n in range(width):
        begin, o = place[lane_of[U(n)]] + j, target + U(n)
        for row in range(SPATIAL_ROWS):
            work[o + U(row) * W] = frames[begin + U(row) * VECTOR]


@kernel
def _gather_obstacles(
    width: int, data: FloatArray, obstacle_of: NDArray[np.uint64], work: FloatArray
) -> None:
    """Copy the frames of the encounters' obstacles to BASE, and their cores' sizes to CORE."""
    for n in range(width):
        o, k = obstacle_of[U(n)], U(n)
        for row in range(9):
            work[BASE + U(row) * W + k] = data[o, TURN + row]
        for row in range(3):
            work[BASE + U(9 + row) * W + k] = data[o, row]
        for row in range(4):
            work[CORE + U(row) * W + k] = data[o, CORE_SIZE + row]


@kernel
def _relative(width: int, work: FloatArray) -> None:
    """Write MOTION, which is FRAME as seen from BASE, and begin VALUE with +inf."""
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
