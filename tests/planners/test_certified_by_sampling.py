"""What certified search accepts, judged again without the certifier: by many exact distances.

`./scripts/test --exhaustive tests/planners/test_certified_by_sampling.py` judges thousands of
motions, the other test commands some of them.
"""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.collision.scene import Part
from evoexp.paths.motion import Motion
from evoexp.records import generations
from matrix import counts, first

SAMPLES = 40  # per segment
COARSE = "collision.collision_substeps=1", "planner.range=60"
SEARCHES = (
    ("curkovic_motion", ()),
    ("lavoie_7dof", ()),
    ("corsepius_shelf", ()),
    ("rrt_connect", COARSE),
    ("rana_planar", ()),
    ("rana_planar", ("control=cma_es",)),
    ("rana_obstacles", ()),
    ("rana_three_arms", ()),
    ("rana_puma", ()),
    ("curkovic_three", ()),
    ("curkovic_safety", ()),
    ("lavoie_10dof", ()),
    ("corsepius_pick_and_place", ("planner.scope=0.05",)),
    ("chen_path", ("robot.body_radius=0.8",)),
    ("chen_mission", ("robot.body_radius=0.8",)),
)


def least_distance(part: Part, motion: Motion) -> float:
    """Return the least distance of coal over all pairs that must not touch and many instants."""
    scene = part.scene
    data, geometry_data = scene.model.createData(), pin.GeometryData(scene.geometry)
    watched = {frozenset(pair) for pair in scene.pairs.tolist()}
    least, pairs = np.inf, [frozenset((p.first, p.second)) for p in scene.geometry.collisionPairs]
    assert watched <= set(pairs)
    for t in np.linspace(part.first, part.last, SAMPLES * (part.last - part.first) + 1):
        q = motion.at(float(t))
        pin.computeDistances(scene.model, data, scene.geometry, geometry_data, q)
        for pair, result in zip(pairs, geometry_data.distanceResults, strict=True):
            if pair in watched:
                least = min(least, result.min_distance)
    return float(least)


def accepted(planner: Any, problem: Any, seed: int) -> list[Any]:
    """Return every solution that one run accepts on its way."""
    found: list[Any] = []
    for record in generations(planner.evolve(problem, np.random.default_rng(seed))):
        if record.solved and (not found or record.best is not found[-1]):
            found.append(record.best)
    return found


@pytest.mark.parametrize(("experiment", "changes"), first(4, SEARCHES))
def test_no_accepted_motion_touches(experiment: str, changes: tuple[str, ...]) -> None:
    words = f"experiment={experiment}", "planner.acceptance=certified", *changes
    planner, problem = composed(*words).prepare()
    judged = 0
    for seed in range(counts(1, 25)):
        for solution in accepted(planner, problem, seed):
            motion = planner.motion(problem, solution)
            distances = [least_distance(part, motion) for part in planner.parts(problem, motion)]
            assert min(distances) > 0.0, (experiment, seed)
            judged += 1
    assert judged > 0 or experiment == "corsepius_shelf"  # where one run may find none
    print(f"{experiment}: {judged} motions")
