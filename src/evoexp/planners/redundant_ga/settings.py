"""Hyperparameters of genetic algorithms whose operators can be chosen."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from evoexp.evolution.crossover import Crossover
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.evolution.mutation import Mutation, Scope
from evoexp.validation import Count, NonNegative, NonNegativeCount, Positive


class SelectiveSettings(GeneticSettings):
    """Settings of real and of binary coding; `RealGenetic` and `BinaryGenetic` add their own."""

    # `tournament`; `roulette` with weights 1/cost; `rank`: roulette with linear weights
    selection: Literal["tournament", "roulette", "rank"]
    tournament_size: Count  # individuals per tournament [-]
    # offspring expected of the best one, in linear ranking [-]
    rank_pressure: Annotated[float, Field(ge=1.0, le=2.0)]


class RealGenetic(SelectiveSettings):
    """Genomes of real numbers within limits."""

    component: ClassVar[str] = "real_genetic"

    # `one_point`, `uniform`, `arithmetic`, `blx_alpha`; of a pair, with probability
    # `crossover_rate`
    crossover: Crossover
    # α of BLX-α: how far beyond the parents children may lie, in units of their distance [-]
    blend_alpha: NonNegative
    mutation: Mutation  # `non_uniform`, `gaussian`, `uniform_reset`
    # whether `mutation_rate` is the probability of every `gene`, or of one gene of an
    # `individual`
    mutation_scope: Scope
    mutation_power: NonNegativeCount  # b of non-uniform mutation [-]
    # standard deviation of Gaussian mutation, in units of a gene's range [-]
    mutation_std: Positive


class BinaryGenetic(SelectiveSettings):
    """Genomes of bits: every gene a plain binary number.

    One-point crossover between bits, mutation bit by bit.
    """

    component: ClassVar[str] = "binary_genetic"

    # B; a gene takes 2^B values, its limits included [-]
    bits_per_gene: Annotated[int, Field(ge=1, le=52)]
