"""Generations of paths over a grid, compiled (Chen & Zalzala 1995, section 2.3).

A path is a row of a table, see `paths.grid_walks`.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.evolution.scaled_selection import SelectionMemory, choose_parents
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block, draw, used_up
from evoexp.paths.grid_choices import Choices
from evoexp.paths.grid_measures import measure_by_tolls, measure_path
from evoexp.paths.grid_walks import walk_all
from evoexp.paths.grids import NodeArray
from evoexp.planners.grid_path_ga.path_operators import (
    Breeding,
    Scratch,
    World,
    copy_path,
    cross,
    mutate,
)
from evoexp.planners.planner import Candidate
from evoexp.planners.table_search import TableSearch
from evoexp.records import FloatArray, IntArray

RESULTS = 3
DISTANCE, UNSAFENESS, COST = range(RESULTS)


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places."""

    paths: NodeArray  # (individuals, nodes + 1)
    results: FloatArray  # (3, individuals) lengths, mean unsafenesses, costs


def solution_of(path: NodeArray, world: World) -> FloatArray:
    """Return a path (nodes + 1,) as a flat solution."""
    return np.asarray(world.coordinates[path[1 : path[0] + 1]], dtype=np.float64).ravel()


def named_terms(results: FloatArray, num_nodes: Any) -> dict[str, float]:
    """Return D, S and the number of nodes of a path by name."""
    named = {"distance": float(results[DISTANCE]), "unsafeness": float(results[UNSAFENESS])}
    return named | {"num_nodes": float(num_nodes)}


class PathTable(TableSearch):
    """A search whose tables keep the best path of each generation, and the results of all.

    Attributes:
        recorded: With a first axis of places; see `note`.
    """

    recorded: Population

    def make_table(self, world: World, individuals: int) -> None:
        """Make the tables for generations of so many individuals."""
        self._world, places = world, self.num_places
        self.recorded = Population(
            np.empty((places, len(world.coordinates) + 1), dtype=np.int32),
            np.empty((places, RESULTS, individuals)),
        )
        self.costs = self.recorded.results[:, COST]

    def candidate(self, place: int, individual: int) -> Candidate:
        """Return the best path of a generation, which is valid, and its terms."""
        path = self.recorded.paths[place]
        terms = named_terms(self.recorded.results[place, :, individual], path[0])
        return Candidate(solution_of(path, self._world), terms, True)


@inlined
def measure(
    path: NodeArray, world: World, weights: tuple[float, float], results: FloatArray, k: int
) -> None:
    """Write D, S and C = ε D + λ S of a path (Eqs. 1 to 3) into column k of `results`."""
    if len(world.tolls.of_node) > 0:
        distance, mean = measure_by_tolls(path, world.tolls)
    else:
        distance, mean = measure_path(path, world.kinds, world.unsafeness)
    results[DISTANCE, k], results[UNSAFENESS, k] = distance, mean
    results[COST, k] = weights[0] * distance + weights[1] * mean


@kernel
def measure_all(
    paths: NodeArray, world: World, weights: tuple[float, float], results: FloatArray
) -> None:
    """Write D, S and C of all paths of a population."""
    paths, world, results = borrowed((paths, world, results))
    for k in range(len(paths)):
        measure(paths[k], world, weights, results, k)


@kernel
def evolve(
    draws: Block,  # uniform numbers
    first: int,  # the present generation
    last: int,  # the generation to reach
    world: World,  # grid and fields
    weights: tuple[float, float],  # ε and λ of Eq. 1.
    breeding: Breeding,  # settings of the operators
    # two generations or more; number g is at place g modulo the number of places
    table: Population,
    chosen: SelectionMemory,  # parents and elites, written
    scratch: Scratch,  # of the operators
    # what is recorded of some generations, see `note`; likewise at places of its own
    found: Population,
    summaries: FloatArray,  # (places, 4) likewise
) -> int:
    """Go on from one generation to another.

    Returns:
        The generation reached: an earlier one if the draws did not suffice. Then it is to go on
        there with more.
    """
    draws, world, table, chosen, scratch = borrowed((draws, world, table, chosen, scratch))
    found, summaries = borrowed((found, summaries))
    paths, results = table.paths, table.results
    for generation in range(first, last):
        before, own = draws.taken[0], generation % len(paths)
        other = (generation + 1) % len(paths)
        population = Population(paths[own], results[own])
        following = Population(paths[other], results[other])
        if not advance(draws, world, weights, breeding, population, following, chosen, scratch):
            draws.taken[0] = before
            return generation
        note(following, (generation + 1) % len(summaries), found, summaries)
    return last


