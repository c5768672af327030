"""Executed motions of robots of two links, in absolute link angles."""

import itertools
from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.planar_arms import Arm
from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion, cubic_motion, top_speeds
from evoexp.records import FloatArray
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults, wrapped

TOOL_SAMPLES = 20  # per segment, where end-effectors' distances from other robots are measured


class SampledMotion(NamedTuple):
    """A motion at many instants."""

    instants: FloatArray  # (samples,), whole numbers are the configurations
    links: FloatArray  # (samples, robots, 2) absolute link angles from +x [deg]
    # (samples, robots, 2) their turns per instant, at the right of each instant [deg]
    speeds: FloatArray

    @property
    def q(self) -> FloatArray:
        """(nq, samples) joint angles, of second links against the first [deg]."""
        relative = self.links.copy()
        relative[:, :, 1] -= relative[:, :, 0]
        return np.ascontiguousarray(relative.reshape(len(relative), -1).T)


def arms(prepared: Prepared) -> tuple[Arm, ...]:
    """Return base and link lengths of every robot."""
    return tuple(Arm((x, y), (one, two)) for x, y, one, two in prepared.problem.arms.tolist())


def executed(prepared: Prepared, solution: FloatArray) -> Motion:
    """Return the motion that a solution executes, in absolute link angles [rad].

    Straight lines or cubic curves lead from configuration to configuration, robot by robot.
    """
    polynomials = prepared.planner.motion(prepared.problem, solution).polynomials.copy()
    polynomials[..., 1::2] += polynomials[..., ::2]  # joints turn against the link before
    return cubic_motion(polynomials)


def sampled(motion: Motion, samples: int) -> SampledMotion:
    """Sample a motion in absolute link angles."""
    segments = motion.num_segments
    instants = np.arange(segments * samples + 1) / samples
    before = np.minimum(instants.astype(np.int64), segments - 1)
    u = (instants - before)[:, None]
    c0, c1, c2, c3 = motion.polynomials[before].transpose(1, 0, 2)
    shape = (len(instants), -1, 2)
    angles, speeds = c0 + u * (c1 + u * (c2 + u * c3)), c1 + u * (2.0 * c2 + 3.0 * u * c3)
    return SampledMotion(instants, angles.reshape(shape) / DEGREE, speeds.reshape(shape) / DEGREE)


def speed_limits(prepared: Prepared) -> FloatArray:
    """Return how far links may turn per sampling step (Eq. 2), (robots, 2) [deg]."""
    limit = wrapped(prepared.planner).speed_limit
    return np.array([limit.greatest_steps(arm.lengths) for arm in arms(prepared)])


def times_over_limit(prepared: Prepared, solution: FloatArray) -> float:
    """Return the greatest speed of any link during a motion, over its limit by Eq. 2 [-]."""
    turns = top_speeds(executed(prepared, solution)).reshape(-1, 2) / DEGREE
    return float(np.max(turns / speed_limits(prepared)))


def straight(prepared: Prepared) -> FloatArray:
    """Return the solution whose link angles go straight from start to goal, flat [deg]."""
    planner, problem = prepared
    ends = problem.start.ravel(), problem.goal.ravel()
    return motion_geometry.straight_line(planner.shape(problem), *ends) / DEGREE


def tool_distance(condition: ConditionResults) -> FloatArray:
    """Return how near any end-effector comes to a link of another robot, (done,) [length unit].

    Links and end-effectors have no thickness here.
    """
    prepared, found = condition.prepared, []
    robots = arms(prepared)
    for k in condition.summaries.index:
        motion = executed(prepared, condition.solutions[int(k)])
        links = np.radians(sampled(motion, TOOL_SAMPLES).links)
        chains = []  # of each robot: base, elbows, tips
        for r, arm in enumerate(robots):
            points = arm.outlines(links[:, r, :, None])[:, :4, 0]
            base = np.broadcast_to(arm.base, (len(links), 2))
            chains.append((base, points[:, :2], points[:, 2:]))
        distances = (
            to_segment(own[-1], start, end)
            for own, other in itertools.permutations(chains, 2)
            for start, end in itertools.pairwise(other)
        )
        found.append(min(distances))
    return np.array(found)


def to_segment(points: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the least distance of points from segments, row by row; each (rows, 2)."""
    along = end - start
    share = np.clip(((points - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    return float(np.sqrt(((points - start - share[:, None] * along) ** 2).sum(axis=1)).min())
