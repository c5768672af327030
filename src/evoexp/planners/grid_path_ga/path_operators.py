"""Crossover and mutation of paths over a grid, compiled (Chen & Zalzala 1995, section 2.3).

A path is a row of a table, see `paths.grids`.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import copy_part, kernel
from evoexp.numeric.random_stream import Block, draw_index, used_up
from evoexp.paths.grids import Moves, NodeArray, SumArray, erase_loops, spread_front, walk
from evoexp.records import FloatArray, IntArray

NOT_CONNECTED, CONNECTED = -1, -2
PLACE_BITS = 32


class World(NamedTuple):
    """A grid and its fields."""

    neighbours: NodeArray  # (nodes, moves), see `grids.Grid`
    num_moves: int  # moves that a front makes; they come first
    coordinates: NodeArray  # (nodes, dimensions)
    kinds: NodeArray
    unsafeness: FloatArray  # (nodes,)
    potentials: FloatArray  # (≥ greatest number of steps + 1,) toward a target after so many steps
    # (targets, nodes, moves) of `weigh_all` toward every node; (0, nodes, moves) on large grids and
    # where they are no small whole numbers
    sums: SumArray


class Breeding(NamedTuple):
    """Settings of the operators."""

    erase: bool  # whether loops are erased
    num_elites: int
    multiple: float  # copies that the best one expects, in units of the mean
    crossover_rate: float  # probability per pair
    reach: int  # how far apart two nodes may be, in every coordinate, to cross paths there [cell]
    mutation_rate: float  # probability per path


class Scratch(NamedTuple):
    """Scratch of the operators."""

    place: NodeArray  # (nodes,) places in a path
    joined: NodeArray  # (3 nodes + 3,) a path of several pieces
    # (nodes + 1,) of `coincident_sites`: the search in which a node was last seen, and its place
    # then, as one number; the last entry is that of the last search, place 0
    seen: IntArray
    sites: IntArray  # (nodes + 1,) places where two paths meet, see there
    steps: NodeArray  # (nodes,) of a front
    queue: NodeArray  # (nodes,) of a front
    walked: NodeArray  # (nodes + 1,) a walk

    @classmethod
    def of(cls, nodes: int) -> "Scratch":
        """Return scratch for a grid of so many nodes."""
        place, joined, steps, queue, walked = (
            np.zeros(size, dtype=np.int32)
            for size in (nodes, 3 * nodes + 3, nodes, nodes, nodes + 1)
        )
        seen, sites = (np.zeros(nodes + 1, dtype=np.int64) for _ in range(2))
        return cls(place, joined, seen, sites, steps, queue, walked)


@kernel
def copy_path(path: NodeArray, out: NodeArray) -> None:
    """Copy a path; the rest of the row stays as it is."""
    copy_part(path, 0, out, 0, path[0] + 1)


@kernel
def cross(
    draws: Block,
    world: World,
    parents: tuple[NodeArray, NodeArray],
    breeding: Breeding,
    children: tuple[NodeArray, NodeArray],
    scratch: Scratch,
) -> bool:
    """Exchange the remainders of two paths at a common node, or at two nodes that are near.

    "If the path pair have coincident points, then select one randomly as the crossover site and
    exchange the remainder of the two paths"; if not, a pair of nodes at most `reach` apart (in
    every coordinate), drawn among all such pairs, is connected, by a move or by a node between.
    Start and goal, which all paths have in common, are no sites.

    Returns whether they are crossed, and the children written: there may be no site.
    """
    one, two = parents
    place, joined, sites, erase = scratch.place, scratch.joined, scratch.sites, breeding.erase
    count = coincident_sites(one, two, scratch.seen, sites)
    if count > 0:  # at a common node, which stays once
        site = sites[draw_index(draws, count)]
        i, j = site >> PLACE_BITS, site & (2**PLACE_BITS - 1)
        link, behind = CONNECTED, 1
    else:  # at two near nodes
        i, j = near_sites(draws, world.coordinates, one, two, breeding.reach)
        if i == 0:
            return False
        link, behind = connection(draws, world.neighbours, one[i], two[j]), 0
        if link == NOT_CONNECTED:
            return False
    settle(joined, _join(one, i, link, two, j + behind, joined), erase, children[0], place)
    settle(joined, _join(two, j, link, one, i + behind, joined), erase, children[1], place)
    return True


@kernel
def _join(head: NodeArray, i: int, link: int, tail: NodeArray, j: int, joined: NodeArray) -> int:
    """Write a path's head up to i, `link` if one, another's tail from j; return the count."""
    count, left = i, int(tail[0] - j + 1)
    copy_part(head, 1, joined, 1, i)
    if link >= 0:
        count += 1
        joined[count] = link
    copy_part(tail, j, joined, count + 1, left)
    return count + left


@kernel
def coincident_sites(one: NodeArray, two: NodeArray, seen: IntArray, sites: IntArray) -> int:
    """Write the places of common nodes but start and goal into `sites`; return how many there are.

    Of a node that the first path passes several times, the last time counts. A site is one number:
    the place in the first path in front of the lowest `PLACE_BITS`, that in the second in them;
    sites ascend by the latter. `seen` needs not be cleared between searches; see `Scratch`.
    """
    search = seen[-1] + (1 << PLACE_BITS)
    seen[-1] = search
    for k in range(2, one[0]):
        seen[np.uint64(one[k])] = search | k
    count = np.uint64(0)
    for k in range(2, two[0]):
        known = seen[np.uint64(two[k])]
        sites[count] = known << PLACE_BITS | k  # kept by counting it, without a branch
        count += np.uint64((known >> PLACE_BITS) == (search >> PLACE_BITS))
    return int(np.int64(count))


@kernel
def near_sites(
    draws: Block, coordinates: NodeArray, one: NodeArray, two: NodeArray, reach: int
) -> tuple[int, int]:
    """Draw a pair of places where two paths are at most `reach` apart; (0, 0): there is none."""
    # how many pairs there are
    num = 0
    for k in range(2, two[0]):
        num += _count_near(coordinates, one, two[k], reach)
    if num == 0:
        return 0, 0
    # one of them
    left = draw_index(draws, num)
    for k in range(2, two[0]):
        here = _count_near(coordinates, one, two[k], reach)
        if left < here:
            for i in range(2, one[0]):
                if _near(coordinates, one[i], two[k], reach):
                    if left == 0:
                        return i, k
                    left -= 1
        left -= here
    return 0, 0


@kernel
def _count_near(coordinates: NodeArray, path: NodeArray, node: int, reach: int) -> int:
    count = 0
    for i in range(2, path[0]):
        count += _near(coordinates, path[i], node, reach)
    return count


@kernel
def _near(coordinates: NodeArray, one: int, two: int, reach: int) -> bool:
    near = True
    for axis in range(coordinates.shape[1]):
        near &= abs(coordinates[one, axis] - coordinates[two, axis]) <= reach
    return near


@kernel
def connection(draws: Block, neighbours: NodeArray, one: int, two: int) -> int:
    """Return a node between two others, drawn among all; else `CONNECTED` or `NOT_CONNECTED`."""
    # how many nodes are between
    count = 0
    for move in range(neighbours.shape[1]):
        between: int = neighbours[one, move]
        if between == two:
            return CONNECTED
        if between >= 0:
            for again in range(neighbours.shape[1]):
                count += neighbours[between, again] == two
    if count == 0:
        return NOT_CONNECTED
    # one of them
    left = draw_index(draws, count)
    for move in range(neighbours.shape[1]):
        between = neighbours[one, move]
        if between >= 0:
            for again in range(neighbours.shape[1]):
                if neighbours[between, again] == two:
                    if left == 0:
                        return between
                    left -= 1
    return NOT_CONNECTED


@kernel
def mutate(draws: Block, world: World, erase: bool, path: NodeArray, scratch: Scratch) -> None:
    """Replace the piece between two nodes of a path, drawn at random, by a random walk."""
    neighbours, steps = world.neighbours, scratch.steps
    joined, walked, place = scratch.joined, scratch.walked, scratch.place
    # two different nodes
    count = path[0]
    first = draw_index(draws, count) + 1
    second = draw_index(draws, count - 1) + 1
    second += second >= first
    low, high = min(first, second), max(first, second)
    ends = (path[low], path[high])
    # a walk from one to the other
    sums = world.sums[ends[1] : ends[1] + 1]
    if len(sums) == 0:
        spread_front(neighbours, world.num_moves, path[high : high + 1], steps, scratch.queue)
    walk(draws, Moves(neighbours, world.potentials, steps), sums, ends, erase, walked, place)
    if used_up(draws):
        return
    # head, walk and tail
    last = low - 1
    copy_part(path, 1, joined, 1, last)
    copy_part(walked, 1, joined, last + 1, walked[0])
    last += walked[0]
    copy_part(path, high + 1, joined, last + 1, count - high)
    last += count - high
    settle(joined, last, erase, path, place)


@kernel
def settle(nodes: NodeArray, count: int, erase: bool, path: NodeArray, place: NodeArray) -> None:
    """Write a joined path, without its loops if these are erased or if it is too long with them."""
    if erase or count > len(path) - 1:
        erase_loops(nodes, count, path, place)
    else:
        copy_part(nodes, 1, path, 1, count)
        path[0] = count
