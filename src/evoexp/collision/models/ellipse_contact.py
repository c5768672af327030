"""The first contact of one path of a planar arm with ellipses; see `ellipse_kernels`."""

import numpy as np

from evoexp.collision.models.ellipse_kernels import Ellipses, gap
from evoexp.numeric.compilation import kernel
from evoexp.numeric.vectors import LANES
from evoexp.records import FloatArray
from evoexp.robots.planar_ends import PlanarArm, block_ends


@kernel
def first_contact(
    start: FloatArray,
    end: FloatArray,
    arm: PlanarArm,
    ellipses: Ellipses,
    num_positions: int,
    chords: bool,
) -> tuple[int, int, int, bool]:
    """Find the first contact of one path, by position, ellipse and link, chords before links.

    Args:
        start: (N,) joint angles at the start [rad].
        end: (N,) at the end.
        arm: The arm.
        ellipses: The ellipses.
        num_positions: M.
        chords: Whether chords are swept.

    Returns:
        Position; index of the ellipse; link, or link end, from 1; whether the chord of that end
        touches. −1, −1, −1 and false if nothing touches.
    """
    num = len(start)
    begin, stop = np.repeat(start, LANES), np.repeat(end, LANES)
    x, y = np.empty((2, (num + 1) * LANES)), np.empty((2, (num + 1) * LANES))
    block_ends(begin, stop, arm, 0, num_positions, x[0], y[0])
    for position in range(1, num_positions + 1):
        old, new = (position + 1) % 2, position % 2
        block_ends(begin, stop, arm, position, num_positions, x[new], y[new])
        for e in range(len(ellipses.maps)):
            ellipse = ellipses.maps[e]
            for k in range(num + 1):
                at, root = k * LANES, max(k - 1, 0) * LANES
                here = _mapped(ellipse, x[new, at], y[new, at])
                if chords and _meets(_mapped(ellipse, x[old, at], y[old, at]), here):
                    return position, e, k, True
                if _meets(_mapped(ellipse, x[new, root], y[new, root]), here):
                    return position, e, k, False
    return -1, -1, -1, False


@kernel
def _mapped(ellipse: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Return a point in an ellipse's frame."""
    return ellipse[0] * x + ellipse[1] * y + ellipse[2], ellipse[3] * y + ellipse[4]


@kernel
def _meets(one: tuple[float, float], two: tuple[float, float]) -> bool:
    """Return whether a segment, given by its `_mapped` ends, touches the unit circle."""
    return bool(gap(one[0], one[1], two[0], two[1]) <= 0.0)
