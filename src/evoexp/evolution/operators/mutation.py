"""Mutation of real genomes, gene by gene or in one gene of an individual, and of bits."""

from typing import ClassVar

import numpy as np

from evoexp.evolution.operators.operator import Context, Genome, Mutation
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import pow_int
from evoexp.records import FloatArray
from evoexp.validation import NonNegativeCount, Positive


class GeneMutation(Mutation, is_base=True):
    """Mutates every gene with the rate, or one gene of an individual."""

    # whether an individual is mutated with the rate, in one gene; else every gene is
    one_gene: bool = False

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return one per gene; or three per individual: decision, gene and amount."""
        return 3 * count if self.one_gene else len(genome.limits) * count


@kernel
def draw_amounts(num_genes: int, count: int, context: Context) -> FloatArray:
    """Return for every gene (genes, count) how it is mutated: a uniform number, or −1 if it is not.

    Where every gene may be, one number decides and, divided by the rate, is the amount.
    """
    amounts, rate, uniforms = np.empty((num_genes, count)), context.rate, context.uniforms
    if context.settings[0] == 0.0:
        for gene in range(num_genes):
            for k in range(count):
                draw = uniforms[gene * count + k]
                amounts[gene, k] = draw / rate if draw < rate else -1.0
    else:
        amounts[:] = -1.0
        for k in range(count):
            if uniforms[3 * k] < rate:
                gene = min(int(uniforms[3 * k + 1] * num_genes), num_genes - 1)
                amounts[gene, k] = uniforms[3 * k + 2]
    return amounts


class NonUniformMutation(GeneMutation):
    """Moves a gene towards one of its limits, by ever smaller steps (Michalewicz 1992).

    With l and h the limits, x becomes x + (h − x) r s or x − (x − l) r s, each with probability
    1/2; r is uniform in [0, 1) and s = (1 − t/T)^b.
    """

    mutation_power: NonNegativeCount = 2  # b, whole [-]

    @staticmethod
    @kernel
    def mutate(genomes: FloatArray, count: int, context: Context) -> None:
        """Change offspring; see `Mutation`."""
        spread = pow_int(1.0 - context.progress, int(context.settings[1]))
        amounts = draw_amounts(len(genomes), count, context)
        for gene in range(len(genomes)):
            row, (low, high) = genomes[gene], context.genome.limits[gene]
            for k in range(count):
                amount, x = amounts[gene, k], row[k]
                up = x + (high - x) * (2.0 * amount) * spread
                down = x - (x - low) * (2.0 * amount - 1.0) * spread
                mutant = min(max(up if amount < 0.5 else down, low), high)
                row[k] = mutant if amount >= 0.0 else x


class GaussianMutation(GeneMutation):
    """Adds s (h − l) z to a gene, z a normal deviate, within its limits l, h (Schwefel 1981)."""

    takes_normals: ClassVar[bool] = True

    mutation_std: Positive = 0.1  # s, standard deviation in units of a gene's range [-]

    @staticmethod
    @kernel
    def mutate(genomes: FloatArray, count: int, context: Context) -> None:
        """Change offspring; see `Mutation`."""
        std, amounts = context.settings[1], draw_amounts(len(genomes), count, context)
        for gene in range(len(genomes)):
            row, (low, high) = genomes[gene], context.genome.limits[gene]
            for k in range(count):
                mutant = min(max(row[k] + std * (high - low) * context.normals[gene, k], low), high)
                row[k] = mutant if amounts[gene, k] >= 0.0 else row[k]


class UniformReset(GeneMutation):
    """Draws a gene anew, uniform within its limits (Michalewicz 1992)."""

    @staticmethod
    @kernel
    def mutate(genomes: FloatArray, count: int, context: Context) -> None:
        """Change offspring; see `Mutation`."""
        amounts = draw_amounts(len(genomes), count, context)
        for gene in range(len(genomes)):
            row, (low, high) = genomes[gene], context.genome.limits[gene]
            for k in range(count):
                mutant = min(max(low + amounts[gene, k] * (high - low), low), high)
                row[k] = mutant if amounts[gene, k] >= 0.0 else row[k]


class AlleleMutation(Mutation):
    """Changes at most one allele of each individual at random (Curkovic et al. 2013, Eq. 9).

    With the rate as probability one gene, each equally likely, gets q + r with r uniform in (0,
    step], as printed, or in [−step, step) in the symmetric reading. The change is made only if the
    result lies in [l, h), the gene's limits; otherwise the allele keeps its value.
    """

    step: Positive  # largest change, in the units of the genes
    symmetric: bool = False  # whether genes may decrease, too

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return three per individual: decision, gene, amount."""
        return 3 * count

    @staticmethod
    @kernel
    def mutate(genomes: FloatArray, count: int, context: Context) -> None:
        """Change offspring; see `Mutation`."""
        num_genes, limits, uniforms = len(genomes), context.genome.limits, context.uniforms
        step, symmetric = context.settings[0], context.settings[1] != 0.0
        for k in range(count):
            if not uniforms[3 * k] < context.rate:
                continue
            gene = min(int(uniforms[3 * k + 1] * num_genes), num_genes - 1)
            draw = uniforms[3 * k + 2]  # in [0, 1)
            change = step * (2.0 * draw - 1.0) if symmetric else step * (1.0 - draw)
            mutant = genomes[gene, k] + change
            if limits[gene, 0] <= mutant < limits[gene, 1]:
                genomes[gene, k] = mutant


class BitFlips(Mutation):
    """Flips every bit, 0.0 or 1.0, with the rate as probability (Holland 1975)."""

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return one for every bit."""
        return len(genome.limits) * count

    @staticmethod
    @kernel
    def mutate(genomes: FloatArray, count: int, context: Context) -> None:
        """Change offspring; see `Mutation`."""
        for row in range(len(genomes)):
            for k in range(count):
                if context.uniforms[row * count + k] < context.rate:
                    genomes[row, k] = 1.0 - genomes[row, k]
