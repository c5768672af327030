"""Crossover of individuals: strings of via-points, and genomes at one point or gene by gene.

"Double cross-over" of a string p : q (Rana & Zalzala 1995, section 3.4b) can be read in two ways:

- tails: either arm's path is cut in two, and what follows the site is exchanged, arm by arm;
- segment: the whole string is cut at both sites, and what lies between them is exchanged: the end
  of the first arm's path and the beginning of the second arm's. With more arms every second piece
  of the string is exchanged.
"""

from typing import Literal, get_args

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray

Crossover = Literal["one_point", "uniform", "arithmetic", "blx_alpha"]
CROSSOVERS: tuple[str, ...] = get_args(Crossover)
ONE_POINT, UNIFORM, ARITHMETIC, BLX_ALPHA = range(len(CROSSOVERS))  # as kernels take them


def num_uniforms(num_arms: int, num_pairs: int) -> int:
    """Count the uniform numbers of `cross_at_sites`: per pair a decision, and a site per arm."""
    return num_pairs * (1 + num_arms)


@kernel
def cross_at_sites(
    uniforms: FloatArray,
    population: FloatArray,
    parents: IntArray,
    arm_slices: IntArray,
    rate: float,
    max_distance: float,
    segment: bool,
    out: FloatArray,
) -> None:
    """Cross strings at one site per arm, where the parents are close (Rana & Zalzala, 3.4b).

    Parents 2k and 2k + 1 form a pair; an odd last one stays alone. A pair is crossed with
    probability `rate`, and only if at the sites chosen in both arms' portions the two parents'
    via-points are closer than `max_distance`. What is not crossed is copied.

    Args:
        uniforms: (`num_uniforms`,) in [0, 1); per pair: decision, a site per arm.
        population: (nq, N + 1, individuals) strings of via-points.
        parents: (offspring,) indices into the population.
        arm_slices: (arms, 2) rows of each arm.
        rate: Probability in [0, 1].
        max_distance: Euclidean, in the units of the via-points.
        segment: Whether the segment between the sites is exchanged, instead of the tails.
        out: (nq, N + 1, ≥ offspring), written: the offspring.
    """
    num_points, num_arms, num_offspring = population.shape[1], len(arm_slices), len(parents)
    # mates and sites of every pair; who is not crossed is its own mate
    mates = parents.copy()
    sites = np.full((num_arms, num_offspring), num_points)
    for pair in range(num_offspring // 2):
        draw = uniforms[pair * (1 + num_arms) :]
        first, second = parents[2 * pair], parents[2 * pair + 1]
        if num_points < 3 or not draw[0] < rate:
            continue
        close = True
        for arm in range(num_arms):
            site = 1 + min(int(draw[1 + arm] * (num_points - 2)), num_points - 3)  # 1 … N − 1
            squared = 0.0
            for j in range(arm_slices[arm, 0], arm_slices[arm, 1]):
                step = population[j, site, first] - population[j, site, second]
                squared += step * step
            close = close and np.sqrt(squared) < max_distance
            sites[arm, 2 * pair] = site
            sites[arm, 2 * pair + 1] = site
        if close:
            mates[2 * pair], mates[2 * pair + 1] = second, first
    # every child: its own parent before the site, the mate from the site on; where a segment is
    # exchanged, the other way round for every second arm
    source = np.empty(num_offspring, dtype=np.uint64)  # unsigned: not to be counted from the end
    for arm in range(num_arms):
        site = sites[arm]
        heads, tails = (mates, parents) if segment and arm % 2 == 1 else (parents, mates)
        for i in range(num_points):
            for k in range(num_offspring):
                source[k] = heads[k] if i < site[k] else tails[k]
            for j in range(arm_slices[arm, 0], arm_slices[arm, 1]):
                given, target = population[j, i], out[j, i]
                for k in range(num_offspring):
                    target[k] = given[source[k]]


def num_single_point_uniforms(num_pairs: int) -> int:
    """Count the uniform numbers of `cross_single_point`: per pair a decision and a site."""
    return 2 * num_pairs


@kernel
def cross_single_point(
    uniforms: FloatArray, genomes: FloatArray, parents: IntArray, rate: float, out: FloatArray
) -> None:
    """Cut pairs of parents at one site and exchange what follows (Curkovic et al. 2013, section 3).

    Parents 2k and 2k + 1 form a pair; an odd last one stays alone. A pair is cut with probability
    `rate`, before one of the genes 1 … genes − 1, each equally likely. What is not cut is copied.

    Args:
        uniforms: (`num_single_point_uniforms`,) in [0, 1); per pair: decision, site.
        genomes: (genes, individuals, padding allowed).
        parents: (offspring,) indices of individuals.
        rate: Probability in [0, 1].
        out: (genes, ≥ offspring), written: the offspring.
    """
    # copies; an unsigned index, as numba would test a signed one for counting from the end
    num_genes, num_offspring = len(genomes), len(parents)
    for gene in range(num_genes):
        source, target = genomes[gene], out[gene]
        for k in range(num_offspring):
            target[k] = source[np.uint64(parents[k])]
    if num_genes < 2:
        return
    # pairs exchange their genes from the site on
    for pair in range(num_offspring // 2):
        if uniforms[2 * pair] < rate:
            first, second = 2 * pair, 2 * pair + 1
            site = 1 + min(int(uniforms[second] * (num_genes - 1)), num_genes - 2)  # 1 … genes − 1
            for gene in range(site, num_genes):
                out[gene, first], out[gene, second] = out[gene, second], out[gene, first]


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
