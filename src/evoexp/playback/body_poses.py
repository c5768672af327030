"""Poses of frames along a motion, as Pinocchio places them."""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.scene import Part
from evoexp.paths.motion import Motion
from evoexp.playback.contacts import part_at
from evoexp.playback.shapes import pose
from evoexp.records import FloatArray

MIN_TICKS, MAX_TICKS = 240, 600  # of a whole motion
TURN = np.radians(2.0)  # [rad] of a joint between two ticks, where there may be so many
SLIDE = 0.01  # [-] of the scene's size, of a sliding joint


class Frame(NamedTuple):
    """A frame that moves bodies: of a joint, or of an object that is carried."""

    name: str  # unique name
    parent: int  # index of the frame that carries it; −1: the world


class Poses(NamedTuple):
    """Poses of all frames over time."""

    world: FloatArray  # (ticks, frames, 7) position, quaternion x, y, z, w in the world
    local: FloatArray  # the same in the parent's frame


def ticks(motion: Motion, prismatic: np.ndarray, size: float) -> FloatArray:
    """Return the instants at which a motion is shown, (ticks,), its first and last among them.

    Every instant is shown, unless there are more than `MAX_TICKS`. `prismatic` (nq,) is true for
    coordinates that are lengths; `size` is the scene's [length unit].
    """
    segments = motion.num_segments
    if segments == 0:
        return np.zeros(1)
    if segments >= MAX_TICKS:
        return np.unique(np.round(np.linspace(0.0, segments, MAX_TICKS)))
    steps = np.where(prismatic, SLIDE * size, TURN)
    wanted = np.array([np.ceil((motion.speed_bound(k) / steps).max()) for k in range(segments)])
    wanted = np.maximum(wanted, np.ceil(MIN_TICKS / segments))
    if wanted.sum() > MAX_TICKS:
        wanted = np.maximum(np.floor(wanted * (MAX_TICKS / wanted.sum())), 1.0)
    pieces = [k + np.arange(count) / count for k, count in enumerate(wanted.astype(int))]
    return np.concatenate([*pieces, [float(segments)]])


def poses(
    model: Any, motion: Motion, times: FloatArray, parts: list[Part], carried: list[str]
) -> Poses:
    """Return the poses of all frames at times (ticks,) [instants].

    Each part of the motion places the carried objects, which have frames of their own.
    """
    data, count = model.createData(), model.njoints - 1 + len(carried)
    world, local = np.empty((2, len(times), count, 7))
    places = {  # of each carried object: its joint, and its placement in the joint's frame
        id(part): [part.scene.shapes[part.scene.names.index(name)][1:] for name in carried]
        for part in parts
    }
    for k, t in enumerate(times):
        pin.forwardKinematics(model, data, motion.at(float(t)))
        for joint in range(1, model.njoints):
            world[k, joint - 1], local[k, joint - 1] = pose(data.oMi[joint]), pose(data.liMi[joint])
        for c, (joint, placement) in enumerate(places[id(part_at(parts, t))]):
            world[k, model.njoints - 1 + c] = local[k, model.njoints - 1 + c] = pose(
                data.oMi[joint] * placement
            )
    return Poses(_continuous(world), _continuous(local))


def points(world: FloatArray, frame: int, point: FloatArray) -> FloatArray:
    """Return the positions of a point (3,) of a frame (−1: the world) over time, (ticks, 3).

    Of points (points, 3), the positions are (points, ticks, 3). `world` is (ticks, frames, 7).
    """
    ticks = len(world)
    rows = np.broadcast_to(point[..., None, :], (*point.shape[:-1], ticks, 3))
    if frame < 0:
        return rows.copy()
    x, y, z, w = world[:, frame, 3:].T
    vector = np.stack([x, y, z], axis=1)
    twice = 2.0 * np.cross(vector, rows)
    return np.asarray(world[:, frame, :3] + rows + w[:, None] * twice + np.cross(vector, twice))


def _continuous(rows: FloatArray) -> FloatArray:
    """Choose between q and −q, which are one rotation: the sign nearer to the tick before."""
    signs = np.sign((rows[1:, :, 3:] * rows[:-1, :, 3:]).sum(axis=-1))
    flips = np.cumprod(np.where(signs < 0.0, -1.0, 1.0), axis=0)
    rows[1:, :, 3:] *= flips[:, :, None]
    return rows
