"""The collision model of Lavoie & Boudreau 2001: a planar arm's links as lines among ellipses."""

from typing import ClassVar, Literal, NamedTuple

import numpy as np

from evoexp.collision.bodies.body_collision import FreeTest, leading_free
from evoexp.collision.planar.ellipse_kernels import (
    Ellipses,
    TestedPath,
    check_paths,
    gap,
    mapped,
    prepare_checks,
)
from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.numeric.vectors import LANES
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.planar_ends import PlanarArm, block_ends, planar_arm
from evoexp.scenarios.obstacles import ELLIPSE, ObstacleTable
from evoexp.validation import Component, LayoutCount


class LinkEllipses(Component):
    """Exact tests of positions and chords along a joint-space line; contact is collision."""

    component: ClassVar[str] = "link_ellipses"

    # M of Eq. 3: equally spaced positions that are tested, the end included, the start not
    num_positions: LayoutCount
    # whether the chord of every link end from one position to the next must be free, too
    swept: Literal["none", "chords"]
    blind: bool = False  # whether obstacles are ignored (a control: its solutions must collide)

    def bind(self, assembly: Assembly, obstacles: ObstacleTable) -> "EllipseCollision":
        """Return the model of an arm among obstacles.

        Raises:
            SettingError: If the robot is no single planar arm of thin links, or an obstacle no
                ellipse in its plane.
        """
        arm = planar_arm(assembly)
        if thick := [link.radius for link in assembly.links if link.radius > 0.0]:
            raise SettingError(
                "robot.link_radius", "0: this collision model knows links as lines", thick[0]
            )
        for k, (kind, center) in enumerate(zip(obstacles.kind, obstacles.center, strict=True)):
            if kind != ELLIPSE or center[2] != 0.0:
                raise SettingError(
                    f"scenario.obstacles[{k}].shape", "an ellipse in the plane z = 0", int(kind)
                )
        seen = 0 if self.blind else len(obstacles.kind)
        columns = obstacles.center, obstacles.rotation, obstacles.size
        rows = list(zip(*columns, strict=True))[:seen]
        maps = np.array([_to_unit_circle(*row) for row in rows]).reshape(-1, 5)
        reached = np.array([_first_link(arm, *row) for row in rows], dtype=np.int64)
        path = TestedPath(self.num_positions, self.swept == "chords")
        return EllipseCollision(arm, Ellipses(maps, reached), path, obstacles)


class Contact(NamedTuple):
    """The first contact of a path."""

    position: int  # j of Eq. 3.
    obstacle: int  # counted from 1
    link: int  # link, or link end if it was swept, counted from 1
    swept: bool  # whether the chord of a link end, between positions j − 1 and j, touches


