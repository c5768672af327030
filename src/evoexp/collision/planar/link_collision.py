"""The collision model of Curkovic et al. 2013 on robots of two links among static obstacles.

Links are lines, or have envelopes.
"""

from typing import Any, ClassVar, NamedTuple

from evoexp.collision.planar.arm_obstacles import (
    PlanarObstacles,
    count_obstacle_collisions,
    planar_obstacles,
)
from evoexp.collision.planar.arm_pairs import Crossings, count_collisions
from evoexp.collision.planar.planar_arms import Arm, path_configurations
from evoexp.errors import SettingError
from evoexp.records import FloatArray, IntArray
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
        enveloped = [Arm(arm.base, arm.lengths, self.half_width, self.tcp_radius) for arm in arms]
        return LinkCollision(tuple(enveloped), flat, self.collision_substeps)


class LinkCollision(NamedTuple):
    """Planar robots of two links, and the obstacles around them."""

    arms: tuple[Arm, ...]  # base and link lengths of every robot, and its envelope
    obstacles: PlanarObstacles  # what stands still
    substeps: int  # configurations tested per segment

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one query has, a configuration of two robots: links, and tools."""
        return (2 + (self.arms[0].tcp_radius > 0.0)) ** 2

    @property
    def is_lines(self) -> bool:
        """Whether robots are lines, among no obstacles, at the configurations of their paths."""
        enveloped = any(arm.is_enveloped for arm in self.arms)
        return not (enveloped or len(self.obstacles.kind) or self.substeps > 1)

    def outlines(self, robot: int, path: FloatArray) -> FloatArray:
        """Return the outlines of a population's paths where they are tested, (K, 8, N).

        Args:
            robot: Whose population.
            path: (configurations, 2, N) link angles [rad], start and goal included, which are the
                same for all.
        """
        q = path[1:-1]
        if self.substeps > 1:
            q = path_configurations(q, path[0, :, 0], path[-1, :, 0], self.substeps)
        return self.arms[robot].outlines(q)

    def contact(self, posture: FloatArray) -> str:
        """Return the first contact at link angles (robots, 2) [rad] in words; empty if none."""
        outlines = [
            arm.outlines(angles.reshape(1, 2, 1))
            for arm, angles in zip(self.arms, posture, strict=True)
        ]
        for r, outline in enumerate(outlines):
            if self.with_obstacles(r, outline)[0]:
                return f"robot {r + 1} touches an obstacle"
            for s in range(r + 1, len(outlines)):
                if self.between(r, outline, s, outlines[s]).counts[0, 0]:
                    return f"robots {r + 1} and {s + 1} touch"
        return ""

    def between(self, one: int, first: FloatArray, two: int, second: FloatArray) -> Crossings:
        """Count colliding configurations for every pair of individuals of two populations."""
        return count_collisions(self.arms[one], first, self.arms[two], second)

    def with_obstacles(self, robot: int, outlines: FloatArray) -> IntArray:
        """Count configurations in an obstacle for every individual of a population, (N,)."""
        return count_obstacle_collisions(self.arms[robot], outlines, self.obstacles)


def two_link_arms(assembly: Assembly) -> tuple[Arm, ...]:
    """Return base and link lengths of every robot.

    Raises:
        SettingError: If a robot is no planar arm of two links.
    """
    slices = [(int(first), int(stop)) for first, stop in assembly.arm_slices]
    links = [link for link in assembly.links if not link.is_tool]
    is_straight = not any(link.start.any() or link.end[1:].any() for link in links)
    is_flat = assembly.table.planar and not assembly.table.turned.any()
    if not (is_flat and is_straight and all(stop - first == 2 for first, stop in slices)):
        raise SettingError(
            "robot",
            "planar arms of two links with base_angle 0",
            ", ".join(f"{stop - first} joints" for first, stop in slices),
        )
    arms = []
    for first, stop in slices:
        x, y, _ = assembly.table.translation[first]
        lengths = [float(link.end[0]) for link in links if first < link.joint <= stop]
        arms.append(Arm((float(x), float(y)), (lengths[0], lengths[1])))
    return tuple(arms)
