"""The chain of digests, which tells from which generation on two runs differ."""

import ctypes
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np
import xxhash
from numpy.typing import NDArray


class Chain:
    """xxh3-128 chain over a replicate: link_g = xxh3_128(link_{g-1} ‖ costs ‖ best ‖ state).

    The generator is only read, never drawn from.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        """Start a chain, its link being empty.

        Args:
            rng: The replicate's generator; its bit generator must be a PCG64.

        Raises:
            TypeError: Another bit generator: its state has another layout.
        """
        if not isinstance(rng.bit_generator, np.random.PCG64):
            raise TypeError(f"rng: must be a PCG64, was a {type(rng.bit_generator).__name__}")
        self._state = state_reader(rng.bit_generator)
        self.link = b""

    def state(self) -> bytes:
        """Return the state of the generator now, for `extend`."""
        return self._state()

    def extend(
        self, costs: Iterable[bytes], best: Iterable[bytes], states: Iterable[bytes]
    ) -> list[str]:
        """Append generations and return their links in hex.

        Args:
            costs: `array_bytes` of the costs of each generation.
            best: `array_bytes` of the best solution until each of them.
            states: What `state` returned at each of them.
        """
        link, links, digest, join = self.link, [], xxhash.xxh3_128_digest, b"".join
        for parts in zip(costs, best, states, strict=True):
            link = digest(join((link, *parts)))
            links.append(link.hex())
        self.link = link
        return links

    def finish(self, population: NDArray[Any]) -> str:
        """Return the replicate's digest, xxh3_128(last link ‖ population), as 32 hex digits."""
        digest = xxhash.xxh3_128(self.link)
        digest.update(array_bytes(population))
        return digest.hexdigest()


def array_bytes(array: NDArray[Any]) -> bytes:
    """Return an array's values as bytes: C order, float64 or int64, little-endian.

    Every NaN becomes the one positive quiet NaN, because neither IEEE 754 nor LLVM says which
    payload an operation yields. The sign of a zero is specified, so -0.0 stays distinct from 0.0.
    """
    if array.dtype.char != "d":
        array = array.astype(np.float64 if array.dtype.kind == "f" else np.int64)
    # argmin finds the first NaN, if there is one, five times faster than np.isnan(...).any().
    if array.size and array.dtype.char == "d" and (least := array.item(array.argmin())) != least:
        array = np.where(np.isnan(array), np.nan, array)
    return array.tobytes()


def any_nan(arrays: Iterable[bytes]) -> bool:
    """Return whether float64 arrays, given as bytes, hold any NaN."""
    return bool(np.isnan(np.frombuffer(b"".join(arrays))).any())


def state_bytes(bit_generator: np.random.PCG64) -> bytes:
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


def state_reader(bit_generator: np.random.PCG64) -> Callable[[], bytes]:
    """Return a function that gives `state_bytes` of this generator.

    Where numpy's layout is known, it takes a tenth of the time.

    numpy publishes the address of the state but not its layout, so the layout is tried on a
    generator of our own first.
    """
    return _read_memory(bit_generator) if _layout_is_known() else lambda: state_bytes(bit_generator)


def _read_memory(bit_generator: np.random.PCG64) -> Callable[[], bytes]:
    # struct {struct {uint128 state, increment} *words; int has_uint32; uint32 uinteger;}
    address: int = bit_generator.ctypes.state_address
    words = memoryview(
        (ctypes.c_uint8 * 32).from_address(ctypes.c_void_p.from_address(address).value or 0)
    )
    half = memoryview((ctypes.c_uint8 * 8).from_address(address + ctypes.sizeof(ctypes.c_void_p)))

    def read(owner: np.random.PCG64 = bit_generator) -> bytes:  # the owner keeps the memory alive
        return b"".join((words, half))

    return read


@cache
def _layout_is_known() -> bool:
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