@kernel
def note(population: Population, place: int, found: Population, summaries: FloatArray) -> None:
    """Write to a place what is recorded of a generation.

    These are the results of all paths, the best path alone, and the summary: all paths are valid.
    """
    results, own = population.results, summaries[place]
    found.results[place] = results
    own[0], own[1], own[2] = cost_statistics(results[COST])
    own[3] = results.shape[1]
    copy_path(population.paths[int(own[0])], found.paths[place])


@kernel
def advance(
    draws: Block,
    world: World,
    weights: tuple[float, float],
    breeding: Breeding,
    population: Population,
    following: Population,
    chosen: SelectionMemory,
    scratch: Scratch,
) -> bool:
    """Write the population that follows another: its offspring, then the elites, best first.

    Returns whether the draws sufficed; if not, what is written is not complete.
    """
    (paths, results), (children, values) = population, following
    parents, elites, count = chosen.parents, chosen.elites, len(chosen.parents)
    if not choose_parents(draws, results[COST], breeding.multiple, chosen):
        return False
    for first in range(0, count, 2):
        # crossover of a pair
        crossed = False
        if first + 1 < count and draw(draws) < breeding.crossover_rate:
            one, two = paths[parents[first]], paths[parents[first + 1]]
            pair = (children[first], children[first + 1])
            crossed = cross(draws, world, (one, two), breeding, pair, scratch)
        # mutation of both, costs of the changed ones
        for k in range(first, min(first + 2, count)):
            changed = crossed
            if not crossed:
                copy_path(paths[parents[k]], children[k])
            if draw(draws) < breeding.mutation_rate:
                mutate(draws, world, breeding.erase, children[k], scratch)
                changed = True
            if used_up(draws):
                return False
            if changed:
                measure(children[k], world, weights, values, k)
            else:
                for row in range(RESULTS):
                    values[row, k] = results[row, parents[k]]
    # elites
    for e in range(len(elites)):
        copy_path(paths[elites[e]], children[count + e])
        for row in range(RESULTS):
            values[row, count + e] = results[row, elites[e]]
    return True


@kernel
def climb(
    draws: Block,  # uniform numbers
    trial: int,  # number of the first trial: trial k changes path k modulo the number of paths
    first: int,  # the present generation
    last: int,  # the generation to reach
    num_trials: int,  # of each generation
    world: World,  # grid and fields
    weights: tuple[float, float],  # ε and λ of Eq. 1.
    erase: bool,  # whether loops are erased
    population: Population,  # paths and their results, changed
    candidate: Population,  # scratch of one path
    scratch: Scratch,  # of the operators
    found: Population,  # see `evolve`, as for `summaries`
    summaries: FloatArray,
) -> int:
    """Regenerate a piece of one path after the other as mutation does; keep what costs no more.

    Returns:
        The number of the next trial: one of an earlier generation if the draws did not suffice.
    """
    draws, world, population, candidate, scratch = borrowed(
        (draws, world, population, candidate, scratch)
    )
    found, summaries = borrowed((found, summaries))
    paths, results = population
    path, values = candidate.paths[0], candidate.results
    for generation in range(first + 1, last + 1):
        for own in range(trial, generation * num_trials):
            before, k = draws.taken[0], own % len(paths)
            copy_path(paths[k], path)
            mutate(draws, world, erase, path, scratch)
            if used_up(draws):
                draws.taken[0] = before
                return own
            measure(path, world, weights, values, 0)
            if values[COST, 0] <= results[COST, k]:
                copy_path(path, paths[k])
                for row in range(RESULTS):
                    results[row, k] = values[row, 0]
        trial = generation * num_trials
        note(population, generation % len(summaries), found, summaries)
    return trial


@kernel
def draw_generations(
    words: NDArray[np.uint64],  # random
    first: int,  # the generation drawn last
    last: int,  # the generation to reach
    num_words: int,  # see `walk_all`, as for `more_words`
    more_words: int,
    choices: Choices,  # of the goal
    ends: tuple[int, int],  # indices of start and goal
    erase: bool,  # whether loops are erased
    world: World,  # grid and fields
    weights: tuple[float, float],  # ε and λ of Eq. 1.
    population: Population,  # written: the generation drawn last
    counts: IntArray,  # (≥ last − first,) written: words of each generation
    found: Population,  # see `evolve`, as for `summaries`
    summaries: FloatArray,
) -> int:
    """Draw and measure generations of random paths, each independent of the others.

    Returns:
        The generation reached: an earlier one if the words did not suffice.
    """
    words, choices, world, population = borrowed((words, choices, world, population))
    found, summaries, at = *borrowed((found, summaries)), 0
    for generation in range(first + 1, last + 1):
        count = walk_all(words[at:], num_words, more_words, choices, ends, erase, population.paths)
        if count < 0:
            return generation - 1
        at += count
        counts[generation - first - 1] = count
        measure_all(population.paths, world, weights, population.results)
        note(population, generation % len(summaries), found, summaries)
    return last
