"""The time from instant to instant: equal, and as short as the joints' speed limits permit."""

from typing import NamedTuple

import numpy as np

from evoexp.paths.motion import Motion, top_speeds
from evoexp.records import FloatArray


class SpeedLimits(NamedTuple):
    """Speed limits of joints, which no paper prints."""

    turn: float = np.pi / 4.0  # limit of revolute joints [rad/s]
    # Limit of prismatic joints [length unit/s]; None: a quarter of the scene's size per second
    slide: float | None = None

    def of(self, prismatic: np.ndarray, size: float) -> FloatArray:
        """Return the limit of every coordinate (nq,).

        Args:
            prismatic: (nq,) true for coordinates that are lengths.
            size: Size of the scene [length unit].
        """
        slide = 0.25 * size if self.slide is None else self.slide
        return np.where(prismatic, slide, self.turn)


def seconds_per_instant(motion: Motion, limits: FloatArray) -> float:
    """Return the least time from instant to instant within all joints' limits [s].

    Args:
        motion: The motion.
        limits: (nq,) greatest |dq/dt| [rad/s or length unit/s].

    Returns:
        1 for a motion that stands still.
    """
    if motion.num_segments == 0:
        return 1.0
    return float((top_speeds(motion) / limits).max()) or 1.0


def velocities(motion: Motion, times: FloatArray, seconds: float) -> FloatArray:
    """Return dq/dt at instants, (ticks, nq) [rad/s or length unit/s].

    Where two straight lines meet, the velocity on the later one is taken.

    Args:
        motion: The motion.
        times: (ticks,) [instants].
        seconds: Time from instant to instant [s].
    """
    if motion.num_segments == 0:
        return np.zeros((len(times), motion.q.shape[1]))
    segments = np.minimum(times.astype(int), motion.num_segments - 1)
    u = (times - segments)[:, None]
    _, c1, c2, c3 = motion.polynomials[segments].transpose(1, 0, 2)
    return np.asarray((c1 + u * (2.0 * c2 + 3.0 * u * c3)) / seconds)
