"""Links as strings of touching circles or spheres (Rana & Zalzala 1995, Fig. 3).

Any number of arms, in the plane or in space, among static obstacles. Yes and no come from
`planar_contacts` or `body_collision`; clearances, which are asked for at the ends of a search, from
the centres here.
"""

import itertools
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.collision.bodies.body_collision import BodyCollision, Clearances, FreeTest
from evoexp.collision.bodies.body_shapes import Shapes
from evoexp.collision.bodies.planar_contacts import CircleTables, contacts, link_lines
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.poses import frame_poses
from evoexp.scenarios.obstacles import (
    CAPSULE,
    CYLINDER,
    HALF_SPACE,
    SPHERE,
    ObstacleTable,
    obstacle_table,
)
from evoexp.validation import Component, LayoutCount, Positive

MOST_PER_LINK = 1000  # spheres; every one is tested against those of the other arms


class TouchingSpheres(Component):
    """The collision model of Rana & Zalzala: spheres on every link that moves.

    Section 4.1 leaves out the columns.
    """

    component: ClassVar[str] = "touching_spheres"

    # centres at equal distances from joint to joint, both ends included
    spheres_per_link: Annotated[int, Field(ge=1, le=MOST_PER_LINK)]
    # of every sphere [length unit]; two arms collide when centres are closer than the sum of
    # radii
    sphere_radius: Positive
    # configurations tested per segment of a path; 1: the via-points only, as in the paper
    collision_substeps: LayoutCount

    def bind(self, assembly: Assembly, obstacles: tuple[Any, ...]) -> "SphereCollision":
        """Return the model of a robot among obstacles, ready for batches.

        Raises:
            SettingError: If an obstacle is an ellipse, or a robot has a tool.
        """
        if any(link.is_tool for link in assembly.links):
            raise SettingError(
                "robot",
                "without tools: circles of one size cannot show them",
                "tool_radius above 0",
            )
        every = [
            sphere
            for link in assembly.links
            if link.joint > 0
            for sphere in self._of_link(assembly, link)
        ]
        kept = [
            s for k, s in enumerate(every) if s.center.any() or not any(map(s.repeats, every[:k]))
        ]
        moving = np.array([sphere.joint for sphere in kept], dtype=np.int64)
        centers = np.array([sphere.center for sphere in kept])
        arms = np.array([sphere.arm for sphere in kept])
        radii, table = np.full(len(kept), self.sphere_radius), assembly.table
        local = np.array([table.local(sphere.joint, sphere.center) for sphere in kept])
        spheres, of_arms = Spheres(moving - 1, local, self.sphere_radius), _ranges(arms)
        # the general model: bodies of different arms against each other, and against obstacles
        arm_of = dict(zip(moving.tolist(), arms.tolist(), strict=True))
        between = [(j, k) for j, k in itertools.combinations(arm_of, 2) if arm_of[j] != arm_of[k]]
        arm_of_joints = [arm_of.get(joint, -1) for joint in range(assembly.model.njoints)]
        around = obstacle_table(obstacles).without_ellipses()
        shapes = Shapes(moving, centers, centers, radii)
        general = BodyCollision.build(
            assembly.model, shapes, around, between, (), arm_of_joints, table
        )
        # the planar one, of links as lines of circles
        links = np.cumsum(np.diff(moving, prepend=moving[0]) != 0)
        of_links = _ranges(links)
        arm_links = _ranges(arms[of_links[:, 0]])
        lines = link_lines(table.chain, *spheres, of_links, arm_links)
        if not table.planar or len(around.kind):
            lines = lines._replace(scale=np.inf)
        tables = CircleTables(table.chain, lines, general.tables)
        return SphereCollision(assembly, spheres, shapes, of_arms, around, general, tables)

    def _of_link(self, assembly: Assembly, link: Any) -> list["_Sphere"]:
        fractions = (
            np.linspace(0.0, 1.0, self.spheres_per_link)
            if self.spheres_per_link > 1
            else np.array([0.5])
        )
        centers = [link.start + f * (link.end - link.start) for f in fractions]
        return [_Sphere(link.arm, link.joint, center, assembly) for center in centers]


