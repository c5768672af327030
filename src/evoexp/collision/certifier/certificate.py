"""The exact verdict on a motion, as replicates record it, with depths of pairs that may touch.

A signed distance is negative where bodies overlap: minus the length of the shortest shift that
parts them. Both bodies are convex, so it is the greatest, over all directions, of the gap between
the two planes across a direction that support the bodies; none of these gaps changes faster than a
point of one body can move relative to the other. The bounds of speed by which distances are
searched therefore hold for depths, too.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evoexp.collision.certifier.coal_distances import (
    CoalDistance,
    LeafGoals,
    QueryLimit,
    search_interval,
)
from evoexp.collision.certifier.task import approach_weights
from evoexp.collision.certifier.verdict import certify, is_clear
from evoexp.collision.motion_bounds import approach_bounds
from evoexp.collision.scene import AllowedContact, Part, Scene
from evoexp.paths.motion import Motion

PAIR = " – "
MOST_QUERIES = 100_000
RESOLUTION = 0.02  # [-] of the allowed depth, up to which the greatest depth is found
EPA_ERROR = 1e-6  # [-] of the scene's size: of coal's depths, by its own tolerance
_ANSWER = {"certified": True, "refuted": False, "undecided": None}


class Certificate(NamedTuple):
    """Fields of `ReplicateSummary` that the certifier fills; without a motion they say nothing.

    Pairs that may touch count for `certified` and `refuted_at` alone, by their depth.
    """

    # whether no bodies touch but for allowed contacts, and these are nowhere deeper than allowed;
    # None: undecided
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
    """Return whether `certificate` would prove a motion, and perhaps its margins; see there.

    It does not measure how clearly; without pieces nothing is proven.
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
    """Return the verdict on a motion from those on its pieces, by the first contact if any."""
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


class Depth(NamedTuple):
    """The greatest depth of one pair that may touch."""

    contact: AllowedContact  # the pair
    greatest: float  # greatest depth found; 0 if the bodies never touch [length unit]
    at: float  # where [instant]
    # where the bodies first overlap deeper than they may [instant]; None: nowhere
    too_deep_at: float | None
    decided: bool  # whether the limit of queries was enough


class _DepthGoals(LeafGoals):
    """Asks for the greatest depth instead of the least clearance."""

    def target(self, upper: float) -> float:
        """Return the lower bound that is enough while `upper` is the least distance found."""
        return max(min(upper, 0.0) - self.resolution, self.level)


def contact_depths(scene: Scene, motion: Motion) -> tuple[tuple[Depth, ...], int]:
    """Find the greatest depths of a scene's allowed contacts, and count coal's queries."""
    if not scene.contacts:
        return (), 0
    pairs = np.array([contact[:2] for contact in scene.contacts], dtype=np.int64)
    distance = CoalDistance(scene._replace(pairs=pairs), motion, MOST_QUERIES)
    chain = scene.table.chain
    weights = approach_weights(chain, scene.bodies, pairs, motion.greatest)
    found = []
    for k, contact in enumerate(scene.contacts):
        depth = Depth(contact, 0.0, 0.0, None, True)
        try:
            found.append(_searched(depth, k, distance, weights))
        except QueryLimit:
            found.append(depth._replace(decided=False))
    return tuple(found), distance.queries


def _searched(depth: Depth, pair: int, distance: CoalDistance, weights: np.ndarray) -> Depth:
    """Search a motion segment by segment, up to the first instant that is too deep."""
    scene, motion, allowed = distance.scene, distance.motion, depth.contact.depth
    chain, slack = scene.table.chain, EPA_ERROR * scene.size
    goals = _DepthGoals(0.0, -allowed - slack, slack, np.inf, RESOLUTION * allowed, 0.0)
    if motion.num_segments == 0:
        least = distance(pair, 0.0)
        too_deep = 0.0 if least <= goals.level else None
        return depth._replace(greatest=max(0.0, -least), too_deep_at=too_deep)
    polynomials = np.ascontiguousarray(motion.polynomials)
    speeds, scratch = np.empty((2, len(weights))), np.empty(len(chain.parent))
    for segment in range(motion.num_segments):
        approach_bounds(chain, polynomials[segment], 0.0, 1.0, weights, speeds, scratch)
        interval = float(segment), segment + 1.0
        leaf = search_interval(distance, pair, interval, float(speeds[0, pair]), goals)
        if -leaf.least > depth.greatest:
            depth = depth._replace(greatest=-leaf.least, at=leaf.at)
        if leaf.first < np.inf:
            return depth._replace(too_deep_at=leaf.first)
    return depth
