"""Eqs. 2 and 3 of Curkovic et al. 2013: what they give, and what the paper prints."""

import numpy as np
import pytest

from evoexp.planners.coevolution.settings import SpeedLimit, length_notes, needed_length

PAPER = SpeedLimit(tcp_speed=5.0, sampling_time=0.01)


def test_steps_are_half_of_what_is_printed() -> None:
    first, second = PAPER.greatest_steps((0.25, 0.25))
    # V_max T = 5 cm, at a distance of both links and of one
    assert np.deg2rad([0.5 * first, 0.25 * second]) == pytest.approx([0.05, 0.05])
    assert (2 * first, 2 * second) == pytest.approx((11.5, 23.0), abs=0.1)


@pytest.mark.parametrize(
    ("turn", "step", "length"),
    [(180.0, 5.7295779513, 64), (120.0, 5.7295779513, 42), (180.0, 11.5, 32), (1.0, 10.0, 2)],
)
def test_needed_length(turn: float, step: float, length: int) -> None:
    assert needed_length(turn, step) == length
    assert turn / (length / 2) <= step * (1.0 + 1e-9)
    assert length == 2 or turn / (length / 2 - 1) > step


def test_notes_tell_formula_print_and_violation() -> None:
    start, goal = np.deg2rad([[150.0, 60.0]]), np.deg2rad([[30.0, 0.0]])
    notes = "\n".join(length_notes(PAPER, [(0.25, 0.25)], start, goal, 8))
    assert "5.73 and 11.46 deg (printed: 11.5 and 23)" in notes
    assert "L = 42 here (120 deg), for L = 64 over 180 deg (printed: 32)" in notes
    assert "takes steps of 24.00 deg at best, which violates it 4.19 times over" in notes
    assert "is within it" in "\n".join(length_notes(PAPER, [(0.25, 0.25)], start, goal, 42))
