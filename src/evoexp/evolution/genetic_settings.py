"""The hyperparameters that evolutionary planners share."""

from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from evoexp.evolution.operators.operator import Crossover, Mutation, Named, Selection
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
    """A generational genetic algorithm whose parents are chosen as in `scaled_selection`.

    Costs are scaled linearly, then parents are drawn by stochastic remainder sampling without
    replacement. The systematic scan of the remainders is assumed: Chen & Zalzala 1995 name the
    sampling only.
    """

    component: ClassVar[str] = "scaled_genetic"

    # copies that the best one expects, in units of the mean [-]
    scaling_multiple: Annotated[float, Field(gt=1.0)]
