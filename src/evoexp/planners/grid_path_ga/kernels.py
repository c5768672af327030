"""Generations of paths over a grid, compiled (Chen & Zalzala 1995, section 2.3).

A population is a table of paths (individuals, nodes + 1), each row as `paths.grid_walks` says, and
of their lengths, mean unsafenesses and costs (3, individuals). Many generations are one call;
settings travel as plain tuples.
"""

from evoexp.evolution.cost_statistics import summarise
from evoexp.evolution.remainder import choose_by_remainders, num_remainder_uniforms
from evoexp.evolution.scaling import scale_costs
from evoexp.evolution.selection import choose_elites
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.random_stream import draw, draw_index, draw_many, used_up
from evoexp.paths.grid_walks import erase_loops, measure_path, walk
from evoexp.paths.grids import Moves, spread_front

RESULTS = 3
DISTANCE, UNSAFENESS, COST = range(RESULTS)
NOT_CONNECTED, CONNECTED = -1, -2


@kernel
def measure(path, world, weights, results, k):  # type: ignore[no-untyped-def]
    """Write D, S and C = ε D + λ S of a path (Eqs. 1 to 3) into column k of `results`."""
    distance, mean = measure_path(path, world[3], world[4])
    results[DISTANCE, k], results[UNSAFENESS, k] = distance, mean
    results[COST, k] = weights[0] * distance + weights[1] * mean


@kernel
def measure_all(paths, world, weights, results):  # type: ignore[no-untyped-def]
    """Write D, S and C of all paths of a population."""
    paths, world, results = borrowed((paths, world, results))
    for k in range(len(paths)):
        measure(paths[k], world, weights, results, k)


@kernel
def evolve(draws, generations, world, weights, breeding, tables, memory, records):  # type: ignore[no-untyped-def]
    """Go on from one generation to another; what each is worth is noted beside it.

    Args:
        draws: See `evoexp.numeric.random_stream`.
        generations: The present one, and the one to reach.
        world: See `advance`, and so are `weights`, `breeding` and `memory`.
        tables: Paths (places, individuals, nodes + 1) and results (places, 3, individuals) of some
            generations; number g has place g modulo the number of places.
        records: (places, 4) see `record`.

    Returns:
        The generation reached: an earlier one if the draws did not suffice. Then it is to go on
        there with more.
    """
    draws, world, tables, memory, records = borrowed((draws, world, tables, memory, records))
    paths, results = tables
    first, last = generations
    for generation in range(first, last):
        before, own, other = draws[1][0], generation % len(paths), (generation + 1) % len(paths)
        population, following = (paths[own], results[own]), (paths[other], results[other])
        if not advance(draws, world, weights, breeding, population, following, memory):
            draws[1][0] = before
            return generation
        record(results[other], records[other])
    return last


@kernel
def record(results, out):  # type: ignore[no-untyped-def]
    """Note in `out` (4,) index of the best, mean and deviation of the costs.

    And the number of paths: all are valid.
    """
    out[0], out[1], out[2] = summarise(results[COST])
    out[3] = results.shape[1]


@kernel
def advance(draws, world, weights, breeding, population, following, memory):  # type: ignore[no-untyped-def]
    """Write the population that follows another: its offspring, then the elites, best first.

    Args:
        draws: See `evoexp.numeric.random_stream`.
        world: (neighbours, moves of a front, coordinates, kinds, unsafeness, potentials, fronts);
            `fronts` (nodes, nodes) holds the steps to every node from every other, or nothing.
        weights: ε and λ of Eq. 1.
        breeding: Whether loops are erased; multiple of the scaling; crossover's rate and reach;
            mutation's rate.
        population: Paths (individuals, nodes + 1) and results (3, individuals).
        following: The same, written.
        memory: (parents (offspring,), elites (elites,), expected copies and order of the scan
            (individuals,)), scratch of `cross`.

    Returns:
        Whether the draws sufficed; if not, what is written is not complete.
    """
    erase, multiple, crossover_rate, reach, mutation_rate = breeding
    (paths, results), (children, values) = population, following
    (parents, elites, expected, order), scratch = memory
    num, count = len(paths), len(parents)
    choose_elites(results[COST], elites)
    scale_costs(results[COST], count, multiple, expected)
    choosing = draw_many(draws, num_remainder_uniforms(num, count))
    if used_up(draws):
        return False
    choose_by_remainders(choosing, expected, order, parents)
    for first in range(0, count, 2):
        crossed = False
        if first + 1 < count and draw(draws) < crossover_rate:
            pair = paths[parents[first]], paths[parents[first + 1]]
            crossed = cross(
                draws, world, pair, (erase, reach), (children[first], children[first + 1]), scratch
            )
        for k in range(first, min(first + 2, count)):
            changed = crossed
            if not crossed:
                copy_path(paths[parents[k]], children[k])
            if draw(draws) < mutation_rate:
                mutate(draws, world, erase, children[k], scratch)
                changed = True
            if used_up(draws):
                return False
            if changed:
                measure(children[k], world, weights, values, k)
            else:
                for row in range(RESULTS):
                    values[row, k] = results[row, parents[k]]
    for e in range(len(elites)):
        copy_path(paths[elites[e]], children[count + e])
        for row in range(RESULTS):
            values[row, count + e] = results[row, elites[e]]
    return True


