"""The elementary functions against 80-bit arithmetic.

And their promise of the same bits everywhere.
"""

import hashlib
import math
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
import scipy
from numpy.typing import NDArray

from evoexp.numeric import elementary
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.elementary import (
    acos,
    asin,
    atan2,
    cos,
    exact_sincos,
    exp,
    log,
    pow_int,
    sin,
    sincos,
    standard_normal,
)

Array = NDArray[Any]
INF = math.inf
NAN = math.nan
NUM_POINTS = 200_000
FUSED = re.compile(r"\bv?fn?m(add|sub|la|ls)\w*")


def unary_loop(function: Callable[..., float]) -> Any:
    """Return the function as an innermost loop over an array, which LLVM vectorises."""

    @numba.njit(error_model="numpy")
    def loop(x: Array, out: Array) -> None:
        for i in range(out.size):
            out[i] = function(x[i])

    return loop


def binary_loop(function: Callable[..., float]) -> Any:
    """Return the function of two arguments as an innermost loop over arrays."""

    @numba.njit(error_model="numpy")
    def loop(y: Array, x: Array, out: Array) -> None:
        for i in range(out.size):
            out[i] = function(y[i], x[i])

    return loop


NUM_ARGUMENTS = {"sin": 1, "cos": 1, "atan2": 2, "asin": 1, "acos": 1, "log": 1, "exp": 1}
LOOPS = {
    name: (unary_loop, binary_loop)[n - 1](getattr(elementary, name))
    for name, n in NUM_ARGUMENTS.items()
}


def over_array(name: str, *arguments: Array) -> Array:
    """Return the function's values, by its loop."""
    out = np.empty(arguments[0].size)
    LOOPS[name](*arguments, out)
    return out


@kernel
def sincos_loop(x: Array, s: Array, c: Array) -> None:
    """Fill s and c with sine and cosine."""
    for i in range(x.size):
        s[i], c[i] = sincos(x[i])


@kernel
def exact_sincos_loop(x: Array, s: Array, c: Array) -> None:
    """Fill s and c with sine and cosine, exact for multiples of 90°."""
    for i in range(x.size):
        s[i], c[i] = exact_sincos(x[i])


@kernel
def fifth_power_loop(x: Array, out: Array) -> None:
    """Fill out with fifth powers."""
    for i in range(x.size):
        out[i] = pow_int(x[i], 5)


@kernel
def every_function_loop(x: Array, out: Array) -> None:
    """Fill out  # (8, n) with the functions at x in (0, 1) and at larger arguments made of it."""
    for i in range(x.size):
        out[0, i], out[1, i] = sincos(1e5 * x[i])
        out[2, i] = atan2(x[i] - 0.5, x[i] - 0.25)
        out[3, i] = asin(x[i])
        out[4, i] = acos(x[i])
        out[5, i] = log(x[i])
        out[6, i] = exp(700.0 * x[i])
        out[7, i] = pow_int(x[i], 5)


@kernel
def multiply_add(x: Array, y: Array, out: Array) -> None:
    """Invite LLVM to contract."""
    for i in range(out.size):
        out[i] = x[i] * y[i] + out[i]


NUMPY_NAMES = {"atan2": "arctan2", "asin": "arcsin", "acos": "arccos"}


