"""The intersection of two links in the space of their angles (Curkovic et al. 2013, Fig. 7)."""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.planar_arms import Arm, tolerance_of
from evoexp.collision.planar.segment_predicates import meeting
from evoexp.numeric.compilation import kernel
from evoexp.records import BoolArray, FloatArray

PARALLEL = 1e-12
"""Links are parallel in `closed_form` up to this sine of the angle between them [-]."""


class ClosedForm(NamedTuple):
    """Intersections of the link pairs (1, 1), (1, 2), (2, 1), (2, 2) of arm 1 and arm 2."""

    # (4, n) where the lines meet on the link of arm 1: 0 at its beginning, 1 at its end; NaN
    # where parallel
    mu: FloatArray
    nu: FloatArray  # (4, n) the same on the link of arm 2
    crossing: BoolArray  # (4, n) whether the links have a point in common


def closed_form(one: Arm, q_1: FloatArray, two: Arm, q_2: FloatArray) -> ClosedForm:
    """Intersect all four pairs of links (Curkovic et al. 2013, Eqs. 11–12 and Fig. 7).

    With the arms' link vectors u1, u2 and v1, v2 and the bases d apart, link i of arm 1 begins w =
    d + Σ v − Σ u away from link j of arm 2 (sums over the links before), and

        mu = (w × vj) / (ui × vj),    nu = (w × ui) / (ui × vj),

    where each product is a sine of a difference of two angles times two lengths; for i = j = 2 and
    equal lengths this is Eq. 12. The paper counts mu, nu in (0, 1]; here in [0, 1]: a link has two
    ends. The formula is rounded, and says nothing of parallel links: whether links cross is decided
    as by `count_collisions`.

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
    crossing = np.empty(mu.shape, dtype=np.bool_)
    _write_crossings(joints_1, joints_2, tolerance_of(one, two), crossing)
    return ClosedForm(mu, nu, crossing)


def _joints(arm: Arm, q: FloatArray) -> FloatArray:
    """Return base, elbow and tip, (3, 2, n), at link angles (2, n) [rad]."""
    base = np.repeat(np.reshape(arm.base, (1, 2, 1)), q.shape[1], axis=2)
    return np.concatenate([base, arm.outlines(q[None])[0, :4].reshape(2, 2, -1)])


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[0] * v[1] - u[1] * v[0])


@kernel
def _write_crossings(
    one: FloatArray, two: FloatArray, tolerance: float, crossing: BoolArray
) -> None:
    """Write whether links cross, from the joints (3, 2, n) of both arms."""
    for pair in range(4):
        i, j = pair // 2, pair % 2
        for n in range(crossing.shape[1]):
            (ax, ay), (bx, by) = one[i, :, n], one[i + 1, :, n]
            (cx, cy), (dx, dy) = two[j, :, n], two[j + 1, :, n]
            crossing[pair, n] = meeting(ax, ay, bx, by, cx, cy, dx, dy, tolerance)
