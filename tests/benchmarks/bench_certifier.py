"""Certifying a motion, beside Pinocchio and coal at 100 configurations per segment.

The check that it replaces sees contacts only at its samples and proves nothing between them.
"""

from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import Scene, geometry_scene, scene
from evoexp.paths.motion import Motion
from evoexp.robots.arms import Arms
from evoexp.robots.planar_chain import PlanarChain

SAMPLES = 100  # per segment


def two_arms(num_joints: int) -> Scene:
    """Two planar arms of links of length 4, 8 apart, as in Rana & Zalzala's scenes."""
    lengths, places = (4.0,) * num_joints, ((0.0, 0.0), (0.0, 8.0))
    arms = tuple(PlanarChain(link_lengths=lengths, base_position=place) for place in places)
    return scene(Arms(arms=arms).build())


def redundant_arm() -> Scene:
    """A planar arm of seven links among five ellipsoids."""
    assembly = PlanarChain(link_lengths=(1.0,) * 7, base_position=(0.0, 0.0)).build()
    geometry, egg = pin.GeometryModel(assembly.geometry), coal.Ellipsoid(0.8, 0.4, 0.3)
    for k, (x, y, angle) in enumerate(
        ((5.0, 2.0, 0.3), (1.0, 4.5, 1.2), (-3.0, 3.0, 2.0), (-2.0, -4.5, 0.5), (4.0, -3.0, 2.5))
    ):
        placement = pin.SE3(pin.exp3(np.array([0.0, 0.0, angle])), np.array([x, y, 0.0]))
        geometry.addGeometryObject(pin.GeometryObject(f"egg_{k}", 0, 0, placement, egg))
        for link in range(7):
            geometry.addCollisionPair(pin.CollisionPair(link, 7 + k))
    return geometry_scene(assembly.model, geometry, assembly.table)


def free_motions(built: Scene, num_segments: int, spread: float) -> list[Motion]:
    """Random walks that certify free: nothing is saved by an early contact."""
    rng, found, nq = np.random.default_rng(0), [], built.model.nq
    while len(found) < 10:
        start = rng.uniform(-spread, spread, size=nq)
        walk = np.cumsum(rng.normal(size=(num_segments + 1, nq)) * 0.05, axis=0)
        if certify(built, motion := Motion(start + walk)).status == "certified":
            found.append(motion)
    return found


def sampled(built: Scene, motion: Motion) -> float:
    """Return the least distance at the samples."""
    own = built.model, built.model.createData(), built.geometry, built.geometry.createData()
    least = np.inf
    for t in np.linspace(0.0, motion.num_segments, motion.num_segments * SAMPLES + 1):
        pair = int(pin.computeDistances(*own, motion.at(float(t))))
        least = min(least, own[3].distanceResults[pair].min_distance)
    return least


@pytest.mark.parametrize(
    ("name", "build", "num_segments", "spread"),
    [
        ("two 2R arms", lambda: two_arms(2), 20, 1.0),
        ("two 3R arms", lambda: two_arms(3), 40, 1.0),
        ("7R among 5 ellipsoids", redundant_arm, 20, 0.3),
    ],
    ids=lambda value: value.replace(" ", "_") if isinstance(value, str) else None,
)
def bench_certify(beside: Any, name: str, build: Any, num_segments: int, spread: float) -> None:
    built = build()
    motions = free_motions(built, num_segments, spread)
    for motion in motions[:2]:
        verdict, least = certify(built, motion), sampled(built, motion)
        assert verdict.clearance <= least + 1e-5
        assert least <= verdict.clearance * 1.05 + 1e-3
    samples = f"Pinocchio + coal at {SAMPLES} samples per segment"
    beside(
        f"certify motions of {name}, {num_segments} segments, {len(built.pairs)} pairs",
        lambda: [certify(built, motion) for motion in motions],
        {samples: (lambda: sampled(built, motions[0]), 1, 1)},
        unit="motion",
        amount=len(motions),
        repeat=3,
        rounds=20,
    )
