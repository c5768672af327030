"""The exact verdict on a motion, as replicates record it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import Part
from evoexp.paths.motion import Motion

PAIR = " – "
_ANSWER = {"certified": True, "refuted": False, "undecided": None}


class Certificate(NamedTuple):
    """Fields of `ReplicateSummary` that the certifier fills; without a motion they say nothing.

    Attributes:
        certified: Whether the bodies never touch; None: undecided.
        certified_margin: Whether they never come closer than the security margin; None: undecided.
        clearance: Least distance of the bodies over the whole motion [length unit of the scene]; 0
            where they touch.
        clearance_at: Where [instant].
        clearance_pair: Which bodies.
        refuted_at: First contact [instant]; None: there is none.
        refuted_pair: Which bodies touch there.
        certificate_queries: Exact distances that were computed.
    """

    certified: bool | None = None
    certified_margin: bool | None = None
    clearance: float = math.nan
    clearance_at: float | None = None
    clearance_pair: str = ""
    refuted_at: float | None = None
    refuted_pair: str = ""
    certificate_queries: int = 0


def certificate(parts: Sequence[Part], motion: Motion, security_margin: float) -> Certificate:
    """Judge a motion piece by piece; without pieces there is nothing to judge by.

    Args:
        parts: Pieces of the motion in the order of time, each with its own bodies.
        motion: The whole motion; instants are counted from its beginning.
        security_margin: Clearance that the task requires [length unit of the scenes], where a piece
            has no margins of its own.
    """
    judged = [judged_part(part, motion, security_margin) for part in parts]
    return combined(judged) if judged else Certificate()


def judged_part(part: Part, motion: Motion, security_margin: float) -> Certificate:
    """Judge one piece of a motion by its own bodies; instants are those of the whole motion."""
    first, last = part.first, part.last
    cubics = motion.coefficients
    piece = Motion(motion.q[first : last + 1], None if cubics is None else cubics[first:last])
    margin = security_margin if part.margins is None else part.margins
    verdict = certify(part.scene, piece, margin)
    touching = verdict.status == "refuted"
    return Certificate(
        certified=_ANSWER[verdict.status],
        certified_margin=_ANSWER[verdict.margin_status],
        clearance=float(verdict.clearance),
        clearance_at=first + float(verdict.clearance_at) if verdict.clearance_pair else None,
        clearance_pair=PAIR.join(verdict.clearance_pair or ()),
        refuted_at=first + float(verdict.refuted_at) if touching else None,
        refuted_pair=PAIR.join(verdict.refuted_pair or ()),
        certificate_queries=verdict.queries,
    )


def combined(parts: Sequence[Certificate]) -> Certificate:
    """Return the verdict on a motion from those on its pieces.

    It has the first contact, or else the least clearance.
    """
    queries = sum(part.certificate_queries for part in parts)
    touched = [part for part in parts if part.refuted_at is not None]
    if touched:
        first = min(touched, key=lambda part: float(part.refuted_at or 0.0))
        return first._replace(certificate_queries=queries)
    return min(parts, key=lambda part: part.clearance)._replace(
        certified=_all([part.certified for part in parts]),
        certified_margin=_all([part.certified_margin for part in parts]),
        certificate_queries=queries,
    )


def _all(answers: Sequence[bool | None]) -> bool | None:
    """Return whether all answers are yes; None if one is undecided and none is no."""
    return False if False in answers else None if None in answers else True
