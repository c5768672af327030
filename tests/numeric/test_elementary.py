"""Elementary functions against 80-bit arithmetic, products in order: the same bits everywhere."""

import ast
import functools
import hashlib
import math
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

import evoexp
from evoexp.numeric import elementary
from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.elementary import acos, asin, atan2, exact_sincos, exp, log, pow_int, sincos

Array = NDArray[Any]
INF = math.inf
NAN = math.nan
NUM_POINTS = 200_000
FUSED = re.compile(r"\bv?fn?m(add|sub|la|ls)\w*")


@inlined
def sin(x: float) -> float:
    return sincos(x)[0]


@inlined
def cos(x: float) -> float:
    return sincos(x)[1]


def function_of(name: str) -> Any:
    return {"sin": sin, "cos": cos}.get(name) or getattr(elementary, name)


def looped(name: str, num_arguments: int) -> Any:
    """Return a function as an innermost loop over arrays, which LLVM vectorises."""
    function = function_of(name)

    @numba.njit(error_model="numpy")
    def unary(x: Array, out: Array) -> None:
        for i in range(out.size):
            out[i] = function(x[i])

    @numba.njit(error_model="numpy")
    def binary(y: Array, x: Array, out: Array) -> None:
        for i in range(out.size):
            out[i] = function(y[i], x[i])

    return (unary, binary)[num_arguments - 1]


BOUNDS = {  # of errors as they are documented: of sine and cosine absolute, else relative
    "sin": 1.3e-16,
    "cos": 1.3e-16,
    "atan2": 3e-16,
    "asin": 3e-16,
    "acos": 2.4e-16,
    "log": 1.6e-16,
    "exp": 1.5e-16,
}
LOOPS = {name: looped(name, 2 if name == "atan2" else 1) for name in BOUNDS}


def over_array(name: str, *arguments: Array) -> Array:
    """Return the function's values, by its loop."""
    out = np.empty(arguments[0].size)
    LOOPS[name](*arguments, out)
    return out


@kernel
def pairs_loop(exact: bool, x: Array, s: Array, c: Array) -> None:
    """Fill s and c with sine and cosine, exact for multiples of 90° or as quick as may be."""
    for i in range(x.size):
        s[i], c[i] = exact_sincos(x[i]) if exact else sincos(x[i])


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
    """Return the function's values with at least 64 bits."""
    if np.finfo(np.longdouble).nmant < 63:
        pytest.skip("numpy has no 80-bit numbers here")
    function = getattr(np, NUMPY_NAMES.get(name, name))
    return function(*(a.astype(np.longdouble) for a in arguments))


def neighbours(x: Array) -> Array:
    """Return the numbers and the two floating-point neighbours of each."""
    return np.concatenate([x, np.nextafter(x, INF), np.nextafter(x, -INF)])


def same_bits(a: Array, b: Array) -> bool:
    """Compare bit by bit, so that 0 and −0 differ."""
    return bool(np.array_equal(a.view(np.int64), b.view(np.int64)))


