"""Collisions of planar arms of two links, drawn as lines: whole populations against each other.

Curkovic, Jerbic & Stipancic 2013, section 3. Each arm has an absolute angle per link, from +x; two
arms collide in a configuration if any of the four pairs of links have a point in common. An
individual of one population is judged against every individual of the other, configuration by
configuration (Eqs 4–5). Parallel, collinear, touching and vanishing links are decided exactly;
links that only rounding holds apart touch (`segment_predicates.contact_tolerance`).

Work with it in this order: `path_configurations` (where), `Arm.points` (once per individual),
`count_crossings` (all pairs) or `update_crossings` (only those of changed individuals), all on
arrays with the individuals last.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.planar import link_crossing_kernels as kernels
from evoexp.collision.planar.segment_predicates import meeting
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import atan2, sin
from evoexp.records import BoolArray, FloatArray, IntArray

PARALLEL = 1e-12
"""Links are parallel in `closed_form` up to this sine of the angle between them [-]."""


class Arm(NamedTuple):
    """A planar arm of two links."""

    base: tuple[float, float]  # its first joint (x, y) [length unit of the scene]
    lengths: tuple[float, float]  # of its links [length unit of the scene]; 0 is allowed

    def points(self, q: FloatArray) -> FloatArray:
        """Return elbows and tips (K, 4, N): elbow x, y, tip x, y [length unit of the scene].

        Args:
            q: (K, 2, N) angles of the links from +x [rad].

        Raises:
            ValueError: If q has another shape.
        """
        q = checked("q", q, 2)
        out = np.empty((q.shape[0], 4, q.shape[2]))
        (x, y), (first, second) = self.base, self.lengths
        kernels.link_points(q, float(x), float(y), float(first), float(second), out)
        return out


class Crossings(NamedTuple):
    """Numbers of configurations in which individuals collide."""

    counts: NDArray[np.int16]  # (N1, N2) of each pair
    # (N1,) of each individual of population 1 over all of population 2: C1 of Eq. 4.
    sums_1: IntArray
    sums_2: IntArray  # (N2,) the other way round


def count_crossings(one: Arm, points_1: FloatArray, two: Arm, points_2: FloatArray) -> Crossings:
    """Count the configurations in which arms collide, for every pair of individuals.

    Args:
        one: Arm of population 1.
        points_1: (K, 4, N1) from `Arm.points`.
        two: Arm of population 2.
        points_2: (K, 4, N2), the same configurations.

    Raises:
        ValueError: If the shapes do not fit, there are more than 32767 configurations, or a
            coordinate is not finite.
    """
    points_1, points_2 = checked_pair("points", points_1, points_2, 4)
    found = no_crossings(points_1.shape[2], points_2.shape[2])
    _update(found, one, points_1, two, points_2, *everyone(found))
    return found


def update_crossings(
    crossings: Crossings,
    one: Arm,
    points_1: FloatArray,
    two: Arm,
    points_2: FloatArray,
    changed_1: BoolArray,
    changed_2: BoolArray,
) -> None:
    """Count anew, in place, the pairs of which an individual changed, to the same counts.

    The result is that of `count_crossings`.

    Args:
        crossings: Of the points before, altered.
        one: Arm of population 1.
        points_1: (K, 4, N1) now.
        two: Arm of population 2.
        points_2: (K, 4, N2) now.
        changed_1: (N1,) true where an individual of population 1 has other points than before.
        changed_2: (N2,) the same of population 2.

    Raises:
        ValueError: As `count_crossings`; nothing is altered then.
    """
    points_1, points_2 = checked_pair("points", points_1, points_2, 4)
    members = changed_members(crossings, points_1.shape[2], points_2.shape[2], changed_1, changed_2)
    _update(crossings, one, points_1, two, points_2, *members)


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

    Raises:
        ValueError: If a shape does not fit, or collision_substeps is below 1.
    """
    genes = checked("genes", genes, 2)
    if collision_substeps < 1:
        raise ValueError(f"collision_substeps must be at least 1, was {collision_substeps}")
    first, last = (np.ascontiguousarray(end, dtype=np.float64) for end in (start, goal))
    for name, end in (("start", first), ("goal", last)):
        if end.shape != (2,):
            raise ValueError(f"{name} must have shape (2,), was {end.shape}")
    out = np.empty(((genes.shape[0] + 1) * collision_substeps - 1, 2, genes.shape[2]))
    kernels.substeps(genes, first, last, collision_substeps, out)
    return out


