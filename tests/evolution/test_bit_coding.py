"""Strings of bits: their codes, crossover and mutation against the same done bit by bit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.evolution.bit_coding import cross_strings, decode_strings, flip_strings
from evoexp.numeric.random_stream import Draws

BITS = st.integers(1, 52)
GENES = 2


def rng(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def random_strings(seed: int, bits: int, count: int) -> np.ndarray:
    return rng(seed).integers(0, 2**bits, size=(GENES, count))


def bits_of(strings: np.ndarray, bits: int) -> np.ndarray:
    """(genes × bits, individuals): every string as it is printed."""
    return np.array(
        [[int(bit) for gene in column for bit in f"{gene:0{bits}b}"] for column in strings.T]
    ).T


@given(BITS, st.booleans(), st.integers(0, 2**32))
def test_numbers_are_decoded_as_the_code_says(bits: int, gray: bool, seed: int) -> None:
    numbers = random_strings(seed, bits, 5)
    numbers[:, 0], numbers[:, 1] = 0, 2**bits - 1
    limits, out = np.array([[-1.0, 2.0], [0.0, 3.0]]), np.full((GENES, 6), 9.0)
    strings = numbers ^ (numbers >> 1) if gray else numbers  # the reflected Gray code
    decode_strings(strings, bits, gray, limits, out)
    expected = limits[:, :1] + 3.0 * (numbers / (2.0**bits - 1.0))
    np.testing.assert_array_equal(out[:, :5], expected)
    np.testing.assert_array_equal(out[:, :2], limits)
    assert np.all(out[:, 5] == 9.0)


@given(BITS, st.floats(0.0, 1.0), st.integers(0, 2**32))
def test_crossing_exchanges_what_is_printed_behind_the_site(
    bits: int, rate: float, seed: int
) -> None:
    strings, parents = random_strings(seed, bits, 6), rng(seed + 1).integers(0, 6, size=7)
    uniforms, out = rng(seed + 2).random(6), np.full((GENES, 9), -1)
    cross_strings(uniforms, strings, bits, parents, rate, out)
    expected, last = bits_of(strings, bits)[:, parents], GENES * bits - 1
    for pair, (decision, place) in enumerate(uniforms.reshape(3, 2)):
        if decision < rate:
            site, both = 1 + int(place * last), [2 * pair, 2 * pair + 1]
            expected[site:, both] = expected[site:, both[::-1]]
    np.testing.assert_array_equal(bits_of(out[:, :7], bits), expected)
    assert np.all(out[:, 7:] == -1)


@given(BITS, st.floats(0.001, 1.0), st.integers(0, 2**32))
def test_flips_are_where_a_walk_with_geometric_steps_ends(
    bits: int, rate: float, seed: int
) -> None:
    strings, draws = random_strings(seed, bits, 5), Draws(4096)
    draws.extend(rng(seed))
    uniforms, taken = draws.block
    found = strings.copy()
    flip_strings(draws.block, found, bits, 4, rate)
    flipped = (bits_of(found, bits) != bits_of(strings, bits)).T.ravel()
    assert not flipped[GENES * bits * 4 :].any()
    places = np.flatnonzero(flipped)
    assert taken[0] == len(places) + 1, "a number per flipped bit, and the one that passes the end"
    staying = (
        np.diff(places, prepend=-1) - 1
    )  # the number u says k stay: (1 − p)^(k + 1) < 1 − u ≤ (1 − p)^k
    left = 1.0 - uniforms[: len(places)]
    with np.errstate(divide="ignore"):
        assert np.all(left <= (1.0 - rate) ** staying * (1.0 + 1e-12))
        assert np.all(left > (1.0 - rate) ** (staying + 1) * (1.0 - 1e-12))


@pytest.mark.parametrize(("rate", "share"), [(0.0, 0.0), (1.0, 1.0), (1e-300, 0.0)])
def test_never_and_always(rate: float, share: float) -> None:
    draws, strings = Draws(64), np.zeros((GENES, 3), dtype=np.int64)
    draws.extend(rng(1))
    flip_strings(draws.block, strings, 8, 3, rate)
    assert bits_of(strings, 8).mean() == share
