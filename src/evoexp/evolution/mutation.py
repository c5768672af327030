"""Mutation of single genes, and how its rate falls over the generations."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray


def num_allele_uniforms(count: int) -> int:
    """Count the uniform numbers of `allele_mutation`: per individual decision, gene, amount."""
    return 3 * count


def allele_mutation(
    rng: np.random.Generator,
    genomes: FloatArray,
    count: int,
    rate: float,
    step: float,
    limit: float,
    symmetric: bool,
) -> None:
    """Change at most one allele of each individual at random (Curkovic et al. 2013, Eq. 9).

    With probability `rate` one gene, each equally likely, gets q + r with r uniform in (0, step],
    as printed, or in [−step, step) in the symmetric reading. The change is made only if the result
    lies in [0, limit); otherwise the allele keeps its value.

    Args:
        rng: Source of `num_allele_uniforms` uniform numbers, whatever the rate.
        genomes: (genes, ≥ count), changed in place.
        count: Individuals that may change; those behind them do not.
        rate: Probability in [0, 1].
        step: Largest change, > 0, in the units of the genes.
        limit: Upper bound of a mutated gene, in the units of the genes.
        symmetric: Whether genes may decrease, too.

    Raises:
        ValueError: If there are fewer individuals than `count`, or no genes.
    """
    if genomes.ndim != 2 or not len(genomes) or not 0 <= count <= genomes.shape[1]:
        raise ValueError(f"genomes are (genes, at least {count} individuals), were {genomes.shape}")
    uniforms = rng.random(num_allele_uniforms(count))
    mutate_allele(uniforms, genomes, count, rate, step, limit, symmetric)


@kernel
def mutate_allele(
    uniforms: FloatArray,
    genomes: FloatArray,
    count: int,
    rate: float,
    step: float,
    limit: float,
    symmetric: bool,
) -> None:
    """The kernel of `allele_mutation`, for other kernels; uniforms: decision, gene, amount."""
    num_genes = len(genomes)
    for k in range(count):
        if not uniforms[3 * k] < rate:
            continue
        gene = min(int(uniforms[3 * k + 1] * num_genes), num_genes - 1)
        draw = uniforms[3 * k + 2]  # in [0, 1)
        change = step * (2.0 * draw - 1.0) if symmetric else step * (1.0 - draw)
        mutant = genomes[gene, k] + change
        if 0.0 <= mutant < limit:
            genomes[gene, k] = mutant


@kernel
def decayed_rate(rate: float, decay: float, generation: int, num_generations: int) -> float:
    """Return the mutation rate of a generation (Curkovic et al. 2013, Eq. 10: 1 − 0.9 t/G).

    It is rate − decay · t/G, in [0, 1]; for kernels and for Python alike.

    Args:
        rate: At generation 0.
        decay: Difference of the rates at generations 0 and G.
        generation: t.
        num_generations: G; if 0, the rate does not fall.
    """
    share = generation / num_generations if num_generations > 0 else 0.0
    return min(max(rate - decay * share, 0.0), 1.0)