@functools.cache
def points(name: str) -> list[tuple[Array, ...]]:
    """Return dense random and hard arguments, a list of regions."""
    rng = np.random.default_rng(20250101)
    tiny = 10.0 ** rng.uniform(-320, 0, NUM_POINTS) * rng.choice([-1.0, 1.0], NUM_POINTS)
    unit, ratio = rng.uniform(-1, 1, NUM_POINTS), rng.uniform(0, 1, NUM_POINTS)
    if name == "atan2":
        seam = rng.uniform(0.4140, 0.4144, NUM_POINTS) * ratio
        near = neighbours(ratio)[NUM_POINTS : 2 * NUM_POINTS]
        regions = [(unit, ratio), (tiny, ratio), (unit, tiny), (seam, ratio), (ratio, seam)]
        regions += [(ratio, near), *((k * unit, k * ratio) for k in (1.7e308, 1e-305))]
        return regions + [(y, -x) for y, x in regions]
    near_one = 1.0 - 10.0 ** rng.uniform(-16, 0, NUM_POINTS)
    every: tuple[Array, ...]
    if name in ("sin", "cos"):
        octants = neighbours(np.arange(-120_000, 120_000) * (np.pi / 4))
        every = *(unit * limit for limit in (0.8, 7.0, 1e3, 1e5, 1.6e6)), octants, tiny
    elif name in ("asin", "acos"):
        seam = neighbours(0.5 + np.arange(-3000, 3000) * 2.0**-50)
        every = unit, near_one, -near_one, seam, -seam, tiny
    elif name == "log":
        around_one = neighbours(1.0 + 10.0 ** rng.uniform(-16, -1, NUM_POINTS) * np.sign(unit))
        root_half = neighbours(math.sqrt(0.5) * 2.0 ** np.arange(-1000, 1000))
        subnormal = 5e-324 * rng.integers(1, 2**52, NUM_POINTS)
        everywhere = 10.0 ** rng.uniform(-307, 308, NUM_POINTS)
        every = ratio, 1.0 + 99.0 * ratio, around_one, root_half, subnormal, everywhere
    else:
        seam = neighbours((np.arange(-1020, 1020) + 0.5) * math.log(2.0))
        largest = np.array([709.78, 709.782712893, 709.782712893384])
        every = unit, 30.0 * unit, 708.0 * unit, seam, tiny, largest
    return [(x,) for x in every]


@pytest.mark.examples(3)
@pytest.mark.parametrize("name", BOUNDS)
def test_error_stays_below_the_documented_bound(name: str) -> None:
    for arguments in points(name):
        expected = truth(name, *arguments)
        error, size = np.abs(over_array(name, *arguments) - expected), np.abs(expected)
        if name not in ("sin", "cos"):  # no subnormal result has a relative error of 1e-16
            error = error[size >= 2.3e-308] / size[size >= 2.3e-308]
        assert np.nanmax(error) <= BOUNDS[name]


SPECIAL = {
    sin: ((0.0, 0.0), (-0.0, -0.0), (INF, NAN), (NAN, NAN), (5e-324, 5e-324)),
    cos: ((0.0, 1.0), (-INF, NAN), (NAN, NAN), (1e-300, 1.0)),
    asin: ((-0.0, -0.0), (1.0, math.pi / 2), (-1.0, -math.pi / 2), (1.0 + 2**-52, NAN), (NAN, NAN)),
    acos: ((1.0, 0.0), (-1.0, math.pi), (0.0, math.pi / 2), (-1.0 - 2**-52, NAN), (INF, NAN)),
    log: (
        *((1.0, 0.0), (0.0, -INF), (-0.0, -INF), (-5e-324, NAN), (-INF, NAN), (INF, INF)),
        *((NAN, NAN), (5e-324, -744.4400719213812)),
    ),
    exp: (
        *((0.0, 1.0), (-0.0, 1.0), (INF, INF), (-INF, 0.0), (NAN, NAN), (709.7827128933841, INF)),
        *((-745.13, 5e-324), (-745.14, 0.0), (1e300, INF), (-1e300, 0.0)),
    ),
}
POWERS = (  # base, exponent, power
    *((0.0, 0, 1.0), (NAN, 0, 1.0), (-2.0, 3, -8.0), (-0.0, 3, -0.0), (2.0, -3, 0.125)),
    *((-0.0, -1, -INF), (2.0, 1023, 2.0**1023), (2.0, 1024, INF), (INF, -2, 0.0), (3, 2, 9.0)),
)
AXES = (0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1e308, -1.7e308, INF, -INF, NAN)


def same_number(value: float, expected: float) -> bool:
    """Compare values and signs; NaN is equal to itself."""
    if math.isnan(expected):
        return math.isnan(value)
    return value == expected and math.copysign(1.0, value) == math.copysign(1.0, expected)


@pytest.mark.parametrize("function", SPECIAL)
def test_special_cases(function: Callable[[float], float]) -> None:
    for argument, expected in SPECIAL[function]:
        assert same_number(function(argument), expected), argument