def truth(name: str, *arguments: Array) -> Any:
    """Return the function's values with at least 64 bits.

    Numpy's longdouble where it has them, else mpmath.
    """
    if np.finfo(np.longdouble).nmant >= 63:
        return getattr(np, NUMPY_NAMES.get(name, name))(
            *(a.astype(np.longdouble) for a in arguments)
        )
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(40):
        every = max(1, arguments[0].size // 5000)
        values = np.full(arguments[0].size, np.nan, dtype=object)
        sample = zip(*(a[::every].tolist() for a in arguments), strict=True)
        values[::every] = [getattr(mpmath, name)(*map(mpmath.mpf, point)) for point in sample]
        return values


def largest_error(name: str, *arguments: Array, relative: bool) -> float:
    """Return the largest absolute or relative error of a function over the points."""
    reference = truth(name, *arguments)
    error = np.abs(over_array(name, *arguments) - reference)
    if relative:
        error = error[reference != 0] / np.abs(reference[reference != 0])
    return float(np.nanmax(error))


def neighbours(x: Array) -> Array:
    """Return the numbers and the two floating-point neighbours of each."""
    return np.concatenate([x, np.nextafter(x, INF), np.nextafter(x, -INF)])


def same_bits(a: Array, b: Array) -> bool:
    """Compare bit by bit, so that 0 and −0 differ."""
    return bool(np.array_equal(a.view(np.int64), b.view(np.int64)))


def points(name: str) -> list[tuple[Array, ...]]:
    """Return dense random and hard arguments, a list of regions."""
    rng = np.random.default_rng(20250101)
    tiny = 10.0 ** rng.uniform(-320, 0, NUM_POINTS) * rng.choice([-1.0, 1.0], NUM_POINTS)
    unit = rng.uniform(-1, 1, NUM_POINTS)
    if name in ("sin", "cos"):
        octants = neighbours(np.arange(-120_000, 120_000) * (np.pi / 4))
        return [(unit * limit,) for limit in (0.8, 7.0, 1e3, 1e5, 1.6e6)] + [(octants,), (tiny,)]
    if name in ("asin", "acos"):
        near_one = 1.0 - 10.0 ** rng.uniform(-16, 0, NUM_POINTS)
        seam = neighbours(0.5 + np.arange(-3000, 3000) * 2.0**-50)
        return [(x,) for x in (unit, near_one, -near_one, seam, -seam, tiny)]
    if name == "log":
        near_one = neighbours(1.0 + 10.0 ** rng.uniform(-16, -1, NUM_POINTS) * np.sign(unit))
        root_half = neighbours(math.sqrt(0.5) * 2.0 ** np.arange(-1000, 1000))
        subnormal = 5e-324 * rng.integers(1, 2**52, NUM_POINTS)
        every = 10.0 ** rng.uniform(-307, 308, NUM_POINTS)
        return [
            (x,) for x in (rng.uniform(0, 1, NUM_POINTS), rng.uniform(1, 100, NUM_POINTS), near_one)
        ] + [(x,) for x in (root_half, subnormal, every)]
    if name == "exp":
        seams = neighbours((np.arange(-1020, 1020) + 0.5) * math.log(2.0))
        largest = np.array([709.78, 709.782712893, 709.782712893384])
        return [(x,) for x in (unit, 30.0 * unit, 708.0 * unit, seams, tiny, largest)]
    ratio = rng.uniform(0, 1, NUM_POINTS)
    seam = rng.uniform(0.4140, 0.4144, NUM_POINTS)
    regions = [
        (unit, ratio),
        (tiny, ratio),
        (unit, tiny),
        (1.7e308 * unit, 1.7e308 * ratio),
        (1e-305 * unit, 1e-305 * ratio),
    ]
    regions += [
        (seam * ratio, ratio),
        (ratio, seam * ratio),
        (ratio, neighbours(ratio)[NUM_POINTS : 2 * NUM_POINTS]),
    ]
    return regions + [(y, -x) for y, x in regions]


BOUNDS = {
    "sin": 1.3e-16,
    "cos": 1.3e-16,
    "atan2": 3e-16,
    "asin": 3e-16,
    "acos": 2.4e-16,
    "log": 1.6e-16,
    "exp": 1.5e-16,
}


@pytest.mark.examples(3)
@pytest.mark.parametrize("name", BOUNDS)
def test_error_stays_below_the_documented_bound(name: str) -> None:
    absolute = name in ("sin", "cos")
    for arguments in points(name):
        if not absolute:  # a subnormal result cannot have a relative error of 1e-16
            normal = np.abs(truth(name, *arguments)) >= 2.3e-308
            arguments = tuple(a[normal | (arguments[0] == 0)] for a in arguments)
        assert largest_error(name, *arguments, relative=not absolute) <= BOUNDS[name]


@pytest.mark.parametrize("name", ["asin", "atan2"])
def test_subnormal_results_err_by_the_last_bit_at_most(name: str) -> None:
    x = 5e-324 * np.random.default_rng(1).integers(-(2**52), 2**52, 10_000)
    arguments = (x, np.ones_like(x)) if name == "atan2" else (x,)
    assert largest_error(name, *arguments, relative=False) <= 5e-324


def test_exp_of_subnormal_result_errs_by_the_last_bit_at_most() -> None:
    x = np.random.default_rng(1).uniform(-745.1, -708.4, 10_000)
    assert largest_error("exp", x, relative=False) <= 5e-324


SPECIAL = [
    (sin, (0.0,), 0.0), (sin, (-0.0,), -0.0), (sin, (INF,), NAN), (sin, (NAN,), NAN), (sin,
    (5e-324,), 5e-324),
    (cos, (0.0,), 1.0), (cos, (-INF,), NAN), (cos, (NAN,), NAN), (cos, (1e-300,), 1.0),
    (asin, (-0.0,), -0.0), (asin, (1.0,), math.pi / 2), (asin, (-1.0,), -math.pi / 2), (asin,
    (1.0 + 2**-52,), NAN),
    (asin, (NAN,), NAN), (acos, (1.0,), 0.0), (acos, (-1.0,), math.pi), (acos, (0.0,), math.pi / 2),
    (acos, (-1.0 - 2**-52,), NAN), (acos, (INF,), NAN), (acos, (NAN,), NAN),
    (log, (1.0,), 0.0), (log, (0.0,), -INF), (log, (-0.0,), -INF), (log, (-5e-324,), NAN), (log,
    (-INF,), NAN),
    (log, (INF,), INF), (log, (NAN,), NAN), (log, (5e-324,), -744.4400719213812),
    (exp, (0.0,), 1.0), (exp, (-0.0,), 1.0), (exp, (INF,), INF), (exp, (-INF,), 0.0), (exp,
    (NAN,), NAN),
    (exp, (709.7827128933841,), INF), (exp, (-745.13,), 5e-324),
    (exp, (-745.14,), 0.0), (exp, (1e300,), INF), (exp, (-1e300,), 0.0),
    (pow_int, (0.0, 0), 1.0), (pow_int, (NAN, 0), 1.0), (pow_int, (-2.0, 3), -8.0), (pow_int,
    (-0.0, 3), -0.0),
    (pow_int, (2.0, -3), 0.125), (pow_int, (-0.0, -1), -INF), (pow_int, (2.0, 1023), 2.0**1023),
    (pow_int, (2.0, 1024), INF), (pow_int, (INF, -2), 0.0), (pow_int, (3, 2), 9.0),
]  # fmt: skip


@pytest.mark.parametrize(("function", "arguments", "expected"), SPECIAL)
def test_special_cases(
    function: Callable[..., float], arguments: tuple[float, ...], expected: float
) -> None:
    value = function(*arguments)
    if math.isnan(expected):
        assert math.isnan(value)
    else:
        assert value == expected
        assert math.copysign(1.0, value) == math.copysign(1.0, expected)


@pytest.mark.parametrize("y", [0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1e308, INF, -INF, NAN])
@pytest.mark.parametrize(
    "x", [0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1e308, -1.7e308, INF, -INF, NAN]
)
def test_atan2_on_axes_diagonals_and_infinities_is_as_c99_has_it(y: float, x: float) -> None:
    expected = math.atan2(
        y, x
    )  # exact multiples of π/4, or arguments themselves: any libm rounds these correctly
    value = atan2(y, x)
    assert value == expected or (math.isnan(value) and math.isnan(expected))
    assert math.isnan(value) or math.copysign(1.0, value) == math.copysign(1.0, expected)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 10, 64, 100, -1, -5])
