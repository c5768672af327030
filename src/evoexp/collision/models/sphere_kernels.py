"""Kernels of touching spheres: least distances of whole batches of configurations.

Eight configurations at a time go through forward kinematics, sphere centres, all pairs of spheres
of different arms and all obstacles, as vectors (`numeric.vectors`) that stay in registers or in the
first-level cache. The arithmetic of the pairs limits the speed: six operations in the plane and
nine in space; square roots are taken once per pair of arms, of the least squared distance. A caller
that only asks for collisions (`limit` 0) is spared the pairs of links that are far apart in all
eight configurations. In the plane, yes or no is answered faster by `planar_contacts`.
"""

from typing import Any, Literal, NamedTuple

import numpy as np

from evoexp.collision.models.center_kernels import (
    POINT,
    nearest,
    planar_point,
    spatial_point,
)
from evoexp.collision.models.flat_tables import (
    CHAIN_BLOCKS,
    OBSTACLE_BLOCKS,
    chain_of,
    column_of,
    flattened,
    obstacles_of,
    table_of,
)
from evoexp.collision.models.obstacle_kernels import MARGIN, LinkBalls, meet, to_obstacles
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.numeric.vectors import LANES, Vector, any_lane, lower, root, spread, store
from evoexp.records import FloatArray, IntArray
from evoexp.robots.forward_kinematics import (
    SPATIAL_FRAME,
    VECTOR,
    copy_lanes,
    eight_of,
    planar_frames,
    spatial_frames,
)
from evoexp.robots.kinematics import KinematicChain, U
from evoexp.scenarios.obstacles import ObstacleTable

Space = Literal[True] | None
"""None for robots that move in a plane, else true: by the type numba compiles one branch only."""


class Spheres(NamedTuple):
    """Spheres of one size, fixed to joints."""

    joint: IntArray  # (spheres,) index into the kinematic table, arm by arm
    local: FloatArray  # (spheres, 3) centres in the table's frames [length unit]
    radius: float  # of every sphere [length unit]


class LinkLines(NamedTuple):
    """Spheres of every link of a planar robot as equal steps along a line."""

    # (links, LINE_COLUMNS) x and y of the middle; x and y of the step from one centre to the next,
    # (1, 0) where there is none; number of steps; length of a step; half the length of all, a
    # little more
    line: FloatArray
    turn: FloatArray  # (joints,) angle of the placement of each joint [quarter turns]
    scale: float  # bound of all coordinates [length unit]; inf where steps are not equal


class SphereTables(NamedTuple):
    """The tables that `clearances` reads."""

    chain: KinematicChain  # the joints
    space: Space  # whether the robot moves in a plane; see `Space`
    spheres: Spheres  # the spheres
    bounds: LinkBalls  # balls around the spheres of each link
    obstacles: ObstacleTable  # the obstacles
    lines: LinkLines  # for `planar_contacts`


class Memory(NamedTuple):
    """Scratch for eight configurations."""

    q: FloatArray  # (nq · LANES,) the last ones of a batch, padded
    frames: FloatArray  # (joints · SPATIAL_FRAME,)
    centers: FloatArray  # (spheres · POINT,) of the spheres
    middles: FloatArray  # (links · POINT,) of the balls around links
    out: FloatArray  # (2 · LANES,) results of the last ones


LINE_COLUMNS = 7
"""See `LinkLines`."""

JOINT = CHAIN_BLOCKS + OBSTACLE_BLOCKS
LOCAL, RADIUS, LINKS, LINES = JOINT + 1, JOINT + 2, JOINT + 3, JOINT + 8
"""Blocks of the flat arrays behind a chain and obstacles."""


def flat_spheres(tables: SphereTables) -> tuple[Any, ...]:
    """Return the tables as kernels take them: whether in space, then two flat arrays."""
    radius, scale = np.array([tables.spheres.radius]), np.array([tables.lines.scale])
    fixed = [tables.spheres.joint, tables.spheres.local, radius]
    lines = [tables.lines.line, tables.lines.turn, scale]
    blocks = [*tables.chain, *tables.obstacles, *fixed, *tables.bounds, *lines]
    return (tables.space, *flattened(blocks))


@kernel
def clearances(tables: tuple[Any, ...], limit: float, q: FloatArray, out: FloatArray) -> None:
    """Run the kernel of `SphereCollision.clearance`.

    Args:
        tables: `SphereCollision.tables`, of `flat_spheres`.
        limit: Above it no clearance is measured [length unit].
        q: (nq, configurations) [deg], contiguous.
        out: (2, configurations), contiguous, written: between arms, to obstacles.
    """
    named = named_tables(tables)
    memory = memory_for(named)
    flat, count = q.reshape(-1), q.shape[1]
    write_clearances(named, limit, False, flat, count, 0, count, out.reshape(-1), memory)


