"""Uniform numbers in blocks: the same numbers in the same order, wherever blocks end."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.numeric.generator_state import state_bytes, states_behind
from evoexp.numeric.random_stream import (
    Block,
    DrawnAhead,
    Draws,
    draw,
    draw_index,
    draw_many,
    used_up,
)


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
    block = Block(
        np.array([0.0, 0.5, np.nextafter(1.0, 0.0), np.nextafter(1.0, 0.0)]),
        np.zeros(1, dtype=np.int64),
    )
    assert [draw_index(block, count) for count in (3, 3, 3, 2**53)] == [0, 1, 2, 2**53 - 1]


@given(
    st.integers(0, 6).flatmap(
        lambda most: st.tuples(
            st.just(most),
            st.lists(st.lists(st.integers(0, most), min_size=1, max_size=4), max_size=6),
        )
    )
)
def test_steps_take_numbers_that_are_drawn_ahead(wanted: tuple[int, list[list[int]]]) -> None:
    most, blocks = wanted
    own, step_by_step = rng(), rng()
    ahead = DrawnAhead(own, most)
    for counts in blocks:
        numbers, begin = ahead.draw(len(counts)), 0
        assert len(numbers) >= most * len(counts)
        for count, state in zip(counts, ahead.take(counts), strict=True):
            expected = step_by_step.random(count)
            assert np.array_equal(numbers[begin : begin + count], expected)
            assert state == state_bytes(step_by_step.bit_generator)
            begin += count


@pytest.mark.parametrize("count", [0, 1, 7, 1000])
@pytest.mark.parametrize("has_half", [False, True])
def test_states_behind_steps_are_those_that_drawing_leads_to(count: int, has_half: bool) -> None:
    rng = np.random.default_rng(3)
    if has_half:
        rng.integers(0, 10, dtype=np.uint32)
    before = state_bytes(rng.bit_generator)
    found = states_behind(before, [count] * 5)
    for state in found:
        rng.random(count)
        assert state_bytes(rng.bit_generator) == state


def test_states_of_another_generator_are_refused() -> None:
    with pytest.raises(TypeError, match="must be a PCG64, was a MT19937"):
        state_bytes(np.random.MT19937(0))
