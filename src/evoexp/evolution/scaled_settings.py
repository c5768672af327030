"""Hyperparameters of genetic algorithms that select by linear scaling and stochastic remainders."""

from typing import Annotated, ClassVar

from pydantic import Field

from evoexp.evolution.genetic_settings import GeneticSettings


class ScaledGenetic(GeneticSettings):
    """A generational genetic algorithm whose parents are chosen by `scaling` and `remainder`.

    Attributes:
        scaling_multiple: Copies that the best one expects, in units of the mean [-].
    """

    component: ClassVar[str] = "scaled_genetic"

    scaling_multiple: Annotated[float, Field(gt=1.0)]
