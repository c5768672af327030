"""Numbers of numpy's PCG64, many at once: the same bits in half the time.

A step of the generator must wait for the step before it. Here four steps are made side by side,
each four numbers ahead of its last one: s ← A⁴ s + (A³ + A² + A + 1) c (O'Neill 2014, PCG).

Where numpy's layout of a generator in memory is not the known one, numpy draws the numbers itself.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel

Word = np.uint64
Wide = tuple[np.uint64, np.uint64]  # 128 bits: the upper half and the lower

ROTATION = Word(58)  # of the upper half: so many bits above it tell by how much words are rotated
WORD_BITS, NONE, ONE = Word(64), Word(0), Word(1)
FRACTION = Word(11)  # bits that a uniform number leaves out
MULTIPLIER = Word(2549297995355413924), Word(4865540595714422341)
LANES = 4


def draw_uniforms(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Return the next uniform numbers in [0, 1), as `rng.random(count)` does."""
    return _drawn(rng, np.empty(count), _fill_uniforms, rng.random)


def draw_words(rng: np.random.Generator, count: int) -> NDArray[np.uint64]:
    """Return the next words of 64 random bits, as `rng.bit_generator.random_raw(count)` does."""
    raw: Any = rng.bit_generator.random_raw
    return _drawn(rng, np.empty(count, dtype=np.uint64), _fill_words, raw)


def _drawn(
    rng: np.random.Generator,
    out: NDArray[Any],
    fill: Callable[..., None],
    otherwise: Callable[[int], NDArray[Any]],
) -> NDArray[Any]:
    bits = rng.bit_generator
    if not isinstance(bits, np.random.PCG64) or not _layout_is_known():
        return otherwise(len(out))
    with bits.lock:
        fill(_state_of(bits), out)
    return out


def _state_of(bits: np.random.PCG64) -> NDArray[np.uint64]:
    """Return the state and the increment of a generator, lower halves first, in its own memory."""
    # struct {struct {uint128 state, increment} *words; int has_uint32; uint32 uinteger;}
    address = ctypes.c_void_p.from_address(bits.ctypes.state_address).value or 0
    words: Any = (ctypes.c_uint64 * 4).from_address(address)
    return np.asarray(words)


@cache
def _layout_is_known() -> bool:
    """Whether the memory of a PCG64 shows its state and increment where they are expected."""
    if np.__version__.split(".")[0] != "2":
        return False
    probe = np.random.PCG64(0)
    words = {"state": 0x0123456789ABCDEF1032547698BADCFE, "inc": 0x1112131415161718191A1B1C1D1E1F21}
    state: Any = {"bit_generator": "PCG64", "state": words, "has_uint32": 0, "uinteger": 0}
    probe.state = state
    found = [int(word) for word in _state_of(probe)]
    return found == [
        half for name in ("state", "inc") for half in (words[name] % 2**64, words[name] >> 64)
    ]


@kernel
def _fill_uniforms(state: NDArray[np.uint64], out: NDArray[np.float64]) -> None:
    """Write the next uniform numbers; the state becomes the one behind them."""
    state, out = borrowed((state, out))
    increment = (state[3], state[2])
    leap, shift = _leap(increment)
    one = _after((state[1], state[0]), MULTIPLIER, increment)
    two = _after(one, MULTIPLIER, increment)
    three = _after(two, MULTIPLIER, increment)
    four = _after(three, MULTIPLIER, increment)
    whole = len(out) - len(out) % LANES
    for k in range(0, whole, LANES):
        out[k], out[k + 1] = _uniform(_word(one)), _uniform(_word(two))
        out[k + 2], out[k + 3] = _uniform(_word(three)), _uniform(_word(four))
        state[1], state[0] = four
        one, two = _after(one, leap, shift), _after(two, leap, shift)
        three, four = _after(three, leap, shift), _after(four, leap, shift)
    for k in range(whole, len(out)):
        out[k] = _uniform(_next_word(state))


@kernel
def _fill_words(state: NDArray[np.uint64], out: NDArray[np.uint64]) -> None:
    """Write the next words; the state becomes the one behind them."""
    state, out = borrowed((state, out))
    increment = (state[3], state[2])
    leap, shift = _leap(increment)
    one = _after((state[1], state[0]), MULTIPLIER, increment)
    two = _after(one, MULTIPLIER, increment)
    three = _after(two, MULTIPLIER, increment)
    four = _after(three, MULTIPLIER, increment)
    whole = len(out) - len(out) % LANES
    for k in range(0, whole, LANES):
        out[k], out[k + 1], out[k + 2], out[k + 3] = (
            _word(one),
            _word(two),
            _word(three),
            _word(four),
        )
        state[1], state[0] = four
        one, two = _after(one, leap, shift), _after(two, leap, shift)
        three, four = _after(three, leap, shift), _after(four, leap, shift)
    for k in range(whole, len(out)):
        out[k] = _next_word(state)


@inlined
def _next_word(state: NDArray[np.uint64]) -> Word:
    """Make a step and return its word."""
    state[1], state[0] = _after((state[1], state[0]), MULTIPLIER, (state[3], state[2]))
    return _word((state[1], state[0]))


@inlined
def _leap(increment: Wide) -> tuple[Wide, Wide]:
    """Return the multiplier and the increment of `LANES` steps at once."""
    multiplier, shift = MULTIPLIER, increment
    for _ in range(LANES - 1):
        multiplier = _after(multiplier, MULTIPLIER, (NONE, NONE))
        shift = _after(shift, MULTIPLIER, increment)
    return multiplier, shift


@inlined
def _word(state: Wide) -> Word:
    """Return the word of a state: both halves together, rotated (XSL RR)."""
    high, low = state
    mixed, rotated = high ^ low, high >> ROTATION
    return mixed >> rotated | mixed << (WORD_BITS - rotated & WORD_BITS - ONE)


@inlined
def _uniform(word: Word) -> float:
    """Return a word as a number in [0, 1)."""
    return np.int64(word >> FRACTION) * 2.0**-53


def _multiply_and_add(typing_context: Any, state: Any, factor: Any, term: Any) -> Any:
    wide, half = ir.IntType(128), ir.IntType(64)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def joined(pair: Any) -> Any:
            high, low = (builder.zext(builder.extract_value(pair, k), wide) for k in (0, 1))
            return builder.or_(builder.shl(high, ir.Constant(wide, 64)), low)

        value, by, plus = map(joined, arguments)
        found = builder.add(builder.mul(value, by), plus)
        high = builder.trunc(builder.lshr(found, ir.Constant(wide, 64)), half)
        return context.make_tuple(builder, pair, (high, builder.trunc(found, half)))

    pair = types.UniTuple(types.uint64, 2)
    return pair(pair, pair, pair), generate


_after: Callable[[Wide, Wide, Wide], Wide] = cast(Any, intrinsic(_multiply_and_add))
"""Return state × multiplier + increment, each of 128 bits."""