def test_pow_int_errs_by_half_a_unit_per_multiplication(n: int) -> None:
    x = np.random.default_rng(3).uniform(0.5, 2.0, 500)
    value = np.array([pow_int(v, n) for v in x])
    assert np.max(np.abs(value / x.astype(np.longdouble) ** n - 1)) <= abs(n) * 1.12e-16


@pytest.mark.parametrize("name", LOOPS)
def test_scalar_calls_and_vectorised_loops_give_the_same_bits(name: str) -> None:
    rng = np.random.default_rng(5)
    for region in points(name):
        arguments = tuple(a[rng.integers(0, a.size, 1)[0] % 1000 :: 997].copy() for a in region)
        arguments = tuple(a[: min(b.size for b in arguments)] for a in arguments)
        scalar = np.array(
            [
                getattr(elementary, name)(*map(float, point))
                for point in zip(*arguments, strict=True)
            ]
        )
        whole = over_array(name, *arguments)
        assert same_bits(whole, scalar)
        for length in (1, 3, 7, 17, 63):  # the remainder of a vector loop is scalar code
            assert same_bits(over_array(name, *(a[:length] for a in arguments)), whole[:length])


@pytest.mark.parametrize("name", LOOPS)
def test_innermost_loop_vectorises(name: str) -> None:
    over_array(name, *points(name)[0])
    (code,) = LOOPS[name].inspect_llvm().values()
    assert re.search(r"fmul <\d+ x double>", code)


