"""Bit-reproducible elementary functions, and products, lengths and rotations of small arrays.

The functions are scalar and meant to be called inside kernels: LLVM inlines them, and an innermost
loop over an array becomes vector code. They use only `+ − × ÷ sqrt`, comparisons and the bits of
numbers, which IEEE 754 fixes to the last bit: no libm, no fused multiply-add. So scalar and vector
code, any vector width and any optimisation level give the same bits. `sincos` takes vectors
(`numeric.vectors`), too. Integer and float32 arguments count as float64. Error bounds are
the largest error measured against 80-bit arithmetic, rounded up; u = 1.11e-16 is half a unit in the
last place of 1.

numpy's `@`, `dot`, `linalg.norm` and `einsum` leave sums to code written for the processor, which
fuses a product and a sum where it can, or adds in another order. Here terms are added one by one.

Coefficients and exact-sum tricks: Sun's fdlibm 5.3 (k_sin.c, k_cos.c, s_atan.c, e_asin.c, e_log.c,
e_exp.c; Copyright (C) 1993 by Sun Microsystems, Inc.: "Permission to use, copy, modify, and
distribute this software is freely granted, provided that this notice is preserved"), here without
branches and with short chains of dependent operations.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import Number, from_bits, select, to_bits

FloatArray = NDArray[np.float64]

DEGREE = 0.017453292519943295  # [rad] one degree


_SIGN = -(2**63)  # the sign bit of a float64, as int64
_ROUND = 1.5 * 2.0**52  # adding it rounds to an integer, which then stands in the low bits
_ROUND_BITS = 0x4338000000000000  # its bits
_ONE_BITS = 0x3FF0000000000000
_SQRT_HALF_BITS = 0x3FE6A09E667F3BCD
_LARGEST = 1.7976931348623157e308  # finite

# ------------------------------------------------------------------------------------- sine, cosine

_TWO_OVER_PI = 6.36619772367581382433e-01
_HALF_PI_HI = (
    1.57079632673412561417e00  # the first 33 bits of pi/2: n times it is exact for |n| < 2^20
)
_HALF_PI_LO = 6.07710050650619224932e-11

_HALF_PI = 1.5707963267948966  # the nearest float64

_S = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)  # fmt: skip
_C = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09, -1.13596475577881948265e-11,
)  # fmt: skip


@inlined
def _reduce(x: Number) -> tuple[Number, Any]:
    """Return r in [−π/4, π/4] and an integer n (modulo 4) with x = r + n π/2 (Cody & Waite)."""
    t = x * _TWO_OVER_PI + _ROUND
    n = t - _ROUND
    return (x - n * _HALF_PI_HI) - n * _HALF_PI_LO, to_bits(t)


@inlined
def _sin_polynomial(r: Number) -> Number:
    """Return sin r for |r| ≤ π/4 (k_sin.c)."""
    z = r * r
    w = z * z
    p = (_S[1] + z * _S[2]) + w * ((_S[3] + z * _S[4]) + w * _S[5])
    s = r + z * r * (_S[0] + z * p)
    return select(r == 0.0, r, s)  # the sign of zero


@inlined
def _cos_polynomial(r: Number) -> Number:
    """Return cos r for |r| ≤ π/4 (k_cos.c); the rounding error of 1 − r²/2 is added back."""
    z = r * r
    w = z * z
    p = (_C[0] + z * _C[1]) + w * ((_C[2] + z * _C[3]) + w * (_C[4] + z * _C[5]))
    half = 0.5 * z
    head = 1.0 - half
    return head + (((1.0 - head) - half) + w * p)


@inlined
def _quadrant(s: Number, c: Number, n: Any) -> Number:
    """Return sin(r + n π/2) from s = sin r and c = cos r."""
    return from_bits(to_bits(select((n & 1) != 0, c, s)) ^ ((n & 2) << 62))


@inlined
def sincos(x: Number) -> tuple[Number, Number]:
    """Return (sin x, cos x) of x [rad].

    Absolute error ≤ 1.3e-16 for |x| ≤ 1.6e6; it grows beyond, and past 1e15 the result means
    nothing. sin(±0) = ±0; NaN for infinities and NaN.
    """
    r, n = _reduce(x)
    s, c = _sin_polynomial(r), _cos_polynomial(r)
    return _quadrant(s, c, n), _quadrant(s, c, n + 1)


@inlined
def exact_sincos(x: float) -> tuple[float, float]:
    """Return (sin x, cos x) of x [rad], exactly 0 and ±1 where x stands for a multiple of 90°.

    The float64 nearest to π is not π. Here n times the float64 nearest to π/2, which is also n
    times 90 times `DEGREE` up to n = 10, counts as n times 90°; others give the bits of `sincos`.
    """
    s, c = sincos(x)
    t = x * _TWO_OVER_PI + _ROUND
    exact, odd = x == (t - _ROUND) * _HALF_PI, to_bits(t) & 1
    return (0.0 if exact and odd == 0 else s), (0.0 if exact and odd == 1 else c)


# -------------------------------------------------------------------------------- inverse functions

_QUARTER_PI = 7.85398163397448278999e-01  # three trailing zero bits: up to 4 times it is exact
_QUARTER_PI_LO = 3.06161699786838301793e-17
_TAN_EIGHTH_PI = 0.41421356237309503

_A = (
    3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01,
    -1.11111104054623557880e-01,
    9.09088713343650656196e-02, -7.69187620504482999495e-02, 6.66107313738753120669e-02,
    -5.83357013379057348645e-02,
    4.97687799461593236017e-02, -3.65315727442169155270e-02, 1.62858201153657823623e-02,
)  # fmt: skip
_P = (
    1.66666666666666657415e-01, -3.25565818622400915405e-01, 2.01212532134862925881e-01,
    -4.00555345006794114027e-02,
    7.91534994289814532176e-04, 3.47933107596021167570e-05,
)  # fmt: skip
_Q = (
    -2.40339491173441421878e00, 2.02094576023350569471e00, -6.88283971605453293030e-01,
    7.70381505559019352791e-02,
)  # fmt: skip


@inlined
def atan2(y: float, x: float) -> float:
    """Return the angle [rad] of the point (x, y), in [−π, π].

    Relative error ≤ 3e-16. Zeros, infinities and NaN as C99 has them: atan2(±0, −0) = ±π,
    atan2(±inf, −inf) = ±3π/4. With a the smaller and b the larger of |x| and |y|, a/b or, above
    tan(π/8), (a − b)/(a + b) lies within ±tan(π/8): one polynomial and one division serve all
    octants.
    """
    sign_x = to_bits(x) & _SIGN
    sign_y = to_bits(y) & _SIGN
    x = abs(x * 1.0)
    y = abs(y * 1.0)
    steep = y > x
    a = x if steep else y
    b = y if steep else x
    scale = 0.25 if b > 1e300 else 1.0  # keeps a + b finite
    infinite = b > _LARGEST
    a = (1.0 if a > _LARGEST else a * 0.0) if infinite else a * scale
    b = 1.0 if infinite else b * scale
    b = 1.0 if b == 0.0 else b
    upper = a > _TAN_EIGHTH_PI * b
    numerator = a - b if upper else a
    denominator = a + b if upper else b
    t = numerator / denominator
    k = 1.0 if upper else 0.0  # the angle is k π/4 ± atan t
    k = 2.0 - k if steep else k
    k = 4.0 - k if sign_x != 0 else k
    t = from_bits(to_bits(t) ^ sign_x)
    t = -t if steep else t
    z = t * t
    w = z * z
    odd = _A[1] + w * (_A[3] + w * (_A[5] + w * (_A[7] + w * _A[9])))
    even = _A[2] + w * (_A[4] + w * (_A[6] + w * (_A[8] + w * _A[10])))
    p = z * (_A[0] + z * (odd + z * even))
    angle = k * _QUARTER_PI - ((t * p - k * _QUARTER_PI_LO) - t)
    signed: float = from_bits(to_bits(angle) ^ sign_y)
    return signed


@inlined
def _asin_core(x: float) -> tuple[float, float]:
    """Return s and asin s − s, where s = |x| ≤ 1/2; above that s = sqrt((1 − |x|)/2).

    There |asin x| = π/2 − 2 asin s.
    """
    x = abs(x)
    folded = 0.5 * (1.0 - x)
    root = math.sqrt(folded)
    s = x if x <= 0.5 else root
    z = x * x if x <= 0.5 else folded
    w = z * z
    p = z * ((_P[0] + z * _P[1]) + w * ((_P[2] + z * _P[3]) + w * (_P[4] + z * _P[5])))
    q = (1.0 + z * _Q[0]) + w * ((_Q[1] + z * _Q[2]) + w * _Q[3])
    return s, s * (p / q)


@inlined
def asin(x: float) -> float:
    """Return the arcsine of x, in [−π/2, π/2] [rad]; relative error ≤ 3e-16; NaN for |x| > 1."""
    x = x * 1.0
    s, excess = _asin_core(x)
    outer = _QUARTER_PI - ((2.0 * excess - 2.0 * _QUARTER_PI_LO) - (_QUARTER_PI - 2.0 * s))
    angle = s + excess if abs(x) <= 0.5 else outer
    signed: float = from_bits(to_bits(angle) ^ (to_bits(x) & _SIGN))
    return signed


@inlined
def acos(x: float) -> float:
    """Return the arccosine of x, in [0, π] [rad]; relative error ≤ 2.4e-16; NaN for |x| > 1."""
    x = x * 1.0
    s, excess = _asin_core(x)
    inner = 2.0 * _QUARTER_PI - (x - (2.0 * _QUARTER_PI_LO - (-excess if x < 0.0 else excess)))
    left = 4.0 * _QUARTER_PI - 2.0 * (s + (excess - 2.0 * _QUARTER_PI_LO))
    right = 2.0 * (s + excess)
    outer = left if x < 0.0 else right
    return inner if abs(x) <= 0.5 else outer


# ------------------------------------------------------------------- logarithm, exponential, powers

_LN2_HI = 6.93147180369123816490e-01
_LN2_LO = 1.90821492927058770002e-10
_ONE_OVER_LN2 = 1.44269504088896338700e00
_L = (
    6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01,
    2.222219843214978396e-01,
    1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01,
)  # fmt: skip
_X = (
    1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05,
    -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
)  # fmt: skip


@inlined
def log(x: float) -> float:
    """Return the natural logarithm of x [-]; relative error ≤ 1.6e-16.

    It is −inf for ±0, NaN for x < 0, inf for inf.
    """
    tiny = x < 2.0**-1022
    bits = to_bits(x * 2.0**54 if tiny else x * 1.0)
    exponent = (
        (bits + (_ONE_BITS - _SQRT_HALF_BITS)) >> 52
    ) & 0x7FF  # biased: x = 2^k (1 + f), 1 + f in [√½, √2)
    f = from_bits(bits - ((exponent - 1023) << 52)) - 1.0
    k = from_bits(exponent + _ROUND_BITS) - (_ROUND + (1077.0 if tiny else 1023.0))
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    r = w * (_L[1] + w * (_L[3] + w * _L[5])) + z * (_L[0] + w * (_L[2] + w * (_L[4] + w * _L[6])))
    half = 0.5 * f * f
    value = k * _LN2_HI - ((half - (s * (half + r) + k * _LN2_LO)) - f)
    value = value if x <= _LARGEST else x * 1.0  # inf and NaN
    below = -math.inf if x == 0.0 else math.nan
    return below if x <= 0.0 else value


@inlined
def exp(x: float) -> float:
    """Return e to the power x [-]; relative error ≤ 1.5e-16 (subnormal results: the last bit).

    It is inf above 709.79.
    """
    x = 710.0 if x > 710.0 else x * 1.0
    x = -746.0 if x < -746.0 else x
    t = x * _ONE_OVER_LN2 + _ROUND
    n = t - _ROUND
    hi = x - n * _LN2_HI
    lo = n * _LN2_LO
    r = hi - lo  # x = n ln 2 + r + c, |r| ≤ ln(2)/2
    z = r * r
    w = z * z
    c = r - (z * (_X[0] + w * (_X[2] + w * _X[4])) + w * (_X[1] + w * _X[3]))
    y = 1.0 - ((lo - (r * c) / (2.0 - c)) - hi)
    doubled = (
        to_bits(t) - _ROUND_BITS + 2048
    )  # 2^n in two factors: 2^n itself may overflow or underflow
    first = (doubled >> 1) & 0xFFF
    power: float = y * from_bits((first - 1) << 52) * from_bits((doubled - first - 1) << 52)
    return power


@inlined
def pow_int(x: float, n: int) -> float:
    """Return x to the integer power n, by squaring; 1 for n = 0, whatever x; 1 / x^−n for n < 0.

    Relative error ≤ |n| u while x^|n| neither overflows nor is subnormal. A constant n lets a loop
    over x vectorise.
    """
    result = 1.0
    base = x * 1.0
    left = abs(n)
    while left > 0:
        result = result * base if left & 1 else result
        base = base * base
        left >>= 1
    return 1.0 / result if n < 0 else result


# ---------------------------------------------------------------------------------- normal deviates


@kernel
def fill_standard_normal(rng: np.random.Generator, out: NDArray[np.float64]) -> None:
    """Fill out (n,) with standard normal deviates; the kernel of `standard_normal`."""
    rng = borrowed(rng)
    num_pairs = (out.size + 1) // 2
    pairs = np.empty(2 * num_pairs)
    squares = np.empty(num_pairs)
    # uniform points in the unit disc
    i = 0
    while i < num_pairs:
        u = 2.0 * rng.random() - 1.0
        v = 2.0 * rng.random() - 1.0
        pairs[2 * i] = u
        pairs[2 * i + 1] = v
        squares[i] = u * u + v * v
        i += 1 if 0.0 < squares[i] < 1.0 else 0
    for i in range(num_pairs):
        squares[i] = math.sqrt(-2.0 * log(squares[i]) / squares[i])
    for i in range(out.size):
        out[i] = pairs[i] * squares[i // 2]


def standard_normal(rng: np.random.Generator, size: int | tuple[int, ...]) -> NDArray[np.float64]:
    """Draw standard normal deviates by the polar method of Marsaglia & Bray 1964, from `random()`.

    An attempt takes 2 uniforms and yields a pair of deviates with probability π/4: n deviates
    consume no fixed number, 1.27 n on average. An odd n discards the second deviate of its last
    pair.
    """
    out = np.empty(size)
    with rng.bit_generator.lock:
        fill_standard_normal(rng, out.reshape(-1))
    return out


# ------------------------------------------------------------------------------------ small arrays


def matrix_product(one: FloatArray, two: FloatArray) -> FloatArray:
    """Return the matrix product of (…, k) and (k,) or (k, m)."""
    columns = one if two.ndim == 1 else one[..., None]
    axis = one.ndim - 1
    total = columns.take(0, axis) * two[0]
    for k in range(1, one.shape[-1]):
        total = total + columns.take(k, axis) * two[k]
    return np.asarray(total)


def length(vector: FloatArray) -> float:
    """Return the Euclidean length of a vector (k,)."""
    return float(np.sqrt(matrix_product(vector, vector)))


def rotation_matrix(angles: tuple[float, float, float]) -> FloatArray:
    """Return the rotation of roll, pitch, yaw [deg]: Rz(yaw) Ry(pitch) Rx(roll), (3, 3)."""
    (sr, cr), (sp, cp), (sy, cy) = (sincos(DEGREE * angle) for angle in angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