def test_special_powers() -> None:
    for base, exponent, power in POWERS:
        assert same_number(pow_int(base, exponent), power), (base, exponent)


def test_atan2_on_axes_diagonals_and_infinities_is_as_c99_has_it() -> None:
    """Exact multiples of π/4, or arguments themselves: any libm rounds these correctly."""
    for y in AXES:
        for x in AXES:
            assert same_number(atan2(y, x), math.atan2(y, x)), (y, x)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 10, 64, 100, -1, -5])
def test_pow_int_errs_by_half_a_unit_per_multiplication(n: int) -> None:
    x = np.random.default_rng(3).uniform(0.5, 2.0, 500)
    value = np.array([pow_int(v, n) for v in x])
    assert np.max(np.abs(value / x.astype(np.longdouble) ** n - 1)) <= abs(n) * 1.12e-16


@pytest.mark.parametrize("name", LOOPS)
def test_scalar_calls_and_vectorised_loops_give_the_same_bits(name: str) -> None:
    rng, function = np.random.default_rng(5), function_of(name)
    for region in points(name):
        arguments = tuple(a[rng.integers(0, a.size, 1)[0] % 1000 :: 997].copy() for a in region)
        arguments = tuple(a[: min(b.size for b in arguments)] for a in arguments)
        scalar = [function(*map(float, point)) for point in zip(*arguments, strict=True)]
        whole = over_array(name, *arguments)
        assert same_bits(whole, np.array(scalar))
        for length in (1, 3, 7, 17, 63):  # the remainder of a vector loop is scalar code
            assert same_bits(over_array(name, *(a[:length] for a in arguments)), whole[:length])
    (code,) = LOOPS[name].inspect_llvm().values()
    assert re.search(r"fmul <\d+ x double>", code), "the innermost loop is vectorised"


def test_exact_sines_and_cosines_are_the_quick_ones_elsewhere() -> None:
    for (x,) in points("sin"):
        quick, exact = np.empty((2, 2, x.size))
        pairs_loop(False, x, *quick)
        pairs_loop(True, x, *exact)
        right = x == np.round(x / (np.pi / 2.0)) * (np.pi / 2.0)
        assert (~right).any()
        assert same_bits(exact[:, ~right], quick[:, ~right])


def test_multiples_of_90_degrees_have_exact_sines_and_cosines() -> None:
    quarters = np.arange(-10, 11)
    for x in (elementary.DEGREE * (90.0 * quarters), quarters * (np.pi / 2.0)):
        s, c = np.empty_like(x), np.empty_like(x)
        pairs_loop(True, x, s, c)
        assert s.tolist() == [(0.0, 1.0, 0.0, -1.0)[k % 4] for k in quarters]
        assert c.tolist() == [(1.0, 0.0, -1.0, 0.0)[k % 4] for k in quarters]
        for neighbour in (np.nextafter(x, -np.inf), np.nextafter(x, np.inf)):
            pairs_loop(True, neighbour, s, c)
            assert (s != 0.0).all() and (c != 0.0).all()


def digest() -> str:
    """Return a digest of values of all functions and of normal deviates."""
    x = np.random.default_rng(1).random(20_001)
    out = np.empty((8, x.size))
    every_function_loop(x, out)
    normals = elementary.standard_normal(np.random.default_rng(1), 5001)
    return hashlib.sha256(out.tobytes() + normals.tobytes()).hexdigest()


