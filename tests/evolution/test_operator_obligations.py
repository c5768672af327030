"""Every operator of evoexp keeps the obligations of an operator, and breaking one is noticed."""

from typing import ClassVar

import numpy as np
import pytest

from evoexp.evolution.operators import crossover, mutation, selection
from evoexp.evolution.operators.operator import Context, Crossover, Mutation, Selection
from evoexp.planners.via_point_ga.string_operators import StringCrossover
from evoexp.records import FloatArray, IntArray
from evoexp.testing import ContractBroken, check_operator

OPERATORS = (
    *(selection.Tournament(), selection.Tournament(tournament_size=5)),
    *(selection.InverseRoulette(), selection.DifferenceRoulette(), selection.LinearRanking()),
    *(selection.FitnessRoulette(fitness_offset=0.5), crossover.OnePoint()),
    *(crossover.UniformCrossover(), crossover.ArithmeticCrossover()),
    *(crossover.BlxAlpha(blend_alpha=2.0), StringCrossover(crossover_distance=3.0)),
    *(mutation.NonUniformMutation(one_gene=own) for own in (False, True)),
    *(mutation.GaussianMutation(one_gene=own) for own in (False, True)),
    *(mutation.UniformReset(one_gene=own) for own in (False, True)),
    mutation.AlleleMutation(step=1.0, symmetric=True),
)


@pytest.mark.parametrize("operator", OPERATORS, ids=str)
def test_operators_keep_their_obligations(operator: Selection | Crossover | Mutation) -> None:
    check_operator(operator)


class Forgetful(crossover.OnePoint):
    """A crossover that does not copy the pairs it does not cross."""

    component: ClassVar[str] = "forgetful"

    @staticmethod
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        out[:, : len(parents) // 2] = genomes[:, parents[: len(parents) // 2]]


class Escaping(mutation.UniformReset):
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
