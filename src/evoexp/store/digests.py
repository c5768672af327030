"""The chain of digests, which tells from which generation on two runs differ; that of a log."""

import struct
from typing import Any

import numpy as np
import xxhash
from numpy.typing import NDArray

from evoexp.numeric.generator_state import state_bytes

_MESSAGE = struct.Struct("<QIQ")  # log_time, sequence, bytes of data


class Chain:
    """xxh3-128 chain over a replicate: link_g = xxh3_128(link_{g-1} ‖ costs ‖ best ‖ state)."""

    def __init__(self, rng: "np.random.Generator") -> None:
        """Start a chain, its link being empty; TypeError: the generator is no PCG64."""
        self._rng, self.link = rng, b""
        self.state()

    def state(self) -> bytes:
        """Return the state of the generator now."""
        return state_bytes(self._rng.bit_generator)

    def extend(self, costs: bytes, best: bytes, state: bytes) -> str:
        """Append a generation, costs and best by `array_bytes`; return its link in hex."""
        self.link = xxhash.xxh3_128_digest(b"".join((self.link, costs, best, state)))
        return self.link.hex()

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


def message_bytes(
    channel: tuple[str, str, str], log_time: int, sequence: int, data: bytes
) -> bytes:
    """Return a message as the content digest takes it: its channel, time, sequence and data.

    The channel is told by topic, schema's name, and message encoding; the digest is xxh3-128.
    """
    head = "\0".join((*channel, "")).encode()
    return head + _MESSAGE.pack(log_time, sequence, len(data)) + data
