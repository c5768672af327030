"""Kernels of touching spheres: least distances of whole batches of configurations.

One kernel runs a block of configurations through forward kinematics, sphere centres, all pairs of
spheres of different arms and all obstacles; the configuration is innermost. What limits it is the
arithmetic of the pairs: per pair six operations in the plane and nine in space, on values that stay
in the first-level cache; square roots are taken once per pair of arms, of the least squared
distance. Who only asks for collisions (`limit` 0) is spared the pairs of links that are far apart
in a whole block.

`space` is None for what moves in a plane, else true: by its type numba compiles one of the two
branches only.
"""

import numpy as np

from evoexp.collision.models.obstacle_kernels import MARGIN, ROWS, meet, to_obstacles
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.robots.kinematics import (
    BLOCK,
    PLANAR_ROWS,
    SPATIAL_ROWS,
    U,
    block_frames,
    block_planar_frames,
    load_block,
)


@kernel
def clearances(tables, limit, q, out):  # type: ignore[no-untyped-def]
    """The kernel of `SphereCollision.clearance`, for other kernels.

    Writes (2, configurations), q in degrees.
    """
    num_spheres, num_bounds, num_joints = len(tables[2][0]), len(tables[3][0]), len(tables[0][0])
    block_q, frames = np.zeros(q.shape[0] * BLOCK), np.empty(num_joints * SPATIAL_ROWS * BLOCK)
    points = np.empty(num_spheres * ROWS), np.empty(num_bounds * ROWS)
    scratch = np.empty(SPATIAL_ROWS * BLOCK), np.empty(ROWS)
    memory = block_q, frames, points, scratch, np.empty(BLOCK), np.empty(BLOCK)
    _clearances(tables, limit, q, out, memory)


@kernel
def _clearances(tables, limit, q, out, memory):  # type: ignore[no-untyped-def]
    """Do what `clearances` says, given its memory.

    So that no references are counted in the innermost loops.
    """
    tables, q, out, memory = borrowed((tables, q, out, memory))
    table, space, spheres, bounds, obstacles = tables
    joint, local, radius = spheres
    bound_joint, bound_local = bounds[0], bounds[1]
    block_q, frames, (centers, middles), (scratch, place), between, outside = memory
    _heights(space, table, joint, local, centers)
    _heights(space, table, bound_joint, bound_local, middles)
    for first in range(0, q.shape[1], BLOCK):
        count = min(BLOCK, q.shape[1] - first)
        load_block(q, first, count, DEGREE, block_q)
        _frames(space, table, block_q, frames, scratch)
        _centers(space, joint, local, frames, centers)
        _centers(space, bound_joint, bound_local, frames, middles)
        _between_arms(
            space, bounds, max(limit + 2.0 * radius, 0.0), centers, middles, scratch, between
        )
        outside[:] = limit + radius
        if len(obstacles[0]) > 0:
            to_obstacles(
                obstacles, bounds, limit + radius, centers, middles, scratch, place, outside
            )
        for lane in range(count):
            out[0, first + lane] = between[lane] - 2.0 * radius
            out[1, first + lane] = outside[lane] - radius


@kernel
def _heights(space, table, joint, local, centers):  # type: ignore[no-untyped-def]
    """In the plane no joint changes a height: z of all centres, once."""
    if space is None:
        parent, translation = table[0], table[5]
        for k in range(len(joint)):
            height, j = local[k, 2], joint[k]
            while j >= 0:
                height += translation[j, 2]
                j = parent[j]
            centers[k * ROWS + 2 * BLOCK : (k + 1) * ROWS] = height


@kernel
def _frames(space, table, q, frames, scratch):  # type: ignore[no-untyped-def]
    parent, index_q, prismatic, turned, rotation, translation = table
    if space is None:
        block_planar_frames(parent, index_q, rotation, translation, q, frames)
    else:
        block_frames(parent, index_q, prismatic, turned, rotation, translation, q, frames, scratch)


@kernel
def _centers(space, joint, local, frames, centers):  # type: ignore[no-untyped-def]
    if space is None:
        _planar_centers(joint, local, frames, centers)
    else:
        _spatial_centers(joint, local, frames, centers)


