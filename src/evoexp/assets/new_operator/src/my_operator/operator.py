"""A crossover that exchanges some genes of two parents: an example to be changed."""

from typing import ClassVar

from evoexp.evolution.operators.crossover import copy_parents
from evoexp.evolution.operators.operator import Context, Crossover, Genome
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray
from evoexp.validation import Rate


class MyOperator(Crossover):
    """Exchanges each gene of a pair with a probability (Spears & De Jong 1991)."""

    component: ClassVar[str] = "my_operator"

    share: Rate = 0.5  # probability that a gene is exchanged, where a pair is crossed

    def num_uniforms(self, genome: Genome, count: int) -> int:
        """Return one for every pair, and one for each of its genes."""
        return count // 2 * (1 + len(genome.limits))

    @staticmethod
    @kernel
    def cross(genomes: FloatArray, parents: IntArray, context: Context, out: FloatArray) -> None:
        """Write offspring; see `Crossover`."""
        copy_parents(genomes, parents, out)
        num_genes, share = len(genomes), context.settings[0]
        for pair in range(len(parents) // 2):
            draws = context.uniforms[pair * (1 + num_genes) :]
            first, second = 2 * pair, 2 * pair + 1
            if draws[0] < context.rate:
                for gene in range(num_genes):
                    if draws[1 + gene] < share:
                        out[gene, first], out[gene, second] = out[gene, second], out[gene, first]
