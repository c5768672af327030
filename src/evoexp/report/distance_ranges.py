"""The range of a quantity over the motions of many replicates, instant by instant.

Motions are looked at one after the other and not kept, so that ten thousand take no more memory
than one.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from evoexp.collision.certifier.least_distance import LeastDistance, known
from evoexp.collision.scene import Scene
from evoexp.records import FloatArray
from evoexp.report.motion_geometry import BodyDistance

Measure = Callable[[FloatArray], FloatArray]  # (nq, configurations) → (configurations,)


class Extremes(NamedTuple):
    """The least and the greatest value at each instant, and the configurations that have them."""

    lowest: FloatArray  # (instants,); inf where nothing was seen
    highest: FloatArray  # (instants,); −inf where nothing was seen
    at_lowest: FloatArray  # (nq, instants), of the first replicate of several
    at_highest: FloatArray  # (nq, instants), of the first replicate of several

    def with_others(self, later: "Extremes") -> "Extremes":
        """Return the extremes of these and others, of which these come first."""
        own, later = self._of_length(len(later.lowest)), later._of_length(len(self.lowest))
        lower, higher = later.lowest < own.lowest, later.highest > own.highest
        return Extremes(
            np.where(lower, later.lowest, own.lowest),
            np.where(higher, later.highest, own.highest),
            np.where(lower, later.at_lowest, own.at_lowest),
            np.where(higher, later.at_highest, own.at_highest),
        )

    def _of_length(self, length: int) -> "Extremes":
        """Return them with so many instants at least."""
        more = max(0, length - len(self.lowest))
        if not more:
            return self
        lowest = np.pad(self.lowest, (0, more), constant_values=np.inf)
        highest = np.pad(self.highest, (0, more), constant_values=-np.inf)
        at = (np.pad(q, ((0, 0), (0, more))) for q in (self.at_lowest, self.at_highest))
        return Extremes(lowest, highest, *at)


def extremes(
    replicates: Sequence[int], sampled: Callable[[int], FloatArray], measures: Sequence[Measure]
) -> tuple[Extremes, ...]:
    """Return the extremes over replicates of several quantities.

    Args:
        replicates: Their numbers, at least one.
        sampled: Gives a replicate's motion, (nq, instants).
        measures: Give the quantities of a motion.
    """
    found: list[Extremes] = []
    for replicate in replicates:
        q = sampled(replicate)
        own = [Extremes(values, values, q, q) for values in (measure(q) for measure in measures)]
        pairs = zip(found, own, strict=True)
        found = [seen.with_others(later) for seen, later in pairs] if found else own
    return tuple(found)


def distance_measure(scene: Scene, exact: BodyDistance) -> Measure:
    """Return a quick measure of a scene's least distance; coal where it alone knows bodies."""
    return LeastDistance(scene) if known(scene) else exact
