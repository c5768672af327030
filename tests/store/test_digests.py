"""The chain: what enters it, and that nothing else does."""

import struct
from typing import Any

import numpy as np
import pytest
import xxhash

from evoexp.numeric.generator_state import state_bytes
from evoexp.store.digests import Chain, array_bytes


def test_chain_is_the_documented_hash() -> None:
    bits = np.random.PCG64(3)
    rng = np.random.Generator(bits)
    costs, best, population = rng.random(5), rng.random(4), rng.random((5, 4))
    chain = Chain(rng)
    state = state_bytes(bits)
    first = xxhash.xxh3_128(costs.tobytes() + best.tobytes() + state).digest()
    given = array_bytes(costs), array_bytes(best)
    assert chain.extend(*given, chain.state()) == first.hex()
    rng.random()
    second = xxhash.xxh3_128(first + costs.tobytes() + best.tobytes() + state_bytes(bits)).digest()
    assert chain.extend(*given, chain.state()) == second.hex() != first.hex()
    assert chain.finish(population) == xxhash.xxh3_128_hexdigest(second + population.tobytes())


def test_state_bytes_follow_the_generator() -> None:
    bits = np.random.PCG64(3)
    rng = np.random.Generator(bits)
    halves = []
    for draw in (rng.random, lambda: rng.integers(5, dtype=np.uint32), lambda: bits.advance(2**80)):
        draw()
        state: Any = bits.state
        words = state["state"]["state"].to_bytes(16, "little") + state["state"]["inc"].to_bytes(
            16, "little"
        )
        expected = words + struct.pack("<II", state["has_uint32"], state["uinteger"])
        assert state_bytes(bits) == expected
        halves.append(state["has_uint32"])
    assert halves == [0, 1, 0]  # a draw of 32 bits keeps the other half, and advance drops it


def test_other_generators_are_refused() -> None:
    with pytest.raises(TypeError, match="PCG64.*MT19937"):
        Chain(np.random.Generator(np.random.MT19937(0)))


def test_every_nan_is_one_and_zeros_keep_their_sign() -> None:
    payloads = np.array(
        [0x7FF8000000000000, 0xFFF8000000000001, 0x7FF0000000000123], dtype=np.uint64
    )
    arrays = [np.array([1.0, np.inf, payload]) for payload in payloads.view(np.float64)]
    assert np.isnan([array[2] for array in arrays]).all()
    assert {array_bytes(array) for array in arrays} == {
        struct.pack("<ddQ", 1.0, np.inf, 0x7FF8000000000000)
    }
    assert array_bytes(np.array([-0.0])) != array_bytes(np.array([0.0]))


def test_layout_and_type_of_an_array_do_not_matter() -> None:
    matrix = np.arange(12.0).reshape(3, 4)
    assert array_bytes(np.asfortranarray(matrix)) == array_bytes(matrix) == matrix.tobytes()
    assert array_bytes(matrix.astype(np.float32)) == matrix.tobytes()
    assert array_bytes(np.array([1, 2], dtype=np.int16)) == struct.pack("<qq", 1, 2)
    assert array_bytes(np.empty(0)) == b""
