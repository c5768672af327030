"""The fastest timing of a path within limits of speed and acceleration."""

from itertools import pairwise
from typing import Any

import numpy as np

from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

Timed = tuple[FloatArray, FloatArray, FloatArray]
"""Times (points,) [s], positions (points, nq), velocities (points, nq)."""

POINTS_PER_SEGMENT = 100  # of a curve's timing, at least
TICK = 0.01  # [s] between points of a curve's timing, at most
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


def along_curve(
    motion: Motion,
    speeds: FloatArray,
    accelerations: FloatArray,
    lengths: FloatArray | None = None,
    stops: tuple[int, ...] = (),
) -> Timed | None:
    """Return the fastest timing of a smooth curve by toppra (Pham & Pham 2018).

    Args:
        motion: A motion of cubic segments.
        speeds: (nq,) limits [rad/s or length unit/s].
        accelerations: (nq,) limits [rad/s² or length unit/s²].
        lengths: (segments,) way of each segment, with respect to which the curve's derivative is
            continuous; None: all 1.
        stops: Instants at which the motion stops: where that derivative jumps.

    Returns:
        The timing; None if toppra is not installed. It is for a controller that interpolates cubics
        between the points, and within the limits for this one.
    """
    try:
        import toppra
    except ImportError:
        return None
    toppra.setup_logging("ERROR")
    # so that limits are kept between the points of the grid, too
    between = toppra.constraint.DiscretizationType.Interpolation
    bounds = [
        toppra.constraint.JointVelocityConstraint(np.stack([-speeds, speeds], axis=1)),
        toppra.constraint.JointAccelerationConstraint(
            np.stack([-accelerations, accelerations], axis=1), between
        ),
    ]
    ways = np.ones(motion.num_segments) if lengths is None else lengths
    borders = [0, *stops, motion.num_segments]
    columns: list[list[FloatArray]] = [[], [], []]
    begin = 0.0
    for first, last in pairwise(borders):
        timed = _section(toppra, motion.polynomials[first:last], ways[first:last], bounds)
        timed = within(timed, speeds, accelerations)
        kept = slice(None) if last == borders[-1] else slice(None, -1)
        for column, values in zip(columns, (timed[0] + begin, *timed[1:]), strict=True):
            column.append(values[kept])
        begin += float(timed[0][-1])
    times, positions, velocities = (np.concatenate(column) for column in columns)
    return times, positions, velocities


def _section(toppra: Any, polynomials: FloatArray, ways: FloatArray, bounds: list[Any]) -> Timed:
    """Time a curve without stops from rest to rest."""
    path = _path(toppra, polynomials, ways)
    shares = np.arange(GRID) / GRID
    steps = [begin + way * shares for begin, way in zip(path.breaks[:-1], ways, strict=True)]
    grid = np.concatenate([*steps, path.breaks[-1:]])
    found = toppra.algorithm.TOPPRA(
        bounds, path, gridpoints=grid, parametrizer="ParametrizeConstAccel"
    )
    timed = found.compute_trajectory(0.0, 0.0)
    duration = float(timed.duration)
    count = max(POINTS_PER_SEGMENT, int(np.ceil(duration / TICK)))
    times = np.linspace(0.0, duration, count + 1)
    velocities = np.asarray(timed(times, 1))
    velocities[[0, -1]] = 0.0
    positions = np.asarray(timed(times))
    positions[0], positions[-1] = polynomials[0, 0], polynomials[-1].sum(axis=0)
    return times, positions, velocities


def within(timed: Timed, speeds: FloatArray, accelerations: FloatArray) -> Timed:
    """Stretch a timing until the cubics between its points keep the limits, too."""
    times, positions, velocities = timed
    motion = hermite_motion(times, positions, velocities)
    rates = greatest_rates(motion, np.diff(times))
    stretch = max(
        1.0,
        float((rates[0] / speeds).max()),
        float(np.sqrt((rates[1] / accelerations).max())),
    )
    return times * stretch, positions, velocities / stretch


def hermite_motion(times: FloatArray, positions: FloatArray, velocities: FloatArray) -> Motion:
    """Return the cubics that a controller puts between points with velocities.

    Args:
        times: (points,) [s].
        positions: (points, nq).
        velocities: (points, nq) per second.
    """
    widths = np.diff(times)[:, None]
    before, after = widths * velocities[:-1], widths * velocities[1:]
    way = positions[1:] - positions[:-1]
    powers = [positions[:-1], before, 3.0 * way - 2.0 * before - after, before + after - 2.0 * way]
    return Motion(positions, np.stack(powers, axis=1))


def greatest_rates(motion: Motion, widths: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the greatest speed, acceleration and jerk of every joint, each (nq,).

    Args:
        motion: Cubic segments.
        widths: (segments,) their durations [s].
    """
    _, c1, c2, c3 = motion.polynomials.transpose(1, 0, 2)
    w = widths[:, None]
    u = np.divide(-c2, 3.0 * c3, out=np.zeros_like(c2), where=c3 != 0.0)
    instants = np.zeros_like(c1), np.ones_like(c1), np.clip(u, 0.0, 1.0)
    speeds = [np.abs(c1 + x * (2.0 * c2 + 3.0 * x * c3)) / w for x in instants]
    accelerations = [np.abs(2.0 * c2 + 6.0 * x * c3) / w**2 for x in instants[:2]]
    jerks = np.abs(6.0 * c3) / w**3
    return (
        np.max(speeds, axis=(0, 1)),
        np.max(accelerations, axis=(0, 1)),
        np.asarray(jerks.max(axis=0)),
    )


def _path(toppra: Any, coefficients: FloatArray, ways: FloatArray) -> Any:
    """Return a curve as a geometric path of toppra: the same polynomials, piece by piece.

    Args:
        toppra: The package.
        coefficients: (segments, 4, nq), lowest power first.
        ways: (segments,) way of each segment.
    """
    ends = np.concatenate([np.zeros(1), np.cumsum(ways)])

    class Path(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        dof = coefficients.shape[2]
        path_interval = np.array([0.0, ends[-1]])
        waypoints = None
        breaks = ends

        def __call__(self, path_positions: Any, order: int = 0) -> Any:
            s = np.asarray(path_positions, dtype=np.float64)
            last = len(coefficients) - 1
            segments = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, last)
            way = ways[segments][..., None]
            u = (s - ends[segments])[..., None] / way
            c0, c1, c2, c3 = np.moveaxis(coefficients[segments], -2, 0)
            if order == 0:
                return c0 + u * (c1 + u * (c2 + u * c3))
            if order == 1:
                return (c1 + u * (2.0 * c2 + 3.0 * u * c3)) / way
            return (2.0 * c2 + 6.0 * u * c3) / way**2

    return Path()
