"""Geometry of stored motions: places of links, outlines of obstacles, distances of bodies."""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pinocchio as pin
from scipy.spatial import ConvexHull

from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import BOX, CYLINDER, ELLIPSE, HALF_SPACE, SPHERE, ObstacleTable

OUTLINE_POINTS = 49  # of a round obstacle
LINK = ["arm", "link", "x", "y", "z", "x_end", "y_end", "z_end"]  # columns of `links_table`


class Nearest(NamedTuple):
    """The two nearest points of two bodies."""

    distance: float  # between them
    points: FloatArray  # (2, 3)


def configurations(prepared: Prepared, solution: FloatArray) -> FloatArray:
    """Return the configurations of a solution's motion, (nq, instants) [deg]."""
    return np.ascontiguousarray(prepared.planner.motion(prepared.problem, solution).q.T / DEGREE)


def straight_line(
    shape: Sequence[tuple[int, int]], start: FloatArray, goal: FloatArray
) -> FloatArray:
    """Return the solution that goes straight from start to goal in equal steps, flat.

    Args:
        shape: Of a solution, part by part: (rows, joints).
        start: (sum of joints,).
        goal: (sum of joints,) in the same unit.
    """
    parts, first = [], 0
    for rows, joints in shape:
        own, share = slice(first, first + joints), np.linspace(0.0, 1.0, rows)[:, None]
        parts.append(((1.0 - share) * start[own] + share * goal[own]).ravel())
        first += joints
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
    frames = list(_frames(assembly, q))
    numbers = [0] * assembly.num_arms
    for link in assembly.links:
        start, end = (
            np.array([frame[link.joint] @ np.append(point, 1.0) for frame in frames])[:, :3]
            for point in (link.start, link.end)
        )
        yield link.arm, numbers[link.arm], start, end
        numbers[link.arm] += 1


def obstacle_outlines(table: ObstacleTable, reach: float = 1.0) -> list[FloatArray]:
    """Return the closed outlines of obstacles as seen along z, each (points, 2).

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


class BodyDistance:
    """Exact distances between bodies, by coal."""

    def __init__(self, model: Any, geometry: Any) -> None:
        """Take a robot and the pairs of bodies that are looked at.

        Args:
            model: A `pin.Model`.
            geometry: A `pin.GeometryModel` with its collision pairs.
        """
        self._model, self._geometry = model, geometry
        self._data, self._placements = model.createData(), geometry.createData()

    def nearest(self, q: FloatArray, pair: int | None = None) -> Nearest:
        """Return the nearest points of two bodies at one configuration (nq,) [rad].

        Args:
            q: The configuration.
            pair: Number of the pair; None: the closest one.

        Returns:
            The points with their distance, 0 where bodies touch.
        """
        pin.computeDistances(self._model, self._data, self._geometry, self._placements, q)
        results = list(self._placements.distanceResults)
        least = min(results if pair is None else [results[pair]], key=lambda r: r.min_distance)
        points = np.array([least.getNearestPoint1(), least.getNearestPoint2()])
        return Nearest(max(0.0, float(least.min_distance)), points)

    def __call__(self, q: FloatArray) -> FloatArray:
        """Return the least distance at each configuration (nq, configurations) [rad]."""
        robot, results = (self._model, self._data, self._geometry), self._placements.distanceResults
        least = np.empty(q.shape[1])
        for k, one in enumerate(np.ascontiguousarray(q.T)):
            closest = pin.computeDistances(*robot, self._placements, one)
            least[k] = max(0.0, results[closest].min_distance)
        return least


def link_distance(assembly: Assembly) -> BodyDistance:
    """Return the distances between links of different arms, on the robot's own geometry."""
    geometry = assembly.geometry.copy()
    for a, first in enumerate(assembly.links):
        for b, second in enumerate(assembly.links[:a]):
            if first.arm != second.arm:
                geometry.addCollisionPair(pin.CollisionPair(b, a))
    return BodyDistance(assembly.model, geometry)


def links_table(assembly: Assembly, q: FloatArray) -> pd.DataFrame:
    """Return all links at every instant of a motion.

    Args:
        assembly: The robot.
        q: (nq, instants) [deg].

    Returns:
        Columns instant, arm, link, x, y, z, x_end, y_end, z_end [length unit], link by link.
    """
    rows = [
        (instant, arm, link, *start[instant], *end[instant])
        for arm, link, start, end in joint_positions(assembly, q)
        for instant in range(q.shape[1])
    ]
    return pd.DataFrame(rows, columns=["instant", *LINK])


def in_stages(table: pd.DataFrame, num_stages: int) -> pd.DataFrame:
    """Return the rows of a motion's instants stage by stage, and all of them as the last stage.

    Args:
        table: With the column instant, whole numbers from 0 on.
        num_stages: Stages that the motion is cut into, as far as it has instants.

    Returns:
        The columns of the table, stage, first and last (instants of the stage); an instant between
        two stages belongs to both.
    """
    last = int(table["instant"].max())
    cuts = np.unique(np.round(np.linspace(0, last, min(num_stages, last) + 1)).astype(np.int64))
    parts = [
        table[table["instant"].between(first, stop)].assign(stage=stage, first=first, last=stop)
        for stage, (first, stop) in enumerate([*itertools.pairwise(cuts), (0, last)])
    ]
    return pd.concat(parts, ignore_index=True)


def _frames(assembly: Assembly, q: FloatArray) -> Iterator[FloatArray]:
    """Yield the placements of all joints at each configuration, (joints, 4, 4)."""
    data = assembly.model.createData()
    for configuration in q.T:
        pin.forwardKinematics(assembly.model, data, DEGREE * configuration)
        yield np.array([placement.homogeneous for placement in data.oMi])
