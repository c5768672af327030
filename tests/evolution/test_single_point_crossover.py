"""Single-point crossover, beside the same pair by pair."""

import numpy as np
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


def test_the_last_site_is_the_last_gene_even_for_the_largest_draw() -> None:
    genomes, out = population(), np.empty((8, 2))
    uniforms = np.array([0.0, np.nextafter(1.0, 0.0)])
    context = drawn.context_of(OnePoint(), uniforms, 1.0, genome_of(genomes))
    OnePoint.cross(genomes, np.array([0, 1]), context, out)
    assert (out[:, 0] != genomes[:, 0]).tolist() == [False] * 7 + [True]
