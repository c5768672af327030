"""The state of a numpy PCG64 as bytes, as the digests of replicates take it."""

from collections.abc import Iterable
from typing import Any

import numpy as np

STATE_SIZE = 16  # [B] of `state_bytes`: those of the state itself, which come first


def state_bytes(bit_generator: Any) -> bytes:
    """Return the state of a PCG64: state (16), increment (16), has_uint32 (4), uinteger (4) bytes.

    All are little-endian. TypeError: the generator is no PCG64.
    """
    if not isinstance(bit_generator, np.random.PCG64):
        raise TypeError(f"rng: must be a PCG64, was a {type(bit_generator).__name__}")
    state: Any = bit_generator.state
    words = state["state"]
    half = state["has_uint32"] | state["uinteger"] << 32
    parts = (words["state"], 16), (words["inc"], 16), (half, 8)
    return b"".join(number.to_bytes(size, "little") for number, size in parts)


def states_behind(state: bytes, counts: Iterable[int]) -> list[bytes]:
    """Return the states (see `state_bytes`) behind steps that draw `counts` numbers each."""
    number, rest = state[:STATE_SIZE], state[STATE_SIZE:]
    words = [int.from_bytes(part, "little") for part in (number, rest[:STATE_SIZE])]
    generator = np.random.PCG64(0)
    named: Any = dict(zip(("state", "inc"), words, strict=True))
    generator.state = {"bit_generator": "PCG64", "state": named, "has_uint32": 0, "uinteger": 0}
    states = []
    for count in counts:
        generator.advance(int(count))
        states.append(state_bytes(generator)[:STATE_SIZE] + rest)
    return states
