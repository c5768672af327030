"""Straight links of planar arms among ellipses: which of a population's paths collide.

An ellipse is mapped to the unit circle by an upper triangular matrix; there a segment meets it
where its distance to the origin is at most 1. With P, Q its ends in that frame and s = P·Q, the
nearest point lies between them where P·P − s and Q·Q − s are positive, and then at the squared
distance (P × Q)² / (P·P + Q·Q − 2 s): no division is needed. A link within a relative 1e-9 of
touching counts as touching, so that rounding never lets a contact pass.

Any order of tests gives the same answer, because only the existence of a collision is asked for.
First the ends of all paths are tested, where most collisions are; individuals that collide are not
tested again. The others go through all positions, and the chords of their link ends are tested on
the way, eight individuals at a time (`load_lanes`).
"""

from typing import Any, Literal, NamedTuple

import numpy as np

from evoexp.collision.bodies.body_collision import FreeTest, leading_free
from evoexp.errors import demand
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.numeric.vectors import LANES, Vector, load, lower, select, spread, store
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import VECTOR, U
from evoexp.robots.planar_ends import PlanarArm, block_ends, load_lanes, planar_arm
from evoexp.scenarios.obstacles import ELLIPSE, ObstacleTable
from evoexp.validation import Component, LayoutCount

CONTACT = 1.0 + 1e-9  # [-] squared distance to the unit circle's centre that counts as contact


class Ellipses(NamedTuple):
    """Ellipses around a planar arm."""

    # (E, 5) a … e of the maps (x, y) → (a x + b y + c, d y + e) to the unit circle
    maps: FloatArray
    first_links: IntArray  # (E,) the first link (1, 2, …) that reaches each ellipse


class TestedPath(NamedTuple):
    """The positions of a path that are tested."""

    num_positions: int  # m of Eq. 3.
    chords: bool  # whether chords between positions are tested, too


class PathChecks(NamedTuple):
    """Scratch that all checks of an arm share, for eight individuals."""

    alive: IntArray  # (count + LANES,) individuals that have not collided
    begin: FloatArray  # (N · LANES,) angles at the start
    end: FloatArray  # (N · LANES,) angles at the end
    gaps: FloatArray  # (LANES,) at or below 0 where a contact was found
    x: FloatArray  # (2, (N + 1) · LANES) link ends at even and odd positions
    y: FloatArray  # likewise


@kernel
def prepare_checks(num: int, count: int) -> PathChecks:
    """Make the scratch of `check_paths`: for an arm of `num` links, at most `count` paths."""
    rows = num * LANES
    return PathChecks(
        np.empty(count + LANES, dtype=np.int64),
        np.empty(rows),
        np.empty(rows),
        np.empty(LANES),
        np.empty((2, rows + LANES)),
        np.empty((2, rows + LANES)),
    )


@kernel
def check_paths(
    starts: FloatArray,
    ends: FloatArray,
    lanes: IntArray,
    count: int,
    arm: PlanarArm,
    ellipses: Ellipses,
    path: TestedPath,
    hit: BoolArray,
    checks: PathChecks,
) -> None:
    """Find which straight joint-space paths collide (Lavoie & Boudreau 2001, Eq. 3).

    Args:
        starts: (N, individuals) joint angles at the start of each path, relative [rad].
        ends: (N, individuals) at its end.
        lanes: (≥ count) indices of the individuals to test.
        path: The positions that are tested.
        hit: (individuals,) written for those tested: whether each collides.
        checks: Of `prepare_checks`; given, so that inner loops count no references.
    """
    starts, ends, lanes, arm, ellipses, hit, checks = borrowed(
        (starts, ends, lanes, arm, ellipses, hit, checks)
    )
    alive, begin, end = checks.alive, checks.begin, checks.end
    alive[:count] = lanes[:count]
    for k in range(count):
        hit[lanes[k]] = False
    left, kept, last = count if len(ellipses.maps) > 0 else 0, 0, path.num_positions
    # the ends of all paths
    for first in range(0, left, LANES):
        load_lanes(starts, alive, first, left, begin)
        load_lanes(ends, alive, first, left, end)
        gaps = _sweep(arm, ellipses, TestedPath(last, False), last, checks)
        kept = _note(gaps, checks, first, left, kept, hit)
    # all positions of those that have not collided
    left = kept if last > 1 or path.chords else 0
    for first in range(0, left, LANES):
        load_lanes(starts, alive, first, left, begin)
        load_lanes(ends, alive, first, left, end)
        gaps = _sweep(arm, ellipses, path, 1, checks)
        _note(gaps, checks, first, left, first, hit)