def test_pow_int_vectorised_gives_the_same_bits() -> None:
    x = np.random.default_rng(6).uniform(-3, 3, 333)
    out = np.empty_like(x)
    fifth_power_loop(x, out)
    assert same_bits(out, np.array([pow_int(v, 5) for v in x]))


def test_sincos_has_the_bits_of_sine_and_cosine() -> None:
    for (x,) in points("sin"):
        s, c = np.empty_like(x), np.empty_like(x)
        sincos_loop(x, s, c)
        assert same_bits(s, over_array("sin", x))
        assert same_bits(c, over_array("cos", x))


def test_multiples_of_90_degrees_have_exact_sines_and_cosines() -> None:
    quarters = np.arange(-10, 11)
    for x in (elementary.DEGREE * (90.0 * quarters), quarters * (np.pi / 2.0)):
        s, c = np.empty_like(x), np.empty_like(x)
        exact_sincos_loop(x, s, c)
        assert s.tolist() == [(0.0, 1.0, 0.0, -1.0)[k % 4] for k in quarters]
        assert c.tolist() == [(1.0, 0.0, -1.0, 0.0)[k % 4] for k in quarters]
        for neighbour in (np.nextafter(x, -np.inf), np.nextafter(x, np.inf)):
            exact_sincos_loop(neighbour, s, c)
            assert (s != 0.0).all()
            assert (c != 0.0).all()


def test_all_other_angles_keep_the_bits_of_sincos() -> None:
    for (x,) in points("sin"):
        found, expected = np.empty((2, x.size)), np.empty((2, x.size))
        exact_sincos_loop(x, *found)
        sincos_loop(x, *expected)
        right = x == np.round(x / (np.pi / 2.0)) * (np.pi / 2.0)
        assert (~right).any()
        for mine, theirs in zip(found, expected, strict=True):
            assert same_bits(mine[~right], theirs[~right])


@pytest.mark.parametrize("name", ["sin", "asin"])
def test_odd_functions_are_odd_to_the_bit(name: str) -> None:
    for (x,) in points(name):
        assert same_bits(over_array(name, -x), -over_array(name, x))


def test_float32_and_integers_count_as_float64() -> None:
    x: Any = np.float32(0.3)
    for function in (sin, acos, log, exp):
        assert function(x) == function(float(x))
        assert function(1) == function(1.0)
    assert atan2(x, x / 3) == atan2(float(x), float(x / 3))
    assert atan2(1, -1) == 3 * math.pi / 4


def digest() -> str:
    """Return a digest of values of all functions and of normal deviates."""
    x = np.random.default_rng(1).random(20_001)
    out = np.empty((8, x.size))
    every_function_loop(x, out)
    return hashlib.sha256(
        out.tobytes() + standard_normal(np.random.default_rng(1), 5001).tobytes()
    ).hexdigest()


