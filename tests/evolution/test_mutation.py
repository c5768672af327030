"""Mutation of single alleles (Curkovic et al. 2013, Eqs. 9 and 10)."""

import numpy as np
import pytest

from evoexp.evolution.operators.mutation import AlleleMutation
from evoexp.evolution.operators.operator import Genome
from evoexp.testing import operator_checks as drawn

LIMIT, STEP = np.pi, np.pi / 5.0
LAST = np.nextafter(1.0, 0.0)  # the largest uniform number there can be


def genome_of(genomes: np.ndarray, limit: float = LIMIT) -> Genome:
    return Genome.of(np.tile([0.0, limit], (len(genomes), 1)))


def mutated(
    seed: int, genomes: np.ndarray, rate: float, symmetric: bool, limit: float = LIMIT
) -> np.ndarray:
    operator, rng = AlleleMutation(step=STEP, symmetric=symmetric), np.random.default_rng(seed)
    return drawn.mutated(operator, rng, genomes, rate, genome_of(genomes, limit))


def mutate_one(gene: float, uniforms: list[float], symmetric: bool) -> float:
    """Return what becomes of a genome of one gene by three uniform numbers."""
    genomes, operator = np.full((1, 1), gene), AlleleMutation(step=STEP, symmetric=symmetric)
    context = drawn.context_of(operator, np.array(uniforms), 1.0, genome_of(genomes))
    operator.mutate(genomes, 1, context)
    return genomes.item()


def mutated_literally(seed: int, genomes: np.ndarray, rate: float, symmetric: bool) -> np.ndarray:
    """The same individual by individual, as one reads it in the paper."""
    out = genomes.copy()
    for k, (decide, which, amount) in enumerate(
        np.random.default_rng(seed).random((genomes.shape[1], 3))
    ):
        gene = int(which * len(genomes))
        r = STEP * (2.0 * amount - 1.0) if symmetric else STEP * (1.0 - amount)
        if decide < rate and 0.0 <= genomes[gene, k] + r < LIMIT:
            out[gene, k] += r
    return out


def population(seed: int, individuals: int = 40) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.0, LIMIT, size=(8, individuals))


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("rate", [0.0, 0.3, 1.0])
def test_mutation_is_what_the_paper_says(rate: float, symmetric: bool) -> None:
    for seed in range(10):
        genomes = population(seed + 50)
        literal = mutated_literally(seed, genomes, rate, symmetric)
        assert np.array_equal(mutated(seed, genomes, rate, symmetric), literal)
        assert np.array_equal(literal, genomes) == (rate == 0.0)


def test_the_ends_of_the_amount_are_as_printed() -> None:
    assert mutate_one(1.0, [0.0, LAST, 0.0], symmetric=False) == 1.0 + STEP
    assert mutate_one(1.0, [0.0, LAST, 0.0], symmetric=True) == 1.0 - STEP
    assert 0.0 < mutate_one(0.0, [0.0, 0.0, LAST], symmetric=False) < 1e-15  # 0 is excluded
    assert STEP - 1e-15 < mutate_one(0.0, [0.0, 0.0, LAST], symmetric=True) < STEP
