"""One generation of end postures of a sub-path, compiled (Lavoie & Boudreau 2001).

A population is a table of rows, individuals innermost: the genes; the joint angles, which are the genes themselves in
real coding and follow them in binary coding; then cost, position error and joint displacement. A whole generation is
one call; settings travel as plain tuples, which `redundant_search` makes.
"""

import numpy as np

from evoexp.collision.ellipse_kernels import paths_collide
from evoexp.evolution.crossover import cross_single_point
from evoexp.evolution.gene_crossover import ONE_POINT, cross_genes
from evoexp.evolution.gene_mutation import decode_bits, flip_bits, mutate_genes
from evoexp.evolution.ranking import choose_by_tournament, rank_weights
from evoexp.evolution.selection import choose_elites, inverse_weights, spin_roulette
from evoexp.evolution.statistics import summarise
from evoexp.evolution.succession import succeed_rows
from evoexp.numerics import kernel
from evoexp.objectives.reaching import measure_reach

TOURNAMENT, ROULETTE, RANK = range(3)
RESULTS = 3  # rows of cost, position error, joint displacement


@kernel
def advance(draws, breeding, judging, starts, memory):  # type: ignore[no-untyped-def]
    """Replace a population by the next one.

    Args:
        draws: Uniform numbers for selection, crossover and mutation; (joints, ≥ offspring) normal deviates.
        breeding: See `breed`.
        judging: See `judge`.
        starts: (joints, ≥ offspring) start of the sub-path, the same for all [rad].
        memory: Tables of the population and of its offspring; parents (offspring,), places of the elites, scratch
            (individuals + LANES,) for indices, (individuals,) for hits.

    Returns:
        See `summary`.
    """
    population, offspring, parents, elites, lanes, hit = memory
    num_joints, num_genes, binary = len(starts), breeding[0], breeding[1]
    costs = population[len(population) - RESULTS]
    choose_elites(costs, elites)
    breed(draws, breeding, costs, population[:num_genes], parents, offspring[:num_genes])
    first = num_genes if binary else 0
    angles = offspring[first : first + num_joints]
    if binary:
        decode_bits(offspring[:num_genes], len(parents), breeding[5], angles)
    count = inherit(population, offspring, parents, num_genes, lanes)
    judge(starts, angles, lanes, count, judging, offspring[len(offspring) - RESULTS :], hit)
    succeed_rows(population, offspring, len(parents), elites)
    return summary(costs)


@kernel
def summary(costs):  # type: ignore[no-untyped-def]
    """Return index of the best, mean and standard deviation of the finite costs, and how many are finite."""
    best, mean, std = summarise(costs)
    finite = 0
    for k in range(len(costs)):
        finite += np.isfinite(costs[k])
    return best, mean, std, finite


@kernel
def breed(draws, breeding, costs, genomes, parents, out):  # type: ignore[no-untyped-def]
    """Write offspring: selected, crossed and mutated.

    Args:
        draws: See `advance`.
        breeding: Number of genes; whether they are bits; (selection, tournament size, rank pressure); (crossover, its
            rate, α); (mutation, its scope, its rate, its spread); limits of the joints.
        costs: (individuals,) of the parents' generation.
        genomes: (genes, individuals) theirs.
        parents: (offspring,) written.
        out: (genes, ≥ offspring) written.
    """
    selecting, crossing, mutating, normals = draws
    _, binary, (selection, size, pressure), (crossover, crossing_rate, alpha), mutation, limits = breeding
    kind, scope, rate, spread = mutation
    if selection == TOURNAMENT:
        choose_by_tournament(selecting, costs, size, parents)
    else:
        weights = np.empty(len(costs))
        if selection == ROULETTE:
            inverse_weights(costs, weights)
        else:
            rank_weights(costs, pressure, weights)
        spin_roulette(weights, selecting, parents)
    if crossover == ONE_POINT:
        cross_single_point(crossing, genomes, parents, crossing_rate, out)
    else:
        cross_genes(crossover, crossing, genomes, parents, crossing_rate, alpha, limits, out)
    if binary:
        flip_bits(mutating, out, len(parents), rate)
    else:
        mutate_genes(kind, scope, mutating, normals, out, len(parents), rate, spread, limits)


@kernel
def inherit(population, offspring, parents, num_genes, lanes):  # type: ignore[no-untyped-def]
    """Give children that are equal to their parent its results; list the others in `lanes` and return their number."""
    changed = np.zeros(len(parents), dtype=np.bool_)
    for gene in range(num_genes):
        own, source = offspring[gene], population[gene]
        for k in range(len(parents)):
            changed[k] |= own[k] != source[parents[k]]
    rows = len(population)
    for row in range(rows - RESULTS, rows):
        own, source = offspring[row], population[row]
        for k in range(len(parents)):
            own[k] = source[parents[k]]
    count = 0
    for k in range(len(parents)):
        lanes[count] = k
        count += changed[k]
    return count


@kernel
def judge(starts, ends, lanes, count, judging, results, hit):  # type: ignore[no-untyped-def]
    """Write Eq. 4 and its parts for some individuals; the tip outside the box is found before any collision is sought.

    Args:
        starts: (joints, individuals) [rad].
        ends: (joints, individuals) [rad].
        lanes: (≥ count + LANES) indices of individuals, changed.
        count: How many.
        judging: Arm, ellipses and path of the collision model; target, box and weights of the objective.
        results: (3, individuals) written: cost, position error, joint displacement.
        hit: (individuals,) scratch.
    """
    arm, ellipses, path, target, box, weights = judging
    cost = results[0]
    measure_reach(starts, ends, lanes, count, arm, target, box, weights, cost, results[1], results[2])
    left = 0
    for k in range(count):
        individual = lanes[k]
        lanes[left] = individual
        left += cost[individual] < np.inf
    paths_collide(starts, ends, lanes, left, arm, ellipses, path, hit)
    for k in range(left):
        individual = lanes[k]
        cost[individual] = np.inf if hit[individual] else cost[individual]