class EllipseCollision(NamedTuple):
    """An arm among ellipses."""

    arm: PlanarArm  # link lengths and base
    ellipses: Ellipses  # the ellipses as the kernels read them
    path: TestedPath  # the positions and chords that are tested
    obstacles: ObstacleTable  # the obstacle table

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one configuration has: links and ellipses."""
        return len(self.arm.lengths) * len(self.ellipses.maps)

    @property
    def queries(self) -> int:
        """Configurations that judging one path asks for; none if there is nothing to meet."""
        return self.path.num_positions if len(self.ellipses.maps) else 0

    def collide(self, starts: FloatArray, ends: FloatArray) -> BoolArray:
        """Return which paths collide, (individuals,).

        Args:
            starts: (N, individuals) relative joint angles [rad].
            ends: (N, individuals).

        Raises:
            ValueError: If their shapes are others.
        """
        num = len(self.arm.lengths)
        if starts.shape != ends.shape or starts.ndim != 2 or len(starts) != num:
            raise ValueError(
                f"starts and ends must be ({num}, individuals), were {starts.shape} and "
                f"{ends.shape}"
            )
        lanes = np.arange(starts.shape[1])
        hit = np.zeros(len(lanes), dtype=np.bool_)
        starts, ends = (np.ascontiguousarray(q, dtype=np.float64) for q in (starts, ends))
        about = self.arm, self.ellipses, self.path, hit, prepare_checks(num, len(lanes))
        check_paths(starts, ends, lanes, len(lanes), *about)
        return hit

    def contact(self, start: FloatArray, end: FloatArray) -> Contact | None:
        """Return the first contact of a path between postures (N,) [rad]; None if it is free."""
        if not self.collide(start[:, None], end[:, None])[0]:
            return None
        num_links, last = len(self.arm.lengths), self.path.num_positions
        begin, stop = np.repeat(start, LANES), np.repeat(end, LANES)
        x, y = np.empty((2, 2, (num_links + 1) * LANES))  # of link ends at two positions
        block_ends(begin, stop, self.arm, 0, last, x[0], y[0])
        for position in range(1, last + 1):
            old, new = (position + 1) % 2, position % 2
            block_ends(begin, stop, self.arm, position, last, x[new], y[new])
            for e, ellipse in enumerate(self.ellipses.maps):
                for k in range(num_links + 1):
                    at, root = k * LANES, max(k - 1, 0) * LANES
                    here = mapped(ellipse, x[new, at], y[new, at])
                    before = mapped(ellipse, x[old, at], y[old, at])
                    if self.path.chords and gap(*before, *here) <= 0.0:
                        return Contact(position, e + 1, k, swept=True)
                    if gap(*mapped(ellipse, x[new, root], y[new, root]), *here) <= 0.0:
                        return Contact(position, e + 1, k, swept=False)
        return None

    @property
    def at_configurations(self) -> "EllipseCollision":
        """The model of single configurations, without chords."""
        return self._replace(path=TestedPath(1, chords=False))

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations (N, count) [deg] collide, (count,)."""
        angles = np.ascontiguousarray(DEGREE * q)
        return self.at_configurations.collide(angles, angles)

    @property
    def free_test(self) -> FreeTest:
        """The test of configurations for kernels of other rooms."""
        return FreeTest.of(_num_free, (self.arm, self.ellipses, self.at_configurations.path))


@kernel
def _num_free(tables: tuple[PlanarArm, Ellipses, TestedPath], q: FloatArray) -> int:
    """Return how many configurations (N, count) [rad] precede the eight of the first contact."""
    arm, ellipses, path = tables
    lanes, hit = np.arange(q.shape[1]), np.zeros(q.shape[1], dtype=np.bool_)
    checks = prepare_checks(len(q), len(lanes))
    check_paths(q, q, lanes, len(lanes), arm, ellipses, path, hit, checks)
    return leading_free(hit)


def _to_unit_circle(
    center: FloatArray, rotation: FloatArray, size: FloatArray
) -> tuple[float, ...]:
    """Return a … e of the map (x, y) → (a x + b y + c, d y + e) of an ellipse to the unit circle.

    The map is the Cholesky factor of R diag(1/a², 1/b²) Rᵀ; d follows from its determinant, without
    cancellation.
    """
    (cosine, sine), one, two = (rotation[0], rotation[3]), 1.0 / size[0], 1.0 / size[1]
    a = float(np.sqrt(cosine * one * cosine * one + sine * two * sine * two))
    b, d = float(cosine * sine * (one * one - two * two) / a), float(one * two / a)
    return a, b, float(-(a * center[0] + b * center[1])), d, float(-d * center[1])


def _first_link(arm: PlanarArm, center: FloatArray, rotation: FloatArray, size: FloatArray) -> int:
    """Return the first link (1, 2, …) whose end can reach an ellipse's bounding box, else N + 2."""
    lengths, c, s = arm.lengths, rotation[0], rotation[3]
    wide = np.sqrt((c * size[0]) ** 2 + (s * size[1]) ** 2)
    high = np.sqrt((s * size[0]) ** 2 + (c * size[1]) ** 2)
    half = np.array([wide, high])
    off = np.maximum(np.abs(center[:2] - (arm.base_x, arm.base_y)) - half, 0.0)
    nearest = float(np.sqrt(np.sum(off * off))) * (1.0 - 1e-9)
    within = np.flatnonzero(np.cumsum(lengths) >= nearest)
    return int(within[0]) + 1 if len(within) else len(lengths) + 2
