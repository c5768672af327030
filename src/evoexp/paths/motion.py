"""A motion through configuration space."""

from typing import NamedTuple

from evoexp.records import FloatArray


class Motion(NamedTuple):
    """Configurations passed at instants 0, 1, …, each reached from the one before along a straight line.

    Attributes:
        q: (instants, nq) [rad], lengths for prismatic joints.
    """

    q: FloatArray
