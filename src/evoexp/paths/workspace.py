"""The constant factor of the splines and the scratch memory of redistribution.

The scratch is one flat array of rows of 64 lanes; a kernel addresses it as `floats[base + r * ROW +
lane]` with a constant r. Only with such constant distances does LLVM see that rows do not overlap
and vectorise loops that read and write several of them. Indices are unsigned: a signed one would be
tested for wrap-around, which prevents vectorising. Rows, for J joints, N segments and S samples per
segment:

- knot i of joint j: a (the coordinate), then m (a sixth of the spline's second derivative there);
- sample −3 … N·S + 1: v (the speed), then L (the arc length up to there);
- 16 rows of work.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.records import FloatArray

ROW = np.uint64(64)  # lanes per block, and distance of two rows of scratch
R2, R3, R4, R5, R6, R7, R8 = (np.uint64(rows * 64) for rows in range(2, 9))
ROW_SHIFT = np.uint64(6)  # ROW = 2^6
U0, U1, U2, U3, U4 = (np.uint64(u) for u in range(5))
WORK_ROWS = 16
MAX_SAMPLES = 1024

Offsets = NDArray[np.uint64]
EndCondition = Literal["natural", "clamped"]


class Redistribution(NamedTuple):
    """Settings, constant factor and scratch of `redistribute`, for one thread.

    Attributes:
        num_via_points: N; a path has the N + 1 points 0..N.
        max_joints: The most joints that one arm may have.
        end_condition: `natural` (no curvature at the ends) or `clamped` (no slope there).
        samples_per_segment: Speeds evaluated per segment.
        pivots: Reciprocal pivots of the tridiagonal system.  # (N + 1,)
        floats: Scratch, 64-byte aligned.
        integers: Scratch.
    """

    num_via_points: int
    max_joints: int
    end_condition: EndCondition
    samples_per_segment: int
    pivots: FloatArray
    floats: FloatArray
    integers: Offsets


def spline_pivots(num_segments: int, end_condition: EndCondition) -> FloatArray:
    """Return the reciprocal pivots (N + 1,) of the system for m.

    m is a sixth of a cubic spline's second derivatives.

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
    offset = (-raw.ctypes.data % 64) // 8
    return raw[offset : offset + size]


def prepare_redistribution(
    num_via_points: int,
    max_joints: int,
    end_condition: EndCondition = "natural",
    samples_per_segment: int = 8,
) -> Redistribution:
    """Factor the splines' system and allocate the scratch of `redistribute`, once.

    Args:
        num_via_points: N; a path has the N + 1 points 0..N.
        max_joints: The most joints that one arm may have.
        end_condition: `natural` or `clamped` (zero slope at both ends).
        samples_per_segment: Speeds evaluated per segment, a power of two from 8 to 1024; see
            `redistribute`.

    Raises:
        ValueError: A setting out of range.
    """
    if num_via_points < 1:
        raise ValueError(f"num_via_points: must be at least 1, was {num_via_points}")
    if max_joints < 1:
        raise ValueError(f"max_joints: must be at least 1, was {max_joints}")
    if end_condition not in ("natural", "clamped"):
        raise ValueError(f"end_condition: must be 'natural' or 'clamped', was {end_condition!r}")
    samples = samples_per_segment
    if not 8 <= samples <= MAX_SAMPLES or samples & (samples - 1):
        raise ValueError(
            f"samples_per_segment: must be a power of two from 8 to {MAX_SAMPLES}, was {samples}"
        )
    rows = 2 * max_joints * (num_via_points + 1) + 2 * (num_via_points * samples + 5) + WORK_ROWS
    return Redistribution(
        num_via_points,
        max_joints,
        end_condition,
        samples,
        spline_pivots(num_via_points, end_condition),
        aligned_zeros(rows * int(ROW)),
        aligned_zeros((num_via_points + 3) * int(ROW)).view(np.uint64),
    )
