"""Sines and cosines of quarter turns against 80-bit arithmetic, and lane by lane."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.quarter_turns import QUARTER_TURN, sincos_of_turn
from evoexp.numeric.vectors import LANES, load, store
from evoexp.records import FloatArray


@kernel
def eight_by_eight(t: FloatArray, s: FloatArray, c: FloatArray) -> None:
    for k in range(0, len(t), LANES):
        sine, cosine = sincos_of_turn(load(t, np.uint64(k)))
        store(s, np.uint64(k), sine)
        store(c, np.uint64(k), cosine)


@kernel
def one_by_one(t: FloatArray, s: FloatArray, c: FloatArray) -> None:
    for k in range(len(t)):
        s[k], c[k] = sincos_of_turn(t[k])


def angles() -> FloatArray:
    rng = np.random.default_rng(0)
    some = [rng.uniform(-2.0, 2.0, 20_000), rng.uniform(-1e3, 1e3, 20_000), np.arange(-50.0, 50.0)]
    near = np.arange(-50.0, 50.0) + 0.5  # where the quarter changes
    return np.concatenate([*some, near, np.nextafter(near, 0.0)])[: 40_300 // LANES * LANES]


def test_errors_stay_below_the_bound() -> None:
    t = angles()
    s, c = np.empty_like(t), np.empty_like(t)
    eight_by_eight(t, s, c)
    # a whole number of turns taken off, without rounding
    rest = (t - 4.0 * np.floor(t / 4.0)).astype(np.longdouble) * np.arccos(np.longdouble(0.0))
    assert float(np.abs(s - np.sin(rest)).max()) < 1e-14
    assert float(np.abs(c - np.cos(rest)).max()) < 1e-14
    assert float(np.abs(s * s + c * c - 1.0).max()) > 1e-15  # it is the quick one
    assert np.float64(np.arccos(np.longdouble(0.0))) == QUARTER_TURN


def test_whole_quarters_are_exact_but_for_the_sign_of_zero() -> None:
    t = np.arange(-16.0, 16.0)
    s, c = np.empty_like(t), np.empty_like(t)
    eight_by_eight(t, s, c)
    assert np.array_equal(s, np.array([0.0, 1.0, 0.0, -1.0] * 8))
    assert np.array_equal(c, np.array([1.0, 0.0, -1.0, 0.0] * 8))


def test_lanes_have_the_bits_of_scalars() -> None:
    t = angles()
    of_lanes, of_scalars = np.empty((2, len(t))), np.empty((2, len(t)))
    eight_by_eight(t, *of_lanes)
    one_by_one(t, *of_scalars)
    assert of_lanes.tobytes() == of_scalars.tobytes()
