"""Links as strings of touching circles or spheres (Rana & Zalzala 1995, Fig. 3).

Any number of arms, in the plane or in space, among static obstacles; the kernels are in
`sphere_kernels`.
"""

import itertools
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.collision.models.obstacle_kernels import MARGIN, LinkBalls
from evoexp.collision.models.planar_contacts import contacts
from evoexp.collision.models.sphere_kernels import (
    LINE_COLUMNS,
    LinkLines,
    Space,
    Spheres,
    SphereTables,
    any_contact,
    clearances,
    flat_spheres,
)
from evoexp.errors import SettingError
from evoexp.numeric.elementary import atan2
from evoexp.numeric.quarter_turns import QUARTER_TURN
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.assembly import Assembly, sphere_geometry
from evoexp.robots.kinematics import KinematicChain
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
        spheres = [
            sphere
            for link in assembly.links
            if link.joint > 0
            for sphere in self._of_link(assembly, link)
        ]
        kept = [
            s
            for k, s in enumerate(spheres)
            if s.center.any() or not any(map(s.repeats, spheres[:k]))
        ]
        joint = np.array([sphere.joint - 1 for sphere in kept], dtype=np.int64)
        local = np.array([assembly.table.local(sphere.joint, sphere.center) for sphere in kept])
        arms = np.array([sphere.arm for sphere in kept])
        links = np.cumsum(np.diff(joint, prepend=joint[0]) != 0)
        link_arms = np.array([arms[np.argmax(links == k)] for k in range(links[-1] + 1)])
        of_links, of_arms = _ranges(links, links[-1] + 1), _ranges(link_arms, assembly.num_arms)
        fixed, table = Spheres(joint, local, self.sphere_radius), assembly.table
        around = obstacle_table(obstacles).without_ellipses()
        space: Space = None if table.planar else True
        balls = _balls(joint, local, of_links, of_arms)
        lines = sphere_lines(table.chain, fixed, of_links)
        return SphereCollision(
            assembly,
            fixed,
            _ranges(arms, assembly.num_arms),
            around,
            flat_spheres(SphereTables(table.chain, space, fixed, balls, around, lines)),
            sphere_geometry(
                assembly,
                np.array([sphere.center for sphere in kept]),
                np.array([sphere.joint for sphere in kept]),
                np.full(len(kept), self.sphere_radius),
            ),
        )

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


def _balls(joint: IntArray, local: FloatArray, spheres: IntArray, arm_links: IntArray) -> LinkBalls:
    """Return a ball around the centres of every link's spheres."""
    middle = np.array([0.5 * (local[a:b].min(axis=0) + local[a:b].max(axis=0)) for a, b in spheres])
    squares = [
        ((local[a:b] - center) ** 2).sum(axis=1).max()
        for (a, b), center in zip(spheres, middle, strict=True)
    ]
    return LinkBalls(joint[spheres[:, 0]], middle, np.sqrt(squares), spheres, arm_links)


def sphere_lines(chain: KinematicChain, spheres: Spheres, of_links: IntArray) -> LinkLines:
    """Return the spheres of every link as equal steps along a line."""
    rows = np.zeros((len(of_links), LINE_COLUMNS))
    reach = np.sqrt((chain.translation**2).sum(axis=1)).sum() + 2.0 * spheres.radius
    reach += np.sqrt((spheres.local**2).sum(axis=1)).max()
    scale = 2.0 * float(reach)
    for row, (first, stop) in zip(rows, of_links, strict=True):
        own = spheres.local[first:stop]
        steps = len(own) - 1 if (own[-1] != own[0]).any() else 0
        step = (own[-1] - own[0]) / steps if steps else np.array([1.0, 0.0, 0.0])
        length = np.sqrt((step**2).sum())
        row[:2], row[2:4] = (own[0] + 0.5 * steps * step)[:2], step[:2]
        row[4:] = steps, length, 0.5 * steps * length * MARGIN
        places = np.arange(len(own)) if steps else np.zeros(len(own))
        if np.abs(own - (own[0] + np.outer(places, step))).max() > 1e-14 * scale:
            scale = np.inf  # nothing is sure then
    turn = np.array([atan2(row[3], row[0]) / QUARTER_TURN for row in chain.rotation])
    return LinkLines(rows, turn, scale)


def _ranges(owners: np.ndarray, count: int) -> np.ndarray:
    """Return (count, 2): where each owner's run begins and ends in a sorted list of owners."""
    return np.array(
        [
            [np.searchsorted(owners, k), np.searchsorted(owners, k, side="right")]
            for k in range(count)
        ]
    )


class Clearance(NamedTuple):
    """Least clearances of a batch: negative where spheres overlap, +inf where nothing is met."""

    # (configurations,) least centre distance of spheres of two arms, less both radii
    between_arms: FloatArray
    # (configurations,) least distance of a centre to an obstacle's surface, less the radius
    to_obstacles: FloatArray

    @property
    def least(self) -> FloatArray:
        """Smaller of the two; a configuration collides where it is negative."""
        return np.minimum(self.between_arms, self.to_obstacles)


class SphereCollision(NamedTuple):
    """Touching spheres on one robot, and the obstacles around it."""

    assembly: Assembly  # the robot
    spheres: Spheres  # the spheres
    arm_spheres: IntArray  # (arms, 2) first and one-past-last sphere of each arm
    obstacles: ObstacleTable  # the obstacle table
    tables: tuple[Any, ...]  # `SphereTables` in two arrays, for kernels; see `flat_spheres`
    geometry: Any  # the same spheres as a `pin.GeometryModel` of coal spheres

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one configuration has: spheres of two arms, and with obstacles."""
        own = [int(stop - first) for first, stop in self.arm_spheres]
        between = sum(a * b for a, b in itertools.combinations(own, 2))
        return between + sum(own) * len(self.obstacles.kind)

    def clearance(self, q: FloatArray, limit: float = np.inf) -> Clearance:
        """Return the clearances of a batch of configurations.

        Args:
            q: (nq, configurations) [deg].
            limit: Above it nothing is measured: a clearance is exact where it is less, elsewhere
                some value not below it. With 0 the signs are right, and bodies far apart are
                skipped.

        Raises:
            ValueError: If q has another number of rows than the robot has joints.
        """
        q = self._checked(q)
        out = np.empty((2, q.shape[1]))
        clearances(self.tables, limit, q, out)
        return Clearance(out[0], out[1])

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations collide, (configurations,): where `clearance` is negative.

        Raises:
            ValueError: If q has another number of rows than the robot has joints.
        """
        q = self._checked(q)
        out = np.empty(q.shape[1])
        contacts(self.tables, q, 0, out)
        return out < 0.0

    def any_collides(self, q: FloatArray) -> bool:
        """Return whether any configuration of a batch collides, as the edges of a planner's graph.

        The batch, (nq, configurations) [deg], is tested until one is found, eight at a time: those
        that are likely to collide should come first.

        Raises:
            ValueError: If q has another number of rows than the robot has joints.
        """
        return any_contact(self.tables, self._checked(q))

    def _checked(self, q: FloatArray) -> FloatArray:
        nq = self.assembly.table.num_coordinates
        q = np.ascontiguousarray(q, dtype=np.float64)
        if q.ndim != 2 or q.shape[0] != nq:
            raise ValueError(f"q must have shape ({nq}, configurations), was {q.shape}")
        return q

    @property
    def radius(self) -> float:
        """Radius of every sphere [length unit]."""
        return self.spheres.radius
