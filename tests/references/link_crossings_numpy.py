"""Crossing links, in rational numbers pair by pair, and in numpy for whole populations."""

from fractions import Fraction
from typing import Any

import numpy as np

from evoexp.records import FloatArray


def side(a: Any, b: Any, c: Any) -> int:
    """Return 1, 0 or −1: on which side of the line ab c lies."""
    value = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return (value > 0) - (value < 0)


def exact_touch(a: Any, b: Any, c: Any, d: Any) -> bool:
    """Whether two segments have a common point; ends are pairs of exact numbers."""
    if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
        return True
    return on_segment(a, b, c) or on_segment(a, b, d) or on_segment(c, d, a) or on_segment(c, d, b)


def on_segment(a: Any, b: Any, c: Any) -> bool:
    within = (min(a[k], b[k]) <= c[k] <= max(a[k], b[k]) for k in (0, 1))
    return side(a, b, c) == 0 and all(within)


def exact_squared_distance(a: Any, b: Any, c: Any, d: Any) -> Fraction:
    """Return the squared distance of two segments; ends are floats, taken as rational numbers."""
    a, b, c, d = (tuple(map(Fraction, point)) for point in (a, b, c, d))
    if exact_touch(a, b, c, d):
        return Fraction(0)
    ends = (a, b, c), (a, b, d), (c, d, a), (c, d, b)
    return min(_from_segment(*each) for each in ends)


def _from_segment(a: Any, b: Any, p: Any) -> Fraction:
    u, v = (b[0] - a[0], b[1] - a[1]), (p[0] - a[0], p[1] - a[1])
    square = u[0] * u[0] + u[1] * u[1]
    t = min(max((u[0] * v[0] + u[1] * v[1]) / square, 0), 1) if square else 0
    return (v[0] - t * u[0]) ** 2 + (v[1] - t * u[1]) ** 2


def cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[0] * v[1] - u[1] * v[0])


def crossing(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> np.ndarray:
    """Whether segments cross, by the signs of rounded line functions; ends are (2, …)."""
    first = cross(b - a, c - a) * cross(b - a, d - a) <= 0.0
    return np.asarray(first & (cross(d - c, a - c) * cross(d - c, b - c) <= 0.0))


def counts_of_populations(
    base_1: Any, points_1: FloatArray, base_2: Any, points_2: FloatArray
) -> np.ndarray:
    """Return the number of colliding configurations of each pair, (N1, N2)."""
    counts = np.zeros((points_1.shape[2], points_2.shape[2]), dtype=np.int64)
    start_1, start_2 = (np.array(base)[:, None, None] for base in (base_1, base_2))
    for one, two in zip(points_1, points_2, strict=True):
        a = start_1, one[:2, :, None], one[2:, :, None]
        b = start_2, two[:2, None], two[2:, None]
        met = [crossing(a[m], a[m + 1], b[n], b[n + 1]) for m in (0, 1) for n in (0, 1)]
        counts += met[0] | met[1] | met[2] | met[3]
    return counts


def squared_distance(a: FloatArray, b: FloatArray, p: FloatArray) -> FloatArray:
    """Of points from segments, (2, …) each."""
    u, w = b - a, p - a
    squared = (u * u).sum(axis=0)
    t = np.clip((u * w).sum(axis=0) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
    off = w - t * u
    return np.asarray((off * off).sum(axis=0))


def envelope_counts(
    lines_1: FloatArray,  # (4, 4, K, N1) of each boundary line its ends' x, y, x, y
    tips_1: FloatArray,  # (K, 2, N1)
    radius_1: float,  # of the circles around the tips
    lines_2: FloatArray,
    tips_2: FloatArray,
    radius_2: float,
) -> np.ndarray:
    """Return the number of colliding configurations of each pair of enveloped arms, (N1, N2)."""
    counts = np.zeros((tips_1.shape[2], tips_2.shape[2]), dtype=np.int64)
    for k in range(len(tips_1)):
        tip_1, tip_2 = tips_1[k][:, :, None], tips_2[k][:, None]
        met = ((tip_1 - tip_2) ** 2).sum(axis=0) < (radius_1 + radius_2) ** 2
        for one in lines_1[:, :, k, :, None]:
            met |= squared_distance(one[:2], one[2:], tip_2) < radius_2**2
            for two in lines_2[:, :, k, None]:
                met |= crossing(one[:2], one[2:], two[:2], two[2:])
        for two in lines_2[:, :, k, None]:
            met |= squared_distance(two[:2], two[2:], tip_1) < radius_1**2
        counts += met
    return counts
