"""The certifier beside brute force.

Coal at 10 000 instants per segment of 200 random motions among random bodies.
"""

import numpy as np
import pytest

from collision.certifier_scenes import SAMPLES, brute_force, random_motion, random_scene
from evoexp.collision.certifier.verdict import certify, is_clear
from matrix import first

SCENES, BATCH = 200, 20

COAL_ERROR = 1e-6  # of distances of curved bodies, far above what was seen


@pytest.mark.examples(1)
@pytest.mark.parametrize("first_scene", first(2, range(0, SCENES, BATCH)))
def test_brute_force_never_contradicts(first_scene: int) -> None:
    statuses = []
    for seed in range(first_scene, first_scene + BATCH):
        rng = np.random.default_rng(seed)
        scene = random_scene(rng)
        motion = random_motion(rng, scene.model.nq)
        verdict, brute = certify(scene, motion), brute_force(scene, motion)
        assert is_clear(scene, motion) == (verdict.status == "certified"), seed
        near = 0.5 * verdict.clearance, 1.5 * verdict.clearance
        asked = [margin for margin in near if np.isfinite(margin) and margin > 0.0]
        assert [is_clear(scene, motion, margin) for margin in asked] == [True, False][: len(asked)]
        statuses.append(verdict.status)
        least, touching = brute.least.min(), brute.t[brute.least <= scene.tolerances[brute.pair]]
        if verdict.status == "certified":
            assert len(touching) == 0, seed
            assert verdict.proven - COAL_ERROR <= least, seed
            assert verdict.clearance <= least + COAL_ERROR, seed
            assert (
                verdict.proven <= verdict.clearance <= verdict.proven * 1.002 + 1e-5 * scene.size
            ), seed
            assert least <= verdict.clearance + 20.0 / SAMPLES, (
                seed
            )  # no body moves faster than 20 per segment
        elif verdict.status == "refuted":
            assert len(touching) > 0 or least < 20.0 / SAMPLES, seed
            assert len(touching) == 0 or verdict.refuted_at <= touching[0] + 1e-9, seed
            before = brute.least[brute.t < verdict.refuted_at]
            assert len(touching) == 0 or len(before) == 0 or before[-1] < 20.0 / SAMPLES, seed
    assert {"certified", "refuted"} <= set(statuses)
    assert statuses.count("undecided") == 0
