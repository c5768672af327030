"""Gray code: neighbouring numbers differ in one bit. Plain binary numbers are decoded in `gene_mutation`."""

from evoexp.numerics import kernel


@kernel
def gray_to_binary(gray, count, num_genes, out):  # type: ignore[no-untyped-def]
    """Turn reflected Gray codes into plain binary numbers: every bit is the parity of all Gray bits above and its own.

    Args:
        gray: (genes × bits, ≥ count) 0.0 or 1.0, gene by gene, the highest bit first.
        count: Individuals.
        num_genes: Number of genes.
        out: Of the same shape, written; may be `gray` itself.
    """
    bits = len(gray) // num_genes
    for gene in range(num_genes):
        for k in range(count):
            bit = 0.0
            for row in range(gene * bits, (gene + 1) * bits):
                bit = abs(bit - gray[row, k])
                out[row, k] = bit
