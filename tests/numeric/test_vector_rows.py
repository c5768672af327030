"""Rows and columns of vectors, beside numpy's."""

from typing import Any

import numpy as np
import pytest
from numba.core.errors import TypingError

from evoexp.numeric.compilation import kernel
from evoexp.numeric.vector_rows import (
    lane_numbers,
    load_each,
    load_pairs,
    load_quads,
    num_up_to,
    store_places,
    transposed,
)
from evoexp.numeric.vectors import LANES, load, store
from evoexp.records import FloatArray

U = np.uint64


@kernel
def transpose(square: FloatArray, out: FloatArray) -> None:
    vectors = (
        load(square, U(0)),
        load(square, U(8)),
        load(square, U(16)),
        load(square, U(24)),
        load(square, U(32)),
        load(square, U(40)),
        load(square, U(48)),
        load(square, U(56)),
    )
    rows = transposed(vectors)
    for k in range(LANES):
        store(out, U(k * LANES), rows[k])


@kernel
def each(array: FloatArray, places: Any, at: int, offset: int, out: FloatArray) -> None:
    store(out, U(0), load_each(array, places, U(at), U(offset)))


@kernel
def pairs(array: FloatArray, places: Any, at: int, offset: int, out: FloatArray) -> None:
    one, two = load_pairs(array, places, U(at), U(offset))
    store(out, U(0), one)
    store(out, U(8), two)


@kernel
def quads(array: FloatArray, places: Any, at: int, offset: int, out: FloatArray) -> None:
    one, two, three, four = load_quads(array, places, U(at), U(offset))
    store(out, U(0), one)
    store(out, U(8), two)
    store(out, U(16), three)
    store(out, U(24), four)


@kernel
def count_seven(
    array: FloatArray, places: Any, offset: int, limits: FloatArray, out: FloatArray
) -> None:
    store(out, U(0), num_up_to(array, places, U(0), U(offset), load(limits, U(0)), 7))
    store(out, U(8), num_up_to(array, places, U(0), U(offset), load(limits, U(0)), 8))


@kernel
def as_places(numbers: FloatArray, out: Any) -> None:
    store_places(out, U(3), load(numbers, U(0)) + lane_numbers())


def test_a_square_is_transposed() -> None:
    square, out = np.random.default_rng(0).random((LANES, LANES)), np.empty(LANES * LANES)
    transpose(square.ravel(), out)
    assert np.array_equal(out.reshape(LANES, LANES), square.T)


@pytest.mark.parametrize(("read", "width"), [(each, 1), (pairs, 2), (quads, 4)])
def test_columns_are_read_from_each_lanes_own_place(read: Any, width: int) -> None:
    rng = np.random.default_rng(1)
    array = rng.random(100)
    for at, offset in ((0, 0), (5, 17)):
        places = rng.integers(0, 70, 20).astype(np.uint64)
        out = np.empty(width * LANES)
        read(array, places, at, offset, out)
        begins = places[at : at + LANES].astype(int) + offset
        assert np.array_equal(out.reshape(width, LANES).T, [array[b : b + width] for b in begins])


def test_numbers_up_to_a_limit_are_counted() -> None:
    rng = np.random.default_rng(2)
    for k in range(200):
        array = rng.integers(0, 5, 60).astype(float)
        array[rng.integers(0, 60, 3)] = [np.nan, np.inf, -np.inf]
        limits = rng.integers(-1, 6, LANES).astype(float)
        limits[k % LANES] = (np.nan, np.inf)[k % 2]
        places, out = rng.integers(0, 40, LANES).astype(np.uint64), np.empty(2 * LANES)
        count_seven(array, places, 10, limits, out)
        for lane, begin in enumerate(places.astype(int) + 10):
            for num, found in ((7, out[lane]), (8, out[LANES + lane])):
                assert found == np.count_nonzero(array[begin + 8 - num : begin + 8] <= limits[lane])


def test_whole_numbers_become_places() -> None:
    numbers, out = np.array([0.0, 1.0, 5.0, 2.0**40, 7.0, 0.0, 3.0, 2.0]), np.zeros(12, np.uint64)
    as_places(numbers, out)
    assert list(out) == [0, 0, 0, *(numbers + np.arange(8)).astype(int), 0]


def test_the_number_that_is_counted_is_a_constant() -> None:
    @kernel
    def count_some(array: FloatArray, places: Any, num: int) -> Any:
        return num_up_to(array, places, U(0), U(0), load(array, U(0)), num)

    with pytest.raises(TypingError, match="constant"):
        count_some(np.zeros(8), np.zeros(8, np.uint64), 7)
