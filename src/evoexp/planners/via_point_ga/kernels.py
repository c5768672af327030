"""One generation of strings of via-points, compiled (Rana & Zalzala 1995, section 3.4).

Several generations are one call: between kernels, Python's own work would cost half as much as
theirs. Populations are arrays (nq, N + 1, individuals), padded to whole vectors.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.bodies.planar_contacts import contacts
from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.evolution.crossover import cross_at_sites
from evoexp.evolution.selection import choose_elites, shuffle_head, spin_roulette
from evoexp.evolution.succession import follow_rows
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.objectives.string_fitness import StringTerms, count_collisions, fill_wheel, weigh
from evoexp.paths.interpolation import interpolate
from evoexp.paths.lengths import measure_paths
from evoexp.paths.redistribution import redistribute_arms
from evoexp.paths.relaxation import relax_points
from evoexp.paths.walk import walk_strings
from evoexp.records import FloatArray, IntArray


class Counts(NamedTuple):
    """Sizes of a generation."""

    offspring: int  # individuals that are new
    pair_uniforms: int  # uniform numbers that cross-over takes
    new: int  # offspring that may be replaced by new trajectories


class Breeding(NamedTuple):
    """Settings of section 3.4 (a), (b) and (d)."""

    fitness_offset: float  # C_max of Eq. 7.
    crossover_rate: float  # probability that a pair is crossed
    crossover_distance: float  # parents are crossed only where they are closer than this [deg]
    exchanges_segment: bool  # whether cross-over exchanges the segment between its sites
    mutation_rate: float  # probability that a slot gets a new trajectory
    walk_step: float  # step of a new trajectory, in units of its straight distance over N
    max_turn: float  # its largest turn away from the goal [rad]
    start: FloatArray  # (nq,) [deg]
    goal: FloatArray  # (nq,) [deg]


class Smoothing(NamedTuple):
    """Settings and scratch of section 3.4 (c)."""

    redistribution: bool  # whether to redistribute
    samples: int  # of the arc length per segment
    pivots: FloatArray  # factor of the spline's system; see `Redistribution`
    floats: FloatArray  # scratch
    integers: np.ndarray  # scratch
    relaxation_step: float  # delta of Eqs. 8, 9.


class Judging(NamedTuple):
    """Settings of Eqs. 2–7."""

    substeps: int  # configurations tested per segment
    weights: tuple[float, float, float]  # k1, k2, k3 of Eq. 7.
    tables: Any  # `CircleTables` of the collision model; not read where bodies are covered


class Settings(NamedTuple):
    """Settings of a whole generation."""

    counts: Counts  # sizes
    breeding: Breeding  # of section 3.4 (a), (b), (d)
    smoothing: Smoothing  # of section 3.4 (c)
    judging: Judging  # of Eqs. 2–7.


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places."""

    strings: FloatArray  # (nq, N + 1, individuals, padded); offspring first, then the elites
    costs: FloatArray  # (individuals,)
    collisions: FloatArray  # (individuals,) colliding instants


class Scratch(NamedTuple):
    """Arrays that a generation writes on its way."""

    offspring: FloatArray  # strings
    terms: StringTerms  # of the offspring
    elites: IntArray  # places of the elites, best first


@kernel
def evolve(
    # (generations, numbers) those of every generation, in the order in which they are used
    uniforms: FloatArray,
    first: int,  # the present generation
    arm_slices: IntArray,  # (arms, 2) rows of each arm
    settings: Settings,
    # see `Population`: some generations; number g is at place g modulo the number of places
    table: Population,
    scratch: Scratch,
    summaries: FloatArray,  # (places, 4) written, see `summarise_strings`
) -> None:
    """Go on from one generation to others."""
    settings, table, scratch, summaries = borrowed((settings, table, scratch, summaries))
    strings, costs, collisions = table
    for step in range(len(uniforms)):
        own, other = (first + step) % len(costs), (first + step + 1) % len(costs)
        population = Population(strings[own], costs[own], collisions[own])
        following = Population(strings[other], costs[other], collisions[other])
        advance(uniforms[step], arm_slices, settings, population, following, scratch)
        summarise_strings(following.costs, following.collisions, summaries[other])


@kernel
def advance(
    uniforms: FloatArray,  # random numbers of the generation, in the order in which they are used
    arm_slices: IntArray,  # (arms, 2) rows of each arm
    settings: Settings,  # of a generation
    population: Population,  # the present one
    following: Population,  # written
    scratch: Scratch,  # written
) -> None:
    """Write the population that follows another: its offspring, then the elites, best first."""
    counts, (offspring, terms, elites) = settings.counts, scratch
    # elites: the lowest costs
    choose_elites(population.costs, elites)
    # (a) reproduction, (b) cross-over, and (d) mutation before (c): a new trajectory, too, is
    # redistributed and relaxed once
    breeding, costs = settings.breeding, population.costs
    breed(uniforms, counts, arm_slices, breeding, population.strings, costs, offspring)
    # (c) redistribution and relaxation
    smooth(offspring, counts.offspring, arm_slices, settings.smoothing)
    # Eqs. 2–7
    judge(offspring, arm_slices, settings.judging, terms)
    follow(population, scratch, counts.offspring, following)