@kernel
def copy_paths(paths, out):  # type: ignore[no-untyped-def]
    """Copy paths into another table, whatever the width of either."""
    paths, out = borrowed((paths, out))
    for k in range(len(paths)):
        copy_path(paths[k], out[k])


@kernel
def copy_path(path, out):  # type: ignore[no-untyped-def]
    """Copy a path; what stands behind its last node stays."""
    for k in range(path[0] + 1):
        out[k] = path[k]


@kernel
def cross(draws, world, parents, settings, children, scratch):  # type: ignore[no-untyped-def]
    """Exchange the remainders of two paths at a node that both pass, or at two nodes that are near.

    "If the path pair have coincident points, then select one randomly as the crossover site and
    exchange the remainder of the two paths"; if not, a pair of nodes at most `reach` apart (in
    every coordinate), drawn among all such pairs, is connected, by a move or by a node between.
    Start and goal, which all paths have in common, are no sites.

    Args:
        draws: See `evoexp.numeric.random_stream`.
        world: See `advance`.
        parents: Two paths.
        settings: Whether loops are erased; reach.
        children: Two paths, written if the parents are crossed.
        scratch: Places in a path (nodes,), a path (3 nodes + 3,), sites (2, nodes + 1), steps of a
            front and its queue (nodes,), a walk (nodes + 1,).

    Returns:
        Whether they are: there may be no site.
    """
    one, two = parents
    place, joined, sites = scratch[0], scratch[1], scratch[2]
    count = coincident_sites(one, two, place, sites)
    if count > 0:
        site = draw_index(draws, count)
        i, j = sites[0, site], sites[1, site]
        if settings[0]:
            exchange_without_loops(one, two, i, j, sites[:, :count], children[0])
            exchange_without_loops(two, one, j, i, sites[::-1, :count], children[1])
        else:
            settle(joined, _join(one, i, -1, two, j + 1, joined), False, children[0], place)
            settle(joined, _join(two, j, -1, one, i + 1, joined), False, children[1], place)
        return True
    i, j = near_sites(draws, world[2], one, two, settings[1])
    if i == 0:
        return False
    link = connection(draws, world[0], one[i], two[j])
    if link == NOT_CONNECTED:
        return False
    settle(joined, _join(one, i, link, two, j, joined), settings[0], children[0], place)
    settle(joined, _join(two, j, link, one, i, joined), settings[0], children[1], place)
    return True


@kernel
def exchange_without_loops(head, tail, i, j, sites, child):  # type: ignore[no-untyped-def]
    """Write the head of a path up to its node i and the tail of another behind its node j.

    Without loops.

    Neither path has loops, so a loop begins in the head and ends in the tail: at a site. Erasing
    loops one by one leaves the head up to the first node at which any node of the tail comes back
    to it, and the tail from there.

    Args:
        head: A path without loops.
        tail: Another one.
        i: Place of a node in the head.
        j: Place of the same node in the tail.
        sites: (2, sites) places in `head` and in `tail` of all nodes that both have, but start and
            goal.
        child: Written.
    """
    least, behind = i, j
    for k in range(sites.shape[1]):
        sooner = (sites[1, k] > j) & (sites[0, k] < least)
        least = sites[0, k] if sooner else least
        behind = sites[1, k] if sooner else behind
    for k in range(1, least + 1):
        child[k] = head[k]
    shift = least - behind
    for k in range(behind + 1, tail[0] + 1):
        child[k + shift] = tail[k]
    child[0] = tail[0] + shift


