"""The time along a motion: equal from instant to instant, or as fast as a robot permits.

The fastest timing is toppra's (Pham & Pham 2018), within limits of speed and acceleration, from
rest to rest; it stops where the direction of the motion jumps, as where two straight lines meet.
"""

import warnings
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion, top_speeds
from evoexp.records import FloatArray

TICK = 0.01  # [s] between points of the fastest timing, at most
POINTS_PER_SECTION = 20  # points of the fastest timing between two stops, at least
GRID = 200  # points per segment at which toppra keeps to the limits
SMOOTH = 1e-9  # [-] of the greatest derivative, by which it may jump without a stop


class BadTiming(EvoexpError):
    """A timing that is not available."""


class SpeedLimits(NamedTuple):
    """Speed limits of joints, which no paper prints."""

    turn: float = np.pi / 4.0  # limit of revolute joints [rad/s]
    # limit of prismatic joints [length unit/s]; None: a quarter of the scene's size per second
    slide: float | None = None

    def of(self, prismatic: np.ndarray, size: float) -> FloatArray:
        """Return the limit of every coordinate (nq,), in a scene of a size [length unit]."""
        slide = 0.25 * size if self.slide is None else self.slide
        return np.where(prismatic, slide, self.turn)


class TimedPoints(NamedTuple):
    """Points of a motion in time; a controller puts cubics between them."""

    times: FloatArray  # (points,) from the start [s]
    positions: FloatArray  # (points, nq) [rad or length unit]
    velocities: FloatArray  # (points, nq) per second


def seconds_per_instant(motion: Motion, limits: FloatArray) -> float:
    """Return the least time from instant to instant within limits (nq,) of joints' speeds [s]."""
    if motion.num_segments == 0:
        return 1.0
    return float((top_speeds(motion) / limits).max()) or 1.0


def velocities(motion: Motion, times: FloatArray, seconds: float) -> FloatArray:
    """Return dq/dt at times (ticks,) [instants] that are seconds apart, (ticks, nq) [per s].

    Where two straight lines meet, the velocity on the later one is taken.
    """
    if motion.num_segments == 0:
        return np.zeros((len(times), motion.q.shape[1]))
    segments = np.minimum(times.astype(int), motion.num_segments - 1)
    u = (times - segments)[:, None]
    _, c1, c2, c3 = motion.polynomials[segments].transpose(1, 0, 2)
    return np.asarray((c1 + u * (2.0 * c2 + 3.0 * u * c3)) / seconds)


def fastest(motion: Motion, speeds: FloatArray, accelerations: FloatArray) -> TimedPoints:
    """Time a motion as fast as limits of speed and acceleration (nq,) permit, from rest to rest.

    BadTiming is raised where toppra is not installed.
    """
    try:
        with warnings.catch_warnings():  # Python warns of its docstrings when it compiles them
            warnings.simplefilter("ignore")
            import toppra
    except ImportError:
        raise BadTiming(
            "--timing optimal needs toppra: pip install 'evoexp[timing]'; --timing uniform does not"
        ) from None
    toppra.setup_logging("ERROR")
    polynomials = motion.polynomials[motion.polynomials[:, 1:].any(axis=(1, 2))]
    if not len(polynomials):  # it stands still
        return TimedPoints(np.array([0.0, 1.0]), motion.q[[0, 0]], 0.0 * motion.q[[0, 0]])
    # it stops where the direction jumps
    _, c1, c2, c3 = polynomials.transpose(1, 0, 2)
    jumps = np.abs((c1 + 2.0 * c2 + 3.0 * c3)[:-1] - c1[1:]).max(axis=1)
    stops = 1 + np.flatnonzero(jumps > SMOOTH * np.abs(c1).max())
    parts: list[TimedPoints] = []
    for first, last in pairwise([0, *stops.tolist(), len(polynomials)]):
        section = _section(toppra, polynomials[first:last], speeds, accelerations)
        if parts:  # it begins at the last point of the one before
            begin = parts[-1].times[-1]
            section = TimedPoints(*(column[1:] for column in section))
            section = section._replace(times=begin + section.times)
        parts.append(section)
    return TimedPoints(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _section(
    toppra: Any, polynomials: FloatArray, speeds: FloatArray, accelerations: FloatArray
) -> TimedPoints:
    """Time cubics (segments, 4, nq) without a stop between them from rest to rest."""
    count, constraint = len(polynomials), toppra.constraint
    limits = [
        constraint.JointVelocityConstraint(np.stack([-speeds, speeds], axis=1)),
        constraint.JointAccelerationConstraint(
            np.stack([-accelerations, accelerations], axis=1),
            # limits are kept between the points of the grid, too
            constraint.DiscretizationType.Interpolation,
        ),
    ]
    c0, c1, c2, c3 = polynomials.transpose(1, 0, 2)
    ends = np.vstack([c0, polynomials[-1].sum(axis=0)])
    slopes = np.vstack([c1, c1[-1] + 2.0 * c2[-1] + 3.0 * c3[-1]])
    path = toppra.SimplePath(np.arange(count + 1.0), ends, slopes)
    solver = toppra.algorithm.TOPPRA(
        limits,
        path,
        gridpoints=np.linspace(0.0, count, GRID * count + 1),
        parametrizer="ParametrizeConstAccel",
    )
    timed = solver.compute_trajectory(0.0, 0.0)
    duration = float(timed.duration)
    points = max(POINTS_PER_SECTION, int(np.ceil(duration / TICK)))
    times = np.linspace(0.0, duration, points + 1)
    positions, rates = np.asarray(timed(times)), np.asarray(timed(times, 1))
    positions[[0, -1]], rates[[0, -1]] = ends[[0, -1]], 0.0
    # stretched until the cubics between the points keep the limits, too
    executed = hermite_motion(times, positions, rates)
    speed, acceleration = greatest_rates(executed, np.diff(times))
    excess = (speed / speeds).max(), np.sqrt((acceleration / accelerations).max())
    stretch = max(1.0, *map(float, excess))
    return TimedPoints(times * stretch, positions, rates / stretch)


def hermite_motion(times: FloatArray, positions: FloatArray, velocities: FloatArray) -> Motion:
    """Return the cubics that a controller puts between points, see `TimedPoints`."""
    widths = np.diff(times)[:, None]
    before, after = widths * velocities[:-1], widths * velocities[1:]
    way = positions[1:] - positions[:-1]
    powers = [positions[:-1], before, 3.0 * way - 2.0 * before - after, before + after - 2.0 * way]
    return Motion(positions, np.stack(powers, axis=1))


def greatest_rates(motion: Motion, widths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the greatest speed and acceleration of every joint, each (nq,).

    The segments of the motion take widths (segments,) [s].
    """
    _, c1, c2, c3 = motion.polynomials.transpose(1, 0, 2)
    w = widths[:, None]
    u = np.divide(-c2, 3.0 * c3, out=np.zeros_like(c2), where=c3 != 0.0)
    instants = np.zeros_like(c1), np.ones_like(c1), np.clip(u, 0.0, 1.0)
    speeds = [np.abs(c1 + x * (2.0 * c2 + 3.0 * x * c3)) / w for x in instants]
    accelerations = [np.abs(2.0 * c2 + 6.0 * x * c3) / w**2 for x in instants[:2]]
    return np.max(speeds, axis=(0, 1)), np.max(accelerations, axis=(0, 1))
