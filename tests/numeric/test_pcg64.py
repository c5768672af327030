"""PCG64 in kernels: numpy's numbers and states, and normal deviates of them, to the last bit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.numeric.elementary import standard_normal
from evoexp.numeric.pcg64 import (
    Twin,
    fill_normals,
    fill_uniforms,
)


def rng(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


@given(st.integers(0, 2**64), st.lists(st.integers(0, 300), min_size=1, max_size=6))
def test_uniform_numbers_and_states_are_numpys(seed: int, counts: list[int]) -> None:
    own, other = rng(seed), rng(seed)
    twin = Twin(own)
    for count in counts:
        found = np.full(count + 1, -1.0)
        fill_uniforms(twin.words, found[:count])
        assert np.array_equal(found[:count], other.random(count))
        assert found[count] == -1.0, "nothing behind the end is written"
        twin.follow(twin.words[:2].copy())
        assert own.bit_generator.state == other.bit_generator.state


@given(st.integers(0, 2**64), st.lists(st.integers(0, 40), min_size=1, max_size=6))
def test_normal_deviates_and_states_are_those_of_the_polar_method(
    seed: int, counts: list[int]
) -> None:
    own, other = rng(seed), rng(seed)
    twin = Twin(own)
    for count in counts:
        found = np.empty(count)
        fill_normals(twin.words, found)
        assert found.tobytes() == standard_normal(other, count).tobytes()
        twin.follow(twin.words[:2].copy())
        assert own.bit_generator.state == other.bit_generator.state


def test_a_twin_meets_its_generator_and_leaves_it_alone_until_it_follows() -> None:
    own = rng(3)
    twin, before = Twin(own), own.bit_generator.state
    ahead = np.empty(100)
    fill_uniforms(twin.words, ahead)
    assert own.bit_generator.state == before
    assert np.array_equal(own.random(100), ahead)
    own.random(7)
    twin.meet()
    again = np.empty(5)
    fill_uniforms(twin.words, again)
    assert np.array_equal(again, own.random(5))


def test_half_a_number_that_a_generator_keeps_stays_kept() -> None:
    """`integers` draws 32 bits at a time and keeps the other 32."""
    own, other = rng(1), rng(1)
    assert own.integers(0, 9, dtype=np.uint32) == other.integers(0, 9, dtype=np.uint32)
    twin, found = Twin(own), np.empty(3)
    fill_uniforms(twin.words, found)
    assert np.array_equal(found, other.random(3))
    twin.follow(twin.words[:2])
    assert own.bit_generator.state == other.bit_generator.state
    assert own.integers(0, 9, dtype=np.uint32) == other.integers(0, 9, dtype=np.uint32)


def test_another_generator_is_refused() -> None:
    with pytest.raises(TypeError, match="must be a PCG64, was a MT19937"):
        Twin(np.random.Generator(np.random.MT19937(0)))
