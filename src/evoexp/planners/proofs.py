"""The exact verdict on a planner's motion, and searches that accept only what it proves."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from evoexp.collision.certifier.certificate import Certificate, certificate, is_proven
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray

Acceptance = Literal["model", "certified", "margin"]
"""Motions that a search accepts.

`model`: those that its collision model accepts at the instants it tests; `certified`: those of them
that the exact certifier proves free of contact between all instants; `margin`: or by the task's
margins.
"""

KEPT = 10_000  # verdicts that are remembered: elites, and what operators leave as it is


def judge_motion(planner: Any, problem: Any, motion: Motion | None) -> Certificate:
    """Judge a planner's motion by the exact bodies; without a motion the certificate is empty."""
    if motion is None:
        return Certificate()
    return certificate(planner.parts(problem, motion), motion, planner.security_margin(problem))


class Proofs:
    """Judges whole motions for a search that accepts proven ones only, each solution once."""

    def __init__(self, planner: Any, problem: Any) -> None:
        """Begin with no verdict; the planner's field `acceptance` is not `model`."""
        self.planner, self.problem = planner, problem
        self._known: dict[bytes, bool] = {}
        self._touching: dict[bytes, str] = {}
        self.num_certificates = 0  # motions judged so far

    def is_proven(self, solution: FloatArray) -> bool:
        """Return whether the certifier proves the motion of a flat solution."""
        key = solution.tobytes()
        if key not in self._known:
            if len(self._known) >= KEPT:
                self._known.clear()
            self.num_certificates += 1
            planner, problem = self.planner, self.problem
            motion = planner.motion(problem, solution)
            self._known[key] = motion is not None and is_proven(
                planner.parts(problem, motion),
                motion,
                planner.security_margin(problem),
                planner.acceptance == "margin",
            )
        return self._known[key]

    def touching_pair(self, solution: FloatArray) -> str:
        """Return the bodies that touch first in a motion, " – " between them; empty if none do."""
        key = solution.tobytes()
        if key not in self._touching:
            if len(self._touching) >= KEPT:
                self._touching.clear()
            motion = self.planner.motion(self.problem, solution)
            self._touching[key] = judge_motion(self.planner, self.problem, motion).refuted_pair
        return self._touching[key]

    def settle(self, costs: FloatArray, solution: Callable[[int], FloatArray]) -> int | None:
        """Judge individuals, the cheapest first, until one is proven; return it, None if none is.

        In `costs` (individuals,) refuted ones cost inf then.
        """
        while np.isfinite(costs[k := int(np.argmin(costs))]):
            if self.is_proven(solution(k)):
                return k
            costs[k] = np.inf
        return None
