"""Individuals as strings of bits, one whole number per gene: decoding, crossover, mutation.

A gene of B ≤ 52 bits is a number in [0, 2^B); its highest bit comes first in the string.
"""

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import log
from evoexp.numeric.random_stream import Block, draw
from evoexp.records import FloatArray, IntArray


@kernel
def decode_strings(
    strings: IntArray,  # (genes, individuals)
    bits: int,  # B
    # whether they are reflected Gray codes: every bit of n is then the parity of its own Gray bit
    # and all above it
    gray: bool,
    limits: FloatArray,  # (genes, 2) l and h of each gene
    out: FloatArray,  # (genes, ≥ individuals), written
) -> None:
    """Decode numbers n of B bits: l + (h − l) n / (2^B − 1)."""
    greatest = float((1 << bits) - 1)
    for gene in range(len(strings)):
        low, high = limits[gene, 0], limits[gene, 1]
        for k in range(strings.shape[1]):
            number = strings[gene, k]
            if gray:
                for shift in (1, 2, 4, 8, 16, 32):
                    number ^= number >> shift
            out[gene, k] = low + (high - low) * (float(number) / greatest)


@kernel
def cross_strings(
    uniforms: FloatArray,  # (2 × pairs,): decision, site
    strings: IntArray,  # (genes, individuals)
    bits: int,  # of a gene
    parents: IntArray,  # (offspring,) indices of individuals
    rate: float,  # probability in [0, 1]
    out: IntArray,  # (genes, ≥ offspring), written
) -> None:
    """Cut pairs of parents at one site and exchange their tails (Chen & Zalzala 1995, section 3.2).

    Parents 2k and 2k + 1 form a pair; an odd last one stays alone. A pair is cut with probability
    `rate`, before one of the bits 1 … all − 1, each equally likely; else it is copied.
    """
    genes, count = len(strings), len(parents)
    # copies of the parents
    for gene in range(genes):
        for k in range(count):
            out[gene, k] = strings[gene, parents[k]]
    # pairs exchange the bits behind their site, gene by gene
    last = genes * bits - 1
    for pair in range(count // 2):
        first, second = 2 * pair, 2 * pair + 1
        if last > 0 and uniforms[first] < rate:
            site = 1 + min(int(uniforms[second] * last), last - 1)
            for gene in range(genes):
                behind = min(max((gene + 1) * bits - site, 0), bits)
                different = (out[gene, first] ^ out[gene, second]) & ((1 << behind) - 1)
                out[gene, first] ^= different
                out[gene, second] ^= different


@kernel
def flip_strings(draws: Block, strings: IntArray, bits: int, count: int, rate: float) -> None:
    """Flip every bit of the first `count` strings with probability p, in place (Holland 1975).

    The number of bits that stay before the next flipped one is geometrically distributed, ⌊ln(1 −
    u) / ln(1 − p)⌋ (Devroye 1986, section X.2); so a uniform number is taken per flipped bit.
    """
    num = len(strings) * bits
    staying, place = log(1.0 - rate), -1  # −inf if every bit is to be flipped: then none stays
    while staying < 0.0:
        passed = log(1.0 - draw(draws)) / staying
        if not passed < num * count - 1 - place:
            break
        place += 1 + int(passed)
        individual, bit = place // num, place % num
        strings[bit // bits, individual] ^= 1 << (bits - 1 - bit % bits)


@kernel
def decode_bits(bits: FloatArray, count: int, limits: FloatArray, out: FloatArray) -> None:
    """Decode plain binary numbers n of B bits, the highest first: l + (h − l) n / (2^B − 1).

    From bits (genes × B, ≥ count), 0.0 or 1.0, by limits (genes, 2), to out (genes, ≥ count).
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
