"""The exact verdict on a motion, as replicates record it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from evoexp.collision.certifier.allowed_contacts import contact_depths
from evoexp.collision.certifier.verdict import certify, is_clear
from evoexp.collision.scene import Part
from evoexp.paths.motion import Motion

PAIR = " – "
_ANSWER = {"certified": True, "refuted": False, "undecided": None}


class Certificate(NamedTuple):
    """Fields of `ReplicateSummary` that the certifier fills; without a motion they say nothing.

    Pairs that may touch count for `certified` and `refuted_at` alone, by their depth.
    """

    # whether the bodies never touch, and those that may never overlap deeper than they may; None:
    # undecided
    certified: bool | None = None
    # whether they never come closer than the security margin; None: undecided
    certified_margin: bool | None = None
    # least distance of the bodies over the whole motion [length unit of the scene]; 0 where they
    # touch
    clearance: float = math.nan
    clearance_at: float | None = None  # where [instant]
    clearance_pair: str = ""  # which bodies
    refuted_at: float | None = None  # first contact [instant]; None: there is none
    refuted_pair: str = ""  # which bodies touch there
    certificate_queries: int = 0  # exact distances that were computed
    # the pairs that may touch somewhere in the motion, separated by commas
    allowed_contacts: str = ""
    # their greatest depth; 0 where they never touch, None without such pairs
    penetration: float | None = None
    penetration_pair: str = ""  # which pair


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


def is_proven(
    parts: Sequence[Part], motion: Motion, security_margin: float, by_margin: bool
) -> bool:
    """Return whether `certificate` would prove a motion, without measuring how clearly.

    Args:
        parts: See `certificate`; without pieces nothing is proven.
        motion: The whole motion.
        security_margin: See `certificate`.
        by_margin: Whether the task's margins must be kept, too.
    """
    for part in parts:
        piece = _piece(part, motion)
        margin = security_margin if part.margins is None else part.margins
        if not is_clear(part.scene, piece, margin if by_margin else 0.0):
            return False
        depths, _ = contact_depths(part.scene, piece)
        if not all(d.too_deep_at is None and (d.decided or by_margin) for d in depths):
            return False
    return bool(parts)


def _piece(part: Part, motion: Motion) -> Motion:
    """Return a piece of a motion; its instants begin at 0."""
    first, last, cubics = part.first, part.last, motion.coefficients
    return Motion(motion.q[first : last + 1], None if cubics is None else cubics[first:last])


def judged_part(part: Part, motion: Motion, security_margin: float) -> Certificate:
    """Judge one piece of a motion by its own bodies; instants are those of the whole motion."""
    first, piece = part.first, _piece(part, motion)
    margin = security_margin if part.margins is None else part.margins
    verdict = certify(part.scene, piece, margin)
    touching = verdict.status == "refuted"
    judged = Certificate(
        certified=_ANSWER[verdict.status],
        certified_margin=_ANSWER[verdict.margin_status],
        clearance=float(verdict.clearance),
        clearance_at=first + float(verdict.clearance_at) if verdict.clearance_pair else None,
        clearance_pair=PAIR.join(verdict.clearance_pair or ()),
        refuted_at=first + float(verdict.refuted_at) if touching else None,
        refuted_pair=PAIR.join(verdict.refuted_pair or ()),
        certificate_queries=verdict.queries,
    )
    # how deep the pairs overlap that may touch
    depths, queries = contact_depths(part.scene, piece)
    if not depths:
        return judged
    names = part.scene.names
    pairs = [PAIR.join((names[d.contact.one], names[d.contact.two])) for d in depths]
    deepest = max(range(len(depths)), key=lambda k: depths[k].greatest)
    judged = judged._replace(
        certificate_queries=judged.certificate_queries + queries,
        allowed_contacts=", ".join(pairs),
        penetration=depths[deepest].greatest,
        penetration_pair=pairs[deepest] if depths[deepest].greatest > 0.0 else "",
    )
    # a pair that overlaps too deep refutes like one that must not touch
    at = [math.inf if d.too_deep_at is None else part.first + d.too_deep_at for d in depths]
    first = min(range(len(depths)), key=lambda k: at[k])
    if at[first] < (math.inf if judged.refuted_at is None else judged.refuted_at):
        return judged._replace(
            certified=False,
            certified_margin=False,
            clearance=0.0,
            clearance_at=at[first],
            clearance_pair=pairs[first],
            refuted_at=at[first],
            refuted_pair=pairs[first],
        )
    decided = all(d.decided for d in depths)
    return judged if decided else judged._replace(certified=_all([judged.certified, None]))


def combined(parts: Sequence[Certificate]) -> Certificate:
    """Return the verdict on a motion from those on its pieces.

    It has the first contact, or else the least clearance.
    """
    # the pairs that may touch anywhere, and the deepest overlap of one
    pairs = dict.fromkeys(p for part in parts for p in part.allowed_contacts.split(", ") if p)
    deepest = max(parts, key=lambda part: -1.0 if part.penetration is None else part.penetration)
    touched = [part for part in parts if part.refuted_at is not None]
    if touched:
        whole = min(touched, key=lambda part: float(part.refuted_at or 0.0))
    else:
        whole = min(parts, key=lambda part: part.clearance)._replace(
            certified=_all([part.certified for part in parts]),
            certified_margin=_all([part.certified_margin for part in parts]),
        )
    return whole._replace(
        certificate_queries=sum(part.certificate_queries for part in parts),
        allowed_contacts=", ".join(pairs),
        penetration=deepest.penetration,
        penetration_pair=deepest.penetration_pair,
    )


def _all(answers: Sequence[bool | None]) -> bool | None:
    """Return whether all answers are yes; None if one is undecided and none is no."""
    return False if False in answers else None if None in answers else True
