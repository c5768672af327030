"""Settings that genetic algorithms share, and offspring by the operators of a configuration."""

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, NamedTuple, Self, TypeAlias

import numpy as np
from pydantic import Field, model_validator

from evoexp.evolution.operators.operator import (
    Context,
    Crossover,
    Genome,
    Mutation,
    Named,
    Selection,
)
from evoexp.numeric.compilation import KernelAddress, kernel
from evoexp.records import FloatArray, IntArray
from evoexp.validation import Component, Count, NonNegativeCount, Rate


class PopulationSettings(Component):
    """Settings of a generational genetic algorithm; every planner uses the same words."""

    population_size: Count  # individuals per generation
    num_generations: NonNegativeCount  # generations after the initial one
    num_elites: NonNegativeCount  # best individuals copied untouched into the next generation
    crossover_rate: Rate  # probability that a pair of parents is crossed
    mutation_rate: Rate  # probability of a mutation, of whatever the planner mutates

    @model_validator(mode="after")
    def _elites_fit(self) -> Self:
        size = self.population_size
        self.demand("num_elites", self.num_elites <= size, f"at most population_size ({size})")
        return self

    @property
    def num_offspring(self) -> int:
        """Individuals that are new in every generation."""
        return self.population_size - self.num_elites


class GeneticSettings(PopulationSettings):
    """A genetic algorithm with operators of the planner's paper, or with others in their place."""

    component: ClassVar[str] = "genetic"

    selection: Named[Selection] | None = None  # None: as the planner's paper selects parents
    crossover: Named[Crossover] | None = None  # None: the paper's
    mutation: Named[Mutation] | None = None  # None: the paper's


class ScaledGenetic(PopulationSettings):
    """A generational genetic algorithm whose parents are chosen as in `succession`.

    Costs are scaled linearly, then parents are drawn by stochastic remainder sampling without
    replacement. The systematic scan of the remainders is assumed: Chen & Zalzala 1995 name the
    sampling only.
    """

    component: ClassVar[str] = "scaled_genetic"

    # copies that the best one expects, in units of the mean [-]
    scaling_multiple: Annotated[float, Field(gt=1.0)]


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