@kernel
def _planar_centers(joint, local, frames, centers):  # type: ignore[no-untyped-def]
    for k in range(len(joint)):
        own, j = U(k) * U(ROWS), U(joint[k]) * U(PLANAR_ROWS * BLOCK)
        x, y = local[k, 0], local[k, 1]
        for n in range(BLOCK):
            lane = U(n)
            s, c = frames[j + lane], frames[j + U(BLOCK) + lane]
            centers[own + lane] = frames[j + U(2 * BLOCK) + lane] + (c * x - s * y)
            centers[own + U(BLOCK) + lane] = frames[j + U(3 * BLOCK) + lane] + (s * x + c * y)


@kernel
def _spatial_centers(joint, local, frames, centers):  # type: ignore[no-untyped-def]
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
def _between_arms(space, bounds, limit, centers, middles, least, out):  # type: ignore[no-untyped-def]
    """Least centre distance over all pairs of arms, (BLOCK,), as far as it is below the limit."""
    bounds, centers, middles, least, out = borrowed((bounds, centers, middles, least, out))
    _, _, reach, spheres, arm_links = bounds
    out[:] = limit
    for a in range(len(arm_links)):
        for b in range(a + 1, len(arm_links)):
            least[:BLOCK] = limit * limit
            for one in range(arm_links[a, 0], arm_links[a, 1]):
                for two in range(arm_links[b, 0], arm_links[b, 1]):
                    within = (limit + reach[one] + reach[two]) * MARGIN
                    if not meet(middles, U(one) * U(ROWS), middles, U(two) * U(ROWS), within):
                        continue
                    first, stop = U(spheres[two, 0]), U(spheres[two, 1])
                    for i in range(spheres[one, 0], spheres[one, 1]):
                        _pairs(space, centers, U(i) * U(ROWS), first, stop, least)
            for n in range(BLOCK):
                distance, best = np.sqrt(least[U(n)]), out[U(n)]
                out[U(n)] = distance if distance < best else best


@kernel
def _pairs(space, centers, i, first, stop, least):  # type: ignore[no-untyped-def]
    if space is None:
        _planar_pairs(centers, i, first, stop, least)
    else:
        _spatial_pairs(centers, i, first, stop, least)


@kernel
def _planar_pairs(centers, i, first, stop, least):  # type: ignore[no-untyped-def]
    """Lower `least` to the squared distances of one sphere from a range of spheres.

    Four in registers at a time.
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
            dx, dy = (
                centers[i + lane] - centers[k],
                centers[i + U(BLOCK) + lane] - centers[k + U(BLOCK)],
            )
            squared, best = dx * dx + dy * dy, least[lane]
            least[lane] = squared if squared < best else best
        j += U(1)


@kernel
def _spatial_pairs(centers, i, first, stop, least):  # type: ignore[no-untyped-def]
    j = first
    while j + U(4) <= stop:
        for n in range(BLOCK):
            lane, best = U(n), least[U(n)]
            x, y, z = (
                centers[i + lane],
                centers[i + U(BLOCK) + lane],
                centers[i + U(2 * BLOCK) + lane],
            )
            for t in range(4):
                k = j * U(ROWS) + U(t * ROWS) + lane
                dx, dy, dz = (
                    x - centers[k],
                    y - centers[k + U(BLOCK)],
                    z - centers[k + U(2 * BLOCK)],
                )
                squared = dx * dx + dy * dy + dz * dz
                best = squared if squared < best else best
            least[lane] = best
        j += U(4)
    while j < stop:
        for n in range(BLOCK):
            lane, k = U(n), j * U(ROWS) + U(n)
            dx, dy = (
                centers[i + lane] - centers[k],
                centers[i + U(BLOCK) + lane] - centers[k + U(BLOCK)],
            )
            dz = centers[i + U(2 * BLOCK) + lane] - centers[k + U(2 * BLOCK)]
            squared, best = dx * dx + dy * dy + dz * dz, least[lane]
            least[lane] = squared if squared < best else best
        j += U(1)
