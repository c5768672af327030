"""numpy's PCG64 in kernels: its numbers, to the last bit, in half the time.

The generator (O'Neill 2014, PCG XSL RR 128/64) multiplies a state of 128 bits and adds an
increment; a number is made of the halves of the state. Here four states that are four steps apart
go on at once, because a multiplication takes longer than the next one has to wait for it; the
numbers are then made of many states at once, in vectors.

A kernel takes a generator as `words`: high and low half of the state, of the increment.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numpy.typing import NDArray

from evoexp.numeric.compilation import inlined, intrinsic, kernel
from evoexp.numeric.elementary import scale_to_normal
from evoexp.numeric.generator_state import MULTIPLIER, demand_pcg64

Words = NDArray[np.uint64]

_HALF = 2**64
HIGH_FACTOR, LOW_FACTOR = np.uint64(MULTIPLIER // _HALF), np.uint64(MULTIPLIER % _HALF)
_BLOCK = 64  # states of which numbers are made at once
_STREAMS = 4
_INT64, _INT128, _DOUBLE = ir.IntType(64), ir.IntType(128), ir.DoubleType()


class Twin:
    """A generator's twin, of which kernels draw numbers ahead; the generator follows.

    Attributes:
        words: The twin, as kernels take it.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        """Begin where a generator is.

        Args:
            rng: The generator; its bit generator must be a PCG64.

        Raises:
            TypeError: Another bit generator.
        """
        demand_pcg64(rng.bit_generator)
        self._bits, self.words = rng.bit_generator, np.empty(4, dtype=np.uint64)
        self.meet()

    def meet(self) -> None:
        """Go where the generator is."""
        words: Any = self._bits.state["state"]
        state, increment = words["state"], words["inc"]
        self.words[:] = state // _HALF, state % _HALF, increment // _HALF, increment % _HALF

    def follow(self, state: Words) -> None:
        """Let the generator go to a state: high and low half."""
        high, low = state.tolist()
        whole: Any = self._bits.state
        whole["state"]["state"] = high * _HALF + low
        self._bits.state = whole


def _joined(builder: Any, high: Any, low: Any) -> Any:
    """Return a number of 128 bits from its halves."""
    shifted = builder.shl(builder.zext(high, _INT128), ir.Constant(_INT128, 64))
    return builder.or_(shifted, builder.zext(low, _INT128))


@intrinsic
def _step(
    typing_context: Any,
    high: Any,
    low: Any,
    factor_high: Any,
    factor_low: Any,
    addend_high: Any,
    addend_low: Any,
) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        state, factor, addend = (_joined(builder, *arguments[k : k + 2]) for k in (0, 2, 4))
        found = builder.add(builder.mul(state, factor), addend)
        shifted = builder.lshr(found, ir.Constant(_INT128, 64))
        halves = [builder.trunc(part, _INT64) for part in (shifted, found)]
        return context.make_tuple(builder, signature.return_type, halves)

    return types.UniTuple(types.uint64, 2)(*[types.uint64] * 6), generate


