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

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import (
    LANES,
    Vector,
    load,
    lower,
    select,
    spread,
    store,
)
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import U
from evoexp.robots.planar_ends import (
    VECTOR,
    PlanarArm,
    block_ends,
    load_lanes,
)

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
    arm: PlanarArm,
    ellipses: Ellipses,
    path: TestedPath,
    first_position: int,
    checks: PathChecks,
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
