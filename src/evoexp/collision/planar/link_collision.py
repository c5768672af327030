"""The collision model of Curkovic et al. 2013 on a robot among static obstacles.

Links are lines, or have envelopes.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.collision.planar.link_crossings import (
    Arm,
    Crossings,
    count_crossings,
    path_configurations,
)
from evoexp.collision.planar.link_envelopes import EnvelopedArm, count_collisions
from evoexp.collision.planar.link_obstacles import (
    PlanarObstacles,
    count_enveloped_obstacle_collisions,
    count_obstacle_collisions,
    planar_obstacles,
)
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import obstacle_table
from evoexp.validation import Component, LayoutCount, NonNegative


class LinkCrossings(Component):
    """Planar robots of two links, which collide where their lines meet (Eqs. 4, 5, 11, 12)."""

    component: ClassVar[str] = "link_crossings"

    # configurations tested per segment of a path; 1: the encoded ones only, as in the paper
    collision_substeps: LayoutCount
    # of the envelope: distance of a link's two boundary lines from it [length unit]; 0: the
    # link itself
    half_width: NonNegative
    tcp_radius: NonNegative  # of a circle around the tool centre point [length unit]; 0: none

    def bind(self, assembly: Assembly, obstacles: tuple[Any, ...]) -> "LinkCollision":
        """Return the model of some robots among obstacles.

        Raises:
            SettingError: If a robot is no planar arm of two links, or an obstacle no figure of the
                plane.
        """
        arms = two_link_arms(assembly)
        try:
            flat = planar_obstacles(obstacle_table(obstacles))
        except ValueError as error:
            raise SettingError(
                "scenario.obstacles", f"figures of the plane ({error})", len(obstacles)
            ) from None
        return LinkCollision(arms, flat, self.collision_substeps, self.half_width, self.tcp_radius)


class LinkCollision(NamedTuple):
    """Planar robots of two links, and the obstacles around them."""

    arms: tuple[Arm, ...]  # base and link lengths of every robot
    obstacles: PlanarObstacles  # what stands still
    substeps: int  # configurations tested per segment
    half_width: float  # of the envelopes
    tcp_radius: float  # of the circles around the tool centre points

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one query has, a configuration of two robots: links, and tools."""
        return (2 + (self.tcp_radius > 0.0)) ** 2

    @property
    def enveloped(self) -> bool:
        """Whether robots are more than their lines."""
        return self.half_width > 0.0 or self.tcp_radius > 0.0

    @property
    def is_lines(self) -> bool:
        """Whether robots are lines, among no obstacles, at the configurations of their paths."""
        return not (self.enveloped or len(self.obstacles.kind) or self.substeps > 1)

    def outlines(self, robot: int, path: FloatArray, points: FloatArray) -> FloatArray:
        """Return the tested points or outlines of a population's paths, (configurations, 4 | 8, N).

        Args:
            robot: Whose population.
            path: (K + 2, 2, N) link angles [rad], start and goal included, which are the same for
                all.
            points: (K + 2, 4, N) of the robot's `Arm.points` at these angles.
        """
        if self.substeps > 1:
            q = path_configurations(path[1:-1], path[0, :, 0], path[-1, :, 0], self.substeps)
            return self.of_configurations(robot, q)
        return self._enveloped(robot).outlines(path[1:-1]) if self.enveloped else points[1:-1]

    def of_configurations(self, robot: int, q: FloatArray) -> FloatArray:
        """Return the points or outlines of configurations (K, 2, N), (K, 4 | 8, N)."""
        return self._enveloped(robot).outlines(q) if self.enveloped else self.arms[robot].points(q)

    def contact(self, posture: FloatArray) -> str:
        """Return the first contact at link angles (robots, 2) [rad] in words; empty if none."""
        lines = [
            self.of_configurations(r, np.ascontiguousarray(angles.reshape(1, 2, 1)))
            for r, angles in enumerate(posture)
        ]
        for r, own in enumerate(lines):
            if self.with_obstacles(r, own)[0]:
                return f"robot {r + 1} touches an obstacle"
            for s in range(r + 1, len(lines)):
                if self.between(r, own, s, lines[s]).counts[0, 0]:
                    return f"robots {r + 1} and {s + 1} touch"
        return ""

    def between(self, one: int, first: FloatArray, two: int, second: FloatArray) -> Crossings:
        """Count colliding configurations for every pair of individuals of two populations."""
        if self.enveloped:
            return count_collisions(self._enveloped(one), first, self._enveloped(two), second)
        return count_crossings(self.arms[one], first, self.arms[two], second)

    def with_obstacles(self, robot: int, lines: FloatArray) -> np.ndarray:
        """Count configurations in an obstacle for every individual of a population, (N,)."""
        if not len(self.obstacles.kind):
            return np.zeros(lines.shape[2], dtype=np.int64)
        if self.enveloped:
            return count_enveloped_obstacle_collisions(
                self._enveloped(robot), lines, self.obstacles
            )
        return count_obstacle_collisions(self.arms[robot], lines, self.obstacles)

    def _enveloped(self, robot: int) -> EnvelopedArm:
        return EnvelopedArm(self.arms[robot], self.half_width, self.tcp_radius)


def two_link_arms(assembly: Assembly) -> tuple[Arm, ...]:
    """Return base and link lengths of every robot.

    Raises:
        SettingError: If a robot is no planar arm of two links.
    """
    return tuple(_arm(assembly, first) for first, _ in _pairs_of_joints(assembly))


def _pairs_of_joints(assembly: Assembly) -> list[tuple[int, int]]:
    """Return first and one-past-last joint of every robot.

    Raises:
        SettingError: If a robot is no planar arm of two links.
    """
    slices = [(int(first), int(stop)) for first, stop in assembly.arm_slices]
    flat = assembly.table.planar and all(stop - first == 2 for first, stop in slices)
    links = [link for link in assembly.links if not link.is_tool]
    straight = flat and all(not link.start.any() and not link.end[1:].any() for link in links)
    turned = [bool(assembly.table.turned[k]) for k in range(len(assembly.table.parent))]
    if not straight or any(turned):
        raise SettingError(
            "robot",
            "planar arms of two links with base_angle 0",
            ", ".join(f"{stop - first} joints" for first, stop in slices),
        )
    return slices


def _arm(assembly: Assembly, first: int) -> Arm:
    base = assembly.table.translation[first]
    lengths = [
        float(link.end[0])
        for link in assembly.links
        if link.joint - 1 in (first, first + 1) and not link.is_tool
    ]
    return Arm((float(base[0]), float(base[1])), (lengths[0], lengths[1]))
