"""Planar arms of two links: where their lines and envelopes are, and when two of them touch.

Curkovic, Jerbic & Stipancic 2013. Each arm has an absolute angle per link, from +x. A link is its
line (section 3); or it is two boundary lines, parallel to it, and a circle of variable radius lies
around the tool centre point (section 4, Fig. 11). Boundary lines have no ends across: an arm may
lie between another's two lines unnoticed, as in the paper.

Outlines are (K, 8, N): elbow x, y, tip x, y, direction of the first link x, y, of the second x, y.
Lines need the first four rows only.

Ends of links are sums of rounded sines, so links that touch, or lie on one line, may come out a few
units in the last place apart (sin 45° and sin 135° differ by one). `meeting` therefore counts what
is at most a tolerance apart as contact; `contact_tolerance` bounds that rounding, and exceeds that
of the sides in `meeting`: where a side is in doubt, an end is nearer to a line than the tolerance.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.elementary import exact_sincos
from evoexp.numeric.vectors import Mask, Number, lower, select, upper
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.kinematics import U

Point = tuple[float, float]

POINT_ROWS, OUTLINE_ROWS = 4, 8
PARALLEL = 1e-12  # [-] links are parallel up to this sine of the angle between them
Line = tuple[Number, Number, Number, Number]
"""Both ends of a segment, x and y: of one arm (numbers) or of eight (vectors)."""

ROUNDING = 2.0**-46
"""`contact_tolerance` of coordinates up to 1 [-]."""


class Arm(NamedTuple):
    """A planar arm of two links, with its envelope [length unit of the scene]."""

    base: Point  # x, y of its first joint
    lengths: Point  # of its links; 0 is allowed
    half_width: float = 0.0  # distance of the boundary lines from their link; 0: the link itself
    tcp_radius: float = 0.0  # of the circle around the tip; 0: no circle

    @property
    def is_enveloped(self) -> bool:
        """Whether the arm is more than its lines."""
        return self.half_width > 0.0 or self.tcp_radius > 0.0

    def outlines(self, q: FloatArray) -> FloatArray:
        """Return the outlines of a population, (K, 8, N).

        Args:
            q: (K, 2, N) angles of the links from +x [rad].

        Raises:
            ValueError: If q has another shape.
        """
        q = np.ascontiguousarray(q, dtype=np.float64)
        if q.ndim != 3 or q.shape[1] != 2:
            must = "(configurations, 2, individuals)"
            raise ValueError(f"q must have shape {must}, was {q.shape}")
        outlines = np.empty((q.shape[0], OUTLINE_ROWS, q.shape[2]))
        write_outlines(q, self, outlines)
        return outlines


def path_configurations(
    genes: FloatArray, start: FloatArray, goal: FloatArray, collision_substeps: int
) -> FloatArray:
    """Return the configurations at which a path is tested.

    The path start → genes → goal, straight in joint angles, is cut into equal parts. Start and goal
    themselves are left out: they are checked before any search. With one substep the configurations
    are the genes.

    Args:
        genes: (K, 2, N) [rad].
        start: (2,) [rad].
        goal: (2,) [rad].
        collision_substeps: Parts per segment [-].

    Returns:
        Configurations ((K + 1) · collision_substeps − 1, 2, N) [rad]; every `collision_substeps`-th
        is a gene's own.
    """
    num = genes.shape[2]
    before, after = (np.repeat(np.reshape(end, (1, 2, 1)), num, axis=2) for end in (start, goal))
    corners = np.concatenate([before, genes, after])[:, None]
    shares = (np.arange(1, collision_substeps + 1) / collision_substeps)[:, None, None]
    parts = corners[:-1] + shares * (corners[1:] - corners[:-1])
    parts[:, -1] = corners[1:, 0]  # a gene's own configuration, without rounding
    return np.ascontiguousarray(parts.reshape(-1, 2, num)[:-1])


@kernel
def write_outlines(q: FloatArray, arm: Arm, outlines: FloatArray) -> None:
    """Write elbows and tips (Eq. 11) to outlines (K, 4 | 8, N), and directions if there is room.

    The angles q (K, 2, N) [rad] of the links are counted from +x.
    """
    num_configurations, rows, count = outlines.shape
    (base_x, base_y), (first, second) = arm.base, arm.lengths
    angles, flat, num = q.reshape(-1), outlines.reshape(-1), U(count)
    for k in range(num_configurations):
        x = U(rows * k) * num
        y, z, w = x + num, x + U(2) * num, x + U(3) * num
        # cosines, then sines, exact at multiples of 90°
        for link in range(2):
            angle, cosines = U(2 * k + link) * num, x + U(2 * link) * num
            for n in range(count):
                sine, cosine = exact_sincos(angles[angle + U(n)])
                flat[cosines + U(n)] = cosine
                flat[cosines + num + U(n)] = sine
        if rows == OUTLINE_ROWS:
            for n in range(4 * count):
                flat[x + U(4) * num + U(n)] = flat[x + U(n)]
        # the elbow from the base, the tip from the elbow
        for n in range(count):
            flat[x + U(n)] = base_x + first * flat[x + U(n)]
            flat[y + U(n)] = base_y + first * flat[y + U(n)]
        for n in range(count):
            flat[z + U(n)] = flat[x + U(n)] + second * flat[z + U(n)]
            flat[w + U(n)] = flat[y + U(n)] + second * flat[w + U(n)]


@kernel
def tolerance_of(arm_1: Arm, arm_2: Arm) -> float:
    """Return the `contact_tolerance` of two arms [length unit]."""
    return contact_tolerance(max(largest_coordinate(arm_1), largest_coordinate(arm_2)))


@kernel
def largest_coordinate(arm: Arm) -> float:
    """Return the greatest coordinate that an arm can reach [length unit]."""
    (x, y), (first, second) = arm.base, arm.lengths
    return max(abs(x), abs(y)) + first + second + (arm.half_width + arm.tcp_radius)


class ClosedForm(NamedTuple):
    """Intersections of the link pairs (1, 1), (1, 2), (2, 1), (2, 2) of arm 1 and arm 2."""

    # (4, n) where the lines meet on the link of arm 1: 0 at its beginning, 1 at its end; NaN
    # where parallel
    mu: FloatArray
    nu: FloatArray  # (4, n) the same on the link of arm 2

    @property
    def crossing(self) -> BoolArray:
        """(4, n) whether the links have a point in common, up to rounding; not if parallel."""
        mu, nu = self
        return np.asarray((mu >= 0.0) & (mu <= 1.0) & (nu >= 0.0) & (nu <= 1.0))


def closed_form(one: Arm, q_1: FloatArray, two: Arm, q_2: FloatArray) -> ClosedForm:
    """Intersect all four pairs of links (Curkovic et al. 2013, Eqs. 11–12 and Fig. 7).

    With the arms' link vectors u1, u2 and v1, v2 and the bases d apart, link i of arm 1 begins w =
    d + Σ v − Σ u away from link j of arm 2 (sums over the links before), and

        mu = (w × vj) / (ui × vj),    nu = (w × ui) / (ui × vj),

    where each product is a sine of a difference of two angles times two lengths; for i = j = 2 and
    equal lengths this is Eq. 12. The paper counts mu, nu in (0, 1]; here in [0, 1]: a link has two
    ends. The formula is rounded, and says nothing of parallel links: searches count crossings by
    `count_collisions`.

    Args:
        one: Arm 1.
        q_1: (2, n) angles of its links from +x [rad].
        two: Arm 2.
        q_2: (2, n).

    Raises:
        ValueError: If the shapes differ or are not (2, n).
    """
    q_1, q_2 = (np.ascontiguousarray(q, dtype=np.float64) for q in (q_1, q_2))
    if q_1.ndim != 2 or q_1.shape[0] != 2 or q_1.shape != q_2.shape:
        raise ValueError(
            f"q_1 and q_2 must both have shape (2, n), were {q_1.shape} and {q_2.shape}"
        )
    joints_1, joints_2 = _joints(one, q_1), _joints(two, q_2)
    mu, nu = np.full((2, 4, q_1.shape[1]), np.nan)
    for pair, (i, j) in enumerate(np.ndindex(2, 2)):
        u, v = joints_1[i + 1] - joints_1[i], joints_2[j + 1] - joints_2[j]
        w, across = joints_2[j] - joints_1[i], _cross(u, v)
        skew = np.abs(across) > PARALLEL * (one.lengths[i] * two.lengths[j])
        np.divide(_cross(w, v), across, out=mu[pair], where=skew)
        np.divide(_cross(w, u), across, out=nu[pair], where=skew)
    return ClosedForm(mu, nu)


def _joints(arm: Arm, q: FloatArray) -> FloatArray:
    """Return base, elbow and tip, (3, 2, n), at link angles (2, n) [rad]."""
    base = np.repeat(np.reshape(arm.base, (1, 2, 1)), q.shape[1], axis=2)
    return np.concatenate([base, arm.outlines(q[None])[0, :4].reshape(2, 2, -1)])


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[0] * v[1] - u[1] * v[0])


@kernel
def contact_tolerance(size: float) -> float:
    """Return the distance up to which rounding cannot tell two planar arms from touching ones.

    With u = 2^-53, and angles within ±π, the computed end of a link is off by at most 46 u · size:

    - angles by 40 u: 2 π u from degrees to radians, 3 π u between two configurations, 24 u where
      the end-effector's place is given (two arctangents and an arccosine);
    - sine and cosine by 1.2 u each, their multiples and the sums of them by 4 u.

    Two arms are thus off by 92 u · size against each other, and the distance of two segments is
    rounded by less than 20 u · size: 128 u · size = 2^-46 · size exceed both. What touches in exact
    arithmetic always counts; what is more than twice the tolerance apart never does.

    Args:
        size: Greatest coordinate that an end can have, and that of an obstacle, if it is one
            [length unit].
    """
    return ROUNDING * size


@inlined
def meeting(one: Line, two: Line, tolerance: float) -> Mask:
    """Return whether two segments cross, or are at most `tolerance` apart.

    They cross if the ends of each lie on both sides of the other's line. Segments on one line have
    rounded sides; the boxes around them show whether they are apart.
    """
    (ax, ay, bx, by), (cx, cy, dx, dy) = one, two
    overlap = (lower(ax, bx) <= upper(cx, dx)) & (lower(cx, dx) <= upper(ax, bx))
    overlap = overlap & (lower(ay, by) <= upper(cy, dy)) & (lower(cy, dy) <= upper(ay, by))
    crossing = overlap & _parts(one, two) & _parts(two, one)
    # segments that do not cross are nearest to each other at an end
    least = lower(
        lower(squared_distance(one, cx, cy), squared_distance(one, dx, dy)),
        lower(squared_distance(two, ax, ay), squared_distance(two, bx, by)),
    )
    return crossing | (least <= tolerance * tolerance)


@inlined
def _parts(line: Line, other: Line) -> Mask:
    """Return whether the ends of the other lie on different sides of a line."""
    (ax, ay, bx, by), (cx, cy, dx, dy) = line, other
    ux, uy = bx - ax, by - ay
    one = ux * (cy - ay) - uy * (cx - ax)
    two = ux * (dy - ay) - uy * (dx - ax)
    return ((one > 0.0) & (two < 0.0)) | ((one < 0.0) & (two > 0.0))


@inlined
def squared_distance(line: Line, x: Number, y: Number) -> Number:
    """Return the squared distance of the point (x, y) from a segment, rounded."""
    ax, ay, bx, by = line
    ux, uy, vx, vy = bx - ax, by - ay, x - ax, y - ay
    squared, along = ux * ux + uy * uy, ux * vx + uy * vy
    t = lower(upper(along / select(squared > 0.0, squared, 1.0), 0.0), 1.0)
    vx, vy = vx - t * ux, vy - t * uy
    return vx * vx + vy * vy


@inlined
def sign_product(one: Line, two: Line) -> Number:
    """Return a number < 0 if the ends of each segment are on both sides of the other, else ≥ 0."""
    (ax, ay, bx, by), (cx, cy, dx, dy) = one, two
    ux, uy, vx, vy, x, y = bx - ax, by - ay, dx - cx, dy - cy, cx - ax, cy - ay
    first, second, across = ux * y - uy * x, vx * y - vy * x, ux * vy - uy * vx
    return upper(first * (first + across), second * (second + across))
