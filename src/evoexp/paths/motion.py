"""A motion through configuration space: straight or cubic between its instants."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray


class Motion(NamedTuple):
    """Configurations passed at instants 0, 1, …, along straight lines or cubics between them.

    Time t is counted in instants: segment i covers [i, i + 1], on which u = t − i runs from 0 to 1.
    """

    q: FloatArray  # (instants, nq) [rad], lengths for prismatic joints
    # (segments, 4, nq) of q(u) = c0 + c1 u + c2 u² + c3 u³ on every segment; None: straight lines
    coefficients: FloatArray | None = None

    @property
    def num_segments(self) -> int:
        """Number of segments: one less than there are instants."""
        return len(self.q) - 1

    @property
    def polynomials(self) -> FloatArray:
        """(segments, 4, nq) coefficients in powers of u, of straight motions, too."""
        if self.coefficients is not None:
            return self.coefficients
        coefficients = np.zeros((self.num_segments, 4, self.q.shape[1]))
        coefficients[:, 0] = self.q[:-1]
        coefficients[:, 1] = self.q[1:] - self.q[:-1]
        return coefficients

    def at(self, t: float) -> FloatArray:
        """Return q (nq,) at t in [0, segments]; ValueError outside."""
        if not 0.0 <= t <= self.num_segments:
            raise ValueError(f"t must lie in [0, {self.num_segments}], was {t}")
        segment = min(int(t), max(self.num_segments - 1, 0))
        u = t - segment
        if self.coefficients is None:
            step = self.q[segment + 1] - self.q[segment] if u > 0.0 else 0.0
            return np.asarray(self.q[segment] + u * step)
        c0, c1, c2, c3 = self.coefficients[segment]
        return np.asarray(c0 + u * (c1 + u * (c2 + u * c3)))

    @property
    def greatest(self) -> FloatArray:
        """An upper bound (nq,) of |q|: the Bézier points of all segments."""
        if self.coefficients is None:
            return np.asarray(np.abs(self.q).max(axis=0))
        c0, c1, c2, c3 = self.coefficients.transpose(1, 0, 2)
        points = np.stack([c0, c0 + c1 / 3.0, c0 + (2.0 * c1 + c2) / 3.0, c0 + c1 + c2 + c3])
        return np.asarray(np.abs(points).max(axis=(0, 1)))

    def speed_bound(self, segment: int, begin: float = 0.0, end: float = 1.0) -> FloatArray:
        """Return an upper bound (nq,) of |dq/du| on a segment's u in [begin, end].

        The derivative's values lie between the least and the greatest of its Bézier coefficients
        there.
        """
        if self.coefficients is None:
            return np.asarray(np.abs(self.q[segment + 1] - self.q[segment]))
        coefficients = np.ascontiguousarray(self.coefficients[segment])
        return np.array(
            [speed_bound(coefficients, joint, begin, end) for joint in range(coefficients.shape[1])]
        )


def cubic_motion(coefficients: FloatArray) -> Motion:
    """Return a motion from power coefficients (segments, 4, nq), lowest power first.

    ValueError: they have another shape, or a segment does not begin where the one before ends.
    """
    coefficients = np.ascontiguousarray(coefficients, dtype=np.float64)
    if coefficients.ndim != 3 or coefficients.shape[0] == 0 or coefficients.shape[1] != 4:
        raise ValueError(
            f"coefficients must have shape (segments, 4, nq), was {coefficients.shape}"
        )
    ends = coefficients.sum(axis=1)
    jumps = np.abs(ends[:-1] - coefficients[1:, 0])
    if jumps.size and jumps.max() > 1e-9 * max(1.0, float(np.abs(coefficients).max())):
        segment = int(jumps.max(axis=1).argmax())
        raise ValueError(
            f"coefficients must be continuous, jump by {jumps.max()} behind segment {segment}"
        )
    return Motion(np.vstack([coefficients[:, 0], ends[-1:]]), coefficients)


def spline_motion(spline: Any) -> Motion:
    """Return the motion of a `scipy.interpolate.CubicSpline` over (nq,) values.

    Every knot becomes an instant.
    """
    widths = np.diff(spline.x)
    # scipy counts powers of (x − knot), highest first: (4, segments, nq)
    powers = np.stack([spline.c[3 - p] * (widths**p)[:, None] for p in range(4)], axis=1)
    return cubic_motion(powers)


def clamped_cubic(q: FloatArray) -> Motion:
    """Return the cubic spline through configurations q (instants, nq) that starts and ends at rest.

    It is as smooth as "a polynomial of the third order to ensure second order derivability"
    (Curkovic et al. 2013, Fig. 9) can be. ValueError: there are fewer than two configurations.
    """
    from scipy.interpolate import CubicSpline  # only curves need it, and it takes long to load

    if q.ndim != 2 or len(q) < 2:
        raise ValueError(f"q must have shape (2 or more instants, nq), was {q.shape}")
    return spline_motion(CubicSpline(np.arange(float(len(q))), q, axis=0, bc_type="clamped"))


def joint_ranges(motion: Motion) -> FloatArray:
    """Return every joint's least and greatest value (nq, 2), exact but for rounding."""
    c0, c1, c2, c3 = motion.polynomials.transpose(1, 0, 2)  # each (segments, nq)
    values = [motion.q]
    if motion.coefficients is not None:
        # the zeros of 3 c3 u² + 2 c2 u + c1, by the formula that loses no digits
        root = -(c2 + np.copysign(np.sqrt(np.maximum(c2 * c2 - 3.0 * c1 * c3, 0.0)), c2))
        for above, below in ((root, 3.0 * c3), (c1, root)):
            u = np.divide(above, below, out=np.zeros_like(above), where=below != 0.0)
            u = np.minimum(np.maximum(u, 0.0), 1.0)
            values.append(c0 + u * (c1 + u * (c2 + u * c3)))
    stacked = np.concatenate(values)
    return np.stack([stacked.min(axis=0), stacked.max(axis=0)], axis=1)


def top_speeds(motion: Motion) -> FloatArray:
    """Return the greatest |dq/dt| of every joint (nq,) per instant, exact but for rounding."""
    _, c1, c2, c3 = motion.polynomials.transpose(1, 0, 2)
    # the zero of the acceleration
    u = np.divide(-c2, 3.0 * c3, out=np.zeros_like(c2), where=c3 != 0.0)
    instants = np.zeros_like(c1), np.ones_like(c1), np.minimum(np.maximum(u, 0.0), 1.0)
    speeds = np.concatenate([np.abs(c1 + u * (2.0 * c2 + 3.0 * u * c3)) for u in instants])
    return np.asarray(speeds.max(axis=0))


@kernel
def speed_bound(coefficients: FloatArray, joint: int, begin: float, end: float) -> float:
    """Return an upper bound of a joint's |dq/du| on [begin, end] of coefficients (4, nq)."""
    c1, c2, c3 = coefficients[1, joint], 2.0 * coefficients[2, joint], 3.0 * coefficients[3, joint]
    first = abs(c1 + begin * (c2 + begin * c3))
    last = abs(c1 + end * (c2 + end * c3))
    middle = abs(c1 + 0.5 * c2 * (begin + end) + c3 * begin * end)
    return float(max(first, max(middle, last)))
