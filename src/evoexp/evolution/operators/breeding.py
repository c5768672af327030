"""Offspring of a population by the operators of a configuration, compiled."""

from collections.abc import Sequence
from typing import Any, NamedTuple, Self, TypeAlias

import numpy as np

from evoexp.evolution.genetic_settings import PopulationSettings
from evoexp.evolution.operators.operator import Context, Crossover, Genome, Mutation, Selection
from evoexp.numeric.compilation import KernelAddress, kernel
from evoexp.records import FloatArray, IntArray

# kernels of operators, by their addresses: see `Selection`, `Crossover`, `Mutation`
Select: TypeAlias = Any
Cross: TypeAlias = Any
Mutate: TypeAlias = Any


class Operators(NamedTuple):
    """The operators of a genetic algorithm."""

    selection: Selection
    crossover: Crossover
    mutation: Mutation

    @property
    def addresses(self) -> tuple[KernelAddress, KernelAddress, KernelAddress]:
        """Their kernels, as other kernels take them."""
        return self.selection.address, self.crossover.address, self.mutation.address


class Breeding(NamedTuple):
    """The rules of breeding, as kernels take them."""

    genome: Genome  # of every individual
    crossover_rate: float  # probability that a pair is crossed
    mutation_rate: float  # probability of a mutation, of whatever the operator mutates
    num_generations: int  # T
    most: int  # offspring
    # (most − least offspring + 1, 3) uniform numbers that selection, crossover and mutation take
    # for so many offspring, the most first
    sizes: IntArray
    selecting: FloatArray  # settings of the selection
    crossing: FloatArray  # settings of the crossover
    mutating: FloatArray  # settings of the mutation

    @classmethod
    def of(
        cls,
        operators: Operators,
        genome: Genome,  # of every individual
        ga: PopulationSettings,
        counts: Sequence[int],  # of offspring that there may be: each one less than the one before
    ) -> Self:
        """Return the rules of breeding."""
        selection, crossover, mutation = operators
        sizes = [
            (
                selection.num_uniforms(ga.population_size, count),
                crossover.num_uniforms(genome, count),
                mutation.num_uniforms(genome, count),
            )
            for count in counts
        ]
        settings = (operator.settings for operator in operators)
        rates = ga.crossover_rate, ga.mutation_rate
        return cls(genome, *rates, ga.num_generations, counts[0], np.array(sizes), *settings)


@kernel
def breed(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    numbers: FloatArray,  # uniform, those of selection, then of crossover, then of mutation
    normals: FloatArray,  # (genes, ≥ offspring) normal deviates, if the mutation takes any
    index: int,  # t of the parents' generation
    rate: float,  # of mutation, on the way to the next one
    rules: Breeding,
    costs: FloatArray,  # (individuals,) of the parents' generation
    genomes: FloatArray,  # (genes, individuals) of the same, padding allowed
    parents: IntArray,  # (offspring,) written
    out: FloatArray,  # (genes, ≥ offspring) written
) -> None:
    """Write offspring: selected, crossed and mutated."""
    genome, count, progress = rules.genome, len(parents), index / rules.num_generations
    # the numbers of each operator
    sizes = rules.sizes[rules.most - count]
    first, last = sizes[0], sizes[0] + sizes[1]
    one, two, three = numbers[:first], numbers[first:last], numbers[last : last + sizes[2]]
    # selection, crossover, mutation
    select(costs, Context(one, normals, 1.0, progress, rules.selecting, genome), parents)
    crossing = Context(two, normals, rules.crossover_rate, progress, rules.crossing, genome)
    cross(genomes, parents, crossing, out)
    mutate(out, count, Context(three, normals, rate, progress, rules.mutating, genome))
