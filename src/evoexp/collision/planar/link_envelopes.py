"""Collisions of planar arms of two links with envelopes, whole populations against each other.

Curkovic, Jerbic & Stipancic 2013, section 4: each link is a set of two boundary lines, parallel to
it, and a circle of variable radius lies around the tool centre point (Fig. 11). Two arms collide in
a configuration if a boundary line or the circle of one touches a boundary line or the circle of the
other. Boundary lines have no ends across: an arm may lie between another's two lines unnoticed, as
in the paper. Without width and radius this is `link_crossings`.

Lines and circles that only rounding holds apart touch, as in `link_crossings`.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar import link_envelope_kernels as kernels
from evoexp.collision.planar.envelope_contact import Envelope
from evoexp.collision.planar.link_crossings import (
    Arm,
    Crossings,
    changed_members,
    checked,
    checked_pair,
    everyone,
    no_crossings,
)
from evoexp.records import BoolArray, FloatArray, IntArray


class EnvelopedArm(NamedTuple):
    """A planar arm of two links with its envelope."""

    arm: Arm  # the arm
    half_width: float  # distance of both boundary lines from their link [length unit of the scene]
    tcp_radius: float  # of the circle around the tip [length unit of the scene]; 0: no circle

    def outlines(self, q: FloatArray) -> FloatArray:
        """Return the outlines of a population.

        Args:
            q: (K, 2, N) angles of the links from +x [rad].

        Returns:
            (K, 8, N): elbow x, y, tip x, y [length unit of the scene], and the links' unit
            directions x, y, x, y.

        Raises:
            ValueError: If q has another shape.
        """
        q = checked("q", q, 2)
        out = np.empty((q.shape[0], 8, q.shape[2]))
        (x, y), (first, second) = self.arm.base, self.arm.lengths
        kernels.outlines(q, float(x), float(y), (float(first), float(second)), out)
        return out

    def boundaries(self, outlines: FloatArray) -> FloatArray:
        """Return the boundary lines: right and left of the first link, then of the second.

        Args:
            outlines: (K, 8, N).

        Returns:
            (4, 4, K, N): of each line its ends' x, y, x, y [length unit of the scene].
        """
        outlines = checked("outlines", outlines, 8)
        base = np.zeros(outlines[:, 0].shape)
        (x, y), joints = self.arm.base, (outlines[:, row] for row in range(4))
        ends = [base + x, base + y, *joints]
        lines = []
        for link in (0, 1):
            c, s = outlines[:, 4 + 2 * link], outlines[:, 5 + 2 * link]
            for side in (-1.0, 1.0):
                dx, dy = -(side * self.half_width * s), side * self.half_width * c
                ax, ay, bx, by = ends[2 * link : 2 * link + 4]
                lines.append([ax + dx, ay + dy, bx + dx, by + dy])
        return np.array(lines)


def count_collisions(
    one: EnvelopedArm, outlines_1: FloatArray, two: EnvelopedArm, outlines_2: FloatArray
) -> Crossings:
    """Count the configurations in which arms collide, for every pair of individuals.

    Args:
        one: Arm of population 1.
        outlines_1: (K, 8, N1) from `EnvelopedArm.outlines`.
        two: Arm of population 2.
        outlines_2: (K, 8, N2), the same configurations.

    Raises:
        ValueError: If the shapes do not fit, there are more than 32767 configurations, something is
            not finite, or a half width or radius is negative.
    """
    outlines_1, outlines_2 = checked_pair("outlines", outlines_1, outlines_2, 8)
    found = no_crossings(outlines_1.shape[2], outlines_2.shape[2])
    _update(found, one, outlines_1, two, outlines_2, *everyone(found))
    return found


def update_collisions(
    crossings: Crossings,
    one: EnvelopedArm,
    outlines_1: FloatArray,
    two: EnvelopedArm,
    outlines_2: FloatArray,
    changed_1: BoolArray,
    changed_2: BoolArray,
) -> None:
    """Count anew, in place, the pairs of which an individual changed, as `update_crossings` does.

    Args:
        crossings: Of the outlines before, altered.
        one: Arm of population 1.
        outlines_1: (K, 8, N1) now.
        two: Arm of population 2.
        outlines_2: (K, 8, N2) now.
        changed_1: (N1,) true where an individual of population 1 has another outline than before.
        changed_2: (N2,) the same of population 2.

    Raises:
        ValueError: As `count_collisions`; nothing is altered then.
    """
    outlines_1, outlines_2 = checked_pair("outlines", outlines_1, outlines_2, 8)
    members = changed_members(
        crossings, outlines_1.shape[2], outlines_2.shape[2], changed_1, changed_2
    )
    _update(crossings, one, outlines_1, two, outlines_2, *members)


def _update(
    found: Crossings,
    one: EnvelopedArm,
    outlines_1: FloatArray,
    two: EnvelopedArm,
    outlines_2: FloatArray,
    *members: IntArray,
) -> None:
    rows, others, columns = members
    arms = []
    for name, enveloped in (("one", one), ("two", two)):
        (x, y), (first, second) = enveloped.arm.base, enveloped.arm.lengths
        half_width, radius = enveloped.half_width, enveloped.tcp_radius
        if not np.isfinite([x, y, first, second, half_width, radius]).all():
            raise ValueError(f"{name} must be finite, was {enveloped}")
        if half_width < 0.0 or radius < 0.0:
            raise ValueError(
                f"{name}: half_width and tcp_radius must be at least 0, were {half_width} and "
                f"{radius}"
            )
        base, lengths = (float(x), float(y)), (float(first), float(second))
        arms.append(Envelope(base, lengths, float(half_width), float(radius)))
    if not (np.isfinite(outlines_1).all() and np.isfinite(outlines_2).all()):
        raise ValueError("outlines must be finite")
    kernels.collisions(arms[0], outlines_1, rows, others, arms[1], outlines_2, columns, *found)
