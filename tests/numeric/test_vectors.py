"""Vectors of eight numbers: every lane has the bits of the same scalar operation."""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba.core.errors import TypingError

from evoexp.numeric.compilation import copy_part, kernel
from evoexp.numeric.elementary import sincos
from evoexp.numeric.vectors import (
    LANES,
    ceiling,
    load,
    lower,
    magnitude,
    root,
    select,
    spread,
    store,
    transposed,
    upper,
)
from evoexp.records import FloatArray

SPECIAL = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, 1.7976931348623157e308, 0.1]
Function = Callable[..., Any]
U = np.uint64


def some_pairs() -> tuple[FloatArray, FloatArray]:
    """Return pairs of numbers: special ones, equal ones, and random ones of all sizes."""
    rng = np.random.default_rng(0)
    special = [(a, b) for a in SPECIAL for b in SPECIAL if not np.isnan(a * b) or a is b]
    random = rng.normal(size=(400, 2)) * 10.0 ** rng.integers(-300, 300, (400, 2))
    pairs = np.concatenate([special, random, random[:, :1].repeat(2, axis=1)])
    first, second = pairs[: len(pairs) // LANES * LANES].T.copy()
    return first, second


X, Y = some_pairs()


def same(found: FloatArray, expected: FloatArray) -> bool:
    """Return whether all numbers have the same bits; one NaN is as good as another."""
    equal = found.view(np.int64) == (expected * 1.0).view(np.int64)
    return bool((equal | (np.isnan(found) & np.isnan(expected))).all())


def over_lanes(function: Function) -> Callable[..., FloatArray]:
    """Return a function of two arrays that calls a kernel's function vector by vector."""
    of_lanes = kernel(function)

    @kernel
    def run(x: FloatArray, y: FloatArray, out: FloatArray) -> None:
        for k in range(0, len(x), LANES):
            store(out, U(k), of_lanes(load(x, U(k)), load(y, U(k))))

    def over_arrays(x: FloatArray = X, y: FloatArray = Y) -> FloatArray:
        out = np.empty_like(x)
        run(x, y, out)
        return out

    return over_arrays


@kernel
def flag(condition: Any) -> Any:
    return select(condition, spread(1.0), spread(0.0))


# a comparison with NaN is false: the second of the choices, the first of lower and upper
CASES: dict[str, tuple[Function, Function]] = {  # of lanes, of numpy
    "root": (lambda a, b: root(a), lambda x, y: np.sqrt(x)),
    "magnitude": (lambda a, b: magnitude(a), lambda x, y: np.abs(x)),
    "ceiling": (lambda a, b: ceiling(a), lambda x, y: np.ceil(x)),
    "spread": (lambda a, b: spread(2.5), lambda x, y: np.full_like(x, 2.5)),
    "select": (lambda a, b: select(a < b, a, b), lambda x, y: np.where(x < y, x, y)),
    "lower": (lambda a, b: lower(a, b), lambda x, y: np.where(y < x, y, x)),
    "upper": (lambda a, b: upper(a, b), lambda x, y: np.where(x < y, y, x)),
    "or": (lambda a, b: flag((a < -1.0) | (b > 1.0)), lambda x, y: (x < -1.0) | (y > 1.0)),
    "and": (lambda a, b: flag((a > -1.0) & (b < 1.0)), lambda x, y: (x > -1.0) & (y < 1.0)),
}
BINARY = [operator.add, operator.sub, operator.mul, operator.truediv]
COMPARISONS = [operator.lt, operator.le, operator.gt, operator.ge, operator.eq]


@pytest.mark.parametrize(("of_lanes", "of_numpy"), CASES.values(), ids=CASES)
def test_functions_have_the_bits_of_scalars(of_lanes: Function, of_numpy: Function) -> None:
    with np.errstate(all="ignore"):
        assert same(over_lanes(of_lanes)(), of_numpy(X, Y))


@pytest.mark.parametrize("operation", BINARY)
def test_arithmetic_has_the_bits_of_scalars(operation: Function) -> None:
    with np.errstate(all="ignore"):
        assert same(over_lanes(lambda a, b: operation(a, b))(), operation(X, Y))
        assert same(over_lanes(lambda a, b: operation(0.5, a))(), operation(0.5, X))
        assert same(over_lanes(lambda a, b: operation(a, 3.0))(), operation(X, 3.0))


@pytest.mark.parametrize("comparison", COMPARISONS)
def test_comparisons_hold_as_those_of_scalars(comparison: Function) -> None:
    assert same(over_lanes(lambda a, b: flag(comparison(a, b)))(), comparison(X, Y))
    assert same(over_lanes(lambda a, b: flag(comparison(a, 0.0)))(), comparison(X, 0.0))


def test_neighbours_are_read_and_written_where_they_are_named() -> None:
    @kernel
    def shift(x: FloatArray, place: int, out: FloatArray, to: int) -> None:
        store(out, U(to), load(x, U(place)) + 0.0)

    x, out = np.arange(20.0), np.full(20, -1.0)
    shift(x, 3, out, 5)
    assert out.tolist() == [-1.0] * 5 + list(range(3, 11)) + [-1.0] * 7
    others: list[Any] = [np.zeros((8, 8)), np.zeros(16)[::2], np.zeros(8, dtype=int)]
    for array in others:
        with pytest.raises(TypingError, match="contiguous float64 of one dimension"):
            shift(array, 0, out, 0)


# Sines and cosines


def angles() -> FloatArray:
    octants, rng = np.arange(-400, 400) * (np.pi / 4.0), np.random.default_rng(0)
    every = np.concatenate([SPECIAL[:-2], octants, rng.uniform(-1e5, 1e5, 4000)])
    return every[: len(every) // LANES * LANES]


def test_sines_and_cosines_have_the_bits_of_scalars() -> None:
    @kernel
    def scalars(x: FloatArray, out: FloatArray) -> None:
        for k in range(len(x)):
            out[0, k], out[1, k] = sincos(x[k])

    x = angles()
    expected = np.empty((2, len(x)))
    scalars(x, expected)
    for row in (0, 1):
        assert same(over_lanes(lambda a, b, row=row: sincos(a)[row])(x, x), expected[row])


# Rows and columns, and parts of arrays


def test_a_square_is_transposed() -> None:
    @kernel
    def transpose(square: FloatArray, out: FloatArray) -> None:
        low = load(square, U(0)), load(square, U(8)), load(square, U(16)), load(square, U(24))
        high = load(square, U(32)), load(square, U(40)), load(square, U(48)), load(square, U(56))
        rows = transposed(low + high)
        for k in range(LANES):
            store(out, U(k * LANES), rows[k])

    square, out = np.random.default_rng(0).random((LANES, LANES)), np.empty(LANES * LANES)
    transpose(square.ravel(), out)
    assert np.array_equal(out.reshape(LANES, LANES), square.T)


@pytest.mark.parametrize("kind", [np.uint8, np.int32, np.int64, np.float64])
def test_parts_of_arrays_are_copied_and_nothing_else(kind: type) -> None:
    @kernel
    def copy(source: Any, first: int, out: Any, at: int, count: int) -> None:
        copy_part(source, first, out, at, count)

    rng = np.random.default_rng(1)
    for _ in range(200):
        source, out = rng.integers(0, 200, (2, 40)).astype(kind)
        first, at = rng.integers(0, 40, 2).tolist()
        count = int(rng.integers(0, 41 - max(first, at)))
        expected = out.copy()
        expected[at : at + count] = source[first : first + count]
        copy(source, first, out, at, count)
        np.testing.assert_array_equal(out, expected)
    whole, other = np.zeros((2, 8), kind), np.zeros(8, dtype=np.float32)
    for source, out in ((other, whole[0]), (whole[0, ::2], whole[1]), (whole[0], whole[:, 1])):
        with pytest.raises(TypingError):
            copy(source, 0, out, 0, 1)
