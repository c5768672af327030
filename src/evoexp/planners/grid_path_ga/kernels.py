"""Generations of paths over a grid, compiled (Chen & Zalzala 1995, section 2.3).

A path is a row of a table, see `paths.grids`.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.evolution.succession import choose_parents, summarise
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block, draw, used_up
from evoexp.paths.grids import NodeArray, measure_path
from evoexp.planners.driver import TableSearch
from evoexp.planners.grid_path_ga.path_operators import (
    Breeding,
    Scratch,
    World,
    copy_path,
    cross,
    mutate,
)
from evoexp.planners.planner import Candidate
from evoexp.records import FloatArray

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
    """A search whose tables keep the best path of each generation, and the results of all."""

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
def note(population: Population, place: int, recorded: Population, summaries: FloatArray) -> None:
    """Write to a place the results of all paths, the best path alone, and the summary."""
    results, summary = population.results, summaries[place]
    recorded.results[place] = results
    summarise(results[COST], np.isfinite(results[COST]), summary)
    copy_path(population.paths[int(summary[0])], recorded.paths[place])


@kernel
def advance(
    draws: Block,  # uniform numbers
    world: World,  # grid and fields
    weights: tuple[float, float],  # ε and λ of Eq. 1.
    breeding: Breeding,  # settings of the operators
    population: Population,
    following: Population,  # written
    scratch: Scratch,  # of the operators
) -> bool:
    """Write the population that follows another: its offspring, then the elites, best first.

    Returns whether the draws sufficed; if not, what is written is not complete.
    """
    draws, world, scratch = borrowed((draws, world, scratch))
    population, following = borrowed((population, following))
    (paths, results), (children, values) = population, following
    parents, elites = choose_parents(draws, results[COST], breeding.multiple, breeding.num_elites)
    if used_up(draws):
        return False
    count = len(parents)
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
    last: int,  # the trial behind the last one
    world: World,  # grid and fields
    weights: tuple[float, float],  # ε and λ of Eq. 1.
    erase: bool,  # whether loops are erased
    population: Population,  # paths and their results, changed
    candidate: Population,  # scratch of one path
    scratch: Scratch,  # of the operators
) -> int:
    """Regenerate a piece of one path after the other as mutation does; keep what costs no more.

    Returns the number of the next trial: below `last` if the draws did not suffice.
    """
    draws, world, population, candidate, scratch = borrowed(
        (draws, world, population, candidate, scratch)
    )
    paths, results = population
    path, values = candidate.paths[0], candidate.results
    for own in range(trial, last):
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
    return last
