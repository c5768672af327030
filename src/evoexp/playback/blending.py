"""Corners of a motion rounded, as far as the exact certifier proves the rounded motion.

A corner between two straight lines is replaced by a parabola that leaves the one line and joins the
other at equal ways from the corner. Each starts with half of the shorter line, and is made smaller
until the whole motion is as certified as the one with corners was.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evoexp.collision.certifier.certificate import Certificate, certificate
from evoexp.collision.scene import Part
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

SHARPEST = -0.9  # [-] cosine of the turn at a corner, beyond which the motion stops there
HALVINGS = 8  # of a parabola, before the motion stops at its corner


class BlendedMotion(NamedTuple):
    """A motion without corners, or with fewer."""

    motion: Motion  # lines and parabolas
    # (segments,) way along each, measured in times at the joints' greatest speeds [s]; the
    # derivative of q with respect to this way is continuous except at `stops`
    lengths: FloatArray
    # Instants, between the first and the last, at which the motion has to stop
    stops: tuple[int, ...]
    parts: tuple[Part, ...]  # pieces with bodies of their own, in instants of `motion`
    num_corners: int  # corners that were rounded
    verdict: Certificate  # of the rounded motion


class _Corners(NamedTuple):
    """A motion of straight lines that all have a length."""

    q: FloatArray  # (instants, nq)
    lengths: FloatArray  # (segments,) of the lines, in units of greatest speeds [s]
    instants: list[int]  # (instants,) numbers in the motion that was given
    # (instants,) half of the way that each parabola replaces [s]; 0 at ends and stops
    rounded: FloatArray


def blended(
    motion: Motion, parts: Sequence[Part], margin: float, speeds: FloatArray
) -> BlendedMotion:
    """Round the corners of a motion within its proven clearance.

    Args:
        motion: A motion of straight segments that is certified.
        parts: Its pieces with bodies of their own; where one ends, the motion stops.
        margin: Clearance that the task requires [length unit].
        speeds: (nq,) greatest speeds, by which joints are weighed.
    """
    wanted = certificate(parts, motion, margin)
    corners = _corners(motion, parts, speeds)
    tried = np.zeros(len(corners.q), dtype=np.int64)
    while True:
        found = _rounded(corners, parts)
        verdict = certificate(found.parts, found.motion, margin)
        if _at_least(verdict, wanted) or not corners.rounded.any():
            return found._replace(verdict=verdict)
        at = verdict.refuted_at if verdict.refuted_at is not None else verdict.clearance_at
        worst = _nearest_corner(corners, found, at)
        tried[worst] += 1
        corners.rounded[worst] *= 0.5 if tried[worst] <= HALVINGS else 0.0


def _at_least(verdict: Certificate, wanted: Certificate) -> bool:
    """Whether a verdict proves what another one proves."""
    pairs = (
        (wanted.certified, verdict.certified),
        (wanted.certified_margin, verdict.certified_margin),
    )
    return all(now is True or before is not True for before, now in pairs)


def _corners(motion: Motion, parts: Sequence[Part], speeds: FloatArray) -> _Corners:
    """Drop segments without a way, and begin with the largest parabolas."""
    kept = [0]
    for k in range(1, len(motion.q)):
        if (motion.q[k] != motion.q[kept[-1]]).any():
            kept.append(k)
    q = motion.q[kept]
    scaled = q / speeds
    ways = np.diff(scaled, axis=0)
    lengths = np.sqrt((ways**2).sum(axis=1))
    borders = {instant for part in parts for instant in (part.first, part.last)}
    rounded = np.zeros(len(q))
    for k in range(1, len(q) - 1):
        turn = float((ways[k - 1] * ways[k]).sum() / (lengths[k - 1] * lengths[k]))
        here = range(kept[k], kept[k + 1])  # instants at this very place
        if turn > SHARPEST and not borders.intersection(here):
            rounded[k] = 0.5 * min(lengths[k - 1], lengths[k])
    return _Corners(q, lengths, kept, rounded)


def _rounded(corners: _Corners, parts: Sequence[Part]) -> BlendedMotion:
    """Write the motion with its present parabolas."""
    q, lengths, half = corners.q, corners.lengths, corners.rounded
    pieces, ways, starts, stops = [], [], [0], []
    for k in range(len(lengths)):
        along = (q[k + 1] - q[k]) / lengths[k]
        begin, end = q[k] + half[k] * along, q[k + 1] - half[k + 1] * along
        rest = lengths[k] - half[k] - half[k + 1]
        if rest > 1e-9 * lengths[k]:
            pieces.append([begin, end - begin, np.zeros_like(begin), np.zeros_like(begin)])
            ways.append(rest)
        starts.append(len(pieces))
        if k + 1 < len(lengths) and half[k + 1] > 0.0:
            onward = (q[k + 2] - q[k + 1]) / lengths[k + 1]
            after = q[k + 1] + half[k + 1] * onward
            middle = 2.0 * (q[k + 1] - end)
            pieces.append([end, middle, after - end - middle, np.zeros_like(begin)])
            ways.append(2.0 * half[k + 1])
        elif k + 1 < len(lengths):
            stops.append(len(pieces))
    coefficients = np.array(pieces)
    motion = Motion(np.vstack([coefficients[:, 0], q[-1:]]), coefficients)
    instant = {given: starts[k] for k, given in enumerate(corners.instants)}
    placed = tuple(
        part._replace(first=_instant(instant, part.first), last=_instant(instant, part.last))
        for part in parts
    )
    placed = (*placed[:-1], placed[-1]._replace(last=len(pieces))) if placed else placed
    count = int((half > 0.0).sum())
    return BlendedMotion(motion, np.array(ways), tuple(stops), placed, count, Certificate())


def _instant(places: dict[int, int], given: int) -> int:
    """Return the instant at which the motion is where it was at a given one."""
    return places[max(k for k in places if k <= given)]


def _nearest_corner(corners: _Corners, found: BlendedMotion, at: float | None) -> int:
    """Return the parabola, of those that are left, that is nearest to an instant."""
    left = np.flatnonzero(corners.rounded > 0.0)
    if at is None:
        return int(left[np.argmax(corners.rounded[left])])
    q = found.motion.at(min(max(at, 0.0), float(found.motion.num_segments)))
    away = ((corners.q[left] - q) ** 2).sum(axis=1)
    return int(left[np.argmin(away)])
