"""A timing that starts and ends at rest, of bounded speed, acceleration and jerk.

On a straight line all joints follow one polynomial of fifth degree, s = 10 u³ − 15 u⁴ + 6 u⁵ of the
share u of the time: its rates vanish at both ends, and its greatest ones are known. A controller
that interpolates the ends (positions, zero velocities, zero accelerations) executes just this, and
one that ignores accelerations a cubic on the same line, within the same limits.
"""

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.playback.joint_limits import JointLimits
from evoexp.playback.optimal_timing import Timed, within
from evoexp.records import FloatArray

SPEED = 1.875  # [-] greatest ds/du of the polynomial, at u = 1/2; a cubic's is 1.5
ACCELERATION = 6.0  # [-] greatest |d²s/du²| of the cubic; the polynomial's is 10 / √3
JERK = 60.0  # [-] greatest |d³s/du³| of the polynomial, at both ends
POINTS_PER_SEGMENT = 50  # of a curve
SAMPLES = 400  # per segment, by which a curve's rates are found


def rest_on_lines(motion: Motion, limits: JointLimits) -> Timed:
    """Time straight lines with rest wherever two of them meet.

    Args:
        motion: A motion of straight segments.
        limits: Limits of the joints.
    """
    times, points = [0.0], [motion.q[0]]
    for before, after in zip(motion.q[:-1], motion.q[1:], strict=True):
        way = np.abs(after - before)
        if way.any():
            seconds = max(
                (SPEED * way / limits.velocity).max(),
                np.sqrt((ACCELERATION * way / limits.acceleration).max()),
                np.cbrt((JERK * way / limits.jerk).max()),
            )
            times.append(times[-1] + float(seconds))
            points.append(after)
    if len(times) == 1:  # it stands still
        times, points = [0.0, 1.0], [motion.q[0]] * 2
    return np.array(times), np.array(points), np.zeros((len(times), motion.q.shape[1]))


def rest_on_curve(motion: Motion, limits: JointLimits) -> Timed:
    """Time a curve by the polynomial from its one end to the other.

    Args:
        motion: A motion of cubic segments.
        limits: Limits of the joints; the time is such that samples of the curve keep them.
    """
    last = float(motion.num_segments)
    u = np.linspace(0.0, 1.0, SAMPLES * motion.num_segments + 1)
    rates = _rates(motion, u)
    scale = [rates[0] / limits.velocity, rates[1] / limits.acceleration, rates[2] / limits.jerk]
    seconds = max(float(values.max()) ** (1.0 / (k + 1)) for k, values in enumerate(scale))
    seconds = seconds or 1.0
    u = np.linspace(0.0, 1.0, POINTS_PER_SEGMENT * motion.num_segments + 1)
    s, s1 = _share(u)[:2]
    positions = np.array([motion.at(min(last * each, last)) for each in s])
    velocities = _derivatives(motion, last * s)[0] * (last * s1 / seconds)[:, None]
    # the cubics between the points, by which a controller moves, differ a little from the curve
    return within((seconds * u, positions, velocities), limits.velocity, limits.acceleration)


def _share(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Evaluate the polynomial and its three derivatives."""
    s = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
    return (
        np.minimum(s, 1.0),
        30.0 * u**2 * (1.0 - u) ** 2,
        60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
        60.0 * (1.0 - 6.0 * u + 6.0 * u**2),
    )


def _derivatives(motion: Motion, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the first three derivatives of q with respect to t at instants, each (n, nq)."""
    segments = np.minimum(t.astype(int), motion.num_segments - 1)
    x = (t - segments)[:, None]
    _, c1, c2, c3 = motion.polynomials[segments].transpose(1, 0, 2)
    return c1 + x * (2.0 * c2 + 3.0 * x * c3), 2.0 * c2 + 6.0 * x * c3, 6.0 * c3


def _rates(motion: Motion, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the greatest rates of every joint, each (nq,), if the curve took one second."""
    last = float(motion.num_segments)
    s, s1, s2, s3 = (last * each[:, None] for each in _share(u))
    q1, q2, q3 = _derivatives(motion, s[:, 0])
    return (
        np.abs(q1 * s1).max(axis=0),
        np.abs(q2 * s1**2 + q1 * s2).max(axis=0),
        np.abs(q3 * s1**3 + 3.0 * q2 * s1 * s2 + q1 * s3).max(axis=0),
    )
