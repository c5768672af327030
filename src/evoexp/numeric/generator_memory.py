"""The memory of numpy's PCG64: its state, read and written where it stands.

numpy publishes the address of the state but not its layout, so the layout is tried on a generator
of our own first.
"""

import ctypes
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645  # of a PCG64
STATE_SIZE = 16  # [B] of `state_bytes`: those of the state itself, which come first
_MASK = 2**128 - 1


def state_bytes(bit_generator: "np.random.PCG64") -> bytes:
    """Return the state of a PCG64.

    State (16), increment (16), has_uint32 (4), uinteger (4), all little-endian.
    """
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


def states_behind(bit_generator: Any, count: int, steps: int) -> list[bytes]:
    """Return the states behind some steps that take so many numbers each; see `state_bytes`.

    The generator stays where it is. A step of many numbers is one multiplication and one addition,
    as each number is (Brown 1994).

    Raises:
        TypeError: If the generator is no PCG64.
    """
    content = state_reader(bit_generator)()
    first, rest = content[:STATE_SIZE], content[STATE_SIZE:]
    state, increment = (int.from_bytes(each[:STATE_SIZE], "little") for each in (first, rest))
    factor, addend = _jump(count, increment)
    found = []
    for _ in range(steps):
        state = (state * factor + addend) & _MASK
        found.append(state.to_bytes(STATE_SIZE, "little") + rest)
    return found


@lru_cache(maxsize=8)
def _jump(count: int, increment: int) -> tuple[int, int]:
    """Return factor and addend of `count` steps of a PCG64 at once."""
    factor, addend, power, power_addend = 1, 0, MULTIPLIER, increment
    while count:
        if count & 1:
            factor, addend = factor * power & _MASK, (addend * power + power_addend) & _MASK
        power, power_addend = power * power & _MASK, power_addend * (power + 1) & _MASK
        count >>= 1
    return factor, addend


def state_reader(bit_generator: Any) -> Callable[[], bytes]:
    """Return a function that gives `state_bytes` of this generator.

    Where numpy's layout is known, it takes a tenth of the time.

    Raises:
        TypeError: If the generator is no PCG64.
    """
    demand_pcg64(bit_generator)
    return _read_memory(bit_generator) if layout_is_known() else lambda: state_bytes(bit_generator)


def demand_pcg64(bit_generator: Any) -> None:
    """Refuse other bit generators, whose states have other layouts.

    Raises:
        TypeError: If it is another one.
    """
    if not isinstance(bit_generator, np.random.PCG64):
        raise TypeError(f"rng: must be a PCG64, was a {type(bit_generator).__name__}")


@lru_cache(maxsize=32)
def words_of(bit_generator: "np.random.PCG64") -> NDArray[np.uint64]:
    """Return state and increment of a generator, lower halves first, in its own memory.

    Only where the layout is known. Finding it takes as long as some hundred numbers, so it is kept,
    and the generator with it.
    """
    words: Any = (ctypes.c_uint64 * 4).from_address(_address_of_words(bit_generator))
    return np.asarray(words)


def _address_of_words(bit_generator: "np.random.PCG64") -> int:
    # struct {struct {uint128 state, increment} *words; int has_uint32; uint32 uinteger;}
    return ctypes.c_void_p.from_address(bit_generator.ctypes.state_address).value or 0


def _read_memory(bit_generator: "np.random.PCG64") -> Callable[[], bytes]:
    address: int = bit_generator.ctypes.state_address
    words = memoryview((ctypes.c_uint8 * 32).from_address(_address_of_words(bit_generator)))
    half = memoryview((ctypes.c_uint8 * 8).from_address(address + ctypes.sizeof(ctypes.c_void_p)))

    def read(owner: Any = bit_generator) -> bytes:  # the owner keeps the memory alive
        return b"".join((words, half))

    return read


@cache
def layout_is_known() -> bool:
    """Whether the memory of a PCG64 shows its state before and after a change, in every word."""
    if np.__version__.split(".")[0] != "2":
        return False
    probe = np.random.PCG64(0)
    read = _read_memory(probe)
    agree = read() == state_bytes(probe)
    words = {"state": 0x0123456789ABCDEF1032547698BADCFE, "inc": 0x1112131415161718191A1B1C1D1E1F21}
    state: Any = {"bit_generator": "PCG64", "state": words, "has_uint32": 1, "uinteger": 0xDEADBEEF}
    probe.state = state
    return agree and read() == state_bytes(probe)
