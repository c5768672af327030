"""Vectors of eight numbers: every lane has the bits of the same scalar operation."""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba.core.errors import TypingError

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import sincos
from evoexp.numeric.vectors import (
    LANES,
    any_lane,
    ceiling,
    load,
    lower,
    magnitude,
    root,
    select,
    spread,
    store,
    upper,
    whole,
)
from evoexp.records import FloatArray

SPECIAL = [0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, 1.7976931348623157e308, 0.1]
PAIRS = np.array([(a, b) for a in SPECIAL for b in SPECIAL if not np.isnan(a * b) or a is b])


def some_pairs() -> tuple[FloatArray, FloatArray]:
    """Return pairs of numbers: special ones, and random ones of all sizes."""
    rng = np.random.default_rng(0)
    random = rng.normal(size=(400, 2)) * 10.0 ** rng.integers(-300, 300, (400, 2))
    pairs = np.concatenate([PAIRS, random])
    pairs = pairs[: len(pairs) // LANES * LANES]
    return np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])


def same(found: FloatArray, expected: FloatArray) -> bool:
    """Return whether all numbers have the same bits; one NaN is as good as another."""
    equal = found.view(np.int64) == expected.view(np.int64)
    return bool((equal | (np.isnan(found) & np.isnan(expected))).all())


def over_lanes(function: Callable[..., Any]) -> Callable[..., FloatArray]:
    """Return a function of two arrays that calls a kernel's function vector by vector."""

    @kernel
    def run(x: FloatArray, y: FloatArray, out: FloatArray) -> None:
        for k in range(0, len(x), LANES):
            store(out, np.uint64(k), function(load(x, np.uint64(k)), load(y, np.uint64(k))))

    def over_arrays(x: FloatArray, y: FloatArray) -> FloatArray:
        out = np.empty_like(x)
        run(x, y, out)
        return out

    return over_arrays


