"""Mutation of single alleles (Curkovic et al. 2013, Eqs. 9 and 10)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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


@pytest.mark.parametrize("symmetric", [False, True])
def test_rate_one_changes_one_allele_of_everybody_who_can_change(symmetric: bool) -> None:
    genomes = np.full((8, 300), LIMIT / 2.0)  # further than a step from both bounds
    changed = mutated(1, genomes, 1.0, symmetric) != genomes
    assert np.all(changed.sum(axis=0) == 1)


def test_a_change_out_of_bounds_is_not_made() -> None:
    high, low = np.full((3, 200), np.nextafter(LIMIT, 0.0)), np.zeros((3, 200))
    assert np.array_equal(mutated(0, high, 1.0, False), high)
    falls = mutated(0, high, 1.0, True)
    assert np.all(falls <= high)
    assert 60 < np.any(falls < high, axis=0).sum() < 140  # half of 200, ± 5.7 standard deviations
    rises = mutated(0, low, 1.0, True)
    assert np.all(rises >= 0.0)
    assert 60 < np.any(rises > low, axis=0).sum() < 140


def test_the_ends_of_the_amount_are_as_printed() -> None:
    assert mutate_one(1.0, [0.0, LAST, 0.0], symmetric=False) == 1.0 + STEP
    assert mutate_one(1.0, [0.0, LAST, 0.0], symmetric=True) == 1.0 - STEP
    assert 0.0 < mutate_one(0.0, [0.0, 0.0, LAST], symmetric=False) < 1e-15  # 0 is excluded
    assert STEP - 1e-15 < mutate_one(0.0, [0.0, 0.0, LAST], symmetric=True) < STEP


@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.floats(0.0, LIMIT, exclude_max=True), min_size=1, max_size=30),
    st.floats(0.0, 1.0),
    st.booleans(),
)
def test_genes_stay_in_bounds_and_one_allele_moves_by_a_step_at_most(
    seed: int, row: list[float], rate: float, symmetric: bool
) -> None:
    genomes = np.array([row, row[::-1]])
    out = mutated(seed, genomes, rate, symmetric)
    moved = out - genomes
    assert np.all((out >= 0.0) & (out < LIMIT))
    assert np.all((moved != 0.0).sum(axis=0) <= 1)
    assert np.all(np.abs(moved) <= STEP * (1.0 + 1e-12) + 1e-15)  # a difference of rounded sums
    assert symmetric or np.all(moved >= 0.0)


@pytest.mark.parametrize(
    ("symmetric", "mean", "std"), [(False, 0.5, 0.2887), (True, 0.0, 0.5774)]
)  # of a step
def test_statistics_of_alleles(symmetric: bool, mean: float, std: float) -> None:
    count, rate = 40_000, 0.3
    genomes = np.full((8, count), 100.0)
    moved = mutated(3, genomes, rate, symmetric, limit=200.0) - genomes
    genes, individuals = np.nonzero(moved)
    amounts = moved[genes, individuals] / STEP
    assert len(amounts) / count == pytest.approx(
        rate, abs=4.0 * (rate * (1.0 - rate) / count) ** 0.5
    )
    shares = np.bincount(genes, minlength=8) / len(genes)
    assert shares == pytest.approx(np.full(8, 0.125), abs=4.0 * (0.125 * 0.875 / len(genes)) ** 0.5)
    assert amounts.mean() == pytest.approx(mean, abs=4.0 * std / len(amounts) ** 0.5)
    assert amounts.std() == pytest.approx(std, rel=0.03)
