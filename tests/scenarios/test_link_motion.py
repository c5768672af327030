"""Postures of planar arms of two links, given by angles or by the place of the end-effector."""

from typing import Any

import numpy as np
import pytest

from evoexp.errors import SettingError
from evoexp.scenarios.arm_motion import Posture


def reached(x: float, y: float, elbow: Any, base: float = 0.0) -> np.ndarray:
    posture = Posture(tip=(float(x), float(y)), elbow=elbow)
    return posture.link_angles("q_start[0]", np.array([base, 0.0]), np.array([0.25, 0.25]))


@pytest.mark.parametrize(
    "tip", [(0.3, 0.4), (0.5, 0.0), (-0.5, 0.0), (0.14, 0.48), (-0.4, 0.3), (-0.3, 0.4)]
)
@pytest.mark.parametrize("elbow", ["left", "right"])
def test_a_tip_at_full_reach_stretches_the_arm(tip: tuple[float, float], elbow: str) -> None:
    """0.3² + 0.4² is above 0.5² by the last place, or below: no elbow bends by 1e-8 rad."""
    first, second = reached(*tip, elbow)
    assert first == second == pytest.approx(np.degrees(np.arctan2(tip[1], tip[0])), abs=1e-12)


def test_a_tip_out_of_reach_is_refused() -> None:
    with pytest.raises(SettingError, match=r"tip: must be 0 to 0.5 away from the robot's base"):
        reached(0.3, 0.4 + 1e-12, "left")


@pytest.mark.parametrize("base", [0.0, 0.1, 0.3, 0.7])
@pytest.mark.parametrize("angles", [(0.0, 90.0), (180.0, 90.0), (90.0, 180.0), (45.0, 0.0)])
def test_rounding_puts_no_link_outside_of_the_half_turn(
    angles: tuple[float, float], base: float
) -> None:
    x, y = np.cos(np.radians(angles)).sum(), np.sin(np.radians(angles)).sum()
    elbow = "left" if angles[1] < angles[0] else "right"
    found = reached(base + 0.25 * x, 0.25 * y, elbow, base)
    assert found == pytest.approx(np.array(angles), abs=1e-12)
