"""Answers of a planner beside motions and costs: tables, shapes of solutions, tested covers."""

import math
from typing import Any, NamedTuple

from evoexp.records import FloatArray

Shape = tuple[Any, ...]  # of a solution: one tuple per part; a leading ... stands for any number
LONGEST = 1000  # parts of a solution of any number, as its memory is estimated


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
    """Return how many pairs of shapes one collision query of a planner stands for; NaN: not known.

    Args:
        problem: A prepared one; its collision model counts them.
    """
    return float(getattr(getattr(problem, "collision", None), "num_tests", math.nan))


def num_values(shape: Shape) -> int:
    """Return how many numbers a solution of a documented shape has; of any number of parts, many.

    Args:
        shape: As `Planner.shape` returns it.
    """
    if len(shape) and shape[0] is ...:
        return LONGEST * num_values(shape[1:])
    return sum(math.prod(part) for part in shape)
