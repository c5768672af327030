"""Blocks of arms that an axis seems to separate: what touches is never left out."""

from fractions import Fraction

import numpy as np
import pytest

from collision.exact_crossings import count_exactly
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
    """Arm 1 ends on a link of arm 2 that stands across; then one last place before it."""
    along = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)][turn])
    across = np.array([-along[1], along[0]])
    base = np.array([offset, offset]) * scale
    elbow, tip = base + 0.25 * scale * along, base + 0.5 * scale * along
    one = points(tuple(elbow), tuple(tip))
    for gap in (0.0, 1.0):
        # away from arm 1 by the last place of a coordinate, in every coordinate that counts
        centre = np.where(along != 0, np.nextafter(tip, along * 1e300), tip) if gap else tip
        below, above = centre - 0.25 * scale * across, centre + 0.25 * scale * across
        two = points(tuple(centre), tuple(above))
        found = count_exactly(tuple(base), one, tuple(below), two)
        mirrored = count_exactly(tuple(below), two, tuple(base), one)
        expected = int(not gap or not apart(tip, below, centre, above, along))
        assert np.array_equal(found.counts, np.full((NUM, NUM), expected))
        assert np.array_equal(mirrored.counts, found.counts)


def apart(
    tip: FloatArray, below: FloatArray, centre: FloatArray, above: FloatArray, along: FloatArray
) -> bool:
    """Whether a tip lies before a link's three points, exactly: coordinates are whole multiples."""
    reach = [
        sum(int(a) * Fraction(float(x)) for a, x in zip(along, point, strict=True))
        for point in (tip, below, centre, above)
    ]
    return min(reach[1:]) > reach[0]
