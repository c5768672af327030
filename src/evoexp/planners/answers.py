"""Answers of a planner: judged populations, tables, covers, departures, the verdict on its motion.

`Proofs` serves searches that accept only what the exact certifier proves.

A motion that never leaves the start touches nothing and is certified; only its departures tell that
it does not solve the task.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.certifier.certificate import Certificate, certificate, is_proven
from evoexp.paths.motion import Motion
from evoexp.records import BoolArray, FloatArray

Shape = tuple[Any, ...]  # of a solution: a tuple per part, ((12, 7),); a leading ...: any number
LONGEST = 1000  # parts of a solution of any number, as its memory is estimated
SAME = 1e-6  # [unit of the values] files hold rounded numbers: what differs by less is the same
KEPT = 10_000  # verdicts that are remembered: elites, and what operators leave as it is

Acceptance = Literal["model", "certified", "margin"]
"""Motions that a search accepts.

`model`: its collision model accepts the motion at the instants it tests; `certified`: the exact
certifier also proves the motion free of contact between all instants; `margin`: the proof includes
the task's margins.
"""


class JudgementArrays(NamedTuple):
    """A judged population."""

    cost: FloatArray  # (individuals,) lower is better; inf: infeasible
    feasible: BoolArray  # (individuals,) whether the planner's own model accepts each
    collision_queries: int  # configurations queried, those skipped by kernels included
    terms: Mapping[str, NDArray[Any]]  # name → (individuals,) of the planner's own terms

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the terms of one individual."""
        return {name: float(values[individual]) for name, values in self.terms.items()}


class CoverShape(NamedTuple):
    """A sphere or capsule that a search tests in place of a body."""

    joint: int  # Pinocchio's index of the joint that moves it; 0: it stands still
    start: FloatArray  # (3,) one end of its segment in the joint's frame [length unit]
    end: FloatArray  # (3,) the other end; the same for a sphere
    radius: float  # [length unit]


class Listing(NamedTuple):
    """A table with one row per configuration of a solution."""

    names: list[str]  # names of the columns
    rows: list[list[Any]]  # values, row by row


def num_body_tests(problem: Any) -> float:
    """Return how many pairs of shapes one query of a problem's model compares; NaN: unknown."""
    return float(getattr(getattr(problem, "collision", None), "num_tests", math.nan))


def num_values(shape: Shape) -> int:
    """Return how many numbers a solution of a documented shape has; many for any number."""
    if len(shape) and shape[0] is ...:
        return LONGEST * num_values(shape[1:])
    return sum(math.prod(part) for part in shape)


def in_shape(solution: FloatArray, *shape: int) -> FloatArray:
    """Return a flat solution in a shape, whose first size may be −1: any number.

    Raises:
        ValueError: If it has another size.
    """
    size = math.prod(shape)
    rest = solution.size % size if size < 0 else abs(solution.size - size)
    if solution.ndim != 1 or solution.size == 0 or rest:
        must = f"a multiple of {-size} values" if size < 0 else f"{size} values"
        raise ValueError(f"a solution has {must}, was {solution.shape}")
    return np.ascontiguousarray(solution.reshape(shape))


def of_place(name: str, given: FloatArray, wanted: FloatArray, unit: str) -> list[str]:
    """Return a phrase if a configuration or place, of any shape, differs from the task's.

    The name is one as in "the start of arm 1".
    """
    apart = float(np.max(np.abs(given - wanted)))
    return [] if apart <= SAME else [f"{name} is not the task's: {apart:.4g} {unit} away"]


def of_limits(names: Sequence[str], values: FloatArray, limits: FloatArray, unit: str) -> list[str]:
    """Return a phrase per joint that leaves its limits (joints, 2) by values (joints, any)."""
    below = limits[:, 0] - values.min(axis=1)
    above = values.max(axis=1) - limits[:, 1]
    return [
        f"{name} leaves its limits by {beyond:.4g} {unit}"
        for name, beyond in zip(names, np.maximum(below, above).tolist(), strict=True)
        if beyond > SAME
    ]


def of_postures(postures: FloatArray, start: FloatArray, limits: FloatArray) -> list[str]:
    """Compare the start of postures (postures, joints) [rad] with the task's, all with limits."""
    at_start = of_place("the start", postures[0], start, "rad")
    return at_start + of_limits(joint_names(len(start)), postures.T, limits, "rad")


def joint_names(count: int) -> list[str]:
    """Return the names of joints, counted from 1."""
    return [f"joint {k + 1}" for k in range(count)]


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

        In `costs` (individuals,) refuted individuals then cost inf.
        """
        while np.isfinite(costs[k := int(np.argmin(costs))]):
            if self.is_proven(solution(k)):
                return k
            costs[k] = np.inf
        return None