class _Sphere(NamedTuple):
    arm: int
    joint: int
    center: FloatArray
    assembly: Assembly

    def repeats(self, other: "_Sphere") -> bool:
        """Whether it ends the other's link at the joint that both share: one point for every q."""
        model = self.assembly.model
        if self.arm != other.arm or model.parents[self.joint] != other.joint or self.center.any():
            return False
        return bool(np.array_equal(model.jointPlacements[self.joint].translation, other.center))


def _ranges(owners: IntArray) -> IntArray:
    """Return (owners, 2): where each owner's run begins and ends in a sorted list of owners."""
    return np.array(
        [
            [np.searchsorted(owners, k), np.searchsorted(owners, k, side="right")]
            for k in range(owners[-1] + 1)
        ]
    )


class Spheres(NamedTuple):
    """Spheres of one size, fixed to joints."""

    joint: IntArray  # (spheres,) index into the kinematic table, arm by arm
    local: FloatArray  # (spheres, 3) centres in the table's frames [length unit]
    radius: float  # of every sphere [length unit]


class SphereCollision(NamedTuple):
    """Touching spheres on one robot, and the obstacles around it."""

    assembly: Assembly  # the robot
    spheres: Spheres  # the spheres
    shapes: Shapes  # the same in the frames of Pinocchio's joints
    arm_spheres: IntArray  # (arms, 2) first and one-past-last sphere of each arm
    obstacles: ObstacleTable  # the obstacle table
    general: BodyCollision  # the same spheres in the model of spheres and capsules
    tables: CircleTables  # for the kernel `contacts`

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one configuration has: spheres of two arms, and with obstacles."""
        own = [int(stop - first) for first, stop in self.arm_spheres]
        between = sum(a * b for a, b in itertools.combinations(own, 2))
        return between + sum(own) * len(self.obstacles.kind)

    @property
    def radius(self) -> float:
        """Radius of every sphere [length unit]."""
        return self.spheres.radius

    def clearance(self, q: FloatArray) -> Clearances:
        """Return the clearances of a batch of configurations (nq, configurations) [deg].

        Raises:
            ValueError: If q has another number of rows than the robot has joints.
        """
        centers = self._centers(DEGREE * self._checked(q))
        squares = np.full(q.shape[1], np.inf)
        for (first, stop), (begin, end) in itertools.combinations(self.arm_spheres, 2):
            for center in centers[first:stop]:
                x, y, z = (center - centers[begin:end]).transpose(1, 0, 2)
                squares = np.minimum(squares, (x * x + y * y + z * z).min(axis=0))
        outside = np.full(q.shape[1], np.inf)
        for kind, middle, rotation, size in zip(*self.obstacles, strict=True):
            points = centers.transpose(0, 2, 1) - middle
            distances = _signed_distances(
                kind, size, matrix_product(points, rotation.reshape(3, 3))
            )
            outside = np.minimum(outside, distances.min(axis=0))
        return Clearances(outside - self.radius, np.sqrt(squares) - 2.0 * self.radius)

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations collide, (configurations,): where `clearance` is negative.

        Raises:
            ValueError: If q has another number of rows than the robot has joints.
        """
        q = self._checked(q)
        out = np.empty(q.shape[1])
        contacts(self.tables, q, 0, out)
        return np.asarray(~(out >= 0.0))

    @property
    def free_test(self) -> FreeTest:
        """The test of configurations for kernels of other rooms."""
        return self.general.free_test

    def _centers(self, q: FloatArray) -> FloatArray:
        """Return the centres (spheres, 3, configurations) at q (nq, configurations) [rad]."""
        chain, pose = self.assembly.table.chain, np.empty((12, q.shape[1]))
        centers = np.empty((len(self.spheres.joint), 3, q.shape[1]))
        for k, (joint, local) in enumerate(zip(*self.spheres[:2], strict=True)):
            frame_poses(chain, joint, np.append(np.eye(3), local), q, pose)
            centers[k] = pose[9:]
        return centers

    def _checked(self, q: FloatArray) -> FloatArray:
        nq = self.assembly.table.num_coordinates
        q = np.ascontiguousarray(q, dtype=np.float64)
        if q.ndim != 2 or q.shape[0] != nq:
            raise ValueError(f"q must have shape ({nq}, configurations), was {q.shape}")
        return q


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
