"""The collision model of Curkovic et al. 2013 on robots of two links among static obstacles.

Links are lines, or have envelopes.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.bodies.body_collision import BodyCollision, Shapes
from evoexp.collision.planar import planar_arms
from evoexp.collision.planar.arm_pairs import Crossings, count_collisions
from evoexp.errors import demand
from evoexp.records import FloatArray, IntArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table
from evoexp.validation import Component, LayoutCount, NonNegative


class LinkCrossings(Component):
    """Planar robots of two links, which collide where their lines meet (Eqs. 4, 5, 11, 12)."""

    # configurations tested per segment of a path; 1: the encoded ones only, as in the paper
    collision_substeps: LayoutCount
    # of the envelope: distance of a link's two boundary lines from it [length unit]; 0: the
    # link itself
    half_width: NonNegative
    tcp_radius: NonNegative  # of a circle around the tool centre point [length unit]; 0: none

    def bind(self, assembly: Assembly, obstacles: tuple[Any, ...]) -> "LinkCollision":
        """Return the model of some robots among obstacles."""
        arms = tuple(
            planar_arms.Arm(arm.base, arm.lengths, self.half_width, self.tcp_radius)
            for arm in two_link_arms(assembly)
        )
        table = obstacle_table(obstacles).without_ellipses()
        firsts = (int(first) + 1 for first, _ in assembly.arm_slices)
        solids = tuple(
            BodyCollision.build(assembly.table, _boundary_shapes(arm, first, table), table, ())
            for arm, first in zip(arms, firsts, strict=True)
            if len(table.kind)
        )
        return LinkCollision(arms, solids, self.collision_substeps)


class LinkCollision(NamedTuple):
    """Planar robots of two links, and the obstacles around them."""

    arms: tuple[planar_arms.Arm, ...]  # base and link lengths of every robot, and its envelope
    solids: tuple[BodyCollision, ...]  # (robots,) each among the obstacles; none without them
    substeps: int  # configurations tested per segment

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one query has, a configuration of two robots: links, and tools."""
        return (2 + (self.arms[0].tcp_radius > 0.0)) ** 2

    @property
    def is_lines(self) -> bool:
        """Whether robots are lines, among no obstacles, at the configurations of their paths."""
        enveloped = any(arm.is_enveloped for arm in self.arms)
        return not (enveloped or self.solids or self.substeps > 1)

    def tested(self, path: FloatArray) -> FloatArray:
        """Return the configurations at which a population's paths are tested, (K, 2, N) [rad].

        A path (configurations, 2, N) has start and goal, which are the same for all.
        """
        q = path[1:-1]
        if self.substeps > 1:
            q = planar_arms.path_configurations(q, path[0, :, 0], path[-1, :, 0], self.substeps)
        return q

    def contact(self, posture: FloatArray) -> str:
        """Return the first contact at link angles (robots, 2) [rad] in words; empty if none."""
        q = posture.reshape(-1, 1, 2, 1)
        for r in range(len(q)):
            if self.with_obstacles(r, q[r])[0]:
                return f"robot {r + 1} touches an obstacle"
            for s in range(r + 1, len(q)):
                if self.between(r, q[r], s, q[s]).counts[0, 0]:
                    return f"robots {r + 1} and {s + 1} touch"
        return ""

    def between(self, one: int, q_1: FloatArray, two: int, q_2: FloatArray) -> Crossings:
        """Count colliding configurations for every pair of individuals of two robots' populations.

        They have link angles q_1 (K, 2, N1) and q_2 (K, 2, N2) [rad].
        """
        first, second = self.arms[one], self.arms[two]
        return count_collisions(first, first.outlines(q_1), second, second.outlines(q_2))

    def with_obstacles(self, robot: int, q: FloatArray) -> IntArray:
        """Count configurations in an obstacle for each individual (N,) at q (K, 2, N) [rad]."""
        if not self.solids:
            return np.zeros(q.shape[2], dtype=np.int64)
        configurations = np.zeros((2 * len(self.arms), q.shape[0] * q.shape[2]))
        own = configurations[2 * robot : 2 * robot + 2]
        own[:] = q.transpose(1, 0, 2).reshape(2, -1)
        own[1] -= own[0]  # joints turn against the link before
        hits = self.solids[robot].collides(configurations).reshape(q.shape[0], -1)
        return np.asarray(hits.sum(axis=0))


def _boundary_shapes(arm: planar_arms.Arm, first: int, obstacles: ObstacleTable) -> Shapes:
    """Return an arm's lines, or boundary lines, and its circle as thin capsules and a sphere.

    They are thicker by what rounding may hide, so that what touches an obstacle collides.
    """
    far = (np.abs(obstacles.center).sum(axis=1) + obstacles.size.sum(axis=1)).max(initial=0.0)
    near = planar_arms.contact_tolerance(planar_arms.largest_coordinate(arm) + float(far))
    beside = (-arm.half_width, arm.half_width) if arm.half_width > 0.0 else (0.0,)
    rows = [
        (first + link, (0.0, y, 0.0), (length, y, 0.0), near, first + link)
        for link, length in enumerate(arm.lengths)
        for y in beside
    ]
    if arm.tcp_radius > 0.0:
        tip = (arm.lengths[1], 0.0, 0.0)
        rows.append((first + 1, tip, tip, arm.tcp_radius + near, first + 1))
    return Shapes(*(np.array(column) for column in zip(*rows, strict=True)))


def two_link_arms(assembly: Assembly) -> tuple[planar_arms.Arm, ...]:
    """Return base and link lengths of every robot, which must be a planar arm of two links."""
    slices = [(int(first), int(stop)) for first, stop in assembly.arm_slices]
    links = [link for link in assembly.links if not link.is_tool]
    is_straight = not any(link.start.any() or link.end[1:].any() for link in links)
    is_flat = assembly.table.planar and not assembly.table.chain.turned.any()
    are_two = all(stop - first == 2 for first, stop in slices)
    must = "planar arms of two links with base_angle 0"
    was = ", ".join(f"{stop - first} joints" for first, stop in slices)
    demand(is_flat and is_straight and are_two, "robot", must, was)
    arms = []
    for first, stop in slices:
        x, y, _ = assembly.table.chain.translation[first]
        lengths = [float(link.end[0]) for link in links if first < link.joint <= stop]
        arms.append(planar_arms.Arm((float(x), float(y)), (lengths[0], lengths[1])))
    return tuple(arms)
