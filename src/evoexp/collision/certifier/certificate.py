"""The exact verdict on a motion, as replicates record it."""

import math
from typing import Any, NamedTuple

from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import Part, Scene
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


def certificate(problem: Any, motion: Motion | None) -> Certificate:
    """Judge a motion by the bodies of a planner's problem.

    Args:
        problem: With its `scene` and `security_margin`; without them there is nothing to judge by.
            A problem whose bodies change on the way has `parts(motion)`, too: each is judged by its
            own bodies.
        motion: None where the planner's answer is no motion.
    """
    scene = getattr(problem, "scene", None)
    if scene is None or motion is None:
        return Certificate()
    if not hasattr(problem, "parts"):
        return _judged(scene, motion, problem.security_margin)
    return combined(
        [judged_part(part, motion, problem.security_margin) for part in problem.parts(motion)]
    )


def judged_part(part: Part, motion: Motion, security_margin: float) -> Certificate:
    """Judge a piece of a motion of straight segments by its own bodies.

    Instants are those of the whole motion.
    """
    found = _judged(part.scene, Motion(motion.q[part.first : part.last + 1]), security_margin)
    at, touched = found.clearance_at, found.refuted_at
    return found._replace(
        clearance_at=None if at is None else at + part.first,
        refuted_at=None if touched is None else touched + part.first,
    )


def combined(parts: list[Certificate]) -> Certificate:
    """Return the verdict on a motion from those on its pieces.

    The first contact, the least clearance.
    """
    touched = [part for part in parts if part.refuted_at is not None]
    queries = sum(part.certificate_queries for part in parts)
    if touched:
        return min(touched, key=lambda part: float(part.refuted_at or 0.0))._replace(
            certificate_queries=queries
        )
    closest = min(parts, key=lambda part: part.clearance)
    answers = {
        "certified": [part.certified for part in parts],
        "margin": [part.certified_margin for part in parts],
    }
    certified, margin = (
        False if False in given else None if None in given else True for given in answers.values()
    )
    return closest._replace(
        certified=certified, certified_margin=margin, certificate_queries=queries
    )


def _judged(scene: Scene, motion: Motion, security_margin: float) -> Certificate:
    verdict = certify(scene, motion, security_margin)
    touching = verdict.status == "refuted"
    return Certificate(
        certified=_ANSWER[verdict.status],
        certified_margin=_ANSWER[verdict.margin_status],
        clearance=float(verdict.clearance),
        clearance_at=float(verdict.clearance_at) if verdict.clearance_pair else None,
        clearance_pair=PAIR.join(verdict.clearance_pair or ()),
        refuted_at=float(verdict.refuted_at) if touching else None,
        refuted_pair=PAIR.join(verdict.refuted_pair or ()),
        certificate_queries=verdict.queries,
    )
