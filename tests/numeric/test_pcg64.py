"""Numbers drawn many at once against numpy's own: the same bits, and the same state behind them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.numeric import pcg64
from evoexp.numeric.pcg64 import draw_uniforms, draw_words

COUNTS = st.lists(st.tuples(st.integers(0, 40), st.booleans()), min_size=1, max_size=8)


@pytest.mark.matrix
@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**64), st.booleans(), COUNTS)
def test_numbers_and_states_are_numpys(
    seed: int, half: bool, counts: list[tuple[int, bool]]
) -> None:
    own, numpys = np.random.default_rng(seed), np.random.default_rng(seed)
    if half:  # half a word that numpy keeps for later
        assert own.integers(2**16, dtype=np.uint32) == numpys.integers(2**16, dtype=np.uint32)
    for count, are_words in counts:
        if are_words:
            expected = numpys.bit_generator.random_raw(count)
            np.testing.assert_array_equal(draw_words(own, count), expected)
        else:
            np.testing.assert_array_equal(draw_uniforms(own, count), numpys.random(count))
        assert own.bit_generator.state == numpys.bit_generator.state


def test_where_the_layout_is_not_known_numpy_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    assert pcg64._layout_is_known()
    monkeypatch.setattr(pcg64, "_layout_is_known", lambda: False)
    own, numpys = np.random.default_rng(3), np.random.default_rng(3)
    np.testing.assert_array_equal(draw_uniforms(own, 9), numpys.random(9))
    np.testing.assert_array_equal(draw_words(own, 9), numpys.bit_generator.random_raw(9))
    other = np.random.Generator(np.random.MT19937(3))
    again = np.random.Generator(np.random.MT19937(3))
    monkeypatch.undo()
    np.testing.assert_array_equal(draw_uniforms(other, 9), again.random(9))
