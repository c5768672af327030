"""One generation of strings of via-points, compiled (Rana & Zalzala 1995, section 3.4).

A whole generation is one call: between kernels, Python's own work would cost half as much as
theirs. Populations are arrays (nq, N + 1, individuals), padded to whole vectors; settings travel as
plain tuples, which `via_point_ga` makes.
"""

import numpy as np

from evoexp.collision.models.sphere_kernels import clearances
from evoexp.evolution.cost_statistics import summarise
from evoexp.evolution.crossover import cross_at_sites
from evoexp.evolution.selection import choose_elites, shuffle_head, spin_roulette
from evoexp.evolution.succession import succeed_rows
from evoexp.numeric.compilation import kernel
from evoexp.objectives.string_fitness import count_collisions, fill_wheel, weigh
from evoexp.paths.interpolation import interpolate
from evoexp.paths.lengths import measure_paths
from evoexp.paths.redistribution import redistribute_arms
from evoexp.paths.relaxation import relax_points
from evoexp.paths.walk import walk_strings


@kernel
def advance(uniforms, draws, arm_slices, breeding, smoothing, judging, memory):  # type: ignore[no-untyped-def]
    """Replace a population by the next one.

    Args:
        uniforms: Random numbers of the whole generation, as many as `draws` and the new
            trajectories take.
        draws: How many offspring, numbers for cross-over, and new trajectories there are.
        arm_slices: (arms, 2) rows of each arm.
        breeding: See `breed`.
        smoothing: See `smooth`.
        judging: See `judge`.
        memory: population, its costs and collisions; offspring, their terms; places of the elites.

    Returns:
        Index of the best, mean and standard deviation of the finite costs, number of collision-free
        individuals.
    """
    population, costs, collisions, offspring, terms, elites = memory
    count = draws[0]
    choose_elites(costs, elites)
    # (a) Reproduction, (b) cross-over, and (d) mutation before (c): a new trajectory, too, is
    # redistributed and relaxed once.
    breed(uniforms, draws, arm_slices, breeding, population, costs, offspring)
    # (c) Redistribution and relaxation.
    smooth(offspring, count, arm_slices, smoothing)
    judge(offspring, arm_slices, judging, terms)
    # The elites stand behind the offspring, untouched and not evaluated again.
    rows = population.shape[0] * population.shape[1]
    succeed_rows(population.reshape((rows, -1)), offspring.reshape((rows, -1)), count, elites)
    succeed_rows(costs.reshape((1, -1)), terms[3].reshape((1, -1)), count, elites)
    succeed_rows(collisions.reshape((1, -1)), terms[2].reshape((1, -1)), count, elites)
    feasible = 0
    for k in range(len(collisions)):
        feasible += collisions[k] == 0.0
    best, mean, std = summarise(costs)
    return best, mean, std, feasible


@kernel
def breed(uniforms, draws, arm_slices, breeding, population, costs, offspring):  # type: ignore[no-untyped-def]
    """Write offspring: reproduced, crossed and mutated (section 3.4 a, b, d).

    Args:
        uniforms: See `advance`.
        draws: See `advance`.
        arm_slices: See `advance`.
        breeding: C_max, rate and distance of cross-over, rate of mutation, step and turn of a walk,
            start, goal.
        population: The parents' generation.
        costs: (individuals,) theirs.
        offspring: Written.
    """
    (
        fitness_offset,
        crossover_rate,
        crossover_distance,
        mutation_rate,
        walk_step,
        max_turn,
        start,
        goal,
    ) = breeding
    count, pairs, new = draws
    # (a) Weighted roulette wheel; neighbours in the order drawn are the random pairs of (b).
    wheel, parents = np.empty(len(costs)), np.empty(count, dtype=np.int64)
    fill_wheel(fitness_offset, costs, wheel)
    spin_roulette(wheel, uniforms[:count], parents)
    # (b) One site per arm, at the same index in both parents.
    sites = uniforms[count : count + pairs]
    cross_at_sites(
        sites, population, parents, arm_slices, crossover_rate, crossover_distance, offspring
    )
    # (d) New trajectories in distinct places, each with the mutation's probability.
    slots, first = np.arange(count), count + pairs
    shuffle_head(uniforms[first : first + new], slots)
    walks = uniforms[first + 2 * new :].reshape((new, -1)) if new else np.empty((0, 0))
    for k in range(new):
        if uniforms[first + new + k] < mutation_rate:
            walk_strings(
                offspring,
                slots[k : k + 1],
                walks[k : k + 1],
                start,
                goal,
                arm_slices,
                walk_step,
                max_turn,
            )


@kernel
def smooth(strings, count, arm_slices, smoothing):  # type: ignore[no-untyped-def]
    """Redistribute and relax the first `count` strings (section 3.4 c).

    Args:
        strings: (nq, N + 1, ≥ count), changed.
        count: Of strings.
        arm_slices: See `advance`.
        smoothing: Whether to redistribute, its samples per segment, pivots and scratch; delta of
            the relaxation.
    """
    redistribution, samples, pivots, floats, integers, delta = smoothing
    lanes = -(-count // 8) * 8  # whole vectors
    if redistribution and count > 0 and strings.shape[1] > 2:
        redistribute_arms(strings, arm_slices, lanes, samples, pivots, floats, integers)
    if delta > 0.0 and count > 0:
        relax_points(strings, delta, lanes)


@kernel
def judge(strings, arm_slices, judging, terms):  # type: ignore[no-untyped-def]
    """Eqs. 2–7 for all strings; the instants 1 … N are the configurations that may collide.

    Args:
        strings: (nq, N + 1, individuals).
        arm_slices: See `advance`.
        judging: Substeps per segment, weights of Eq. 7, tables of the collision model.
        terms: Written: lengths, unevenness, collisions, cost.
    """
    substeps, weights, tables = judging
    lengths, unevenness, collisions, cost = terms
    nq, num_points, lanes = strings.shape
    measure_paths(strings, arm_slices, lengths, unevenness)
    between = np.empty((nq, (num_points - 1) * substeps, lanes))
    interpolate(strings, substeps, between)
    clearance = np.empty((2, (num_points - 1) * substeps * lanes))
    clearances(tables, 0.0, between.reshape((nq, -1)), clearance)
    count_collisions(clearance.reshape((2, num_points - 1, substeps, lanes)), collisions)
    weigh(weights, lengths, unevenness, collisions, cost)
