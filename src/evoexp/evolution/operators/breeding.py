"""Offspring of a population by the operators of a configuration, compiled."""

from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np

from evoexp.evolution.operators.operator import Context, Crossover, Genome, Mutation, Selection
from evoexp.numeric.compilation import KernelAddress, kernel
from evoexp.records import FloatArray, IntArray

Select = Callable[[FloatArray, FloatArray, FloatArray, IntArray], None]
Cross = Callable[[FloatArray, FloatArray, IntArray, Context, FloatArray], None]
Mutate = Callable[[FloatArray, FloatArray, FloatArray, int, Context], None]


class Operators(NamedTuple):
    """The operators of a genetic algorithm."""

    selection: Selection
    crossover: Crossover
    mutation: Mutation

    @property
    def addresses(self) -> tuple[KernelAddress, KernelAddress, KernelAddress]:
        """Their kernels, as other kernels take them."""
        return self.selection.address, self.crossover.address, self.mutation.address

    def sizes(self, genome: Genome, size: int, count: int) -> IntArray:
        """Return how many uniform numbers each takes, (3,).

        Args:
            genome: Of every individual.
            size: Individuals of the population.
            count: Offspring.
        """
        return np.array(
            [
                self.selection.num_uniforms(size, count),
                self.crossover.num_uniforms(genome, count),
                self.mutation.num_uniforms(genome, count),
            ]
        )


class Breeding(NamedTuple):
    """The rules of breeding, as kernels take them."""

    genome: Genome  # of every individual
    crossover_rate: float  # probability that a pair is crossed
    mutation_rate: float  # probability of a mutation, of whatever the operator mutates
    num_generations: int  # T
    selecting: FloatArray  # settings of the selection
    crossing: FloatArray  # settings of the crossover
    mutating: FloatArray  # settings of the mutation

    @classmethod
    def of(cls, operators: Operators, genome: Genome, ga: Any) -> Self:
        """Return the rules by which `ga`, a component with rates and generations, breeds."""
        settings = (operator.settings for operator in operators)
        rates = ga.crossover_rate, ga.mutation_rate
        return cls(genome, *rates, ga.num_generations, *settings)


@kernel
def breed(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    uniforms: FloatArray,  # those of selection, then of crossover, then of mutation
    normals: FloatArray,  # (genes, ≥ offspring) normal deviates, if the mutation takes any
    sizes: IntArray,  # (3,) see `Operators.sizes`
    index: int,  # t of the parents' generation
    mutation_rate: float,  # on the way to the next one
    breeding: Breeding,
    costs: FloatArray,  # (individuals,) of the parents' generation
    genomes: FloatArray,  # (genes, individuals) of the same, padding allowed
    parents: IntArray,  # (offspring,) written
    out: FloatArray,  # (genes, ≥ offspring) written
) -> None:
    """Write offspring: selected, crossed and mutated."""
    progress = index / breeding.num_generations
    first, last = sizes[0], sizes[0] + sizes[1]
    select(uniforms[:first], costs, breeding.selecting, parents)
    crossing = Context(breeding.crossover_rate, progress, breeding.crossing, breeding.genome)
    cross(uniforms[first:last], genomes, parents, crossing, out)
    mutating = Context(mutation_rate, progress, breeding.mutating, breeding.genome)
    mutate(uniforms[last : last + sizes[2]], normals, out, len(parents), mutating)
