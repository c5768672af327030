"""Hyperparameters of genetic algorithms whose operators can be chosen."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from evoexp.evolution.crossover import Crossover
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.evolution.mutation import Mutation, Scope
from evoexp.validation import Count, NonNegative, NonNegativeCount, Positive


class SelectiveSettings(GeneticSettings):
    """Settings of real and of binary coding; `RealGenetic` and `BinaryGenetic` add their own.

    Attributes:
        selection: `tournament`; `roulette` with weights 1/cost; `rank`: roulette with linear
            weights.
        tournament_size: Individuals per tournament [-].
        rank_pressure: Offspring expected of the best one, in linear ranking [-].
    """

    selection: Literal["tournament", "roulette", "rank"]
    tournament_size: Count
    rank_pressure: Annotated[float, Field(ge=1.0, le=2.0)]


class RealGenetic(SelectiveSettings):
    """Genomes of real numbers within limits.

    Attributes:
        crossover: `one_point`, `uniform`, `arithmetic`, `blx_alpha`; of a pair, with probability
            `crossover_rate`.
        blend_alpha: α of BLX-α: how far beyond the parents children may lie, in units of their
            distance [-].
        mutation: `non_uniform`, `gaussian`, `uniform_reset`.
        mutation_scope: Whether `mutation_rate` is the probability of every `gene`, or of one gene
            of an `individual`.
        mutation_power: b of non-uniform mutation [-].
        mutation_std: Standard deviation of Gaussian mutation, in units of a gene's range [-].
    """

    component: ClassVar[str] = "real_genetic"

    crossover: Crossover
    blend_alpha: NonNegative
    mutation: Mutation
    mutation_scope: Scope
    mutation_power: NonNegativeCount
    mutation_std: Positive


class BinaryGenetic(SelectiveSettings):
    """Genomes of bits: every gene a plain binary number.

    One-point crossover between bits, mutation bit by bit.

    Attributes:
        bits_per_gene: B; a gene takes 2^B values, its limits included [-].
    """

    component: ClassVar[str] = "binary_genetic"

    bits_per_gene: Annotated[int, Field(ge=1, le=52)]
