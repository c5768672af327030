"""Criteria of motions, for whole populations: of strings of via-points, and of a planar robot.

Rana & Zalzala 1995, Eqs. 2–7: short, even and free of collisions. Curkovic et al. 2013: C2, C3 and
C4 are those of Eqs. 6–8.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray
from evoexp.validation import Component, NonNegative


class StringTerms(NamedTuple):
    """Terms of a population of strings."""

    lengths: FloatArray  # (arms, individuals) C1, C2, … in configuration space (Eqs. 2, 3) [deg]
    unevenness: FloatArray  # (arms, individuals) C3, C4, …: Σ |distance − mean| (Eqs. 4, 5) [deg]
    collisions: FloatArray  # (individuals,) C5: colliding instants i = 1 … N (Eq. 6)
    cost: FloatArray  # (individuals,) what Eq. 7 subtracts from C_max


class StringFitness(Component):
    """Weights of Eq. 7, read with the sign that punishes collisions.

    F = C_max − (k1 ΣC + k2 ΣC + k3 C5).
    """

    length_weight: NonNegative  # k1 [1/deg]
    unevenness_weight: NonNegative  # k2 [1/deg]
    collision_weight: NonNegative  # k3 per colliding instant
    fitness_offset: NonNegative  # C_max; roulette weights are max(F, 0)

    @property
    def weights(self) -> tuple[float, float, float]:
        """k1, k2, k3, as the kernel `weigh` takes them."""
        return self.length_weight, self.unevenness_weight, self.collision_weight

    def fitness(self, cost: FloatArray) -> FloatArray:
        """Return the paper's fitness F of a cost, any shape."""
        return self.fitness_offset - cost


@kernel
def weigh(weights: tuple[float, float, float], terms: StringTerms) -> None:
    """Write the bracket of Eq. 7 for every individual that has a cost, by k1, k2, k3."""
    (k1, k2, k3), (lengths, unevenness, collisions, cost) = weights, terms
    for k in range(len(cost)):
        length, uneven = 0.0, 0.0
        for arm in range(len(lengths)):
            length += lengths[arm, k]
            uneven += unevenness[arm, k]
        cost[k] = (k1 * length + k2 * uneven) + k3 * collisions[k]


@kernel
def count_collisions(clearance: FloatArray, collisions: FloatArray) -> None:
    """Count the instants at which each individual collides (Eq. 6), (lanes,).

    Clearances are (instants, substeps, lanes): one negative one of an instant is enough.
    """
    instants, substeps, lanes = clearance.shape
    hit = np.empty(lanes)
    collisions[:] = 0.0
    for i in range(instants):
        hit[:] = 0.0
        for s in range(substeps):
            row = clearance[i, s]
            for lane in range(lanes):
                hit[lane] = 1.0 if row[lane] < 0.0 else hit[lane]
        for lane in range(lanes):
            collisions[lane] += hit[lane]


class MotionCriteria(Component):
    """Weights of C1 … C4; the paper adds them as they are."""

    # of C1, colliding configurations summed over all collaborators [-]
    collision_weight: NonNegative
    path_weight: NonNegative  # of C2, the end-effector's path [1/length unit]
    rotation_weight: NonNegative  # of C3, the sum of all links' turns [1/rad]
    # of C4, longest step of the end-effector less its shortest [1/length unit]
    evenness_weight: NonNegative


@kernel
def measure_motions(
    # (configurations, 2, ≥ individuals) absolute link angles, start and goal included [rad]
    angles: FloatArray,
    points: FloatArray,  # (configurations, 4, ≥ individuals) elbow x, y, end-effector x, y
    weights: tuple[float, float, float],  # of C2, C3, C4
    criteria: FloatArray,  # (3, individuals), written: C2, C3, C4
    own: FloatArray,  # (individuals,), written: their weighted sum
) -> None:
    """Measure C2, C3, C4 of every individual, and their weighted sum."""
    count = len(own)
    longest, shortest = np.zeros(count), np.full(count, np.inf)
    criteria[:] = 0.0
    for i in range(1, angles.shape[0]):
        now, before = np.uint64(i), np.uint64(i - 1)
        for n in range(count):
            x = points[now, 2, n] - points[before, 2, n]
            y = points[now, 3, n] - points[before, 3, n]
            step = np.sqrt(x * x + y * y)
            criteria[0, n] += step
            longest[n] = step if step > longest[n] else longest[n]
            shortest[n] = step if step < shortest[n] else shortest[n]
        for j in range(angles.shape[1]):
            for n in range(count):
                criteria[1, n] += abs(angles[now, j, n] - angles[before, j, n])
    w2, w3, w4 = weights
    for n in range(count):
        criteria[2, n] = longest[n] - shortest[n]
        own[n] = (w2 * criteria[0, n] + w3 * criteria[1, n]) + w4 * criteria[2, n]
