"""Sine and cosine for answers that are checked: fewer operations, some digits less.

Angles are counted in quarter turns, so that taking whole ones off is exact, and no sum of two parts
stands for π/2. Kernels that decide yes or no use them, where doubtful cases are decided anew with
`elementary`. As there: only `+ − ×`, comparisons and the bits of numbers, the same on all machines.

Coefficients: the polynomials in t² that take the values of sin(t π/2) / t and cos(t π/2) at
Chebyshev's nodes of [0, 0.2505].
"""

from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import Number, from_bits, select, to_bits

QUARTER_TURN = 1.5707963267948966  # [rad]

_ROUND = 1.5 * 2.0**52  # adding it rounds to an integer, which then stands in the low bits

_S = (
    1.57079632679489, -0.6459640975042896, 0.07969262615502205, -0.004681752582201742,
    0.00016042921749270445, -3.5563018147276756e-06,
)  # fmt: skip
_C = (
    -1.233700550136151, 0.2536695078998529, -0.020863480734719126, 0.0009192599480942653,
    -2.5200127655950226e-05, 4.655185637830721e-07,
)  # fmt: skip


@inlined
def sincos_of_turn(t: Number) -> tuple[Number, Number]:
    """Return sine and cosine of t quarter turns; absolute error ≤ 1e-14 for |t| < 2^51."""
    shifted = t + _ROUND
    n, r = to_bits(shifted), t - (shifted - _ROUND)
    z = r * r
    s = r * (_S[0] + z * (_S[1] + z * (_S[2] + z * (_S[3] + z * (_S[4] + z * _S[5])))))
    c = _C[0] + z * (_C[1] + z * (_C[2] + z * (_C[3] + z * (_C[4] + z * _C[5]))))
    c = 1.0 + z * c
    odd = (n & 1) != 0
    sine = from_bits(to_bits(select(odd, c, s)) ^ ((n & 2) << 62))
    return sine, from_bits(to_bits(select(odd, s, c)) ^ (((n + 1) & 2) << 62))
