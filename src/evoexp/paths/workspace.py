"""The constant factor of the splines and the scratch memory of redistribution.

Eight paths of one arm are treated at a time, as vectors. The scratch is one flat array. Vectors
hold one number of each of the eight paths (lanes); rows hold the numbers of one path side by side,
for reading them at a place that differs from path to path. For J joints, N segments and S samples
per segment:

- `knots`: vectors a (the coordinate) and m (a sixth of the spline's second derivative there) of
  knot i of joint j;
- `begins`: vectors of arc length up to the begin of each segment;
- `targets`, `entered`, `found`: vectors of each target's length, of the last segment that it is the
  first to follow, and of its sample;
- `speeds`: vectors of the speed at every sample, and at one beyond the goal;
- `rows`: per lane a and m again, joint by joint and knot by knot;
- `lengths`: per lane the arc length up to every sample.

Another array holds places: eight for a moment, then per target those of its segment in `rows`
(`knots`), of its sample in `lengths` (`samples`) and in `speeds` (`instants`).
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import LANES
from evoexp.records import FloatArray

VECTOR = np.uint64(LANES)  # places of a vector
U0, U1, U2, U3, U4, U5, U6, U7 = (np.uint64(u) for u in range(8))
EIGHT = VECTOR * VECTOR  # places of eight vectors

Offsets = NDArray[np.uint64]
EndCondition = Literal["natural", "clamped"]


class Redistribution(NamedTuple):
    """Constant factor and scratch of `redistribute_arms`, for one thread."""

    samples_per_segment: int  # speeds evaluated per segment, a power of two from 8 on
    pivots: FloatArray  # (N + 1,) reciprocal pivots of the tridiagonal system
    floats: FloatArray  # scratch, 64-byte aligned
    integers: Offsets  # scratch


class Layout(NamedTuple):
    """Places in the scratch; see the module's first lines."""

    joint: np.uint64  # distance of two joints, in `knots` of vectors and in `rows` of numbers
    row: np.uint64  # distance of two lanes in `rows`
    sample: np.uint64  # distance of two lanes in `lengths`
    begins: np.uint64  # `knots` begin at 0
    targets: np.uint64  # in all, one per point
    entered: np.uint64  # as `targets`
    found: np.uint64  # as `targets`
    speeds: np.uint64  # as `targets`, one per sample
    rows: np.uint64  # of lane 0
    lengths: np.uint64  # of lane 0
    size: np.uint64  # of all
    knots: np.uint64  # in the other array
    samples: np.uint64  # in the other array
    instants: np.uint64  # in the other array
    num_places: np.uint64  # size of the other array


@inlined
def layout(joints: np.uint64, N: np.uint64, S: np.uint64) -> Layout:
    """Return the places for paths of so many joints, segments, and samples per segment."""
    points = (N + U1) * VECTOR
    joint = ((N + U4) >> U2) << U3  # two numbers per knot, knots in fours
    row, sample = joints * joint, N * S + VECTOR
    begins = row * VECTOR
    targets = begins + points
    entered, found, speeds = targets + points, targets + U2 * points, targets + U3 * points
    rows = speeds + (N * S + U2) * VECTOR
    lengths = rows + row * VECTOR
    return Layout(
        joint,
        row,
        sample,
        begins,
        targets,
        entered,
        found,
        speeds,
        rows,
        lengths,
        lengths + sample * VECTOR,
        VECTOR,
        VECTOR + points,
        VECTOR + U2 * points,
        VECTOR + U3 * points,
    )


def spline_pivots(num_segments: int, end_condition: EndCondition) -> FloatArray:
    """Return the reciprocal pivots (N + 1,) of the system for m, a sixth of the second derivatives.

    Inside, m[i−1] + 4 m[i] + m[i+1] = a[i−1] − 2 a[i] + a[i+1]. Clamped ends (slope zero) add the
    first equation 2 m[0] + m[1] = a[1] − a[0] and the last, m[N−1] + 2 m[N] = a[N−1] − a[N].
    Natural ones have m[0] = m[N] = 0, which a reciprocal of zero achieves.
    """
    clamped = end_condition == "clamped"
    pivots = np.zeros(num_segments + 1)
    pivots[0] = 0.5 if clamped else 0.0
    for i in range(1, num_segments):
        pivots[i] = 1.0 / (4.0 - pivots[i - 1])
    pivots[num_segments] = 1.0 / (2.0 - pivots[num_segments - 1]) if clamped else 0.0
    return pivots


def aligned_zeros(size: int) -> FloatArray:
    """Return zeros (size,) float64 that begin at a cache line."""
    raw = np.zeros(size + 8)
    offset = (-raw.__array_interface__["data"][0] % 64) // 8
    return raw[offset : offset + size]


def prepare_redistribution(
    num_via_points: int,  # N; a path has the N + 1 points 0..N
    max_joints: int,  # the most joints that one arm may have
    end_condition: EndCondition = "natural",  # or `clamped`: zero slope at both ends
    samples_per_segment: int = 8,  # a power of two from 8 to 1024; see `redistribute_arms`
) -> Redistribution:
    """Factor the splines' system and allocate the scratch of `redistribute_arms`, once."""
    at = layout(*(np.uint64(size) for size in (max_joints, num_via_points, samples_per_segment)))
    return Redistribution(
        samples_per_segment,
        spline_pivots(num_via_points, end_condition),
        aligned_zeros(int(at.size)),
        aligned_zeros(int(at.num_places)).view(np.uint64),
    )
