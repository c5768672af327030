"""Kernels of touching spheres: least distances of whole batches of configurations.

One kernel runs a block of configurations through forward kinematics, sphere centres, all pairs of
spheres of different arms and all obstacles; the configuration is innermost. The arithmetic of the
pairs limits the speed: per pair six operations in the plane and nine in space, on values that stay
in the first-level cache; square roots are taken once per pair of arms, of the least squared
distance. A caller that only asks for collisions (`limit` 0) is spared the pairs of links that are
far apart in a whole block.
"""

from typing import Any, Literal, NamedTuple

import numpy as np

from evoexp.collision.models.obstacle_kernels import MARGIN, ROWS, LinkBalls, meet, to_obstacles
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import (
    BLOCK,
    PLANAR_ROWS,
    SPATIAL_ROWS,
    KinematicChain,
    U,
    block_frames,
    block_planar_frames,
    load_block,
)
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
    """Scratch for one block of configurations.

    Attributes:
        q: (nq · BLOCK,).
        frames: (joints · SPATIAL_ROWS · BLOCK,).
        centers: (spheres · ROWS,) of the spheres.
        middles: (links · ROWS,) of the balls around links.
        scratch: (SPATIAL_ROWS · BLOCK,).
        place: (ROWS,).
        between: (BLOCK,) least distance of centres of two arms.
        outside: (BLOCK,) least distance of a centre from an obstacle.
    """

    q: FloatArray
    frames: FloatArray
    centers: FloatArray
    middles: FloatArray
    scratch: FloatArray
    place: FloatArray
    between: FloatArray
    outside: FloatArray


