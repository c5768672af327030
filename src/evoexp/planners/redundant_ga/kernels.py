"""One generation of end postures of a sub-path, compiled (Lavoie & Boudreau 2001).

A population is a table of rows, individuals innermost: the genes; the joint angles, which are the
genes themselves in real coding and follow them in binary coding; then cost, position error and
joint displacement. A whole generation is one call; settings travel as plain tuples, which
`redundant_search` makes.
"""

import numpy as np

from evoexp.collision.models.ellipse_kernels import paths_collide
from evoexp.evolution.cost_statistics import summarise
from evoexp.evolution.crossover import cross_single_point
from evoexp.evolution.gene_crossover import ONE_POINT, cross_genes
from evoexp.evolution.gene_mutation import decode_bits, flip_bits, mutate_genes
from evoexp.evolution.ranking import choose_by_tournament, rank_weights
from evoexp.evolution.selection import choose_elites, inverse_weights, spin_roulette
from evoexp.evolution.succession import succeed_rows
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.objectives.reaching import measure_reach, measure_reach_from

TOURNAMENT, ROULETTE, RANK = range(3)
RESULTS = 3  # rows of cost, position error, joint displacement


@kernel
def advance(draws, breeding, judging, starts, memory):  # type: ignore[no-untyped-def]
    """Replace a population by the next one.

    Args:
        draws: Uniform numbers for selection, crossover and mutation; (joints, ≥ offspring) normal
            deviates.
        breeding: See `breed`.
        judging: See `judge`.
        starts: (joints, ≥ offspring) start of the sub-path, the same for all [rad].
        memory: Tables of the population and of its offspring; parents (offspring,), places of the
            elites, scratch (individuals + LANES,) for indices, (individuals,) for hits.

    Returns:
        See `summary`.
    """
    draws, breeding, judging, starts, memory = borrowed((draws, breeding, judging, starts, memory))
    population, offspring, parents, elites, lanes, hit = memory
    num_joints, num_genes, binary = len(starts), breeding[0], breeding[1]
    costs = population[len(population) - RESULTS]
    choose_elites(costs, elites)
    breed(draws, breeding, costs, population[:num_genes], parents, offspring[:num_genes])
    first = num_genes if binary else 0
    angles = offspring[first : first + num_joints]
    if binary:
        decode_bits(offspring[:num_genes], len(parents), breeding[5], angles)
    judge_children(starts, angles, population, offspring, parents, num_genes, judging, lanes, hit)
    succeed_rows(population, offspring, len(parents), elites)
    return summary(costs)


@kernel
def summary(costs):  # type: ignore[no-untyped-def]
    """Return index of the best, mean and standard deviation of the finite costs.

    And how many are finite.
    """
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
        breeding: Number of genes; whether they are bits; (selection, tournament size, rank
            pressure); (crossover, its rate, α); (mutation, its scope, its rate, its spread); limits
            of the joints.
        costs: (individuals,) of the parents' generation.
        genomes: (genes, individuals) theirs.
        parents: (offspring,) written.
        out: (genes, ≥ offspring) written.
    """
    selecting, crossing, mutating, normals = draws
    _, binary, (selection, size, pressure), (crossover, crossing_rate, alpha), mutation, limits = (
        breeding
    )
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
def judge_children(  # type: ignore[no-untyped-def]
    starts, angles, population, offspring, parents, num_genes, judging, lanes, hit
):
    """Write Eq. 4 and its parts for all offspring.

    Who ends outside the box, or is its own parent, is not tested.

    Args:
        starts: (joints, ≥ offspring), the same for all [rad].
        angles: (joints, ≥ offspring) theirs [rad].
        population: Table of the parents' generation.
        offspring: Table of the offspring, its last rows written.
        parents: (offspring,).
        num_genes: Rows that make a child its own parent if they are equal; it then costs what the
            parent does.
        judging: See `judge`.
        lanes: (≥ offspring + LANES) scratch.
        hit: (≥ offspring,) scratch.
    """
    arm, ellipses, path, target, box, weights = judging
    row = len(population) - RESULTS
    cost, known = offspring[row], population[row]
    start, count, error, displacement = (
        starts[:, 0].copy(),
        len(parents),
        offspring[row + 1],
        offspring[row + 2],
    )
    measure_reach_from(start, angles, count, arm, target, box, weights, cost, error, displacement)
    inside = 0
    for k in range(count):
        lanes[inside] = k
        inside += cost[k] < np.inf
    left = 0
    for n in range(inside):
        child = lanes[n]
        parent, gene = parents[child], 0
        while gene < num_genes and offspring[gene, child] == population[gene, parent]:
            gene += 1
        if gene == num_genes:
            cost[child] = known[parent]
        lanes[left] = child
        left += gene < num_genes
    _drop_collisions(starts, angles, lanes, left, arm, ellipses, path, cost, hit)


@kernel
def judge(starts, ends, lanes, count, judging, results, hit):  # type: ignore[no-untyped-def]
    """Write Eq. 4 and its parts for some individuals.

    The tip outside the box is found before any collision is sought.

    Args:
        starts: (joints, individuals) [rad].
        ends: (joints, individuals) [rad].
        lanes: (≥ count + LANES) indices of individuals, changed.
        count: How many.
        judging: Arm, ellipses and path of the collision model; target, box and weights of the
            objective.
        results: (3, individuals) written: cost, position error, joint displacement.
        hit: (individuals,) scratch.
    """
    starts, ends, lanes, judging, results, hit = borrowed(
        (starts, ends, lanes, judging, results, hit)
    )
    arm, ellipses, path, target, box, weights = judging
    cost = results[0]
    measure_reach(
        starts, ends, lanes, count, arm, target, box, weights, cost, results[1], results[2]
    )
    left = 0
    for k in range(count):
        individual = lanes[k]
        lanes[left] = individual
        left += cost[individual] < np.inf
    _drop_collisions(starts, ends, lanes, left, arm, ellipses, path, cost, hit)


@kernel
def _drop_collisions(starts, ends, lanes, count, arm, ellipses, path, cost, hit):  # type: ignore[no-untyped-def]
    """Write inf as the cost of those among `lanes` that collide on their way."""
    paths_collide(starts, ends, lanes, count, arm, ellipses, path, hit)
    for k in range(count):
        individual = lanes[k]
        cost[individual] = np.inf if hit[individual] else cost[individual]
