"""Executed motions of robots of two links, in absolute link angles.

Straight or curved between configurations.
"""

from typing import NamedTuple

import numpy as np

from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion, cubic_motion, top_speeds
from evoexp.records import FloatArray
from evoexp.report.results import WRAPPED


class Sampled(NamedTuple):
    """A motion at many instants.

    Attributes:
        instants: (samples,), whole numbers are the configurations.
        links: (samples, robots, 2) absolute link angles from +x [deg].
        speeds: (samples, robots, 2) their turns per instant, at the right of each instant [deg].
    """

    instants: FloatArray
    links: FloatArray
    speeds: FloatArray

    @property
    def q(self) -> FloatArray:
        """(nq, samples) joint angles, of second links against the first [deg]."""
        relative = self.links.copy()
        relative[:, :, 1] -= relative[:, :, 0]
        return np.ascontiguousarray(relative.reshape(len(relative), -1).T)


def executed(prepared: Prepared, solution: FloatArray) -> Motion:
    """Return what is executed of a solution, in absolute link angles [rad], robot by robot."""
    polynomials = prepared.planner.motion(prepared.problem, solution).polynomials.copy()
    links = polynomials.reshape(
        *polynomials.shape[:2], -1, 2
    )  # joints turn against the link before
    links[..., 1] += links[..., 0]
    return cubic_motion(polynomials)


def sampled(motion: Motion, samples: int) -> Sampled:
    """Sample a motion in absolute link angles.

    Args:
        motion: Of `executed`.
        samples: Per segment.
    """
    segments = motion.num_segments
    instants = np.arange(segments * samples + 1) / samples
    before = np.minimum(instants.astype(np.int64), segments - 1)
    u = (instants - before)[:, None]
    c0, c1, c2, c3 = motion.polynomials[before].transpose(1, 0, 2)
    shape = (len(instants), -1, 2)
    angles, speeds = c0 + u * (c1 + u * (c2 + u * c3)), c1 + u * (2.0 * c2 + 3.0 * u * c3)
    return Sampled(instants, angles.reshape(shape) / DEGREE, speeds.reshape(shape) / DEGREE)


def speed_limits(prepared: Prepared) -> FloatArray:
    """Return how far either link of every robot may turn per sampling step (Curkovic et al.

    2013, Eq. 2).

    Returns:
        (robots, 2) [deg].
    """
    arms = prepared.problem.collision.arms
    limit = getattr(prepared.planner, WRAPPED, prepared.planner).speed_limit
    return np.array([limit.greatest_steps(arm.lengths) for arm in arms])


def times_over_limit(prepared: Prepared, solution: FloatArray) -> float:
    """Return the greatest speed of any link over what Eq.

    2 allows it, at a motion's fastest instant [-].
    """
    turns = top_speeds(executed(prepared, solution)).reshape(-1, 2) / DEGREE
    return float(np.max(turns / speed_limits(prepared)))


def straight(prepared: Prepared) -> FloatArray:
    """Return the solution whose link angles go straight from start to goal, flat [deg]."""
    problem, parts = prepared.problem, []
    for start, goal, (rows, _) in zip(
        problem.start, problem.goal, prepared.planner.shape(problem), strict=True
    ):
        share = np.linspace(0.0, 1.0, rows)[:, None]
        parts.append((((1.0 - share) * start + share * goal) / DEGREE).ravel())
    return np.concatenate(parts)
