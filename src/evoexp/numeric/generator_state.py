"""The state of a numpy PCG64 as bytes, as the digests of replicates take it."""

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np

MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645  # of a PCG64
STATE_SIZE = 16  # [B] of `state_bytes`: those of the state itself, which come first
_MASK = 2**128 - 1


def state_bytes(bit_generator: Any) -> bytes:
    """Return the state of a PCG64.

    State (16), increment (16), has_uint32 (4), uinteger (4), all little-endian.

    Raises:
        TypeError: If the generator is no PCG64.
    """
    demand_pcg64(bit_generator)
    state: Any = bit_generator.state
    words = state["state"]
    half = state["has_uint32"] | state["uinteger"] << 32
    return b"".join(
        (
            words["state"].to_bytes(16, "little"),
            words["inc"].to_bytes(16, "little"),
            half.to_bytes(8, "little"),
        )
    )


def states_behind(state: bytes, counts: Iterable[int]) -> list[bytes]:
    """Return the states behind some steps that draw numbers each.

    A step of many numbers is one multiplication and one addition, as each number is (Brown 1994).

    Args:
        state: Where the first step begins, see `state_bytes`.
        counts: Numbers that each step draws.
    """
    number, rest = int.from_bytes(state[:STATE_SIZE], "little"), state[STATE_SIZE:]
    increment = int.from_bytes(rest[:STATE_SIZE], "little")
    states = []
    for count in counts:
        factor, addend = _jump(count, increment)
        number = (number * factor + addend) & _MASK
        states.append(number.to_bytes(STATE_SIZE, "little") + rest)
    return states


@lru_cache(maxsize=64)
def _jump(count: int, increment: int) -> tuple[int, int]:
    """Return factor and addend of `count` steps of a PCG64 at once."""
    factor, addend, power, power_addend = 1, 0, MULTIPLIER, increment
    while count:
        if count & 1:
            factor, addend = factor * power & _MASK, (addend * power + power_addend) & _MASK
        power, power_addend = power * power & _MASK, power_addend * (power + 1) & _MASK
        count >>= 1
    return factor, addend


def demand_pcg64(bit_generator: Any) -> None:
    """Refuse other bit generators, whose states have other layouts.

    Raises:
        TypeError: If it is another one.
    """
    if not isinstance(bit_generator, np.random.PCG64):
        raise TypeError(f"rng: must be a PCG64, was a {type(bit_generator).__name__}")
