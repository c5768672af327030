"""Links as strings of touching circles or spheres (Rana & Zalzala 1995, Fig. 3).

Any number of arms, in the plane or in space, among static obstacles. Yes and no come
from `body_collision`; clearances, which are asked for at the ends of a search, from the centres
here.
"""

import itertools
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evoexp.collision.bodies.body_collision import (
    BodyCollision,
    Clearances,
    Shapes,
    contiguous_batch,
)
from evoexp.collision.bodies.covered_bodies import ArmCollision
from evoexp.errors import demand
from evoexp.numeric.elementary import DEGREE, matrix_product
from evoexp.records import FloatArray, IntArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import frame_poses
from evoexp.scenarios.obstacles import CAPSULE, CYLINDER, HALF_SPACE, SPHERE, obstacle_table
from evoexp.validation import Component, LayoutCount, Positive

MOST_PER_LINK = 1000  # spheres; every one is tested against those of the other arms


class TouchingSpheres(Component):
    """The collision model of Rana & Zalzala: spheres on every link that moves.

    Section 4.1 leaves out the columns.
    """

    # centres at equal distances from joint to joint, both ends included
    spheres_per_link: Annotated[int, Field(ge=1, le=MOST_PER_LINK)]
    # of every sphere [length unit]; two arms collide when centres are closer than the sum of
    # radii
    sphere_radius: Positive
    # configurations tested per segment of a path; 1: the via-points only, as in the paper
    collision_substeps: LayoutCount

    def bind(self, assembly: Assembly, obstacles: tuple[Any, ...]) -> "SphereCollision":
        """Return the model of a robot among obstacles, ready for batches."""
        has_tool = any(link.is_tool for link in assembly.links)
        must = "without tools: circles of one size cannot show them"
        demand(not has_tool, "robot", must, "tool_radius above 0")
        arms, moving, centers = self._placed(assembly)
        radii = np.full(len(arms), self.sphere_radius)
        # bodies of different arms against each other, and against obstacles
        arm_of = dict(zip(moving.tolist(), arms.tolist(), strict=True))
        between = [(j, k) for j, k in itertools.combinations(arm_of, 2) if arm_of[j] != arm_of[k]]
        arm_of_joints = [arm_of.get(joint, -1) for joint in range(assembly.model.njoints)]
        around = obstacle_table(obstacles).without_ellipses()
        shapes = Shapes(moving, centers, centers, radii, moving)
        collision = BodyCollision.build(assembly.table, shapes, around, between, (), arm_of_joints)
        about = assembly, shapes, between, around, collision
        return SphereCollision(*about, self.sphere_radius, np.bincount(arms))

    def _placed(self, assembly: Assembly) -> tuple[IntArray, IntArray, FloatArray]:
        """Return arm, joint and centre (3,) of each sphere on the links that move.

        Two links share a joint: the sphere at the end of the first counts, if it stands there for
        every q, and that at the beginning of the second does not.
        """
        parents, places = assembly.model.parents, assembly.model.jointPlacements
        num = self.spheres_per_link
        fractions = np.linspace(0.0, 1.0, num) if num > 1 else np.array([0.5])
        every, is_new = list[tuple[int, int, FloatArray]](), list[bool]()
        for link in (link for link in assembly.links if link.joint > 0):
            ends = [
                center
                for arm, joint, center in every
                if arm == link.arm and joint == parents[link.joint]
            ]
            begin = places[link.joint].translation
            for fraction in fractions:
                center = link.start + fraction * (link.end - link.start)
                repeats = not center.any() and any(np.array_equal(begin, end) for end in ends)
                every.append((link.arm, link.joint, center))
                is_new.append(not repeats)
        arms, joints, centers = zip(*itertools.compress(every, is_new), strict=True)
        return np.array(arms), np.array(joints, dtype=np.int64), np.array(centers)


@dataclass(frozen=True)
class SphereCollision(ArmCollision):
    """Touching spheres on one robot, and the obstacles around it."""

    radius: float  # of every sphere [length unit]
    counts: IntArray  # (arms,) spheres of each arm

    def clearance(self, q: FloatArray) -> Clearances:
        """Return the clearances of a batch of configurations (nq, configurations) [deg]."""
        q = DEGREE * contiguous_batch(q, self.collision.nq)
        table, pose = self.assembly.table, np.empty((12, q.shape[1]))
        centers = np.empty((len(self.shapes.joint), 3, q.shape[1]))
        for k, (joint, center) in enumerate(zip(*self.shapes[:2], strict=True)):
            local = np.append(np.eye(3), table.local(joint, center))
            frame_poses(table.chain, joint - 1, local, q, pose)
            centers[k] = pose[9:]
        squares = np.full(q.shape[1], np.inf)
        of_arms = np.split(centers, np.cumsum(self.counts)[:-1])
        for one, two in itertools.combinations(of_arms, 2):
            for center in one:
                x, y, z = (center - two).transpose(1, 0, 2)
                squares = np.minimum(squares, (x * x + y * y + z * z).min(axis=0))
        outside = np.full(q.shape[1], np.inf)
        for kind, middle, rotation, size in zip(*self.obstacles, strict=True):
            points = centers.transpose(0, 2, 1) - middle
            distances = _signed_distances(
                kind, size, matrix_product(points, rotation.reshape(3, 3))
            )
            outside = np.minimum(outside, distances.min(axis=0))
        return Clearances(outside - self.radius, np.sqrt(squares) - 2.0 * self.radius)


def _signed_distances(kind: int, size: FloatArray, points: FloatArray) -> FloatArray:
    """Return the signed distances of points (…, 3) in an obstacle's frame from its surface, (…)."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    if kind == HALF_SPACE:
        return z
    if kind in (SPHERE, CAPSULE):
        along = z - np.clip(z, -size[1], size[1])
        return np.asarray(np.sqrt(x * x + y * y + along * along) - size[0])
    beyond = [np.abs(x) - size[0], np.abs(y) - size[1], np.abs(z) - size[2]]
    if kind == CYLINDER:
        beyond = [np.sqrt(x * x + y * y) - size[0], np.abs(z) - size[1]]
    within = np.minimum(np.maximum.reduce(beyond), 0.0)
    squares = [np.maximum(off, 0.0) * np.maximum(off, 0.0) for off in beyond]
    return np.asarray(np.sqrt(sum(squares[1:], squares[0])) + within)