@inlined
def _note(
    gaps: Vector, checks: PathChecks, first: int, count: int, kept: int, hit: BoolArray
) -> int:
    """Write which of a block collide, move the others to `kept` among those alive, and count on."""
    alive = checks.alive
    store(checks.gaps, U(0), gaps)
    for n in range(min(LANES, count - first)):
        individual, free = alive[first + n], checks.gaps[n] > 0.0
        hit[individual] = not free
        alive[kept] = individual
        kept += free
    return kept


@inlined
def _sweep(
    arm: PlanarArm, ellipses: Ellipses, path: TestedPath, first_position: int, checks: PathChecks
) -> Vector:
    """Test the positions of a block from one on, and perhaps the chords of all link ends before."""
    gaps, x, y = spread(1.0), checks.x, checks.y
    for position in range(first_position - path.chords, path.num_positions + 1):
        now = position % 2
        block_ends(checks.begin, checks.end, arm, position, path.num_positions, x[now], y[now])
        if position >= first_position:
            gaps = _test_links(ellipses, checks, now, path.chords, gaps)
    return gaps


@inlined
def _test_links(
    ellipses: Ellipses, checks: PathChecks, now: int, chords: bool, gaps: Vector
) -> Vector:
    """Lower `gaps` where a link, or a chord since the position before, meets an ellipse."""
    x, y, u, v = checks.x[now], checks.y[now], checks.x[1 - now], checks.y[1 - now]
    num_ends = U(len(x)) // VECTOR
    for e in range(len(ellipses.maps)):
        ellipse, first = ellipses.maps[e], U(ellipses.first_links[e])
        if first >= num_ends:
            continue
        root = (first - U(1)) * VECTOR
        p, q = mapped(ellipse, load(x, root), load(y, root))
        for k in range(first, num_ends):
            end = U(k) * VECTOR
            r, s = mapped(ellipse, load(x, end), load(y, end))
            gaps = lower(gaps, gap(p, q, r, s))
            if chords:
                p, q = mapped(ellipse, load(u, end), load(v, end))
                gaps = lower(gaps, gap(p, q, r, s))
            p, q = r, s
    return gaps


@inlined
def mapped(ellipse: FloatArray, x: Any, y: Any) -> tuple[Any, Any]:
    """Return a point, of floats or vectors, in an ellipse's frame."""
    return ellipse[0] * x + ellipse[1] * y + ellipse[2], ellipse[3] * y + ellipse[4]


@inlined
def gap(u: Any, v: Any, p: Any, q: Any) -> Any:
    """Return a number ≤ 0 if a segment from (u, v) to (p, q) touches the unit circle.

    Numbers are floats or vectors.
    """
    r, s = u * u + v * v, p * p + q * q
    turned, along = u * q - v * p, u * p + v * q
    one, two = r - along, s - along
    at_ends = lower(r, s) - CONTACT
    between = turned * turned - CONTACT * (one + two)
    between = select(one > 0.0, between, at_ends)
    between = select(two > 0.0, between, at_ends)
    return lower(between, at_ends)


class LinkEllipses(Component):
    """Exact tests of positions and chords along a joint-space line; contact is collision."""

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
        for link in assembly.links:
            must = "0: this collision model knows links as lines"
            demand(link.radius == 0.0, "robot.link_radius", must, link.radius)
        for k, (kind, center) in enumerate(zip(obstacles.kind, obstacles.center, strict=True)):
            is_flat, must = kind == ELLIPSE and center[2] == 0.0, "an ellipse in the plane z = 0"
            demand(is_flat, f"scenario.obstacles[{k}].shape", must, int(kind))
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
