"""Postures of planar arms of two links, given by angles or by the place of the end-effector."""

from typing import Literal

import numpy as np
import pytest

from evoexp.collision.planar.arm_obstacles import planar_obstacles
from evoexp.collision.planar.link_collision import LinkCollision
from evoexp.collision.planar.planar_arms import Arm
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.scenarios.link_motion import Posture
from evoexp.scenarios.obstacles import obstacle_table

LENGTHS = np.array([0.25, 0.25])


def reached(
    tip: tuple[float, float], elbow: Literal["left", "right"], base: tuple[float, float]
) -> np.ndarray:
    return Posture(tip=tip, elbow=elbow).link_angles("q_start[0]", np.array(base), LENGTHS)


@pytest.mark.parametrize(
    "tip", [(0.3, 0.4), (0.5, 0.0), (-0.5, 0.0), (0.14, 0.48), (-0.4, 0.3), (-0.3, 0.4)]
)
def test_a_tip_at_full_reach_stretches_the_arm(tip: tuple[float, float]) -> None:
    """0.3² + 0.4² is above 0.5² by the last place, or below: no elbow bends by 1e-8 rad."""
    for elbow in ("left", "right"):
        first, second = reached(tip, elbow, (0.0, 0.0))
        assert first == second == pytest.approx(np.degrees(np.arctan2(tip[1], tip[0])), abs=1e-12)


def test_a_tip_out_of_reach_is_refused() -> None:
    with pytest.raises(SettingError, match=r"tip: must be 0 to 0.5 away from the robot's base"):
        reached((0.3, 0.4 + 1e-12), "left", (0.0, 0.0))


@pytest.mark.parametrize("base", [0.0, 0.1, 0.3, 0.7])
@pytest.mark.parametrize("angles", [(0.0, 90.0), (180.0, 90.0), (90.0, 180.0), (45.0, 0.0)])
def test_rounding_puts_no_link_outside_of_the_half_turn(
    angles: tuple[float, float], base: float
) -> None:
    x, y = np.cos(np.radians(angles)), np.sin(np.radians(angles))
    tip = (float(base + 0.25 * x.sum()), float(0.25 * y.sum()))
    elbow: Literal["left", "right"] = "left" if angles[1] < angles[0] else "right"
    assert reached(tip, elbow, (base, 0.0)) == pytest.approx(np.array(angles), abs=1e-12)


def test_tips_of_links_on_one_line_touch() -> None:
    """45°, 180° beside 135°, 180°: the second links share 10 cm; also for a third robot."""
    arms = tuple(Arm((x, 0.0), (0.25, 0.25)) for x in (3.0, 0.0, 0.5))
    flat = planar_obstacles(obstacle_table(()))
    model = LinkCollision(arms, flat, 1)
    height, across = 0.25 * np.sqrt(0.5), 0.25 * np.sqrt(0.5)
    one = reached((float(across - 0.25), float(height)), "right", (0.0, 0.0))
    two = reached((float(0.5 - across - 0.25), float(height)), "right", (0.5, 0.0))
    assert one == pytest.approx(np.array([45.0, 180.0]), abs=1e-12)
    assert two == pytest.approx(np.array([135.0, 180.0]), abs=1e-12)
    posture = DEGREE * np.array([[90.0, 90.0], one, two])
    assert model.contact(posture) == "robots 2 and 3 touch"
    assert LinkCollision(arms, flat, 5).contact(posture) == "robots 2 and 3 touch"