@pytest.mark.parametrize("operation", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_arithmetic_has_the_bits_of_scalars(operation: Callable[..., Any]) -> None:
    x, y = some_pairs()
    with np.errstate(all="ignore"):
        expected = operation(x, y)
        half = operation(0.5, x)
        thrice = operation(x, 3.0)
    assert same(over_lanes(kernel(lambda a, b: operation(a, b)))(x, y), expected)
    assert same(over_lanes(kernel(lambda a, b: operation(0.5, a)))(x, y), half)
    assert same(over_lanes(kernel(lambda a, b: operation(a, 3.0)))(x, y), thrice)


def test_roots_magnitudes_and_choices() -> None:
    x, y = some_pairs()
    with np.errstate(invalid="ignore"):
        assert same(over_lanes(kernel(lambda a, b: root(a)))(x, y), np.sqrt(x))
    assert same(over_lanes(kernel(lambda a, b: magnitude(a)))(x, y), np.abs(x))
    assert same(over_lanes(kernel(lambda a, b: ceiling(a)))(x, y), np.ceil(x))
    assert same(over_lanes(kernel(lambda a, b: whole(a)))(x, y), np.rint(x))
    assert same(over_lanes(kernel(lambda a, b: spread(2.5)))(x, y), np.full_like(x, 2.5))
    # a comparison with NaN is false: the second of the choices, the first of lower and upper
    assert same(over_lanes(kernel(lambda a, b: select(a < b, a, b)))(x, y), np.where(x < y, x, y))
    assert same(over_lanes(kernel(lambda a, b: select(a > b, a, b)))(x, y), np.where(x > y, x, y))
    assert same(over_lanes(kernel(lambda a, b: select(a == b, a, b)))(x, y), np.where(x == y, x, y))
    assert same(over_lanes(lower)(x, y), np.where(y < x, y, x))
    assert same(over_lanes(upper)(x, y), np.where(x < y, y, x))


def test_a_condition_holds_in_any_lane() -> None:
    @kernel
    def any_below(x: FloatArray, limit: float) -> bool:
        return any_lane(load(x, np.uint64(0)) < limit)

    for lane in range(LANES):
        x = np.ones(LANES)
        x[lane] = -1.0
        assert any_below(x, 0.0)
        assert not any_below(x, -1.0)
    assert not any_below(np.full(LANES, np.nan), np.inf)


def test_conditions_hold_together_in_the_lanes_of_both() -> None:
    @kernel
    def between(x: FloatArray, low: float, high: float) -> bool:
        one = load(x, np.uint64(0))
        return any_lane((one > low) & (one < high))

    @kernel
    def below_if(x: FloatArray, high: float, asked: bool) -> bool:
        return any_lane((load(x, np.uint64(0)) < high) & asked)

    x = np.arange(LANES, dtype=np.float64)
    assert between(x, 1.5, 4.5)
    assert not between(x, 4.5, 1.5)
    assert below_if(x, 3.0, True)
    assert not below_if(x, 3.0, False)


COMPARISONS = [operator.lt, operator.le, operator.gt, operator.ge, operator.eq]


@pytest.mark.parametrize("comparison", COMPARISONS)
def test_comparisons_hold_as_those_of_scalars(comparison: Callable[..., Any]) -> None:
    x, y = some_pairs()
    x = np.where(np.arange(len(x)) % 3 == 0, y, x)
    holds = over_lanes(kernel(lambda a, b: select(comparison(a, b), spread(1.0), spread(0.0))))
    assert same(holds(x, y), comparison(x, y) * 1.0)
    positive = over_lanes(kernel(lambda a, b: select(comparison(a, 0.0), spread(1.0), spread(0.0))))
    assert same(positive(x, y), comparison(x, 0.0) * 1.0)


def test_one_of_two_conditions_is_enough() -> None:
    x, y = some_pairs()

    @kernel
    def outside(a: Any, b: Any) -> Any:
        return select((a < -1.0) | (b > 1.0), spread(1.0), spread(0.0))

    assert same(over_lanes(outside)(x, y), ((x < -1.0) | (y > 1.0)) * 1.0)


def test_sines_and_cosines_have_the_bits_of_scalars() -> None:
    angles = np.concatenate(
        [
            SPECIAL[:-2],
            np.arange(-400, 400) * (np.pi / 4.0),
            np.random.default_rng(0).uniform(-1e5, 1e5, 4000),
        ]
    )
    angles = angles[: len(angles) // LANES * LANES]

    @kernel
    def scalars(x: FloatArray, out: FloatArray) -> None:
        for k in range(len(x)):
            out[0, k], out[1, k] = sincos(x[k])

    expected = np.empty((2, len(angles)))
    scalars(angles, expected)
    for row in range(2):
        found = over_lanes(kernel(lambda a, b, row=row: sincos(a)[row]))(angles, angles)
        assert same(found, expected[row])


def test_neighbours_are_read_and_written_where_they_are_named() -> None:
    @kernel
    def shift(x: FloatArray, place: int, out: FloatArray, to: int) -> None:
        store(out, np.uint64(to), load(x, np.uint64(place)) + 0.0)

    x, out = np.arange(20.0), np.full(20, -1.0)
    shift(x, 3, out, 5)
    assert out.tolist() == [-1.0] * 5 + list(range(3, 11)) + [-1.0] * 7


def test_other_arrays_are_refused() -> None:
    @kernel
    def first(x: Any) -> bool:
        return any_lane(load(x, np.uint64(0)) < 0.0)

    others: list[Any] = [np.zeros((8, 8)), np.zeros(16)[::2], np.zeros(8, dtype=int)]
    for array in others:
        with pytest.raises(TypingError, match="contiguous float64 of one dimension"):
            first(array)


def test_any_lane_is_seen() -> None:
    @kernel
    def run(x: FloatArray, limit: float) -> bool:
        return any_lane(load(x, np.uint64(0)) < limit)

    rng = np.random.default_rng(3)
    for x in (*rng.normal(size=(50, LANES)), np.full(LANES, np.inf), *(np.eye(LANES) * -1.0)):
        assert run(np.ascontiguousarray(x), -0.1) == (x < -0.1).any()
