"""Crossover of real genomes gene by gene: uniform, arithmetic, BLX-α.

One-point crossover is in `crossover`.
"""

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray

CROSSOVERS = ("one_point", "uniform", "arithmetic", "blx_alpha")
"""Names of crossovers; kernels take their places in this list."""

ONE_POINT, UNIFORM, ARITHMETIC, BLX_ALPHA = range(4)


def num_gene_uniforms(num_genes: int, num_pairs: int) -> int:
    """Return the number of uniform numbers that `cross_genes` takes, whatever the kind."""
    return num_pairs * (1 + 2 * num_genes)


@kernel
def cross_genes(
    kind: int,
    uniforms: FloatArray,
    genomes: FloatArray,
    parents: IntArray,
    rate: float,
    alpha: float,
    limits: FloatArray,
    out: FloatArray,
) -> None:
    """Cross pairs of parents x, y with probability `rate`; other pairs are copied.

    Parents 2k and 2k + 1 form a pair; an odd last one stays alone.

    - uniform (Syswerda 1989): every gene is exchanged with probability 1/2.
    - arithmetic (Michalewicz 1992): the children are λ x + (1 − λ) y and (1 − λ) x + λ y, one λ in
      [0, 1) per pair.
    - BLX-α (Eshelman & Schaffer 1993): every gene of either child is drawn uniformly from [l − α d,
      h + α d), where l and h are the lesser and the greater of both parents' genes and d = h − l;
      it is then brought within its limits.

    Args:
        kind: UNIFORM, ARITHMETIC or BLX_ALPHA.
        uniforms: (`num_gene_uniforms`,) per pair: a decision, then two per gene.
        genomes: (genes, individuals, padding allowed).
        parents: (offspring,) indices of individuals.
        rate: Probability in [0, 1].
        alpha: α of BLX-α, ≥ 0.
        limits: (genes, 2) least and greatest value of each gene.
        out: (genes, ≥ offspring), written: the offspring.
    """
    num_genes, num_offspring = len(genomes), len(parents)
    # copies of the parents
    for gene in range(num_genes):
        for k in range(num_offspring):
            out[gene, k] = genomes[gene, parents[k]]
    # pairs that are crossed, gene by gene
    for pair in range(num_offspring // 2):
        draw = uniforms[pair * (1 + 2 * num_genes) :]
        one, two = 2 * pair, 2 * pair + 1
        if not draw[0] < rate:
            continue
        for gene in range(num_genes):
            x, y, u, v = out[gene, one], out[gene, two], draw[1 + 2 * gene], draw[2 + 2 * gene]
            if kind == UNIFORM:
                first, second = (y, x) if u < 0.5 else (x, y)
            elif kind == ARITHMETIC:
                first, second = y + draw[1] * (x - y), x + draw[1] * (y - x)
            else:
                low, wide = min(x, y) - alpha * abs(x - y), (1.0 + 2.0 * alpha) * abs(x - y)
                first, second = low + u * wide, low + v * wide
            out[gene, one] = min(max(first, limits[gene, 0]), limits[gene, 1])
            out[gene, two] = min(max(second, limits[gene, 0]), limits[gene, 1])
