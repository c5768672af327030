"""Answers of a planner beside motions and costs: a table, and the shapes that its search tests."""

from typing import Any, NamedTuple

from evoexp.records import FloatArray


class CoverShape(NamedTuple):
    """A sphere or capsule that a search tests in place of a body.

    Attributes:
        joint: Pinocchio's index of the joint that moves it; 0: it stands still.
        start: (3,) one end of its segment in the joint's frame [length unit].
        end: (3,) the other end; the same for a sphere.
        radius: [length unit].
    """

    joint: int
    start: FloatArray
    end: FloatArray
    radius: float


class Listing(NamedTuple):
    """A table with one row per configuration of a solution.

    Attributes:
        names: Names of the columns.
        rows: Values, row by row.
    """

    names: list[str]
    rows: list[list[Any]]
