"""Kernels of touching spheres: least distances of whole batches of configurations.

Eight configurations at a time go through forward kinematics, sphere centres, all pairs of spheres
of different arms and all obstacles, as vectors (`numeric.vectors`) that stay in registers or in the
first-level cache. The arithmetic of the pairs limits the speed: six operations in the plane and
nine in space; square roots are taken once per pair of arms, of the least squared distance. A caller
that only asks for collisions (`limit` 0) is spared the pairs of links that are far apart in all
eight configurations.
"""

from typing import Any, Literal, NamedTuple

import numpy as np

from evoexp.collision.models.obstacle_kernels import (
    MARGIN,
    POINT,
    LinkBalls,
    meet,
    to_obstacles,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.numeric.vectors import LANES, Vector, load, lower, root, spread, store
from evoexp.records import FloatArray, IntArray
from evoexp.robots.forward_kinematics import (
    PLANAR_FRAME,
    SPATIAL_FRAME,
    VECTOR,
    copy_lanes,
    planar_frames,
    spatial_frames,
)
from evoexp.robots.kinematics import KinematicChain, U
from evoexp.scenarios.obstacles import ObstacleTable

Space = Literal[True] | None
"""None for robots that move in a plane, else true: by the type numba compiles one branch only."""


class Spheres(NamedTuple):
    """Spheres of one size, fixed to joints.

    Attributes:
        joint: (spheres,) index into the kinematic table, arm by arm.
        local: (spheres, 3) centres in the table's frames [length unit].
        radius: Of every sphere [length unit].
    """

    joint: IntArray
    local: FloatArray
    radius: float


class SphereTables(NamedTuple):
    """The tables that `clearances` reads.

    Attributes:
        chain: The joints.
        space: Whether the robot moves in a plane; see `Space`.
        spheres: The spheres.
        bounds: Balls around the spheres of each link.
        obstacles: The obstacles.
    """

    chain: KinematicChain
    space: Space
    spheres: Spheres
    bounds: LinkBalls
    obstacles: ObstacleTable


class Memory(NamedTuple):
    """Scratch for eight configurations.

    Attributes:
        q: (nq · LANES,) the last ones of a batch, padded.
        frames: (joints · SPATIAL_FRAME,).
        centers: (spheres · POINT,) of the spheres.
        middles: (links · POINT,) of the balls around links.
        out: (2 · LANES,) results of the last ones.
    """

    q: FloatArray
    frames: FloatArray
    centers: FloatArray
    middles: FloatArray
    out: FloatArray


@kernel
def clearances(tables: tuple[Any, ...], limit: float, q: FloatArray, out: FloatArray) -> None:
    """Run the kernel of `SphereCollision.clearance`.

    Args:
        tables: `SphereCollision.tables`: fields of `SphereTables` as plain tuples.
        limit: Above it no clearance is measured [length unit].
        q: (nq, configurations) [deg], contiguous.
        out: (2, configurations), contiguous, written: between arms, to obstacles.
    """
    chain, space, spheres, bounds, obstacles = tables
    named = SphereTables(
        KinematicChain(*chain),
        space,
        Spheres(*spheres),
        LinkBalls(*bounds),
        ObstacleTable(*obstacles),
    )
    memory = Memory(
        np.zeros(q.shape[0] * LANES),
        np.empty(U(len(named.chain.parent)) * SPATIAL_FRAME),
        np.empty(U(len(named.spheres.joint)) * POINT),
        np.empty(U(len(named.bounds.joint)) * POINT),
        np.empty(2 * LANES),
    )
    _clearances(named, limit, q.reshape(-1), q.shape[1], out.reshape(-1), memory)


@kernel
def _clearances(
    tables: SphereTables, limit: float, q: FloatArray, count: int, out: FloatArray, memory: Memory
) -> None:
    """Do the work of `clearances` in given memory, so that inner loops count no references."""
    tables, q, out, memory = borrowed((tables, q, out, memory))
    _heights(tables.space, tables.chain, tables.spheres.joint, tables.spheres.local, memory.centers)
    _heights(tables.space, tables.chain, tables.bounds.joint, tables.bounds.local, memory.middles)
    chain, space, obstacles = tables.chain, tables.space, tables.obstacles
    spheres, bounds, radius = tables.spheres, tables.bounds, tables.spheres.radius
    frames, centers, middles = memory.frames, memory.centers, memory.middles
    most = max(limit + 2.0 * radius, 0.0)
    for first in range(0, count, LANES):
        # the last ones, if they are fewer than eight, are copied and padded
        whole = first + LANES <= count
        if not whole:
            copy_lanes(q, first, count, count - first, memory.q, 0, LANES)
        angles, place, stride = (q, U(first), U(count)) if whole else (memory.q, U(0), VECTOR)
        # frames of the joints, centres of the spheres and of the balls around links
        if space is None:
            planar_frames(chain, angles, place, stride, DEGREE, frames)
            _planar_centers(spheres.joint, spheres.local, frames, centers)
            _planar_centers(bounds.joint, bounds.local, frames, middles)
        else:
            spatial_frames(chain, angles, place, stride, DEGREE, frames)
            _spatial_centers(spheres.joint, spheres.local, frames, centers)
            _spatial_centers(bounds.joint, bounds.local, frames, middles)
        # pairs of arms, then obstacles
        between = _between_arms(space, bounds, most, centers, middles) - 2.0 * radius
        outside = to_obstacles(obstacles, bounds, limit + radius, centers, middles) - radius
        found = out if whole else memory.out
        store(found, place, between)
        store(found, place + stride, outside)
        if not whole:
            copy_lanes(memory.out, 0, LANES, count - first, out, first, count)


@kernel
def _heights(
    space: Space, chain: KinematicChain, joint: IntArray, local: FloatArray, centers: FloatArray
) -> None:
    """Write z of all centres, once: in the plane no joint changes a height."""
    if space is None:
        for k in range(len(joint)):
            height, j = local[k, 2], joint[k]
            while j >= 0:
                height += chain.translation[j, 2]
                j = chain.parent[j]
            store(centers, U(k) * POINT + U(2) * VECTOR, spread(height))


@inlined
def _planar_centers(
    joint: IntArray, local: FloatArray, frames: FloatArray, centers: FloatArray
) -> None:
    for k in range(len(joint)):
        own, j = U(k) * POINT, U(joint[k]) * PLANAR_FRAME
        x, y = local[k, 0], local[k, 1]
        s, c = load(frames, j), load(frames, j + VECTOR)
        store(centers, own, load(frames, j + U(2) * VECTOR) + (c * x - s * y))
        store(centers, own + VECTOR, load(frames, j + U(3) * VECTOR) + (s * x + c * y))


@inlined
def _spatial_centers(
    joint: IntArray, local: FloatArray, frames: FloatArray, centers: FloatArray
) -> None:
    for k in range(len(joint)):
        own, j = U(k) * POINT, U(joint[k]) * SPATIAL_FRAME
        x, y, z = local[k, 0], local[k, 1], local[k, 2]
        for row in range(3):
            a, o = j + U(3 * row) * VECTOR, j + U(9 + row) * VECTOR
            turned = (
                load(frames, a) * x
                + load(frames, a + VECTOR) * y
                + load(frames, a + U(2) * VECTOR) * z
            )
            store(centers, own + U(row) * VECTOR, load(frames, o) + turned)


@inlined
def _between_arms(
    space: Space, bounds: LinkBalls, limit: float, centers: FloatArray, middles: FloatArray
) -> Vector:
    """Return the least centre distance over all pairs of arms, at most the limit."""
    reach, spheres, arm_links = bounds.radius, bounds.spheres, bounds.arm_links
    best = spread(limit)
    for a in range(len(arm_links)):
        for b in range(a + 1, len(arm_links)):
            least = spread(limit * limit)
            for one in range(arm_links[a, 0], arm_links[a, 1]):
                for two in range(arm_links[b, 0], arm_links[b, 1]):
                    # the balls around both links
                    within = (limit + reach[one] + reach[two]) * MARGIN
                    if meet(middles, U(one) * POINT, middles, U(two) * POINT, within):
                        first, stop = U(spheres[two, 0]), U(spheres[two, 1])
                        i, end = U(spheres[one, 0]), U(spheres[one, 1])
                        while i < end:
                            if i + U(3) < end:  # four of them are held in registers
                                least = _nearest_to_four(space, centers, i, first, stop, least)
                                i += U(4)
                            else:
                                least = _nearest(space, centers, i, first, stop, least)
                                i += U(1)
            # one square root per pair of arms
            best = lower(best, root(least))
    return best


@inlined
def _nearest(
    space: Space,
    centers: FloatArray,
    i: np.uint64,
    first: np.uint64,
    stop: np.uint64,
    least: Vector,
) -> Vector:
    """Return the least squared distance of sphere i from spheres first … stop − 1."""
    x, y, z = _center(space, centers, i)
    for j in range(first, stop):
        least = lower(least, _squared(space, x, y, z, *_center(space, centers, U(j))))
    return least


@inlined
def _nearest_to_four(
    space: Space,
    centers: FloatArray,
    i: np.uint64,
    first: np.uint64,
    stop: np.uint64,
    least: Vector,
) -> Vector:
    """Return the least squared distance of spheres i … i + 3 from spheres first … stop − 1."""
    ax, ay, az = _center(space, centers, i)
    bx, by, bz = _center(space, centers, i + U(1))
    cx, cy, cz = _center(space, centers, i + U(2))
    dx, dy, dz = _center(space, centers, i + U(3))
    a, b, c, d = least, least, least, least
    for j in range(first, stop):
        x, y, z = _center(space, centers, U(j))
        a = lower(a, _squared(space, ax, ay, az, x, y, z))
        b = lower(b, _squared(space, bx, by, bz, x, y, z))
        c = lower(c, _squared(space, cx, cy, cz, x, y, z))
        d = lower(d, _squared(space, dx, dy, dz, x, y, z))
    return lower(lower(a, b), lower(c, d))


@inlined
def _center(space: Space, centers: FloatArray, k: np.uint64) -> tuple[Vector, Vector, Vector]:
    """Return a sphere's centre; in the plane its height is not looked at."""
    own = k * POINT
    x, y = load(centers, own), load(centers, own + VECTOR)
    return x, y, x if space is None else load(centers, own + U(2) * VECTOR)


@inlined
def _squared(
    space: Space, ax: Vector, ay: Vector, az: Vector, bx: Vector, by: Vector, bz: Vector
) -> Vector:
    """Return the squared distance of two points."""
    x, y = ax - bx, ay - by
    if space is None:
        return x * x + y * y
    z = az - bz
    return x * x + y * y + z * z