@kernel
def _join(head, i, link, tail, j, joined):  # type: ignore[no-untyped-def]
    """Write the head of a path up to i, a node between if `link` is one, another's tail from j.

    Return how many.
    """
    count = i
    for k in range(1, i + 1):
        joined[k] = head[k]
    if link >= 0:
        count += 1
        joined[count] = link
    for k in range(j, tail[0] + 1):
        count += 1
        joined[count] = tail[k]
    return count


@kernel
def coincident_sites(one, two, place, sites):  # type: ignore[no-untyped-def]
    """Write where two paths pass the same node, start and goal left out, into `sites` (2.

    Nodes + 1); return how often.

    Of a node that the first path passes several times, the last time counts.
    """
    for k in range(2, one[0]):
        place[one[k]] = k
    count = 0
    for k in range(2, two[0]):
        known = place[two[k]]
        known = known if (known >= 2) & (known < one[0]) else 0
        sites[0, count], sites[1, count] = (
            known,
            k,
        )  # kept by counting it: a branch would be guessed wrong often
        count += (known > 0) & (one[known] == two[k])
    return count


@kernel
def near_sites(draws, coordinates, one, two, reach):  # type: ignore[no-untyped-def]
    """Draw a pair of nodes of two paths that are at most `reach` apart in every coordinate.

    (0, 0) if there is none.

    Args:
        draws: See `evoexp.numeric.random_stream`.
        coordinates: (nodes, dimensions).
        one: A path.
        two: A path.
        reach: [cell].
    """
    num = 0
    for k in range(2, two[0]):
        num += _count_near(coordinates, one, two[k], reach)
    if num == 0:
        return 0, 0
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
def _count_near(coordinates, path, node, reach):  # type: ignore[no-untyped-def]
    count = 0
    for i in range(2, path[0]):
        count += _near(coordinates, path[i], node, reach)
    return count


@kernel
def _near(coordinates, one, two, reach):  # type: ignore[no-untyped-def]
    near = True
    for axis in range(coordinates.shape[1]):
        near &= abs(coordinates[one, axis] - coordinates[two, axis]) <= reach
    return near


@kernel
def connection(draws, neighbours, one, two):  # type: ignore[no-untyped-def]
    """Return a node between two others, drawn among all that moves join to both.

    Moves have two directions.

    `CONNECTED` if a move joins the two themselves, `NOT_CONNECTED` if there is no such node.
    """
    count = 0
    for move in range(neighbours.shape[1]):
        between = neighbours[one, move]
        if between == two:
            return CONNECTED
        if between >= 0:
            for again in range(neighbours.shape[1]):
                count += neighbours[between, again] == two
    if count == 0:
        return NOT_CONNECTED
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
def mutate(draws, world, erase, path, scratch):  # type: ignore[no-untyped-def]
    """Replace what lies between two nodes of a path, drawn at random.

    By a random walk from one to the other.
    """
    neighbours, num_moves, _, _, _, potentials, fronts = world
    place, joined, _, steps, queue, walked = scratch
    count = path[0]
    first = draw_index(draws, count) + 1
    second = draw_index(draws, count - 1) + 1
    second += second >= first
    low, high = min(first, second), max(first, second)
    ends = (path[low], path[high])
    if len(fronts) > 0:
        walk(draws, Moves(neighbours, potentials, fronts[ends[1]]), ends, erase, walked, place)
    else:
        spread_front(neighbours, num_moves, path[high : high + 1], steps, queue)
        walk(draws, Moves(neighbours, potentials, steps), ends, erase, walked, place)
    last = low - 1
    for k in range(1, low):
        joined[k] = path[k]
    for k in range(1, walked[0] + 1):
        last += 1
        joined[last] = walked[k]
    for k in range(high + 1, count + 1):
        last += 1
        joined[last] = path[k]
    settle(joined, last, erase, path, place)


@kernel
def settle(nodes, count, erase, path, place):  # type: ignore[no-untyped-def]
    """Write a path that was put together.

    Without its loops if these are erased or if it would not fit otherwise.
    """
    if erase or count > len(path) - 1:
        erase_loops(nodes, count, path, place)
    else:
        for k in range(1, count + 1):
            path[k] = nodes[k]
        path[0] = count
