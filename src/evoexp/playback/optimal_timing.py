"""The fastest timing of a path within limits of speed and acceleration."""

from typing import Any

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

Timed = tuple[FloatArray, FloatArray, FloatArray]
"""Times (points,) [s], positions (points, nq), velocities (points, nq)."""

POINTS_PER_SEGMENT = 100  # of a curve's timing
GRID = 200  # points per segment at which toppra keeps to the limits


def along_lines(motion: Motion, speeds: FloatArray, accelerations: FloatArray) -> Timed:
    """Return the fastest timing of straight lines with a stop wherever two of them meet.

    On each line the joints speed up, run at constant speed, and slow down.

    Args:
        motion: A motion of straight segments.
        speeds: (nq,) limits [rad/s or length unit/s].
        accelerations: (nq,) limits [rad/s² or length unit/s²].
    """
    times, positions, velocities = [0.0], [motion.q[0]], [np.zeros(motion.q.shape[1])]
    for before, after in zip(motion.q[:-1], motion.q[1:], strict=True):
        way = after - before
        moving = way != 0.0
        if not moving.any():
            continue
        v = float((speeds[moving] / np.abs(way[moving])).min())  # of the share of the way
        a = float((accelerations[moving] / np.abs(way[moving])).min())
        v = min(v, float(np.sqrt(a)))  # of a way too short to reach the limit
        rise = v / a
        total = rise + 1.0 / v
        share = 0.5 * v * rise
        begin = times[-1]
        for time, done, speed in (
            (rise, share, v),
            (total - rise, 1.0 - share, v),
            (total, 1.0, 0.0),
        ):
            if time > times[-1] - begin + 1e-12:  # no run on a short way
                times.append(begin + time)
                positions.append(before + done * way)
                velocities.append(speed * way)
    if len(times) == 1:  # stands still
        return np.array([0.0, 1.0]), np.stack([motion.q[0]] * 2), np.zeros((2, motion.q.shape[1]))
    return np.array(times), np.array(positions), np.array(velocities)


def along_curve(motion: Motion, speeds: FloatArray, accelerations: FloatArray) -> Timed | None:
    """Return the fastest timing of a smooth curve by toppra (Pham & Pham 2018).

    Args:
        motion: A motion of cubic segments.
        speeds: (nq,) limits [rad/s or length unit/s].
        accelerations: (nq,) limits [rad/s² or length unit/s²].

    Returns:
        The timing; None if toppra is not installed.
    """
    try:
        import toppra
    except ImportError:
        return None
    toppra.setup_logging("ERROR")
    last = float(motion.num_segments)
    path = _path(toppra, motion)
    # so that limits are kept between the points of the grid, too
    between = toppra.constraint.DiscretizationType.Interpolation
    bounds = [
        toppra.constraint.JointVelocityConstraint(np.stack([-speeds, speeds], axis=1)),
        toppra.constraint.JointAccelerationConstraint(
            np.stack([-accelerations, accelerations], axis=1), between
        ),
    ]
    grid = np.linspace(0.0, last, GRID * motion.num_segments + 1)
    found = toppra.algorithm.TOPPRA(
        bounds, path, gridpoints=grid, parametrizer="ParametrizeConstAccel"
    )
    timed = found.compute_trajectory(0.0, 0.0)
    times = np.linspace(0.0, float(timed.duration), POINTS_PER_SEGMENT * motion.num_segments + 1)
    return times, np.asarray(timed(times)), np.asarray(timed(times, 1))


def _path(toppra: Any, motion: Motion) -> Any:
    """Return a motion as a geometric path of toppra: the same polynomials, piece by piece."""
    coefficients = motion.polynomials  # (segments, 4, nq), lowest power first

    class Path(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        dof = motion.q.shape[1]
        path_interval = np.array([0.0, float(motion.num_segments)])
        waypoints = None

        def __call__(self, path_positions: Any, order: int = 0) -> Any:
            s = np.asarray(path_positions, dtype=np.float64)
            segments = np.minimum(s.astype(int), motion.num_segments - 1)
            u = (s - segments)[..., None]
            c0, c1, c2, c3 = np.moveaxis(coefficients[segments], -2, 0)
            if order == 0:
                return c0 + u * (c1 + u * (c2 + u * c3))
            if order == 1:
                return c1 + u * (2.0 * c2 + 3.0 * u * c3)
            return 2.0 * c2 + 6.0 * u * c3

    return Path()
