"""The exact verdict on a motion, as replicates record it."""

import math
from typing import Any, NamedTuple

from evoexp.collision.certifier import certify
from evoexp.paths.motion import Motion

PAIR = " – "
_ANSWER = {"certified": True, "refuted": False, "undecided": None}


class Certificate(NamedTuple):
    """Fields of `ReplicateSummary` that the certifier fills; without a motion they say nothing.

    Attributes:
        certified: Whether the bodies never touch; None: undecided.
        certified_margin: Whether they never come closer than the security margin; None: undecided.
        clearance: Least distance of the bodies over the whole motion [length unit of the scene]; 0 where they touch.
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
        motion: None where the planner's answer is no motion.
    """
    scene = getattr(problem, "scene", None)
    if scene is None or motion is None:
        return Certificate()
    verdict = certify(scene, motion, problem.security_margin)
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
