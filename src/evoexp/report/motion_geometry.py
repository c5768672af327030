"""Geometry of stored motions: where links and circles are, and how far the arms are apart."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import BOX, CYLINDER, ELLIPSE, HALF_SPACE, SPHERE, ObstacleTable

OUTLINE_POINTS = 49  # of a round obstacle


class Nearest(NamedTuple):
    """Two nearest points of two arms.

    Attributes:
        distance: Between them.
        points: (2, 3).
    """

    distance: float
    points: FloatArray


def configurations(prepared: Prepared, solution: FloatArray) -> FloatArray:
    """Return the instants of a solution's motion, (nq, instants) [deg]."""
    return np.ascontiguousarray(prepared.planner.motion(prepared.problem, solution).q.T / DEGREE)


def straight_line(prepared: Prepared) -> FloatArray:
    """Return the solution whose arms go straight from start to goal in configuration space.

    Flat [deg].
    """
    problem, parts = prepared.problem, []
    for (first, stop), (rows, _) in zip(
        problem.arm_slices, prepared.planner.shape(problem), strict=True
    ):
        share = np.linspace(0.0, 1.0, rows)[:, None]
        parts.append(
            ((1.0 - share) * problem.start[first:stop] + share * problem.goal[first:stop]).ravel()
        )
    return np.concatenate(parts)


def dense(q: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """Return a motion sampled along its straight segments.

    Args:
        q: (nq, instants).
        samples: Per segment.

    Returns:
        Times in instants, (segments · samples + 1,), and configurations, (nq, the same).
    """
    times = np.arange((q.shape[1] - 1) * samples + 1) / samples
    before = np.minimum(times.astype(np.int64), q.shape[1] - 2)
    share = times - before
    return times, (1.0 - share) * q[:, before] + share * q[:, before + 1]


def joint_positions(
    assembly: Assembly, q: FloatArray
) -> Iterator[tuple[int, int, FloatArray, FloatArray]]:
    """Yield (arm, link of the arm, start (instants, 3), end (instants, 3)) of every link.

    Args:
        assembly: The robot.
        q: (nq, instants) [deg].
    """
    frames = [frame.copy() for frame in _frames(assembly, q)]
    numbers = [0] * assembly.num_arms
    for link in assembly.links:
        start = np.array([frame[link.joint] @ np.append(link.start, 1.0) for frame in frames])[
            :, :3
        ]
        end = np.array([frame[link.joint] @ np.append(link.end, 1.0) for frame in frames])[:, :3]
        yield link.arm, numbers[link.arm], start, end
        numbers[link.arm] += 1


def obstacle_outlines(table: ObstacleTable, reach: float = 1.0) -> list[FloatArray]:
    """Return the outlines of obstacles as seen along z, each (points, 2).

    First and last point the same.

    Args:
        table: The obstacles.
        reach: A half-space is drawn as a strip of this length to both sides of its point, a tenth
            of it deep.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, OUTLINE_POINTS)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    outlines = []
    for kind, center, rotation, size in zip(*table, strict=True):
        matrix = rotation.reshape(3, 3)
        if kind == BOX:
            corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 0)]) * size
            outline = (corners @ matrix.T)[:, :2]
        elif kind == CYLINDER:
            ends = [
                np.column_stack([size[0] * circle, np.full(len(circle), z)])
                for z in (-size[1], size[1])
            ]
            points = (np.vstack(ends) @ matrix.T)[:, :2]
            hull = ConvexHull(points).vertices
            outline = points[[*hull, hull[0]]]
        elif kind == ELLIPSE:
            outline = (circle * size[:2]) @ matrix[:2, :2].T
        elif kind == HALF_SPACE:
            inward = -matrix[:2, 2]
            along, depth = reach * np.array([-inward[1], inward[0]]), 0.1 * reach * inward
            outline = np.array([along, -along, depth - along, depth + along, along])
        else:
            along = np.zeros(2) if kind == SPHERE else size[1] * matrix[:2, 2]
            outline = size[0] * circle + np.where((circle @ along >= 0.0)[:, None], along, -along)
            if (
                kind != SPHERE and along.any()
            ):  # the outline begins where it turns from one end to the other
                first = int(np.argmax(np.diff(circle @ along >= 0.0))) + 1
                outline = np.roll(outline[:-1], -first, axis=0)
                outline = np.vstack([outline, outline[:1]])
        outlines.append(outline + center[:2])
    return outlines


def sphere_centres(collision: Any, q: FloatArray) -> list[FloatArray]:
    """Return the centres of the collision model's circles or spheres at one configuration.

    Per arm (spheres, 3).

    Args:
        collision: The bound collision model.
        q: (nq,) [deg].
    """
    model, geometry = collision.assembly.model, collision.geometry
    data, placements = model.createData(), geometry.createData()
    pin.updateGeometryPlacements(model, data, geometry, placements, DEGREE * q)
    centres = np.array([placement.translation for placement in placements.oMg])
    return [centres[first:stop] for first, stop in collision.arm_spheres]


def centre_distances(problem: Any, q: FloatArray) -> FloatArray:
    """Return the least distance of circle centres of two arms, as the paper draws it.

    Args:
        problem: With its bound collision model.
        q: (nq, configurations) [deg].

    Returns:
        (configurations,) [length unit].
    """
    return np.asarray(problem.collision.clearance(q).between_arms + 2.0 * problem.collision.radius)


class LinkDistance:
    """Exact distances between the links of different arms.

    Coal, on the shapes that the robot is made of.
    """

    def __init__(self, assembly: Assembly) -> None:
        """Take the robot's own geometry and pair the links of different arms."""
        self._model, self._data = assembly.model, assembly.model.createData()
        self._geometry = assembly.geometry.copy()
        for a, first in enumerate(assembly.links):
            for b, second in enumerate(assembly.links[:a]):
                if first.arm != second.arm:
                    self._geometry.addCollisionPair(pin.CollisionPair(b, a))
        self._placements = self._geometry.createData()
        self._pairs = range(len(self._geometry.collisionPairs))

    def nearest(self, q: FloatArray) -> Nearest:
        """Return the nearest points of two arms at one configuration (nq,) [deg].

        0 where links cross.
        """
        self._compute(q)
        results = [self._placements.distanceResults[k] for k in self._pairs]
        least = min(results, key=lambda result: float(result.min_distance))
        points = np.array([least.getNearestPoint1(), least.getNearestPoint2()])
        return Nearest(max(0.0, float(least.min_distance)), points)

    def __call__(self, q: FloatArray) -> FloatArray:
        """Return the least distance at each configuration (nq, configurations) [deg].

        0 where links cross.
        """
        distances = np.empty(q.shape[1])
        for k, configuration in enumerate(np.ascontiguousarray(q.T)):
            self._compute(configuration)
            distances[k] = min(
                self._placements.distanceResults[pair].min_distance for pair in self._pairs
            )
        return np.maximum(distances, 0.0)

    def _compute(self, q: FloatArray) -> None:
        pin.updateGeometryPlacements(
            self._model, self._data, self._geometry, self._placements, DEGREE * q
        )
        pin.computeDistances(self._geometry, self._placements)


def _frames(assembly: Assembly, q: FloatArray) -> Iterator[FloatArray]:
    """Yield the placements of all joints at each configuration, (joints, 4, 4)."""
    data = assembly.model.createData()
    for configuration in q.T:
        pin.forwardKinematics(assembly.model, data, DEGREE * configuration)
        yield np.array([placement.homogeneous for placement in data.oMi])