@kernel
def follow(population: Population, scratch: Scratch, count: int, following: Population) -> None:
    """Write the population that follows another: elites are not evaluated again."""
    offspring, terms, elites = scratch
    rows = population.strings.shape[0] * population.strings.shape[1]
    follow_rows(
        population.strings.reshape((rows, -1)),
        offspring.reshape((rows, -1)),
        count,
        elites,
        following.strings.reshape((rows, -1)),
    )
    for before, new, after in (
        (population.costs, terms.cost, following.costs),
        (population.collisions, terms.collisions, following.collisions),
    ):
        one = before.reshape((1, -1))
        follow_rows(one, new.reshape((1, -1)), count, elites, after.reshape((1, -1)))


@kernel
def summarise_strings(costs: FloatArray, collisions: FloatArray, out: FloatArray) -> None:
    """Write index of the best, mean and deviation of the costs, number of free individuals."""
    out[0], out[1], out[2] = cost_statistics(costs)
    free = 0
    for k in range(len(collisions)):
        free += collisions[k] == 0.0
    out[3] = free


@kernel
def breed(
    uniforms: FloatArray,
    counts: Counts,  # sizes
    arm_slices: IntArray,  # (arms, 2) rows of each arm
    breeding: Breeding,  # settings
    population: FloatArray,  # the parents' generation
    costs: FloatArray,  # (individuals,) of the parents
    offspring: FloatArray,  # written
) -> None:
    """Write offspring: reproduced, crossed and mutated (section 3.4 a, b, d)."""
    count, new = counts.offspring, counts.new
    # (a) weighted roulette wheel; neighbours in the order drawn are the random pairs of (b)
    wheel, parents = np.empty(len(costs)), np.empty(count, dtype=np.int64)
    fill_wheel(breeding.fitness_offset, costs, wheel)
    spin_roulette(wheel, uniforms[:count], parents)
    # (b) one site per arm, at the same index in both parents
    first = count + counts.pair_uniforms
    cross_at_sites(
        uniforms[count:first],
        population,
        parents,
        arm_slices,
        breeding.crossover_rate,
        breeding.crossover_distance,
        breeding.exchanges_segment,
        offspring,
    )
    # (d) new trajectories in distinct places, each with the mutation's probability
    slots = np.arange(count)
    shuffle_head(uniforms[first : first + new], slots)
    walks = uniforms[first + 2 * new :].reshape((new, -1)) if new else np.empty((0, 0))
    num = 0
    for k in range(new):
        if uniforms[first + new + k] < breeding.mutation_rate:
            slots[num] = slots[k]
            for j in range(walks.shape[1]):  # assigning rows compiles numba's message on shapes
                walks[num, j] = walks[k, j]
            num += 1
    walk_strings(
        offspring,
        slots[:num],
        walks[:num],
        breeding.start,
        breeding.goal,
        arm_slices,
        breeding.walk_step,
        breeding.max_turn,
    )


@kernel
def smooth(strings: FloatArray, count: int, arm_slices: IntArray, smoothing: Smoothing) -> None:
    """Redistribute and relax the first `count` strings (section 3.4 c).

    Args:
        strings: (nq, N + 1, ≥ count), changed.
        count: Number of strings.
        arm_slices: See `advance`.
        smoothing: Settings and scratch.
    """
    lanes = -(-count // 8) * 8  # whole vectors
    if smoothing.redistribution and count > 0 and strings.shape[1] > 2:
        redistribute_arms(
            strings,
            arm_slices,
            lanes,
            smoothing.samples,
            smoothing.pivots,
            smoothing.floats,
            smoothing.integers,
        )
    if smoothing.relaxation_step > 0.0 and count > 0:
        relax_points(strings, smoothing.relaxation_step, lanes)


@kernel
def judge(strings: FloatArray, arm_slices: IntArray, judging: Judging, terms: StringTerms) -> None:
    """Eqs. 2–7 for all strings; the instants 1 … N are the configurations that may collide.

    Args:
        strings: (nq, N + 1, individuals).
        arm_slices: See `advance`.
        terms: Written.
    """
    substeps, (nq, num_points, lanes) = judging.substeps, strings.shape
    # Eqs. 2–5: lengths, and how uneven the distances of via-points are
    measure_paths(strings, arm_slices, terms.lengths, terms.unevenness)
    # Eq. 6: contacts at the instants, which follow the start, and at the substeps before them
    configurations, start = strings, lanes
    if substeps > 1:
        configurations, start = np.empty((nq, (num_points - 1) * substeps, lanes)), 0
        interpolate(strings, substeps, configurations)
    hits = np.empty((num_points - 1) * substeps * lanes)
    contacts(judging.tables, configurations.reshape((nq, -1)), start, hits)
    by_instant = hits.reshape((1, num_points - 1, substeps, lanes))
    count_collisions(by_instant, terms.collisions)
    # Eq. 7
    weigh(judging.weights, terms.lengths, terms.unevenness, terms.collisions, terms.cost)
