"""Operators of the genetic algorithm over the ends of a sub-path, compiled."""

from typing import NamedTuple

import numpy as np

from evoexp.evolution.crossover import ONE_POINT, cross_genes, cross_single_point
from evoexp.evolution.mutation import flip_bits, mutate_genes
from evoexp.evolution.selection import (
    choose_by_tournament,
    inverse_weights,
    rank_weights,
    spin_roulette,
)
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray

TOURNAMENT, ROULETTE, RANK = range(3)


class Draws(NamedTuple):
    """Random numbers of one generation."""

    choosing: FloatArray  # uniform numbers for the choice of parents
    crossing: FloatArray  # uniform numbers for crossover
    mutating: FloatArray  # uniform numbers for mutation
    normals: FloatArray  # (genes, ≥ offspring) normal deviates, for Gaussian mutation only


class Breeding(NamedTuple):
    """Settings of the operators."""

    num_genes: int  # number of genes
    binary: bool  # whether they are bits
    selection: int  # TOURNAMENT, ROULETTE or RANK
    tournament_size: int  # contestants per tournament
    rank_pressure: float
    crossover: int  # see `cross_genes`, and so are its rate and α
    crossover_rate: float  # probability per pair
    blend_alpha: float  # α of BLX-α
    mutation: int  # see `mutate_genes`, and so are its scope and rate
    mutation_scope: int
    mutation_rate: float
    mutation_std: float  # of Gaussian mutation, in units of a gene's range
    mutation_power: int  # b of non-uniform mutation
    num_generations: int  # t of non-uniform mutation
    limits: FloatArray  # (joints, 2) of the joint angles [rad]


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
    """Write offspring: selected, crossed and mutated."""
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