@kernel
def clearances(tables: tuple[Any, ...], limit: float, q: FloatArray, out: FloatArray) -> None:
    """Run the kernel of `SphereCollision.clearance`.

    Args:
        tables: `SphereCollision.tables`: fields of `SphereTables` as plain tuples.
        limit: Above it no clearance is measured [length unit].
        q: (nq, configurations) [deg].
        out: (2, configurations), written: between arms, to obstacles.
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
        np.zeros(q.shape[0] * BLOCK),
        np.empty(len(named.chain.parent) * SPATIAL_ROWS * BLOCK),
        np.empty(len(named.spheres.joint) * ROWS),
        np.empty(len(named.bounds.joint) * ROWS),
        np.empty(SPATIAL_ROWS * BLOCK),
        np.empty(ROWS),
        np.empty(BLOCK),
        np.empty(BLOCK),
    )
    _clearances(named, limit, q, out, memory)


@kernel
def _clearances(
    tables: SphereTables, limit: float, q: FloatArray, out: FloatArray, memory: Memory
) -> None:
    """Do the work of `clearances` in given memory, so that inner loops count no references."""
    tables, q, out, memory = borrowed((tables, q, out, memory))
    chain, space, obstacles = tables.chain, tables.space, tables.obstacles
    spheres, bounds, radius = tables.spheres, tables.bounds, tables.spheres.radius
    centers, middles, scratch = memory.centers, memory.middles, memory.scratch
    between, outside = memory.between, memory.outside
    _heights(space, chain, spheres.joint, spheres.local, centers)
    _heights(space, chain, bounds.joint, bounds.local, middles)
    for first in range(0, q.shape[1], BLOCK):
        count = min(BLOCK, q.shape[1] - first)
        # frames of the joints, centres of the spheres and of the balls around links
        load_block(q, first, count, DEGREE, memory.q)
        _frames(space, chain, memory.q, memory.frames, scratch)
        _centers(space, spheres.joint, spheres.local, memory.frames, centers)
        _centers(space, bounds.joint, bounds.local, memory.frames, middles)
        # pairs of arms, then obstacles
        most = max(limit + 2.0 * radius, 0.0)
        _between_arms(space, bounds, most, centers, middles, scratch, between)
        outside[:] = limit + radius
        if len(obstacles.kind) > 0:
            to_obstacles(
                obstacles, bounds, limit + radius, centers, middles, scratch, memory.place, outside
            )
        for lane in range(count):
            out[0, first + lane] = between[lane] - 2.0 * radius
            out[1, first + lane] = outside[lane] - radius


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
            centers[k * ROWS + 2 * BLOCK : (k + 1) * ROWS] = height


@kernel
def _frames(
    space: Space, chain: KinematicChain, q: FloatArray, frames: FloatArray, scratch: FloatArray
) -> None:
    if space is None:
        block_planar_frames(chain, q, frames)
    else:
        block_frames(chain, q, frames, scratch)


@kernel
def _centers(
    space: Space, joint: IntArray, local: FloatArray, frames: FloatArray, centers: FloatArray
) -> None:
    if space is None:
        _planar_centers(joint, local, frames, centers)
    else:
        _spatial_centers(joint, local, frames, centers)


@kernel
def _planar_centers(
    joint: IntArray, local: FloatArray, frames: FloatArray, centers: FloatArray
) -> None:
    for k in range(len(joint)):
        own, j = U(k) * U(ROWS), U(joint[k]) * U(PLANAR_ROWS * BLOCK)
        x, y = local[k, 0], local[k, 1]
        for n in range(BLOCK):
            lane = U(n)
            s, c = frames[j + lane], frames[j + U(BLOCK) + lane]
            centers[own + lane] = frames[j + U(2 * BLOCK) + lane] + (c * x - s * y)
            centers[own + U(BLOCK) + lane] = frames[j + U(3 * BLOCK) + lane] + (s * x + c * y)


@kernel
def _spatial_centers(
    joint: IntArray, local: FloatArray, frames: FloatArray, centers: FloatArray
) -> None:
    for k in range(len(joint)):
        own, j = U(k) * U(ROWS), U(joint[k]) * U(SPATIAL_ROWS * BLOCK)
        x, y, z = local[k, 0], local[k, 1], local[k, 2]
        for n in range(BLOCK):
            lane = U(n)
            for row in range(3):
                a, o = j + U(3 * row * BLOCK) + lane, j + U((9 + row) * BLOCK) + lane
                centers[own + U(row * BLOCK) + lane] = frames[o] + (
                    frames[a] * x + frames[a + U(BLOCK)] * y + frames[a + U(2 * BLOCK)] * z
                )


@kernel
def _between_arms(
    space: Space,
    bounds: LinkBalls,
    limit: float,
    centers: FloatArray,
    middles: FloatArray,
    least: FloatArray,
    out: FloatArray,
) -> None:
    """Write the least centre distance over all pairs of arms (BLOCK,), at most the limit."""
    bounds, centers, middles, least, out = borrowed((bounds, centers, middles, least, out))
    reach, spheres, arm_links = bounds.radius, bounds.spheres, bounds.arm_links
    out[:] = limit
    for a in range(len(arm_links)):
        for b in range(a + 1, len(arm_links)):
            least[:BLOCK] = limit * limit
            for one in range(arm_links[a, 0], arm_links[a, 1]):
                for two in range(arm_links[b, 0], arm_links[b, 1]):
                    # the balls around both links
                    within = (limit + reach[one] + reach[two]) * MARGIN
                    if not meet(middles, U(one) * U(ROWS), middles, U(two) * U(ROWS), within):
                        continue
                    first, stop = U(spheres[two, 0]), U(spheres[two, 1])
                    for i in range(spheres[one, 0], spheres[one, 1]):
                        _pairs(space, centers, U(i) * U(ROWS), first, stop, least)
            # one square root per pair of arms
            for n in range(BLOCK):
                distance, best = np.sqrt(least[U(n)]), out[U(n)]
                out[U(n)] = distance if distance < best else best


@kernel
def _pairs(
    space: Space,
    centers: FloatArray,
    i: np.uint64,
    first: np.uint64,
    stop: np.uint64,
    least: FloatArray,
) -> None:
    if space is None:
        _planar_pairs(centers, i, first, stop, least)
    else:
        _spatial_pairs(centers, i, first, stop, least)


@kernel
def _planar_pairs(
    centers: FloatArray, i: np.uint64, first: np.uint64, stop: np.uint64, least: FloatArray
) -> None:
    """Lower `least` to the squared distances of the sphere at i from the spheres first … stop − 1.

    Four of them are held in registers at a time.
    """
    j = first
    while j + U(4) <= stop:
        for n in range(BLOCK):
            lane = U(n)
            x, y, best = centers[i + lane], centers[i + U(BLOCK) + lane], least[lane]
            for t in range(4):
                k = j * U(ROWS) + U(t * ROWS) + lane
                dx, dy = x - centers[k], y - centers[k + U(BLOCK)]
                squared = dx * dx + dy * dy
                best = squared if squared < best else best
            least[lane] = best
        j += U(4)
    while j < stop:
        for n in range(BLOCK):
            lane, k = U(n), j * U(ROWS) + U(n)
            dx = centers[i + lane] - centers[k]
            dy = centers[i + U(BLOCK) + lane] - centers[k + U(BLOCK)]
            squared, best = dx * dx + dy * dy, least[lane]
            least[lane] = squared if squared < best else best
        j += U(1)


@kernel
def _spatial_pairs(
    centers: FloatArray, i: np.uint64, first: np.uint64, stop: np.uint64, least: FloatArray
) -> None:
    j = first
    while j + U(4) <= stop:
        for n in range(BLOCK):
            lane, best = U(n), least[U(n)]
            x, y = centers[i + lane], centers[i + U(BLOCK) + lane]
            z = centers[i + U(2 * BLOCK) + lane]
            for t in range(4):
                k = j * U(ROWS) + U(t * ROWS) + lane
                dx, dy = x - centers[k], y - centers[k + U(BLOCK)]
                dz = z - centers[k + U(2 * BLOCK)]
                squared = dx * dx + dy * dy + dz * dz
                best = squared if squared < best else best
            least[lane] = best
        j += U(4)
    while j < stop:
        for n in range(BLOCK):
            lane, k = U(n), j * U(ROWS) + U(n)
            dx = centers[i + lane] - centers[k]
            dy = centers[i + U(BLOCK) + lane] - centers[k + U(BLOCK)]
            dz = centers[i + U(2 * BLOCK) + lane] - centers[k + U(2 * BLOCK)]
            squared, best = dx * dx + dy * dy + dz * dz, least[lane]
            least[lane] = squared if squared < best else best
        j += U(1)