@intrinsic
def _make_word(typing_context: Any, high: Any, low: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        high, low = arguments
        mixed, places = builder.xor(high, low), builder.lshr(high, ir.Constant(_INT64, 58))
        kind = ir.FunctionType(_INT64, [_INT64] * 3)
        turn = builder.module.declare_intrinsic("llvm.fshr", [_INT64], kind)
        return builder.call(turn, [mixed, mixed, places])

    return types.uint64(types.uint64, types.uint64), generate


step_state: Callable[..., tuple[np.uint64, np.uint64]] = _step
"""Return state · factor + addend, modulo 2^128; all of them are given in halves."""

word_of_state: Callable[[np.uint64, np.uint64], np.uint64] = _make_word
"""Return the word of a state: exclusive or of its halves, rotated."""


@inlined
def _number(word: np.uint64) -> float:
    """Return a word as a number in [0, 1), of which 53 bits are kept."""
    return np.int64(word >> np.uint64(11)) * 2.0**-53


@kernel
def fill_uniforms(words: Words, out: NDArray[np.float64]) -> None:
    """Fill out (n,) with uniform numbers in [0, 1), as `Generator.random` does.

    Args:
        words: The generator, which goes on by n steps.
        out: Written.
    """
    bits = out.view(np.uint64)
    fill_words(words, bits)
    for k in range(len(out)):
        out[k] = _number(bits[k])


@kernel
def fill_words(words: Words, out: Words) -> None:
    """Fill out (n,) with words of 64 random bits, as `BitGenerator.random_raw` does.

    Args:
        words: The generator, which goes on by n steps.
        out: Written.
    """
    high, low, add_high, add_low = words[0], words[1], words[2], words[3]
    num_blocks, none = len(out) // _BLOCK, np.uint64(0)
    # factor and addend of four steps at once: those of two, twice
    far_high, far_low, far_add_high, far_add_low = HIGH_FACTOR, LOW_FACTOR, add_high, add_low
    for _ in range(2):
        far_add_high, far_add_low = step_state(
            far_add_high, far_add_low, far_high, far_low, far_add_high, far_add_low
        )
        far_high, far_low = step_state(far_high, far_low, far_high, far_low, none, none)
    # the next four states
    a_high, a_low = step_state(high, low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
    b_high, b_low = step_state(a_high, a_low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
    c_high, c_low = step_state(b_high, b_low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
    d_high, d_low = step_state(c_high, c_low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
    highs, lows = np.empty(_BLOCK, dtype=np.uint64), np.empty(_BLOCK, dtype=np.uint64)
    for block in range(num_blocks):
        # states of a block
        for k in range(0, _BLOCK, _STREAMS):
            at = np.uint64(k)
            highs[at], lows[at] = a_high, a_low
            highs[at + np.uint64(1)], lows[at + np.uint64(1)] = b_high, b_low
            highs[at + np.uint64(2)], lows[at + np.uint64(2)] = c_high, c_low
            highs[at + np.uint64(3)], lows[at + np.uint64(3)] = d_high, d_low
            high, low = d_high, d_low
            a_high, a_low = step_state(a_high, a_low, far_high, far_low, far_add_high, far_add_low)
            b_high, b_low = step_state(b_high, b_low, far_high, far_low, far_add_high, far_add_low)
            c_high, c_low = step_state(c_high, c_low, far_high, far_low, far_add_high, far_add_low)
            d_high, d_low = step_state(d_high, d_low, far_high, far_low, far_add_high, far_add_low)
        # their words
        for k in range(_BLOCK):
            out[block * _BLOCK + k] = word_of_state(highs[k], lows[k])
    # the rest, one by one
    for k in range(num_blocks * _BLOCK, len(out)):
        high, low = step_state(high, low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
        out[k] = word_of_state(high, low)
    words[0], words[1] = high, low


@kernel
def fill_normals(words: Words, out: NDArray[np.float64]) -> None:
    """Fill out (n,) with standard normal deviates, as `elementary.standard_normal` does.

    Args:
        words: The generator, which goes on by as many steps as attempts take.
        out: Written.
    """
    high, low, add_high, add_low = words[0], words[1], words[2], words[3]
    num_pairs = (out.size + 1) // 2
    pairs, squares, i = np.empty(2 * num_pairs), np.empty(num_pairs), 0
    while i < num_pairs:
        high, low = step_state(high, low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
        u = 2.0 * _number(word_of_state(high, low)) - 1.0
        high, low = step_state(high, low, HIGH_FACTOR, LOW_FACTOR, add_high, add_low)
        v = 2.0 * _number(word_of_state(high, low)) - 1.0
        pairs[2 * i], pairs[2 * i + 1], squares[i] = u, v, u * u + v * v
        i += 1 if 0.0 < squares[i] < 1.0 else 0
    scale_to_normal(pairs, squares, out)
    words[0], words[1] = high, low
