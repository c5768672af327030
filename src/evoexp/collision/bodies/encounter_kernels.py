"""Kernels of encounters: the shapes of a body against obstacles, or against another body's.

An encounter is a configuration of the batch in which a body is near an obstacle or another body.
Encounters are listed (`Encounters`) and measured eight at a time: their frames are gathered here;
their distances come from `primitive_distances` and `segment_distances`.
"""

from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.extending import intrinsic

from evoexp.collision.bodies.packed_shapes import (
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
from evoexp.collision.bodies.primitive_distances import (
    Core,
    Motion,
    Row,
    center_at,
    move_spheres,
    moved_point,
    spheres_to_boxes,
    spheres_to_cylinders,
    spheres_to_half_spaces,
    spheres_to_spheres,
    turned,
)
from evoexp.collision.models.segment_distances import (
    Segments,
    segment_to_points,
    segment_to_segments,
    segments_to_boxes,
    segments_to_cylinders,
    segments_to_half_spaces,
    segments_to_point,
)
from evoexp.numeric.compilation import inlined
from evoexp.numeric.vector_rows import Places, load_each, load_quads
from evoexp.numeric.vectors import LANES, Vector, spread
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import SPATIAL_FRAME, VECTOR
from evoexp.robots.kinematics import U


def _trailing_zeros() -> Any:
    """Return a function for kernels: the index of the lowest bit that is set."""

    @intrinsic
    def lowest_bit(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.cttz(arguments[0], context.get_constant(types.boolean, True))

        return types.uint64(types.uint64), generate

    return lowest_bit


_lowest_bit = _trailing_zeros()


class Encounters(NamedTuple):
    """Lists of encounters."""

    lanes: Places  # configurations of the batch
    frames: Places  # where their frames stand
    obstacles: Places  # where their obstacles stand in `PackedObstacles.data`


@inlined
def listed_from(
    word: np.uint64, first: int, size: np.uint64, obstacle: np.uint64, end: int, near: Encounters
) -> int:
    """List the encounters of a word of bits; see `ball_tests`.

    Args:
        word: Bit k for configuration first + k.
        first: First configuration.
        size: Numbers of the frames of eight configurations.
        obstacle: Place of the obstacle; 0 for pairs of bodies.
        end: One past the last encounter that is listed.
        near: Written from there on.

    Returns:
        One past the last one now.
    """
    while word != U(0):
        lane = U(first) + _lowest_bit(word)
        word &= word - U(1)
        near.lanes[U(end)] = lane
        near.frames[U(end)] = lane // VECTOR * size + lane % VECTOR
        near.obstacles[U(end)] = obstacle
        end += 1
    return end


@inlined
def fill_up(begin: int, end: int, near: Encounters) -> None:
    """Repeat the last encounter of a list until their number is a multiple of eight."""
    last, stop = U(end - 1), begin + (end - begin + LANES - 1) // LANES * LANES
    for k in range(end, stop):
        near.lanes[U(k)] = near.lanes[last]
        near.frames[U(k)] = near.frames[last]
        near.obstacles[U(k)] = near.obstacles[last]


@inlined
def body_meets_obstacles(
    at: int,
    kind: int,
    unit: int,
    units: Units,
    shapes: PackedShapes,
    obstacles: PackedObstacles,
    near: Encounters,
    frames: FloatArray,
) -> Vector:
    """Return the clearances of a body from obstacles of one class, in eight encounters.

    Args:
        at: First encounter of the list.
        kind: Class of the obstacles.
        units: Bodies and parts.
        frames: Frames of all joints and blocks.
    """
    runs, spheres, capsules = shapes.runs, shapes.spheres, shapes.capsules
    whole, least = units.whole, spread(np.inf)
    # the motion from the body's frame to the obstacle's
    data, places, k = obstacles.data, near.obstacles, U(at)
    x, y, z, xx = load_quads(data, places, k, U(0))
    xy, xz, yx, yy = load_quads(data, places, k, U(TURN + 1))
    yz, zx, zy, zz = load_quads(data, places, k, U(TURN + 5))
    core: Core = load_quads(data, places, k, U(CORE_SIZE))
    frame = _gathered(whole[unit, JOINT], frames, near, at)
    motion = _relative((xx, xy, xz, x), (yx, yy, yz, y), (zx, zy, zz, z), frame)
    # spheres, then capsules
    first, stop = whole[unit, FIRST_RUN], whole[unit, STOP_RUN]
    if first < stop:
        if kind == BOXES:
            least = spheres_to_boxes(motion, core, runs, spheres, first, stop, least)
        elif kind == CYLINDERS:
            least = spheres_to_cylinders(motion, core, runs, spheres, first, stop, least)
        else:
            least = spheres_to_half_spaces(motion, runs, spheres, first, stop, least)
    for i in range(whole[unit, FIRST_CAPSULE], whole[unit, STOP_CAPSULE]):
        segments = _moved_axis(motion, capsules[i])
        if kind == BOXES:
            least = segments_to_boxes(segments, capsules[i, 6], core, least)
        elif kind == CYLINDERS:
            least = segments_to_cylinders(segments, capsules[i, 6], core, least)
        else:
            least = segments_to_half_spaces(segments, capsules[i, 6], least)
    return least


@inlined
def body_meets_body(
    at: int,
    one: int,
    two: int,
    units: Units,
    shapes: PackedShapes,
    near: Encounters,
    frames: FloatArray,
    centers: FloatArray,
) -> Vector:
    """Return the clearances of two bodies in eight encounters, as seen from the first one's frame.

    Args:
        at: First encounter of the list.
        one: First unit, whose shapes are constants.
        two: Second unit.
        units: See `body_meets_obstacles`, as for the next.
        frames: Frames of all joints and blocks.
        centers: (≥ most · POINT,) scratch.
    """
    runs, spheres, capsules = shapes.runs, shapes.spheres, shapes.capsules
    whole, least = units.whole, spread(np.inf)
    # the motion from the second body's frame to the first's
    x, y, z = _gathered(whole[one, JOINT], frames, near, at)
    motion = _relative(x, y, z, _gathered(whole[two, JOINT], frames, near, at))
    first, stop = whole[two, FIRST_RUN], whole[two, STOP_RUN]
    begin, end = (runs[first, 0], runs[stop - 1, 1]) if first < stop else (0, 0)
    rods, own_rods = whole[two, FIRST_CAPSULE], whole[one, FIRST_CAPSULE]
    move_spheres(motion, spheres, begin, end, centers)
    # the second's spheres against the first's spheres and capsules
    for run in range(whole[one, FIRST_RUN], whole[one, STOP_RUN]):
        least = spheres_to_spheres(runs, spheres, run, first, stop, centers, least)
    for i in range(own_rods, whole[one, STOP_CAPSULE]):
        for j in range(begin, end):
            both = capsules[i, 6] + spheres[j, 3]
            least = segment_to_points(capsules[i], center_at(centers, j - begin), both, least)
    # the second's capsules against both
    for j in range(rods, whole[two, STOP_CAPSULE]):
        segments = _moved_axis(motion, capsules[j])
        inverse, thickness = capsules[j, 7], capsules[j, 6]
        for run in range(whole[one, FIRST_RUN], whole[one, STOP_RUN]):
            for i in range(runs[run, 0], runs[run, 1]):
                both = thickness + spheres[i, 3]
                least = segments_to_point(segments, spheres[i], inverse, both, least)
        for i in range(own_rods, whole[one, STOP_CAPSULE]):
            both = capsules[i, 6] + thickness
            least = segment_to_segments(capsules[i], segments, inverse, both, least)
    return least


@inlined
def _moved_axis(motion: Motion, capsule: FloatArray) -> Segments:
    """Return a capsule's axis after a motion."""
    x, y, z = capsule[3], capsule[4], capsule[5]
    axis = turned(motion[0], x, y, z), turned(motion[1], x, y, z), turned(motion[2], x, y, z)
    return Segments(moved_point(motion, capsule[0], capsule[1], capsule[2]), axis)


@inlined
def _gathered(joint: int, frames: FloatArray, near: Encounters, at: int) -> Motion:
    """Return the frames of one joint in eight encounters."""
    j, k, places = U(joint) * SPATIAL_FRAME, U(at), near.frames
    x, y, z = j, j + U(3) * VECTOR, j + U(6) * VECTOR
    return (
        _gathered_row(frames, places, k, x, j + U(9) * VECTOR),
        _gathered_row(frames, places, k, y, j + U(10) * VECTOR),
        _gathered_row(frames, places, k, z, j + U(11) * VECTOR),
    )


@inlined
def _gathered_row(
    frames: FloatArray, places: Places, k: np.uint64, offset: np.uint64, origin: np.uint64
) -> Row:
    """Return a row of frames: three numbers of the rotation, one of the origin."""
    return (
        load_each(frames, places, k, offset),
        load_each(frames, places, k, offset + VECTOR),
        load_each(frames, places, k, offset + U(2) * VECTOR),
        load_each(frames, places, k, origin),
    )


@inlined
def _relative(x: Row, y: Row, z: Row, frame: Motion) -> Motion:
    """Return a frame as seen from the frame whose rows are x, y and z."""
    dx, dy, dz = frame[0][3] - x[3], frame[1][3] - y[3], frame[2][3] - z[3]
    return (
        _relative_row(x[0], y[0], z[0], frame, dx, dy, dz),
        _relative_row(x[1], y[1], z[1], frame, dx, dy, dz),
        _relative_row(x[2], y[2], z[2], frame, dx, dy, dz),
    )


@inlined
def _relative_row(
    a: Vector, b: Vector, c: Vector, frame: Motion, dx: Vector, dy: Vector, dz: Vector
) -> Row:
    """Return a frame's columns and a shift, along the direction (a, b, c)."""
    x, y, z = frame
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
        a * dx + b * dy + c * dz,
    )