@pytest.mark.matrix
@pytest.mark.parametrize(("cpu", "optimisation"), [("haswell", "3"), ("generic", "0")])
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names of x86 processors")
def test_other_processors_and_optimisation_levels_give_the_same_bits(
    cpu: str, optimisation: str, tmp_path: Path
) -> None:
    target = {
        "NUMBA_CPU_NAME": cpu,
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_OPT": optimisation,
        "EVOEXP_CACHE": str(tmp_path),
    }
    script = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); "
        "import test_elementary as t; print(t.digest())"
    )
    command = [sys.executable, "-c", script]
    result = subprocess.run(
        command, env={**os.environ, **target}, capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == digest()


def test_kernels_hold_no_fused_multiply_add() -> None:
    def assembly(compiled: Any, *arguments: Array, **options: Any) -> str:
        fresh = numba.jit(**{**compiled.targetoptions, **options})(
            compiled.py_func
        )  # numba shows no cached code
        fresh(*arguments)
        (code,) = fresh.inspect_asm().values()
        assert re.search(r"v?mul[ps]d|fmul", code) or FUSED.search(code)
        return str(code)

    x = np.ones(64)
    if not FUSED.search(assembly(multiply_add, x, x, x.copy(), fastmath={"contract"})):
        pytest.skip("this processor fuses nothing")
    assert not FUSED.search(assembly(multiply_add, x, x, x.copy()))
    assert not FUSED.search(assembly(every_function_loop, x, np.empty((8, x.size))))


def test_normal_deviates_have_the_moments_and_distribution_of_the_normal() -> None:
    n = 200_000
    sample = standard_normal(np.random.default_rng(7), n)
    assert abs(sample.mean()) < 4 / math.sqrt(n)  # four standard errors each
    assert abs(sample.var() - 1) < 4 * math.sqrt(2 / n)
    assert abs(float(scipy.stats.skew(sample))) < 4 * math.sqrt(6 / n)
    assert abs(float(scipy.stats.kurtosis(sample))) < 4 * math.sqrt(24 / n)
    assert abs(np.mean(sample[::2] * sample[1::2])) < 4 / math.sqrt(
        n / 2
    )  # the two of a pair are independent
    assert scipy.stats.kstest(sample, "norm").pvalue > 0.01


@pytest.mark.parametrize("size", [0, 1, 2, 7, (3, 5), ()])
def test_normal_deviates_consume_the_uniform_stream_and_nothing_else(
    size: int | tuple[int, ...],
) -> None:
    rng, reference = np.random.default_rng(11), np.random.default_rng(11)
    sample = standard_normal(rng, size)
    expected: list[float] = []
    while len(expected) < sample.size:
        u, v = 2.0 * reference.random() - 1.0, 2.0 * reference.random() - 1.0
        s = u * u + v * v
        if 0.0 < s < 1.0:
            factor = math.sqrt(-2.0 * log(s) / s)
            expected += [u * factor, v * factor]
    assert sample.shape == np.empty(size).shape
    assert same_bits(sample.reshape(-1), np.array(expected[: sample.size]))
    assert rng.bit_generator.state == reference.bit_generator.state


def test_normal_deviates_refuse_a_negative_size() -> None:
    with pytest.raises(ValueError, match="negative dimensions"):
        standard_normal(np.random.default_rng(0), -1)


class Rows(NamedTuple):
    first: Array
    rest: tuple[Array, int, tuple[Array, Array]]


@kernel
def add_borrowed(rows, count):  # type: ignore[no-untyped-def]
    """Add all to the first, `count` times, through what was borrowed."""
    first, (second, scale, (third, fourth)) = borrowed(rows)
    for _ in range(count):
        for k in range(len(first)):
            first[k] += scale * second[k] + third[0, k] + fourth[k]


def test_borrowed_arrays_are_the_same_arrays() -> None:
    """Values, shapes and strides; nothing is lost and nothing is freed."""
    rng = np.random.default_rng(0)
    first, second, third, fourth = (
        rng.random(50),
        rng.random(100)[::2],
        rng.random((2, 50)),
        rng.random(50),
    )
    fourth.flags.writeable = False
    expected = first + 3 * (2 * second + third[0] + fourth)
    references = [sys.getrefcount(array) for array in (first, second, third, fourth)]
    add_borrowed(Rows(first, (second, 2, (third, fourth))), 3)
    assert first == pytest.approx(expected, rel=1e-14)
    assert [sys.getrefcount(array) for array in (first, second, third, fourth)] == references


@kernel
def add_row(row, weights, out):  # type: ignore[no-untyped-def]
    if row[0] > 1e9:
        return -1
    for n in range(len(out)):
        out[n] += row[n] * weights[n]
    return 0


def sum_rows(rows, count):  # type: ignore[no-untyped-def]
    """Hand on an array that the loop keeps and changes.

    No processor's code does without a count of it.
    """
    out, (kept, _, (table, weights)) = rows
    for k in range(count):
        if out[0] < k:
            kept = table[k % 2]
        add_row(kept, weights, out)


def sum_borrowed_rows(rows, count):  # type: ignore[no-untyped-def]
    sum_rows_compiled(borrowed(rows), count)


sum_rows_compiled = numba.njit(error_model="numpy", nogil=True, forceinline=True)(sum_rows)


def test_borrowed_arrays_are_not_counted() -> None:
    """Where a kernel hands arrays on, references to them are counted, but not to borrowed ones."""
    counts = []
    for function in (sum_rows, sum_borrowed_rows):
        compiled = numba.njit(error_model="numpy", nogil=True)(
            function
        )  # code from the cache hides its text
        compiled(Rows(np.zeros(3), (np.zeros(3), 2, (np.zeros((2, 3)), np.zeros(3)))), 4)
        (text,) = compiled.inspect_llvm().values()
        counts.append(text.count("call void @NRT_incref"))
    assert counts[0] > 0
    assert counts[1] == 0