@pytest.mark.matrix
@pytest.mark.parametrize(("cpu", "optimisation"), [("haswell", "3"), ("generic", "0")])
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names of x86 processors")
def test_other_processors_and_optimisation_levels_give_the_same_bits(
    cpu: str, optimisation: str, tmp_path: Path
) -> None:
    target = {"NUMBA_CPU_NAME": cpu, "NUMBA_CPU_FEATURES": "", "NUMBA_OPT": optimisation}
    target |= {"EVOEXP_CACHE": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", "import test_elementary as t; print(t.digest())"]
    printed = subprocess.check_output(command, env=os.environ | target, text=True)
    assert printed.strip() == digest()


def test_kernels_hold_no_fused_multiply_add() -> None:
    def assembly(compiled: Any, *arguments: Array, **options: Any) -> str:
        # numba shows no cached code
        fresh = numba.jit(**{**compiled.targetoptions, **options})(compiled.py_func)
        fresh(*arguments)
        (code,) = fresh.inspect_asm().values()
        assert re.search(r"v?mul[ps]d|fmul", code) or FUSED.search(code)
        return str(code)

    x = np.ones(64)
    if not FUSED.search(assembly(multiply_add, x, x, x.copy(), fastmath={"contract"})):
        pytest.skip("this processor fuses nothing")
    assert not FUSED.search(assembly(multiply_add, x, x, x.copy()))
    assert not FUSED.search(assembly(every_function_loop, x, np.empty((8, x.size))))


@pytest.mark.parametrize("size", [0, 1, 2, 7, (3, 5), ()])
def test_normal_deviates_consume_the_uniform_stream_and_nothing_else(
    size: int | tuple[int, ...],
) -> None:
    rng, reference = np.random.default_rng(11), np.random.default_rng(11)
    sample = elementary.standard_normal(rng, size)
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
    with pytest.raises(ValueError, match="negative dimensions"):
        elementary.standard_normal(np.random.default_rng(0), -1)


# products of small arrays do not depend on the processor's linear algebra

ROOMS = ("collision", "evolution", "numeric", "objectives", "paths", "planners", "robots")
NAMES = ("dot", "einsum", "inner", "linalg", "matmul", "tensordot", "vdot")
BY_PROCESSOR = {f"np.{name}" for name in NAMES}
ROBOT = """
import sys
import numpy as np, pinocchio as pin
from evoexp.robots.kinematics import kinematic_table
rng, model = np.random.default_rng(3), pin.Model()
for k in range(40):
    axis = rng.normal(size=3)
    joint = pin.JointModelRevoluteUnaligned(axis / np.sqrt((axis * axis).sum()))
    turn = pin.Quaternion(*rng.normal(size=4)).normalized().toRotationMatrix()
    model.addJoint(k, joint, pin.SE3(turn, rng.normal(size=3)), f"joint_{k}")
table = kinematic_table(model)
arrays = (*table.chain, table.alignment, table.free)
sys.stdout.write(b"".join(array.tobytes() for array in arrays).hex())
"""


def test_products_are_those_of_numpy() -> None:
    rng = np.random.default_rng(1)
    matrix, other, vector = rng.normal(size=(5, 3)), rng.normal(size=(3, 4)), rng.normal(size=3)
    for one, two in ((matrix, other), (matrix, vector), (vector, other), (vector, vector)):
        found = elementary.matrix_product(one, two)
        assert found.shape == (one @ two).shape
        np.testing.assert_allclose(found, one @ two, rtol=1e-14, atol=1e-14)
    assert elementary.length(np.array([2.0, 3.0, 6.0])) == 7.0
    assert elementary.length(np.zeros(3)) == 0.0


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names of x86 processors")
def test_a_robot_in_general_position_has_the_same_table_on_every_processor() -> None:
    def table(**environment: str) -> bytes:
        words = [sys.executable, "-c", ROBOT]
        return subprocess.check_output(words, env=os.environ | environment)

    assert table(OPENBLAS_CORETYPE="Prescott") == table()


@pytest.mark.parametrize("room", ROOMS)
def test_no_sum_between_seed_and_record_is_left_to_the_processor(room: str) -> None:
    for path in sorted((Path(evoexp.__file__).parent / room).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            is_named = isinstance(node, ast.Attribute) and ast.unparse(node) in BY_PROCESSOR
            assert not (isinstance(node, ast.MatMult) or is_named), (
                f"{path}: `numeric.elementary` has products and lengths"
            )
