"""Departures: ways in which a solution is none of the task, each in a phrase for people.

A motion that never leaves the start touches nothing and is certified; only its ends tell that it
does not do what was asked for.
"""

from collections.abc import Sequence

import numpy as np

from evoexp.records import FloatArray

SAME = 1e-6  # [unit of the values] files hold rounded numbers: what differs by less is the same


def of_place(name: str, given: FloatArray, wanted: FloatArray, unit: str) -> list[str]:
    """Return a phrase if a configuration or place is another one than the task's.

    Args:
        name: Of the place, as in "the start of arm 1".
        given: Its values in the solution, any shape.
        wanted: Its values in the task, of the same shape.
        unit: Of both.
    """
    apart = float(np.max(np.abs(given - wanted)))
    return [] if apart <= SAME else [f"{name} is not the task's: {apart:.4g} {unit} away"]


def of_limits(names: Sequence[str], values: FloatArray, limits: FloatArray, unit: str) -> list[str]:
    """Return a phrase per joint that leaves its limits.

    Args:
        names: (joints,) as in "joint 1".
        values: (joints, configurations).
        limits: (joints, 2) least and greatest value.
        unit: Of values and limits.
    """
    below = limits[:, 0] - values.min(axis=1)
    above = values.max(axis=1) - limits[:, 1]
    return [
        f"{name} leaves its limits by {beyond:.4g} {unit}"
        for name, beyond in zip(names, np.maximum(below, above).tolist(), strict=True)
        if beyond > SAME
    ]


def joint_names(count: int) -> list[str]:
    """Return the names of joints, counted from 1."""
    return [f"joint {k + 1}" for k in range(count)]
