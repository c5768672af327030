"""Answers of a planner beside motions: judged populations, tables, covers, departures.

A motion that never leaves the start touches nothing and is certified; only its departures tell that
it does not do what was asked for.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.records import BoolArray, FloatArray

Shape = tuple[Any, ...]  # of a solution: one tuple per part; a leading ... stands for any number
LONGEST = 1000  # parts of a solution of any number, as its memory is estimated
SAME = 1e-6  # [unit of the values] files hold rounded numbers: what differs by less is the same


class JudgementArrays(NamedTuple):
    """A judged population."""

    cost: FloatArray  # (individuals,) lower is better; inf: infeasible
    feasible: BoolArray  # (individuals,) whether the planner's own model accepts each
    collision_queries: int  # configurations asked for, also those that the kernels skip
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
    """Return how many pairs of shapes one query of a problem's model is; NaN: not known."""
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
    """Return a phrase if a configuration or place is another one than the task's, of any shape.

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
