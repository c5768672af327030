"""Least distances by the certifier's kernels, against coal's own."""

import numpy as np
import pinocchio as pin
import pytest

from collision.certifier_scenes import random_scene
from evoexp.collision.certifier.least_distance import LeastDistance, known
from evoexp.collision.scene import Scene, scene
from evoexp.robots.planar_chain import PlanarChain


def by_coal(found: Scene, q: np.ndarray) -> np.ndarray:
    """Least distance of all pairs at each q (nq, configurations); 0 where bodies overlap."""
    data, placements = found.model.createData(), found.geometry.createData()
    least = []
    for one in q.T:
        pin.computeDistances(found.model, data, found.geometry, placements, one)
        least.append(min(result.min_distance for result in placements.distanceResults))
    return np.maximum(least, 0.0)


@pytest.mark.examples(6)
@pytest.mark.parametrize("seed", range(40))
def test_distances_are_those_of_coal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = random_scene(rng)
    if not known(found):
        return
    q = rng.uniform(-3.0, 3.0, size=(found.model.nq, 200))
    # coal errs by 4e-6 with ellipsoids
    np.testing.assert_allclose(LeastDistance(found)(q), by_coal(found, q), atol=2e-5 * found.size)


def test_without_pairs_nothing_is_near() -> None:
    arm = PlanarChain(link_lengths=(1.0, 1.0), base_position=(0.0, 0.0)).build()
    assert LeastDistance(scene(arm))(np.zeros((2, 3))).tolist() == [np.inf] * 3