class ClosedForm(NamedTuple):
    """Intersections of the link pairs (1, 1), (1, 2), (2, 1), (2, 2) of arm 1 and arm 2."""

    # (4, n) where the lines meet on the link of arm 1: 0 at its beginning, 1 at its end; NaN
    # where parallel
    mu: FloatArray
    nu: FloatArray  # (4, n) the same on the link of arm 2
    crossing: BoolArray  # (4, n) whether the links have a point in common

    @property
    def colliding(self) -> BoolArray:
        """Whether any pair of links crosses, (n,)."""
        return np.asarray(self.crossing.any(axis=0))


def closed_form(one: Arm, q_1: FloatArray, two: Arm, q_2: FloatArray) -> ClosedForm:
    """Intersect all four pairs of links in the space of their angles.

    Curkovic et al. 2013, Eqs. 11–12 and Fig. 7.

    With the arms' link vectors u1, u2 and v1, v2 and the bases d apart, link i of arm 1 begins w =
    d + Σ v − Σ u away from link j of arm 2 (sums over the links before), and

        mu = (w × vj) / (ui × vj),    nu = (w × ui) / (ui × vj),

    where each product is a sine of a difference of two angles times two lengths; for i = j = 2 and
    equal lengths this is Eq. 12. The paper counts mu, nu in (0, 1]; here in [0, 1]: a link has two
    ends. The formula is rounded, and says nothing of parallel links: whether links cross is decided
    as by `count_crossings`.

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
    dx, dy = two.base[0] - one.base[0], two.base[1] - one.base[1]
    # of u1, u2, v1, v2, d
    lengths = np.array([*one.lengths, *two.lengths, np.sqrt(dx * dx + dy * dy)])
    angles = np.empty((5, q_1.shape[1]))
    angles[:2], angles[2:4], angles[4] = q_1, q_2, atan2(dy, dx)
    shape = (4, q_1.shape[1])
    found = ClosedForm(np.empty(shape), np.empty(shape), np.empty(shape, dtype=np.bool_))
    _intersect(lengths, angles, found.mu, found.nu)
    tolerance = kernels.tolerance_of(one.base, one.lengths, two.base, two.lengths)
    _cross(_joints(one, q_1), _joints(two, q_2), tolerance, found.crossing)
    return found


def _joints(arm: Arm, q: FloatArray) -> FloatArray:
    """Return base, elbow and tip, (3, 2, n), at link angles (2, n) [rad]."""
    joints = np.empty((3, 2, q.shape[1]))
    joints[0] = np.array(arm.base)[:, None]
    joints[1:] = arm.points(q[None]).reshape(2, 2, -1)
    return joints


@kernel
def _cross(one: FloatArray, two: FloatArray, tolerance: float, crossing: BoolArray) -> None:
    """Write whether links cross, from the joints (3, 2, n) of both arms."""
    for pair in range(4):
        i, j = pair // 2, pair % 2
        for n in range(crossing.shape[1]):
            (ax, ay), (bx, by) = one[i, :, n], one[i + 1, :, n]
            (cx, cy), (dx, dy) = two[j, :, n], two[j + 1, :, n]
            crossing[pair, n] = meeting(ax, ay, bx, by, cx, cy, dx, dy, tolerance)


@kernel
def _intersect(length: FloatArray, angle: FloatArray, mu: FloatArray, nu: FloatArray) -> None:
    sines = np.empty((5, 5))
    for n in range(angle.shape[1]):
        for a in range(5):
            for b in range(5):
                sines[a, b] = sin(angle[b, n] - angle[a, n])
        for i in range(2):
            for j in range(2):
                pair, v = 2 * i + j, 2 + j
                mu[pair, n] = nu[pair, n] = np.nan
                if abs(sines[i, v]) <= PARALLEL or length[i] == 0.0 or length[v] == 0.0:
                    continue
                # w across either link
                across_i = length[4] * sines[i, 4]
                across_j = length[4] * sines[v, 4]
                if j == 1:
                    across_i += length[2] * sines[i, 2]
                    across_j += length[2] * sines[v, 2]
                if i == 1:
                    across_i -= length[0] * sines[i, 0]
                    across_j -= length[0] * sines[v, 0]
                mu[pair, n] = -across_j / (length[i] * sines[i, v])
                nu[pair, n] = -across_i / (length[v] * sines[i, v])


def _update(
    found: Crossings,
    one: Arm,
    points_1: FloatArray,
    two: Arm,
    points_2: FloatArray,
    *members: IntArray,
) -> None:
    rows, others, columns = members
    base_1 = float(one.base[0]), float(one.base[1])
    base_2 = float(two.base[0]), float(two.base[1])
    tolerance = kernels.tolerance_of(base_1, one.lengths, base_2, two.lengths)
    if not kernels.crossings(
        base_1, points_1, rows, others, base_2, points_2, columns, tolerance, *found
    ):
        raise ValueError("points and bases must be finite and below 1e150")


# -------------------------------------------------------------- shared with link_envelopes


def no_crossings(num_1: int, num_2: int) -> Crossings:
    """Return counts to be filled."""
    counts = np.zeros((num_1, num_2), dtype=np.int16)
    return Crossings(counts, np.zeros(num_1, dtype=np.int64), np.zeros(num_2, dtype=np.int64))


def everyone(crossings: Crossings) -> tuple[IntArray, IntArray, IntArray]:
    """Return `changed_members` if all individuals are new."""
    return np.arange(len(crossings.sums_1)), np.arange(0), np.arange(0)


def changed_members(
    crossings: Crossings,
    num_1: int,
    num_2: int,
    changed_1: BoolArray,
    changed_2: BoolArray,
) -> tuple[IntArray, IntArray, IntArray]:
    """Return the changed and unchanged individuals of population 1, and the changed ones of 2.

    Raises:
        ValueError: If counts or flags have another shape than the populations.
    """
    if crossings.counts.shape != (num_1, num_2):
        raise ValueError(
            f"crossings.counts must have shape ({num_1}, {num_2}), was {crossings.counts.shape}"
        )
    for name, changed, size in (("changed_1", changed_1, num_1), ("changed_2", changed_2, num_2)):
        if changed.shape != (size,) or changed.dtype != np.bool_:
            raise ValueError(
                f"{name} must be bool of shape ({size},), was {changed.dtype} of shape "
                f"{changed.shape}"
            )
    return np.flatnonzero(changed_1), np.flatnonzero(~changed_1), np.flatnonzero(changed_2)


def checked_pair(
    name: str, first: FloatArray, second: FloatArray, rows: int
) -> tuple[FloatArray, FloatArray]:
    """Return the arrays of two populations, contiguous.

    Raises:
        ValueError: If they are not (K, rows, N1) and (K, rows, N2), or K is above 32767.
    """
    first, second = checked(f"{name}_1", first, rows), checked(f"{name}_2", second, rows)
    sizes = first.shape[0], second.shape[0]
    if sizes[0] != sizes[1]:
        raise ValueError(
            f"{name}_1 and {name}_2 must have as many configurations, had {sizes[0]} and {sizes[1]}"
        )
    if sizes[0] > kernels.MOST_CONFIGURATIONS:
        raise ValueError(
            f"{name}_1: at most {kernels.MOST_CONFIGURATIONS} configurations, were {sizes[0]}"
        )
    return first, second


def checked(name: str, array: FloatArray, rows: int) -> FloatArray:
    """Return an array of a population, contiguous.

    Raises:
        ValueError: If it is not (configurations, rows, individuals).
    """
    array = np.ascontiguousarray(array, dtype=np.float64)
    if array.ndim != 3 or array.shape[1] != rows:
        raise ValueError(
            f"{name} must have shape (configurations, {rows}, individuals), was {array.shape}"
        )
    return array
