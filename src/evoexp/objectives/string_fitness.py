"""Fitness of strings of via-points: short, even and free of collisions (Rana & Zalzala 1995, Eqs. 2–7)."""

from typing import ClassVar, NamedTuple

import numpy as np

from evoexp.numerics import kernel
from evoexp.records import FloatArray
from evoexp.validation import Component, NonNegative


class StringTerms(NamedTuple):
    """Terms of a population of strings.

    Attributes:
        lengths: (arms, individuals) C1, C2, … [deg]: path lengths in configuration space (Eqs. 2, 3).
        unevenness: (arms, individuals) C3, C4, … [deg]: sum of |distance − mean distance| (Eqs. 4, 5).
        collisions: (individuals,) C5: colliding instants i = 1 … N (Eq. 6).
        cost: (individuals,) what Eq. 7 subtracts from C_max.
    """

    lengths: FloatArray
    unevenness: FloatArray
    collisions: FloatArray
    cost: FloatArray


class StringFitness(Component):
    """Weights of Eq. 7, read with the sign that punishes collisions: F = C_max − [k1 ΣC + k2 ΣC + k3 C5].

    Attributes:
        length_weight: k1 [1/deg].
        unevenness_weight: k2 [1/deg].
        collision_weight: k3 per colliding instant.
        fitness_offset: C_max; roulette weights are max(F, 0).
    """

    component: ClassVar[str] = "string_fitness"

    length_weight: NonNegative
    unevenness_weight: NonNegative
    collision_weight: NonNegative
    fitness_offset: NonNegative

    def cost(self, lengths: FloatArray, unevenness: FloatArray, collisions: FloatArray, out: FloatArray) -> None:
        """Write the cost of every individual: the bracket of Eq. 7.

        Args:
            lengths: (arms, ≥ individuals) [deg].
            unevenness: (arms, ≥ individuals) [deg].
            collisions: (≥ individuals,) colliding instants.
            out: (individuals,), written.
        """
        _cost(lengths, unevenness, collisions, self.length_weight, self.unevenness_weight, self.collision_weight, out)

    def fitness(self, cost: FloatArray) -> FloatArray:
        """Return the paper's fitness F of a cost, any shape."""
        return self.fitness_offset - cost

    def roulette_weights(self, costs: FloatArray) -> FloatArray:
        """Return max(F, 0) of costs (individuals,)."""
        return np.maximum(self.fitness_offset - costs, 0.0)


def count_collisions(clearance: FloatArray, num_instants: int, substeps: int, out: FloatArray) -> None:
    """Count the instants at which each individual collides (Eq. 6).

    Args:
        clearance: (instants · substeps · lanes,) least clearances, lanes innermost; negative is a collision.
        num_instants: N.
        substeps: Configurations tested per instant; one colliding among them makes the instant collide.
        out: (lanes,), written.
    """
    _count_collisions(clearance.reshape(num_instants, substeps, -1), out)


@kernel
def _cost(lengths, unevenness, collisions, k1, k2, k3, out):  # type: ignore[no-untyped-def]
    for k in range(len(out)):
        length, uneven = 0.0, 0.0
        for arm in range(len(lengths)):
            length += lengths[arm, k]
            uneven += unevenness[arm, k]
        out[k] = (k1 * length + k2 * uneven) + k3 * collisions[k]


@kernel
def _count_collisions(clearance, out):  # type: ignore[no-untyped-def]
    num_instants, substeps, lanes = clearance.shape
    hit = np.empty(lanes)
    out[:] = 0.0
    for i in range(num_instants):
        hit[:] = 0.0
        for s in range(substeps):
            row = clearance[i, s]
            for lane in range(lanes):
                hit[lane] = 1.0 if row[lane] < 0.0 else hit[lane]
        for lane in range(lanes):
            out[lane] += hit[lane]
