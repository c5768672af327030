"""Every operator of evoexp keeps the obligations of an operator, and breaking one is noticed."""

from typing import ClassVar

import numpy as np
import pytest

from evoexp.evolution.operators.crossover import (
    ArithmeticCrossover,
    BlxAlpha,
    OnePoint,
    UniformCrossover,
)
from evoexp.evolution.operators.mutation import (
    AlleleMutation,
    GaussianMutation,
    NonUniformMutation,
    UniformReset,
)
from evoexp.evolution.operators.operator import Context, Crossover, Mutation, Selection
from evoexp.evolution.operators.selection import (
    DifferenceRoulette,
    FitnessRoulette,
    InverseRoulette,
    LinearRanking,
    Tournament,
)
from evoexp.planners.via_point_ga.string_operators import StringCrossover
from evoexp.records import FloatArray, IntArray
from evoexp.testing import ContractBroken, check_operator

OPERATORS = (
    *(Tournament(), Tournament(tournament_size=5), InverseRoulette(), DifferenceRoulette()),
    *(FitnessRoulette(fitness_offset=0.5), LinearRanking()),
    *(OnePoint(), UniformCrossover(), ArithmeticCrossover(), BlxAlpha(blend_alpha=2.0)),
    StringCrossover(crossover_distance=3.0),
    *(
        kind(one_gene=own)
        for kind in (NonUniformMutation, GaussianMutation)
        for own in (False, True)
    ),
    *(UniformReset(), UniformReset(one_gene=True), AlleleMutation(step=1.0, symmetric=True)),
)


@pytest.mark.parametrize("operator", OPERATORS, ids=str)
def test_operators_keep_their_obligations(operator: Selection | Crossover | Mutation) -> None:
    check_operator(operator)


class Forgetful(OnePoint):
    """A crossover that does not copy the pairs it does not cross."""

    component: ClassVar[str] = "forgetful"

    @staticmethod
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        out[:, : len(parents) // 2] = genomes[:, parents[: len(parents) // 2]]


class Escaping(UniformReset):
    """A mutation that leaves the limits."""

    component: ClassVar[str] = "escaping"

    @staticmethod
    def mutate(genomes: FloatArray, count: int, context: Context) -> None:
        genomes[:, :count] += np.where(context.uniforms.reshape(-1, count) < context.rate, 9.0, 0.0)


@pytest.mark.parametrize(
    ("operator", "obligation"),
    [
        (Forgetful(), "'forgetful': is one that changes nobody at the rate 0"),
        (Escaping(), "'escaping': is one that keeps genes within limits"),
    ],
    ids=str,
)
def test_a_broken_obligation_is_named(operator: Crossover | Mutation, obligation: str) -> None:
    with pytest.raises(ContractBroken, match=obligation):
        check_operator(operator)
