"""One generation of end postures of a sub-path, compiled (Lavoie & Boudreau 2001).

A population is a table of rows, individuals innermost: the genes; the joint angles, which are the
genes themselves in real coding and follow them in binary coding; then cost, position error and
joint displacement. A whole generation is one call.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.models.ellipse_kernels import Ellipses, TestedPath, paths_collide
from evoexp.evolution.cost_statistics import summarise
from evoexp.evolution.crossover import ONE_POINT, cross_genes, cross_single_point
from evoexp.evolution.mutation import decode_bits, flip_bits, mutate_genes
from evoexp.evolution.selection import (
    choose_by_tournament,
    choose_elites,
    inverse_weights,
    rank_weights,
    spin_roulette,
)
from evoexp.evolution.succession import succeed_rows
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.named_tuples import named
from evoexp.objectives.reaching import measure_reach, measure_reach_from
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.planar_ends import PlanarArm

TOURNAMENT, ROULETTE, RANK = range(3)
RESULTS = 3  # rows of cost, position error, joint displacement


class Draws(NamedTuple):
    """Random numbers of one generation.

    Attributes:
        choosing: Uniform numbers for the choice of parents.
        crossing: Uniform numbers for crossover.
        mutating: Uniform numbers for mutation.
        normals: (genes, ≥ offspring) normal deviates, for Gaussian mutation only.
    """

    choosing: FloatArray
    crossing: FloatArray
    mutating: FloatArray
    normals: FloatArray


class Breeding(NamedTuple):
    """Settings of the operators.

    Attributes:
        num_genes: Number of genes.
        binary: Whether they are bits.
        selection: TOURNAMENT, ROULETTE or RANK.
        tournament_size: Contestants per tournament.
        rank_pressure: See `rank_weights`.
        crossover: See `cross_genes`, and so are its rate and α.
        crossover_rate: Probability per pair.
        blend_alpha: α of BLX-α.
        mutation: See `mutate_genes`, and so are its scope and rate.
        mutation_scope: See there.
        mutation_rate: See there.
        limits: (joints, 2) of the joint angles [rad].
    """

    num_genes: int
    binary: bool
    selection: int
    tournament_size: int
    rank_pressure: float
    crossover: int
    crossover_rate: float
    blend_alpha: float
    mutation: int
    mutation_scope: int
    mutation_rate: float
    limits: FloatArray


class Judging(NamedTuple):
    """The collision model and the objective of a sub-path.

    Attributes:
        arm: The arm.
        ellipses: The ellipses.
        path: The positions that are tested.
        target: (2,) desired place of the tip [length unit].
        box: (4,) least and greatest x, least and greatest y of the tip [length unit].
        weights: w1, w2 of Eq. 4.
    """

    arm: PlanarArm
    ellipses: Ellipses
    path: TestedPath
    target: FloatArray
    box: FloatArray
    weights: tuple[float, float]


class Memory(NamedTuple):
    """Arrays of one search.

    Attributes:
        population: Table of the population.
        offspring: Table of its offspring.
        parents: (offspring,) indices of individuals.
        elites: (elites,) likewise.
        lanes: (individuals + LANES,) scratch.
        hit: (individuals,) scratch.
    """

    population: FloatArray
    offspring: FloatArray
    parents: IntArray
    elites: IntArray
    lanes: IntArray
    hit: BoolArray


@kernel
def advance(
    plain_draws: tuple[Any, ...],
    spread: float,
    plain_breeding: tuple[Any, ...],
    plain_judging: tuple[Any, ...],
    starts: FloatArray,
    plain_memory: tuple[Any, ...],
) -> tuple[int, float, float, int]:
    """Replace a population by the next one.

    Args:
        plain_draws: `Draws`, made plain.
        spread: Of mutation, see `mutate_genes`.
        plain_breeding: `Breeding`, made plain.
        plain_judging: `Judging`, made plain.
        starts: (joints, ≥ offspring) start of the sub-path, the same for all [rad].
        plain_memory: `Memory`, made plain: population and scratch.

    Returns:
        See `summary`.
    """
    draws, breeding = named(Draws, plain_draws), named(Breeding, plain_breeding)
    judging, memory = named(Judging, plain_judging), named(Memory, plain_memory)
    draws, breeding, judging, starts, memory = borrowed((draws, breeding, judging, starts, memory))
    population, offspring, count = memory.population, memory.offspring, len(memory.parents)
    num_joints, num_genes, binary = len(starts), breeding.num_genes, breeding.binary
    costs = population[len(population) - RESULTS]
    choose_elites(costs, memory.elites)
    # offspring, decoded and judged
    genomes, children = population[:num_genes], offspring[:num_genes]
    breed(draws, spread, breeding, costs, genomes, memory.parents, children)
    first = num_genes if binary else 0
    angles = offspring[first : first + num_joints]
    if binary:
        decode_bits(children, count, breeding.limits, angles)
    judge_children(starts, angles, num_genes, judging, memory)
    # succession
    succeed_rows(population, offspring, count, memory.elites)
    found: tuple[int, float, float, int] = summary(costs)
    return found


@kernel
def summary(costs: FloatArray) -> tuple[int, float, float, int]:
    """Return index of the best, mean and deviation of the finite costs, and how many are finite."""
    best, mean, std = summarise(costs)
    finite = 0
    for k in range(len(costs)):
        finite += np.isfinite(costs[k])
    return best, mean, std, finite


@kernel
def breed(
    draws: Draws,
    spread: float,
    breeding: Breeding,
    costs: FloatArray,
    genomes: FloatArray,
    parents: IntArray,
    out: FloatArray,
) -> None:
    """Write offspring: selected, crossed and mutated.

    Args:
        draws: Random numbers.
        spread: Of mutation, see `mutate_genes`.
        breeding: Settings of the operators.
        costs: (individuals,) of the parents' generation.
        genomes: (genes, individuals) of the parents' generation.
        parents: (offspring,) written.
        out: (genes, ≥ offspring) written.
    """
    # parents
    if breeding.selection == TOURNAMENT:
        choose_by_tournament(draws.choosing, costs, breeding.tournament_size, parents)
    else:
        weights = np.empty(len(costs))
        if breeding.selection == ROULETTE:
            inverse_weights(costs, weights)
        else:
            rank_weights(costs, breeding.rank_pressure, weights)
        spin_roulette(weights, draws.choosing, parents)
    # crossover
    rate, limits = breeding.crossover_rate, breeding.limits
    if breeding.crossover == ONE_POINT:
        cross_single_point(draws.crossing, genomes, parents, rate, out)
    else:
        kind, alpha = breeding.crossover, breeding.blend_alpha
        cross_genes(kind, draws.crossing, genomes, parents, rate, alpha, limits, out)
    # mutation
    uniforms, count, rate = draws.mutating, len(parents), breeding.mutation_rate
    if breeding.binary:
        flip_bits(uniforms, out, count, rate)
    else:
        kind, scope, normals = breeding.mutation, breeding.mutation_scope, draws.normals
        mutate_genes(kind, scope, uniforms, normals, out, count, rate, spread, limits)


@kernel
def judge_children(
    starts: FloatArray, angles: FloatArray, num_genes: int, judging: Judging, memory: Memory
) -> None:
    """Write Eq. 4 and its parts for all offspring.

    A child that ends outside the box, or is its own parent, is not tested for collisions.

    Args:
        starts: (joints, ≥ offspring), the same for all [rad].
        angles: (joints, ≥ offspring) of the offspring [rad].
        num_genes: Rows that make a child its own parent if they are equal; the child then costs as
            much as the parent.
        judging: Collision model and objective.
        memory: Both tables and the parents; the last rows of the offspring are written.
    """
    population, offspring, parents, lanes = (
        memory.population,
        memory.offspring,
        memory.parents,
        memory.lanes,
    )
    row, count, start = len(population) - RESULTS, len(parents), starts[:, 0].copy()
    cost, error, displacement = offspring[row], offspring[row + 1], offspring[row + 2]
    arm, target, box, weights = judging.arm, judging.target, judging.box, judging.weights
    measure_reach_from(start, angles, count, arm, target, box, weights, cost, error, displacement)
    # children inside the box
    inside = 0
    for k in range(count):
        lanes[inside] = k
        inside += cost[k] < np.inf
    # of these, children that differ from their parents
    left = 0
    for n in range(inside):
        child = lanes[n]
        parent, gene = parents[child], 0
        while gene < num_genes and offspring[gene, child] == population[gene, parent]:
            gene += 1
        if gene == num_genes:
            cost[child] = population[row, parent]
        lanes[left] = child
        left += gene < num_genes
    _drop_collisions(starts, angles, lanes, left, judging, cost, memory.hit)


@kernel
def judge(
    starts: FloatArray,
    ends: FloatArray,
    lanes: IntArray,
    count: int,
    judging: Judging,
    results: FloatArray,
    hit: BoolArray,
) -> None:
    """Write Eq. 4 and its parts for some individuals.

    An individual whose tip ends outside the box is not tested for collisions.

    Args:
        starts: (joints, individuals) [rad].
        ends: (joints, individuals) [rad].
        lanes: (≥ count + LANES) indices of individuals, changed.
        count: Number of individuals.
        judging: Collision model and objective.
        results: (3, individuals) written: cost, position error, joint displacement.
        hit: (individuals,) scratch.
    """
    starts, ends, lanes, judging, results, hit = borrowed(
        (starts, ends, lanes, judging, results, hit)
    )
    arm, target, box, weights = judging.arm, judging.target, judging.box, judging.weights
    cost, error, displacement = results[0], results[1], results[2]
    measure_reach(starts, ends, lanes, count, arm, target, box, weights, cost, error, displacement)
    # individuals inside the box
    left = 0
    for k in range(count):
        individual = lanes[k]
        lanes[left] = individual
        left += cost[individual] < np.inf
    _drop_collisions(starts, ends, lanes, left, judging, cost, hit)


@kernel
def _drop_collisions(
    starts: FloatArray,
    ends: FloatArray,
    lanes: IntArray,
    count: int,
    judging: Judging,
    cost: FloatArray,
    hit: BoolArray,
) -> None:
    """Write inf as the cost of those among `lanes` that collide on their way."""
    paths_collide(starts, ends, lanes, count, judging.arm, judging.ellipses, judging.path, hit)
    for k in range(count):
        individual = lanes[k]
        cost[individual] = np.inf if hit[individual] else cost[individual]
