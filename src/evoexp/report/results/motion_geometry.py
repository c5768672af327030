"""Geometry of stored motions: places of links, outlines of obstacles, distances and contacts.

Motions are looked at one after the other and not kept, so that ten thousand take no more memory
than one.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pandas as pd
import pinocchio as pin
from scipy.spatial import ConvexHull

from evoexp.collision.certifier.certificate import PAIR
from evoexp.collision.certifier.task import LeastDistance, known
from evoexp.collision.scene import Scene
from evoexp.condition import Prepared
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.report.results.stored_results import ConditionResults
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import BOX, CYLINDER, ELLIPSE, HALF_SPACE, SPHERE, ObstacleTable

OUTLINE_POINTS = 49  # of a round obstacle
Measure = Callable[[FloatArray], FloatArray]  # (nq, configurations) → (configurations,)
LINK = ["arm", "link", "x", "y", "z", "x_end", "y_end", "z_end"]  # columns of `links_table`


def configurations(prepared: Prepared, solution: FloatArray) -> FloatArray:
    """Return the configurations of a solution's motion, (nq, instants) [deg]."""
    return np.ascontiguousarray(prepared.planner.motion(prepared.problem, solution).q.T / DEGREE)


def straight_line(
    shape: Sequence[tuple[int, int]], start: FloatArray, goal: FloatArray
) -> FloatArray:
    """Return the solution that goes straight from start to goal, (sum of joints,), flat.

    It has equal steps; the shape of a solution is (rows, joints), part by part.
    """
    parts, first = [], 0
    for rows, joints in shape:
        own, share = slice(first, first + joints), np.linspace(0.0, 1.0, rows)[:, None]
        parts.append(((1.0 - share) * start[own] + share * goal[own]).ravel())
        first += joints
    return np.concatenate(parts)


def dense(q: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    """Return times (n,) and configurations (nq, n) of q (nq, instants), sampled per segment."""
    times = np.arange((q.shape[1] - 1) * samples + 1) / samples
    before = np.minimum(times.astype(np.int64), q.shape[1] - 2)
    share = times - before
    return times, (1.0 - share) * q[:, before] + share * q[:, before + 1]


def joint_positions(
    assembly: Assembly, q: FloatArray
) -> Iterator[tuple[int, int, FloatArray, FloatArray]]:
    """Yield (arm, its link, start (instants, 3), end (instants, 3)) at q (nq, instants) [deg]."""
    data, frames = assembly.model.createData(), list[FloatArray]()
    for configuration in q.T:
        pin.forwardKinematics(assembly.model, data, DEGREE * configuration)
        frames.append(np.array([place.homogeneous for place in data.oMi]))  # (joints, 4, 4)
    numbers = [0] * assembly.num_arms
    for link in assembly.links:
        start, end = (
            np.array([frame[link.joint] @ np.append(point, 1.0) for frame in frames])[:, :3]
            for point in (link.start, link.end)
        )
        yield link.arm, numbers[link.arm], start, end
        numbers[link.arm] += 1


def obstacle_outlines(table: ObstacleTable, reach: float = 1.0) -> Iterator[FloatArray]:
    """Yield the closed outlines of obstacles as seen along z, each (points, 2).

    A half-space is a strip of length `reach` to both sides of its point, a tenth of it deep.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, OUTLINE_POINTS)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
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
            # the outline begins where it turns from one end to the other
            if kind != SPHERE and along.any():
                first = int(np.argmax(np.diff(circle @ along >= 0.0))) + 1
                outline = np.roll(outline[:-1], -first, axis=0)
                outline = np.vstack([outline, outline[:1]])
        yield outline + center[:2]


class BodyDistance:
    """Exact distances between the bodies of a scene's pairs, by coal."""

    def __init__(self, scene: Scene) -> None:
        self._model, self._geometry = scene.model, scene.geometry.copy()
        self._geometry.removeAllCollisionPairs()
        for one, two in scene.pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(int(one), int(two)))
        self._data, self._placements = self._model.createData(), self._geometry.createData()

    def nearest(self, q: FloatArray, pair: int | None = None) -> tuple[float, FloatArray]:
        """Return distance and nearest points (2, 3) of a pair of bodies at q (nq,) [rad].

        None: of the closest pair. Where bodies touch the distance is 0.
        """
        robot = self._model, self._data, self._geometry
        closest = pin.computeDistances(*robot, self._placements, q)
        least = self._placements.distanceResults[closest if pair is None else pair]
        points = np.array([least.getNearestPoint1(), least.getNearestPoint2()])
        return max(0.0, float(least.min_distance)), points

    def __call__(self, q: FloatArray) -> FloatArray:
        """Return the least distance at each configuration (nq, configurations) [rad]."""
        return np.array([self.nearest(each)[0] for each in np.ascontiguousarray(q.T)])


