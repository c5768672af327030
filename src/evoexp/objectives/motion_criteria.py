"""Criteria of a robot's motion in the plane, for whole populations (Curkovic et al. 2013).

C2, C3 and C4 are those of Eqs. 6–8.
"""

from typing import ClassVar

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray
from evoexp.validation import Component, NonNegative


class MotionCriteria(Component):
    """Weights of C1 … C4; the paper adds them as they are."""

    component: ClassVar[str] = "motion_criteria"

    # of C1, colliding configurations summed over all collaborators [-]
    collision_weight: NonNegative
    path_weight: NonNegative  # of C2, the end-effector's path [1/length unit]
    rotation_weight: NonNegative  # of C3, the sum of all links' turns [1/rad]
    # of C4, longest step of the end-effector less its shortest [1/length unit]
    evenness_weight: NonNegative

    @property
    def own_weights(self) -> tuple[float, float, float]:
        """Weights of C2, C3, C4, as the kernel `measure_motions` takes them."""
        return self.path_weight, self.rotation_weight, self.evenness_weight


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
