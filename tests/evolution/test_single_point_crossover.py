"""Single-point crossover, beside the same pair by pair."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.evolution.operators.crossover import OnePoint
from evoexp.evolution.operators.operator import Genome
from evoexp.testing import operator_checks as drawn


def population(num_genes: int = 8, individuals: int = 12) -> np.ndarray:
    """Every number once, so that it is known where a gene comes from."""
    return np.arange(num_genes * individuals, dtype=float).reshape(num_genes, individuals)


def genome_of(genomes: np.ndarray) -> Genome:
    return Genome.of(np.zeros((len(genomes), 2)))


def crossed(seed: int, genomes: np.ndarray, parents: np.ndarray, rate: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return drawn.crossed(OnePoint(), rng, genomes, parents, rate, genome_of(genomes))


def crossed_literally(
    seed: int, genomes: np.ndarray, parents: np.ndarray, rate: float
) -> np.ndarray:
    children = genomes[:, parents].copy()
    for pair, (decide, where) in enumerate(
        np.random.default_rng(seed).random((len(parents) // 2, 2))
    ):
        site = 1 + int(where * (len(genomes) - 1))
        if decide < rate:
            a, b = children[:, 2 * pair].copy(), children[:, 2 * pair + 1].copy()
            children[site:, 2 * pair], children[site:, 2 * pair + 1] = b[site:], a[site:]
    return children


@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.integers(0, 11), max_size=13),
    st.floats(0.0, 1.0),
    st.integers(1, 9),
)
def test_crossover_is_what_one_reads(
    seed: int, chosen: list[int], rate: float, num_genes: int
) -> None:
    genomes, parents = population(num_genes), np.array(chosen, dtype=np.int64)
    assert np.array_equal(
        crossed(seed, genomes, parents, rate), crossed_literally(seed, genomes, parents, rate)
    )


def test_rate_zero_returns_the_parents() -> None:
    genomes, parents = population(), np.array([3, 4, 9, 0, 7])
    assert np.array_equal(crossed(0, genomes, parents, 0.0), genomes[:, parents])


def test_rate_one_changes_every_pair_and_keeps_all_material() -> None:
    genomes, parents = population(), np.array([0, 1, 2, 3, 4, 5, 6])
    for seed in range(30):
        children = crossed(seed, genomes, parents, 1.0)
        assert np.all(np.any(children != genomes[:, parents], axis=0)[:6])
        assert np.array_equal(children[:, 6], genomes[:, 6])  # alone
        assert np.array_equal(children[0], genomes[0, parents])
        assert np.array_equal(np.sort(children, axis=1), np.sort(genomes[:, parents], axis=1))
        for k in range(6):  # one cut: own genes, then the mate's
            foreign = children[:, k] != genomes[:, k]
            assert np.array_equal(np.sort(foreign), foreign)
            assert np.array_equal(children[foreign, k], genomes[foreign, k ^ 1])


def test_a_single_gene_cannot_be_cut() -> None:
    genomes, parents = population(1), np.array([5, 6])
    assert np.array_equal(crossed(0, genomes, parents, 1.0), genomes[:, parents])


def test_sites_and_rate_are_drawn_evenly() -> None:
    num_pairs, rate = 35_000, 0.6
    parents = np.tile([0, 1], num_pairs)
    own = (crossed(4, population(), parents, rate)[:, ::2] == population()[:, :1]).sum(axis=0)
    counts = np.bincount(own, minlength=9)
    assert counts[0] == 0
    assert 1.0 - counts[8] / num_pairs == pytest.approx(rate, abs=0.0105)  # four standard errors
    assert counts[1:8] / counts[1:8].sum() == pytest.approx(
        np.full(7, 1.0 / 7.0), abs=0.0097
    )  # four standard errors


def test_the_last_site_is_the_last_gene_even_for_the_largest_draw() -> None:
    genomes, out = population(), np.empty((8, 2))
    uniforms = np.array([0.0, np.nextafter(1.0, 0.0)])
    context = drawn.context_of(OnePoint(), uniforms, 1.0, genome_of(genomes))
    OnePoint.cross(genomes, np.array([0, 1]), context, out)
    assert (out[:, 0] != genomes[:, 0]).tolist() == [False] * 7 + [True]
