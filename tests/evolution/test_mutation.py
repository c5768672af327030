"""Mutation of single alleles (Curkovic et al. 2013, Eqs. 9 and 10)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.evolution.mutation import decayed_rate, mutate_allele, num_allele_uniforms

LIMIT, STEP = np.pi, np.pi / 5.0
LAST = np.nextafter(1.0, 0.0)  # the largest uniform number there can be


def mutated(
    seed: int, genomes: np.ndarray, rate: float, symmetric: bool, limit: float = LIMIT
) -> np.ndarray:
    out, count = genomes.copy(), genomes.shape[1]
    uniforms = np.random.default_rng(seed).random(num_allele_uniforms(count))
    mutate_allele(uniforms, out, count, rate, STEP, limit, symmetric)
    return out


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
    for draw, symmetric, expected in ((0.0, False, 1.0 + STEP), (0.0, True, 1.0 - STEP)):
        genomes = np.ones((1, 1))
        mutate_allele(np.array([0.0, LAST, draw]), genomes, 1, 1.0, STEP, LIMIT, symmetric)
        assert genomes[0, 0] == expected
    genomes = np.zeros((1, 1))
    mutate_allele(np.array([0.0, 0.0, LAST]), genomes, 1, 1.0, STEP, LIMIT, False)
    assert 0.0 < genomes[0, 0] < 1e-15  # the amount 0 is excluded
    genomes = np.zeros((1, 1))
    mutate_allele(np.array([0.0, 0.0, LAST]), genomes, 1, 1.0, STEP, LIMIT, True)
    assert STEP - 1e-15 < genomes[0, 0] < STEP


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


def test_padding_is_left_alone() -> None:
    for rate in (0.0, 1.0):
        genomes, uniforms = np.ones((4, 12)), np.random.default_rng(5).random(21)
        mutate_allele(uniforms, genomes, 7, rate, STEP, LIMIT, False)
        assert np.all(genomes[:, 7:] == 1.0)
        assert np.any(genomes[:, :7] != 1.0, axis=0).sum() == 7 * rate


def test_schedule_of_eq_10() -> None:
    assert decayed_rate(1.0, 0.9, 0, 200) == 1.0
    assert decayed_rate(1.0, 0.9, 100, 200) == pytest.approx(0.55, rel=1e-15)
    assert decayed_rate(1.0, 0.9, 200, 200) == pytest.approx(0.1, rel=1e-15)
    assert [decayed_rate(0.3, 0.0, t, 200) for t in (0, 77, 200)] == [0.3, 0.3, 0.3]
    assert decayed_rate(0.7, 0.2, 0, 0) == 0.7
    assert decayed_rate(0.3, 0.3, 200, 200) == 0.0
    assert decayed_rate(0.3, 0.3, 300, 200) == 0.0
    rates = [decayed_rate(1.0, 0.9, t, 200) for t in range(201)]
    assert all(later < earlier for earlier, later in zip(rates, rates[1:], strict=False))