def links_table(assembly: Assembly, q: FloatArray) -> pd.DataFrame:
    """Return all links at every instant of a motion, q (nq, instants) [deg], link by link."""
    rows = [
        (instant, arm, link, *start[instant], *end[instant])
        for arm, link, start, end in joint_positions(assembly, q)
        for instant in range(q.shape[1])
    ]
    return pd.DataFrame(rows, columns=["instant", *LINK])


def in_stages(table: pd.DataFrame, num_stages: int) -> pd.DataFrame:
    """Return the rows of a motion's instants stage by stage, and all of them as the last stage.

    The column instant holds whole numbers from 0 on; stage, first and last (instants of the stage)
    are added. An instant between two stages belongs to both.
    """
    last = int(table["instant"].max())
    cuts = np.unique(np.round(np.linspace(0, last, min(num_stages, last) + 1)).astype(np.int64))
    parts = [
        table[table["instant"].between(first, stop)].assign(stage=stage, first=first, last=stop)
        for stage, (first, stop) in enumerate([*itertools.pairwise(cuts), (0, last)])
    ]
    return pd.concat(parts, ignore_index=True)


def refuted(condition: ConditionResults) -> dict[int, tuple[float, str]]:
    """Return the first contact of every refuted motion: replicate → (instant, its pair)."""
    rows = condition.summaries[condition.summaries["refuted_at"].notna()]
    columns = zip(rows.index, rows["refuted_at"], rows["refuted_pair"], strict=True)
    return {int(k): (float(instant), str(pair)) for k, instant, pair in columns}


def contact(
    prepared: Prepared, solution: FloatArray, instant: float, pair: str
) -> tuple[float, float]:
    """Return the point in the plane, (x, y), at which two bodies touch."""
    planner, problem = prepared
    motion = planner.motion(problem, solution)
    scene = next(p.scene for p in planner.parts(problem, motion) if p.first <= instant <= p.last)
    number = [PAIR.join(scene.pair_names(k)) for k in range(len(scene.pairs))].index(pair)
    _, points = BodyDistance(scene).nearest(motion.at(instant), number)
    x, y, _ = np.mean(points, axis=0)
    return float(x), float(y)


def extremes(
    replicates: Sequence[int], sampled: Callable[[int], FloatArray], measure: Measure
) -> tuple[FloatArray, FloatArray]:
    """Return the configurations of the least and of the greatest value at each instant.

    Both are (nq, instants), of the first replicate of several; `sampled` gives a replicate's
    motion, (nq, instants), and all are equally long.
    """
    first, *others = replicates
    at_lowest = at_highest = sampled(first)
    lowest = highest = measure(at_lowest)
    for replicate in others:
        q = sampled(replicate)
        values = measure(q)
        at_lowest = np.where(values < lowest, q, at_lowest)
        at_highest = np.where(values > highest, q, at_highest)
        lowest, highest = np.minimum(lowest, values), np.maximum(highest, values)
    return at_lowest, at_highest


def distance_measure(scene: Scene) -> Measure:
    """Return a quick measure of a scene's least distance; coal where it alone knows bodies."""
    return LeastDistance(scene) if known(scene) else BodyDistance(scene)