@kernel
def any_contact(tables: tuple[Any, ...], q: FloatArray) -> bool:
    """Return whether any of some configurations collides; leave at the first eight with one.

    Args:
        tables: See `clearances`.
        q: (nq, configurations) [deg], contiguous.
    """
    named = named_tables(tables)
    memory = memory_for(named)
    flat, count = q.reshape(-1), q.shape[1]
    return write_clearances(named, 0.0, True, flat, count, 0, count, memory.out, memory)


@inlined
def named_tables(tables: tuple[Any, ...]) -> SphereTables:
    """Return the tables in the arrays of `flat_spheres` as views."""
    space, n, i = tables
    spheres = Spheres(column_of(i, i, JOINT), table_of(n, i, LOCAL, 3), n[i[2 * RADIUS]])
    links = LinkBalls(
        column_of(i, i, LINKS),
        table_of(n, i, LINKS + 1, 3),
        column_of(n, i, LINKS + 2),
        table_of(i, i, LINKS + 3, 2),
        table_of(i, i, LINKS + 4, 2),
    )
    lines = LinkLines(
        table_of(n, i, LINES, LINE_COLUMNS), column_of(n, i, LINES + 1), n[i[2 * LINES + 4]]
    )
    chain, obstacles = chain_of(n, i, 0), obstacles_of(n, i, CHAIN_BLOCKS)
    return SphereTables(chain, space, spheres, links, obstacles, lines)


@inlined
def memory_for(tables: SphereTables) -> Memory:
    """Return scratch for a robot."""
    return Memory(
        np.empty(U(len(tables.chain.parent)) * VECTOR),
        np.empty(U(len(tables.chain.parent)) * SPATIAL_FRAME),
        np.empty(U(len(tables.spheres.joint)) * POINT),
        np.empty(U(len(tables.bounds.joint)) * POINT),
        np.empty(2 * LANES),
    )


@kernel
def write_clearances(
    tables: SphereTables,
    limit: float,
    at_first: bool,
    q: FloatArray,
    count: int,
    start: int,
    stop: int,
    out: FloatArray,
    memory: Memory,
) -> bool:
    """Do the work of `clearances` or `any_contact` in given memory, so that no references count.

    Args:
        tables: The tables.
        limit: See `clearances`.
        at_first: Whether to leave as soon as a configuration collides; then nothing is written.
        q: (nq · count,) rows of a batch.
        count: Configurations of the batch.
        start: The first that is asked for.
        stop: One past the last.
        out: (2 · (stop − start),) written.
        memory: Scratch.

    Returns:
        Whether it left.
    """
    tables, q, out, memory = borrowed((tables, q, out, memory))
    _heights(tables.space, tables.chain, tables.spheres.joint, tables.spheres.local, memory.centers)
    _heights(tables.space, tables.chain, tables.bounds.joint, tables.bounds.local, memory.middles)
    chain, space, obstacles = tables.chain, tables.space, tables.obstacles
    spheres, bounds, radius = tables.spheres, tables.bounds, tables.spheres.radius
    frames, centers, middles = memory.frames, memory.centers, memory.middles
    most = max(limit + 2.0 * radius, 0.0)
    width = stop - start
    for first in range(start, stop, LANES):
        eight = eight_of(q, first, count, memory.q)
        # frames of the joints, centres of the spheres and of the balls around links
        if space is None:
            planar_frames(chain, eight, DEGREE, frames)
        else:
            spatial_frames(chain, eight, DEGREE, frames)
        _centers(space, spheres.joint, spheres.local, frames, centers)
        _centers(space, bounds.joint, bounds.local, frames, middles)
        # pairs of arms, then obstacles
        between = _between_arms(space, bounds, most, centers, middles) - 2.0 * radius
        if at_first and any_lane(between < 0.0):
            return True
        outside = to_obstacles(obstacles, bounds, limit + radius, centers, middles) - radius
        if at_first:
            if any_lane(outside < 0.0):
                return True
        elif first + LANES <= stop:
            store(out, U(first - start), between)
            store(out, U(first - start + width), outside)
        else:  # the last ones, fewer than eight
            store(memory.out, U(0), between)
            store(memory.out, VECTOR, outside)
            copy_lanes(memory.out, 0, LANES, stop - first, out, first - start, width)
    return False


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
def _centers(
    space: Space, joint: IntArray, local: FloatArray, frames: FloatArray, centers: FloatArray
) -> None:
    """Write the centres of all spheres, or of the balls around links."""
    for k in range(len(joint)):
        if space is None:
            planar_point(frames, joint[k], local[k, 0], local[k, 1], centers, U(k) * POINT)
        else:
            spatial_point(frames, joint[k], local[k], centers, U(k) * POINT, VECTOR)


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
                        i, end = U(spheres[one, 0]), U(spheres[one, 1])
                        first, stop = U(spheres[two, 0]), U(spheres[two, 1])
                        least = nearest(space, centers, i, end, first, stop, least)
            # one square root per pair of arms
            best = lower(best, root(least))
    return best
