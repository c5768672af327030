"""Hyperparameters of genetic algorithms whose operators can be chosen."""

from typing import Annotated, Any, ClassVar, Literal, cast

from pydantic import Field

from evoexp.evolution.operators.breeding import Operators, PopulationSettings
from evoexp.evolution.operators.crossover import (
    ArithmeticCrossover,
    BlxAlpha,
    OnePoint,
    UniformCrossover,
)
from evoexp.evolution.operators.mutation import (
    BitFlips,
    GaussianMutation,
    NonUniformMutation,
    UniformReset,
)
from evoexp.evolution.operators.operator import Crossover, Mutation, Named, Selection
from evoexp.evolution.operators.selection import InverseRoulette, LinearRanking, Tournament
from evoexp.validation import Count, NonNegative, NonNegativeCount, Positive


class SelectiveSettings(PopulationSettings):
    """Settings of real and of binary coding; `RealGenetic` and `BinaryGenetic` add their own.

    An operator is another component, or one of these words; its settings are then those below.
    """

    # `tournament`; `roulette` with weights 1/cost; `rank`: roulette with linear weights
    selection: Literal["tournament", "roulette", "rank"] | Named[Selection]
    tournament_size: Count  # individuals per tournament [-]
    # offspring expected of the best one, in linear ranking [-]
    rank_pressure: Annotated[float, Field(ge=1.0, le=2.0)]

    @property
    def selection_operator(self) -> Selection:
        """The selection that `selection` stands for."""
        named: dict[Any, Any] = {
            "tournament": Tournament(tournament_size=self.tournament_size),
            "roulette": InverseRoulette(),
            "rank": LinearRanking(rank_pressure=self.rank_pressure),
        }
        return cast(Selection, named.get(self.selection, self.selection))


class RealGenetic(SelectiveSettings):
    """Genomes of real numbers within limits."""

    component: ClassVar[str] = "real_genetic"

    # of a pair, with probability `crossover_rate`
    crossover: Literal["one_point", "uniform", "arithmetic", "blx_alpha"] | Named[Crossover]
    # α of BLX-α: how far beyond the parents children may lie, in units of their distance [-]
    blend_alpha: NonNegative
    mutation: Literal["non_uniform", "gaussian", "uniform_reset"] | Named[Mutation]
    # whether `mutation_rate` is the probability of every `gene`, or of one gene of an
    # `individual`
    mutation_scope: Literal["gene", "individual"]
    mutation_power: NonNegativeCount  # b of non-uniform mutation [-]
    # standard deviation of Gaussian mutation, in units of a gene's range [-]
    mutation_std: Positive

    @property
    def operators(self) -> Operators:
        """The operators of a search."""
        one_gene = self.mutation_scope == "individual"
        named: dict[Any, Any] = {
            "one_point": OnePoint(),
            "uniform": UniformCrossover(),
            "arithmetic": ArithmeticCrossover(),
            "blx_alpha": BlxAlpha(blend_alpha=self.blend_alpha),
            "non_uniform": NonUniformMutation(
                one_gene=one_gene, mutation_power=self.mutation_power
            ),
            "gaussian": GaussianMutation(one_gene=one_gene, mutation_std=self.mutation_std),
            "uniform_reset": UniformReset(one_gene=one_gene),
        }
        crossover, mutation = (named.get(own, own) for own in (self.crossover, self.mutation))
        return Operators(self.selection_operator, crossover, mutation)


class BinaryGenetic(SelectiveSettings):
    """Genomes of bits: every gene a plain binary number.

    One-point crossover between bits, mutation bit by bit.
    """

    component: ClassVar[str] = "binary_genetic"

    # B; a gene takes 2^B values, its limits included [-]
    bits_per_gene: Annotated[int, Field(ge=1, le=52)]

    @property
    def operators(self) -> Operators:
        """The operators of a search."""
        return Operators(self.selection_operator, OnePoint(), BitFlips())
