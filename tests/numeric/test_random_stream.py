"""Uniform numbers in blocks: the same numbers in the same order, wherever blocks end."""

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.numeric.generator_state import state_bytes, states_behind
from evoexp.numeric.random_stream import Block, Draws, draw, draw_index, draw_many, used_up


def rng() -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(3))


@given(st.integers(1, 9), st.lists(st.integers(1, 12), min_size=1, max_size=20))
def test_blocks_end_anywhere(least: int, wanted: list[int]) -> None:
    draws, source, found = Draws(least), rng(), []
    for count in wanted:
        while True:
            before = int(draws.block[1][0])
            numbers = [draw(draws.block), *draw_many(draws.block, count)]
            if not used_up(draws.block):
                break
            draws.block[1][0] = before
            draws.extend(source)
        found += numbers
    assert found == rng().random(len(found)).tolist()


def test_behind_its_end_a_block_gives_zeros_and_says_so() -> None:
    draws = Draws(2)
    assert not used_up(draws.block)
    assert draw(draws.block) == 0.0
    assert used_up(draws.block)
    draws.block[1][0] = 0
    draws.extend(rng())
    assert len(draw_many(draws.block, 3)) == 0
    assert used_up(draws.block)


def test_indices_stay_below_their_count() -> None:
    almost = np.nextafter(1.0, 0.0)
    block = Block(np.array([0.0, 0.5, almost, almost]), np.zeros(1, dtype=np.int64))
    assert [draw_index(block, count) for count in (3, 3, 3, 2**53)] == [0, 1, 2, 2**53 - 1]


@pytest.mark.parametrize("count", [0, 1, 7, 1000])
def test_states_behind_steps_are_those_that_drawing_leads_to(count: int) -> None:
    """With and without the other half of a number of which 32 bits were drawn."""
    generator = rng()
    for draw_before in (lambda: None, lambda: generator.integers(0, 10, dtype=np.uint32)):
        draw_before()
        for state in states_behind(state_bytes(generator.bit_generator), [count] * 5):
            generator.random(count)
            assert state_bytes(generator.bit_generator) == state


def test_state_bytes_follow_the_generator_which_is_a_pcg64() -> None:
    generator, halves = rng(), []
    bits: Any = generator.bit_generator
    for draw_some in (
        generator.random,
        lambda: generator.integers(5, dtype=np.uint32),
        lambda: bits.advance(2**80),
    ):
        draw_some()
        state = bits.state
        words = b"".join(state["state"][name].to_bytes(16, "little") for name in ("state", "inc"))
        assert state_bytes(bits) == words + struct.pack(
            "<II", state["has_uint32"], state["uinteger"]
        )
        halves.append(state["has_uint32"])
    assert halves == [0, 1, 0]  # a draw of 32 bits keeps the other half, and advance drops it
    with pytest.raises(TypeError, match="must be a PCG64, was a MT19937"):
        state_bytes(np.random.MT19937(0))
