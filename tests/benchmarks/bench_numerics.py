"""Our elementary functions beside libm (called from the same compiled loop) and numpy.

4096 elements per round.
"""

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

from evoexp.numeric.elementary import (
    acos,
    asin,
    atan2,
    cos,
    exp,
    log,
    pow_int,
    sin,
    sincos,
    standard_normal,
)

SIZE = 4096
rng = np.random.default_rng(0)
ANGLES, UNIT, POSITIVE = (
    rng.uniform(-7, 7, SIZE),
    rng.uniform(-1, 1, SIZE),
    rng.uniform(1e-3, 50, SIZE),
)


def fifth_power(x: float) -> float:
    """Return x to the power 5."""
    return pow_int(x, 5)


def fifth_power_of_libm(x: float) -> float:
    """Return x to the power 5."""
    return math.pow(x, 5.0)


def fifth_power_of_numpy(x: Any, out: Any) -> Any:
    """Return x to the power 5."""
    return np.power(x, 5.0, out=out)


CASES: dict[str, tuple[Any, Any, Any, Any]] = {
    "sin": (sin, math.sin, np.sin, ANGLES),
    "cos": (cos, math.cos, np.cos, ANGLES),
    "asin": (asin, math.asin, np.arcsin, UNIT),
    "acos": (acos, math.acos, np.arccos, UNIT),
    "log": (log, math.log, np.log, POSITIVE),
    "exp": (exp, math.exp, np.exp, ANGLES),
    "pow5": (
        numba.njit(fifth_power),
        numba.njit(fifth_power_of_libm),
        fifth_power_of_numpy,
        ANGLES,
    ),
}


def compiled_loop(function: Callable[[float], float]) -> Callable[..., None]:
    """Return an innermost loop over the function."""

    @numba.njit(error_model="numpy")
    def loop(x: Any, out: Any) -> None:
        for i in range(x.size):
            out[i] = function(x[i])

    return loop


@pytest.mark.parametrize("source", ["ours", "libm", "numpy"])
@pytest.mark.parametrize("name", CASES)
def test_function_of_one_argument(benchmark: Any, name: str, source: str) -> None:
    ours, libm, of_numpy, x = CASES[name]
    out = np.empty(SIZE)
    run = of_numpy if source == "numpy" else compiled_loop(ours if source == "ours" else libm)
    run(x, out)
    benchmark.group = name
    benchmark(run, x, out)
    assert np.allclose(out, of_numpy(x, out=np.empty(SIZE)), rtol=1e-14)


@pytest.mark.parametrize("source", ["ours", "libm", "numpy"])
def test_atan2(benchmark: Any, source: str) -> None:
    inner = atan2 if source == "ours" else math.atan2

    @numba.njit(error_model="numpy")
    def loop(y: Any, x: Any, out: Any) -> None:
        for i in range(x.size):
            out[i] = inner(y[i], x[i])

    run = np.arctan2 if source == "numpy" else loop
    out = np.empty(SIZE)
    run(UNIT, ANGLES, out)
    benchmark.group = "atan2"
    benchmark(run, UNIT, ANGLES, out)
    assert np.allclose(out, np.arctan2(UNIT, ANGLES), rtol=1e-14)


def test_sincos(benchmark: Any) -> None:
    @numba.njit(error_model="numpy")
    def loop(x: Any, s: Any, c: Any) -> None:
        for i in range(x.size):
            s[i], c[i] = sincos(x[i])

    s, c = np.empty(SIZE), np.empty(SIZE)
    loop(ANGLES, s, c)
    benchmark.group = "sincos"
    benchmark(loop, ANGLES, s, c)
    assert np.allclose(s * s + c * c, 1.0, rtol=1e-14)


@pytest.mark.parametrize("size", [100, 10_000])
@pytest.mark.parametrize("source", ["ours", "numpy"])
def test_standard_normal(benchmark: Any, source: str, size: int) -> None:
    generator = np.random.default_rng(0)
    standard_normal(generator, 2)
    benchmark.group = f"normal {size}"
    draw = standard_normal if source == "ours" else np.random.Generator.standard_normal
    assert benchmark(draw, generator, size).shape == (size,)
