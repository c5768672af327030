"""Mutation of genes: of one allele, of real genomes gene by gene, and of bits; its rate."""

from typing import Literal, get_args

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import pow_int
from evoexp.records import FloatArray

Mutation = Literal["non_uniform", "gaussian", "uniform_reset"]
Scope = Literal["gene", "individual"]
MUTATIONS: tuple[str, ...] = get_args(Mutation)
SCOPES: tuple[str, ...] = get_args(Scope)
NON_UNIFORM, GAUSSIAN, UNIFORM_RESET = range(len(MUTATIONS))  # as kernels take them
GENE, INDIVIDUAL = range(len(SCOPES))


def num_allele_uniforms(count: int) -> int:
    """Count the uniform numbers of `mutate_allele`: per individual decision, gene, amount."""
    return 3 * count


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
    """Change at most one allele of each individual at random (Curkovic et al. 2013, Eq. 9).

    With probability `rate` one gene, each equally likely, gets q + r with r uniform in (0, step],
    as printed, or in [−step, step) in the symmetric reading. The change is made only if the result
    lies in [0, limit); otherwise the allele keeps its value.

    Args:
        uniforms: (`num_allele_uniforms`,) in [0, 1); per individual: decision, gene, amount.
        genomes: (genes, ≥ count), changed in place.
        count: Individuals that may change; those behind them do not.
        rate: Probability in [0, 1].
        step: Largest change, > 0, in the units of the genes.
        limit: Upper bound of a mutated gene, in the units of the genes.
        symmetric: Whether genes may decrease, too.
    """
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


def num_mutation_uniforms(num_genes: int, count: int, scope: int) -> int:
    """Return the number of uniform numbers that `mutate_genes` takes.

    They are one per gene, or per individual a decision, a gene and an amount.
    """
    return num_genes * count if scope == GENE else 3 * count


@kernel
def mutate_genes(
    kind: int,
    scope: int,
    uniforms: FloatArray,
    normals: FloatArray,
    genomes: FloatArray,
    count: int,
    rate: float,
    spread: float,
    limits: FloatArray,
) -> None:
    """Mutate genes x in place, within their limits [l, h].

    With w a uniform number in [0, 1) and z a normal deviate:

    - non-uniform (Michalewicz 1992): x + (h − x) r s or x − (x − l) r s, each direction with
      probability 1/2; r is uniform in [0, 1) and s = (1 − t/T)^b falls over the generations
      (`non_uniform_spread`).
    - Gaussian (Schwefel 1981): x + s (h − l) z, brought within the limits.
    - uniform reset (Michalewicz 1992): l + w (h − l).

    Args:
        kind: NON_UNIFORM, GAUSSIAN or UNIFORM_RESET.
        scope: GENE: every gene is mutated with probability `rate`; INDIVIDUAL: every individual is,
            in one gene. With GENE, one number decides and, divided by the rate, is the amount:
            below the rate the ratio is uniform again.
        uniforms: (`num_mutation_uniforms`,) in [0, 1).
        normals: (genes, ≥ count) normal deviates, read by the Gaussian kind only.
        genomes: (genes, ≥ count), changed.
        count: Individuals; columns behind them are left alone.
        rate: Probability in [0, 1].
        spread: s above.
        limits: (genes, 2) least and greatest value of each gene.
    """
    num_genes = len(genomes)
    if scope == GENE:
        for gene in range(num_genes):
            own, first, low, high = genomes[gene], gene * count, limits[gene, 0], limits[gene, 1]
            for k in range(count):
                draw, x = uniforms[first + k], own[k]
                z = normals[gene, k] if kind == GAUSSIAN else 0.0
                mutant = _mutant(kind, x, draw / rate, z, spread, low, high)
                own[k] = mutant if draw < rate else x
    else:
        for k in range(count):
            if uniforms[3 * k] < rate:
                gene = min(int(uniforms[3 * k + 1] * num_genes), num_genes - 1)
                z = normals[gene, k] if kind == GAUSSIAN else 0.0
                genomes[gene, k] = _mutant(
                    kind,
                    genomes[gene, k],
                    uniforms[3 * k + 2],
                    z,
                    spread,
                    limits[gene, 0],
                    limits[gene, 1],
                )


@kernel
def _mutant(
    kind: int, x: float, w: float, z: float, spread: float, low: float, high: float
) -> float:
    if kind == NON_UNIFORM:
        mutant = (
            x + (high - x) * (2.0 * w) * spread
            if w < 0.5
            else x - (x - low) * (2.0 * w - 1.0) * spread
        )
    elif kind == GAUSSIAN:
        mutant = x + spread * (high - low) * z
    else:
        mutant = low + w * (high - low)
    return min(max(mutant, low), high)


@kernel
def non_uniform_spread(generation: int, num_generations: int, power: int) -> float:
    """Return s = (1 − t/T)^b of non-uniform mutation (Michalewicz 1992).

    Args:
        generation: t of the parents: 0 for the initial population.
        num_generations: T ≥ 1.
        power: b ≥ 0, whole.
    """
    return pow_int(1.0 - generation / num_generations, power)


@kernel
def flip_bits(uniforms: FloatArray, bits: FloatArray, count: int, rate: float) -> None:
    """Flip every bit (0.0 or 1.0) with probability `rate`, in place (Holland 1975).

    Args:
        uniforms: (bits × count).
        bits: (bits, ≥ count), changed.
        count: Individuals.
        rate: Probability in [0, 1].
    """
    for row in range(len(bits)):
        for k in range(count):
            if uniforms[row * count + k] < rate:
                bits[row, k] = 1.0 - bits[row, k]


@kernel
def decode_bits(bits: FloatArray, count: int, limits: FloatArray, out: FloatArray) -> None:
    """Decode plain binary numbers n of B bits, the highest first: l + (h − l) n / (2^B − 1).

    Args:
        bits: (genes × B, ≥ count) 0.0 or 1.0, gene by gene.
        count: Individuals.
        limits: (genes, 2) l and h of each gene.
        out: (genes, ≥ count), written.
    """
    num = len(bits) // len(out)
    greatest = 0.0
    for _ in range(num):
        greatest = 2.0 * greatest + 1.0
    for gene in range(len(out)):
        low, high = limits[gene, 0], limits[gene, 1]
        for k in range(count):
            number = 0.0
            for bit in range(num):
                number = 2.0 * number + bits[gene * num + bit, k]
            out[gene, k] = low + (high - low) * (number / greatest)
