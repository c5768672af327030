"""Blocks of arms that an axis seems to separate: what touches is never left out."""

import numpy as np
import pytest

from evoexp.collision.planar.arm_pairs import count_collisions
from evoexp.collision.planar.planar_arms import Arm, tolerance_of
from evoexp.records import FloatArray

NUM = 9  # individuals: a block of eight, and one more


def points(elbow: tuple[float, float], tip: tuple[float, float]) -> FloatArray:
    """Return the points of equal individuals in one configuration.  # (1, 4, NUM)."""
    return np.repeat(np.array([*elbow, *tip])[np.newaxis, :, np.newaxis], NUM, axis=2)


@pytest.mark.parametrize("scale", [2.0**-300, 1e-3, 1.0, 7e5, 2.0**200])
@pytest.mark.parametrize("turn", range(8))
@pytest.mark.parametrize("offset", [0.0, 0.3, 1e6])
def test_what_touches_at_its_outermost_point_is_counted(
    scale: float, turn: int, offset: float
) -> None:
    """Arm 1 ends on a link of arm 2 that stands across; then a little before it."""
    along = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)][turn])
    across = np.array([-along[1], along[0]])
    base = np.array([offset, offset]) * scale
    elbow, tip = base + 0.25 * scale * along, base + 0.5 * scale * along
    one = points(tuple(elbow), tuple(tip))
    lengths = (0.4 * scale, 0.4 * scale)
    for gap in (0.0, 4.0):
        first = Arm((float(base[0]), float(base[1])), lengths)
        centre = tip + gap * tolerance_of(first, first) * along
        below, above = centre - 0.25 * scale * across, centre + 0.25 * scale * across
        second = Arm((float(below[0]), float(below[1])), lengths)
        two = points(tuple(centre), tuple(above))
        found = count_collisions(first, one, second, two)
        mirrored = count_collisions(second, two, first, one)
        assert np.array_equal(found.counts, np.full((NUM, NUM), not gap))
        assert np.array_equal(mirrored.counts, found.counts)
