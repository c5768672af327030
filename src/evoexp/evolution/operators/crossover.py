"""Crossover of genomes at one point or gene by gene."""

import numpy as np

from evoexp.evolution.operators.operator import Context, Crossover, Genome
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray
from evoexp.validation import NonNegative


@kernel
def copy_parents(genomes: FloatArray, parents: IntArray, out: FloatArray) -> None:
    """Write the parents (genes, offspring) themselves to `out`, to be changed pair by pair."""
    for gene in range(len(genomes)):
        source, target = genomes[gene], out[gene]
        for k in range(len(parents)):
            target[k] = source[np.uint64(parents[k])]  # signed: tested for counting from the end


class OnePoint(Crossover):
    """Cuts a pair at one site and exchanges what follows (Curkovic et al. 2013, section 3).

    The site is before one of the genes 1 … genes − 1, each equally likely.
    """

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return two for every pair: decision and site."""
        return 2 * (count // 2)

    @staticmethod
    @kernel
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        """Write offspring; see `Crossover`."""
        copy_parents(genomes, parents, out)
        num_genes, uniforms = len(genomes), context.uniforms
        for pair in range(len(parents) // 2):
            first, second = 2 * pair, 2 * pair + 1
            if num_genes > 1 and uniforms[first] < context.rate:
                site = 1 + min(int(uniforms[second] * (num_genes - 1)), num_genes - 2)
                for gene in range(site, num_genes):
                    out[gene, first], out[gene, second] = out[gene, second], out[gene, first]


class GeneCrossover(Crossover, is_base=True):
    """A crossover that makes each gene of two children from the same gene of two parents."""

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return one for every pair, its decision, and two for each of its genes."""
        return count // 2 * (1 + 2 * len(genome.limits))


@kernel
def pairs_to_cross(
    genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Write the parents; return the pairs to be crossed, and each pair's numbers (1 + 2 · genes).

    These are the decision, then two for each gene.
    """
    copy_parents(genomes, parents, out)
    num_pairs, num_each = len(parents) // 2, 1 + 2 * len(genomes)
    draws = context.uniforms[: num_pairs * num_each].reshape((num_pairs, num_each))
    return np.flatnonzero(draws[:, 0] < context.rate), draws


@kernel
def replace_pair(
    gene: int, pair: int, one: float, two: float, genome: Genome, out: FloatArray
) -> None:
    """Write a gene of both children of a pair, within its limits."""
    low, high = genome.limits[gene, 0], genome.limits[gene, 1]
    out[gene, 2 * pair] = min(max(one, low), high)
    out[gene, 2 * pair + 1] = min(max(two, low), high)


class UniformCrossover(GeneCrossover):
    """Exchanges every gene with probability 1/2 (Syswerda 1989)."""

    @staticmethod
    @kernel
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        """Write offspring; see `Crossover`."""
        pairs, draws = pairs_to_cross(genomes, parents, context, out)
        for pair in pairs:
            for gene in range(len(genomes)):
                x, y = out[gene, 2 * pair], out[gene, 2 * pair + 1]
                one, two = (y, x) if draws[pair, 1 + 2 * gene] < 0.5 else (x, y)
                replace_pair(gene, pair, one, two, context.genome, out)


class ArithmeticCrossover(GeneCrossover):
    """Mixes a pair of parents in the same proportions in all genes (Michalewicz 1992).

    The children are λ x + (1 − λ) y and (1 − λ) x + λ y, one λ in [0, 1) per pair.
    """

    @staticmethod
    @kernel
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        """Write offspring; see `Crossover`."""
        pairs, draws = pairs_to_cross(genomes, parents, context, out)
        for pair in pairs:
            for gene in range(len(genomes)):
                x, y = out[gene, 2 * pair], out[gene, 2 * pair + 1]
                one, two = y + draws[pair, 1] * (x - y), x + draws[pair, 1] * (y - x)
                replace_pair(gene, pair, one, two, context.genome, out)


class BlxAlpha(GeneCrossover):
    """Draws every gene of either child around those of its parents (Eshelman & Schaffer 1993).

    It is uniform in [l − α d, h + α d), where l and h are the lesser and the greater of both
    parents' genes and d = h − l.
    """

    # α: how far beyond the parents children may lie, in units of their distance [-]
    blend_alpha: NonNegative = 0.5

    @staticmethod
    @kernel
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        """Write offspring; see `Crossover`."""
        (pairs, draws), alpha = pairs_to_cross(genomes, parents, context, out), context.settings[0]
        for pair in pairs:
            for gene in range(len(genomes)):
                x, y = out[gene, 2 * pair], out[gene, 2 * pair + 1]
                low, wide = min(x, y) - alpha * abs(x - y), (1.0 + 2.0 * alpha) * abs(x - y)
                one = low + draws[pair, 1 + 2 * gene] * wide
                two = low + draws[pair, 2 + 2 * gene] * wide
                replace_pair(gene, pair, one, two, context.genome, out)
