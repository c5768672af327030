"""Links as strings of touching circles or spheres (Rana & Zalzala 1995, Fig. 3).

Any number of arms, in the plane or in space, among static obstacles.
"""

import itertools
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.collision.bodies.body_collision import BodyCollision, Clearances, FreeTest
from evoexp.collision.bodies.packing import Shapes
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table
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
        """Return the model of a robot among obstacles, ready for batches."""
        if any(link.is_tool for link in assembly.links):
            raise SettingError(
                "robot",
                "without tools: circles of one size cannot show them",
                "tool_radius above 0",
            )
        arms, moving, centers = self._placed(assembly)
        radii = np.full(len(arms), self.sphere_radius)
        # bodies of different arms against each other, and against obstacles
        arm_of = dict(zip(moving.tolist(), arms.tolist(), strict=True))
        between = [(j, k) for j, k in itertools.combinations(arm_of, 2) if arm_of[j] != arm_of[k]]
        arm_of_joints = [arm_of.get(joint, -1) for joint in range(assembly.model.njoints)]
        around = obstacle_table(obstacles).without_ellipses()
        shapes = Shapes(moving, centers, centers, radii, moving)
        collision = BodyCollision.build(assembly.table, shapes, around, between, (), arm_of_joints)
        counts = np.bincount(arms)
        return SphereCollision(assembly, self.sphere_radius, shapes, counts, around, collision)

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


class SphereCollision(NamedTuple):
    """Touching spheres on one robot, and the obstacles around it."""

    assembly: Assembly  # the robot
    radius: float  # of every sphere [length unit]
    shapes: Shapes  # the spheres
    counts: IntArray  # (arms,) spheres of each arm
    obstacles: ObstacleTable  # the obstacle table
    collision: BodyCollision  # the kernels' tables

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one configuration has: spheres of two arms, and with obstacles."""
        between = sum(int(a * b) for a, b in itertools.combinations(self.counts, 2))
        return between + len(self.shapes.joint) * len(self.obstacles.kind)

    def clearance(self, q: FloatArray) -> Clearances:
        """Return the clearances of a batch of configurations (nq, configurations) [deg]."""
        return self.collision.clearance(DEGREE * q)

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations (nq, configurations) [deg] collide."""
        return self.collision.collides(DEGREE * q)

    @property
    def free_test(self) -> FreeTest:
        """The test of configurations for kernels of other rooms."""
        return self.collision.free_test
