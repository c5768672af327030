"""Pairs of bodies that are derived at the door, against Pinocchio's own collisions, and as data."""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp import condition as conditions
from evoexp.attachments import PREFIX, keep
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log
from evoexp.collision import derived_pairs
from evoexp.collision.derived_pairs import DerivedPairs, derive_pairs, unjudged_pairs
from evoexp.collision.scene import scene
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.robots.assembly import Assembly

DATA = Path(__file__).parents[1] / "robots" / "data" / "ur5_like"
REACH = (
    "robot=urdf", "scenario=urdf_reach", "planner=posture_es", "ga=corsepius",
    "objective=corsepius_reach", "collision=corsepius_spheres",
)  # fmt: skip


def condition(*overrides: str) -> Condition:
    words = [*REACH, f"robot.path={DATA / 'ur5_like.urdf'}", *overrides]
    return composed(*words)


def robot(*overrides: str) -> Assembly:
    found: Assembly = condition(*overrides).robot.build()  # type: ignore[attr-defined]
    return found


def touches(assembly: Assembly, count: int) -> dict[frozenset[str], int]:
    """Count, for every pair of bodies, the postures in which Pinocchio sees them touch."""
    geometry = assembly.geometry.copy()
    geometry.addAllCollisionPairs()
    names = [item.name for item in geometry.geometryObjects]
    data, placements = assembly.model.createData(), geometry.createData()
    low, high = assembly.model.lowerPositionLimit, assembly.model.upperPositionLimit
    found: dict[frozenset[str], int] = {}
    for q in np.random.default_rng(9).uniform(low, high, (count, len(low))):
        pin.computeCollisions(assembly.model, data, geometry, placements, q, False)
        for pair, result in zip(geometry.collisionPairs, placements.collisionResults, strict=True):
            key = frozenset((names[pair.first], names[pair.second]))
            found[key] = found.get(key, 0) + result.isCollision()
    return found


def test_pairs_are_those_that_pinocchio_sees() -> None:
    assembly = robot()
    found = derive_pairs(assembly)
    seen = touches(assembly, 600)
    names = {item.name for item in assembly.geometry.geometryObjects}
    sorted_pairs = {*found.neighbours, *found.disabled, *found.always, *found.never}
    assert sorted_pairs < set(seen) and len(seen) == len(names) * (len(names) - 1) // 2
    assert all(seen[pair] == 600 for pair in found.always)
    # rarer than one in two thousand: seen by the other samples once at most
    assert all(seen[pair] <= 2 for pair in found.never)
    left = [pair for pair in seen if pair not in sorted_pairs]
    assert left and all(seen[pair] < 600 for pair in left)
    assert frozenset(("base_link", "shoulder_link")) in found.neighbours


def test_the_same_robot_has_the_same_pairs() -> None:
    assert derive_pairs(robot()) == derive_pairs(robot())
    again = DerivedPairs.from_json(derive_pairs(robot()).to_json())
    assert set(again.never) == set(derive_pairs(robot()).never)


def test_pairs_of_an_srdf_are_sorted_apart() -> None:
    assembly = robot(f"robot.srdf={DATA / 'ur5_like.srdf'}")
    found = derive_pairs(assembly)
    assert found.disabled
    assert set(found.disabled) <= assembly.disabled
    assert not {*found.always, *found.never, *found.neighbours} & assembly.disabled


def test_pairs_travel_with_the_log_and_are_not_derived_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    found = condition("ga.num_generations=3")
    pairs = found.robot.pairs.content  # type: ignore[attr-defined]
    assert found.files()[PREFIX + keep(pairs)] == pairs
    assert json.loads(pairs)["samples"] == derived_pairs.SAMPLES
    log = tmp_path / "0000.mcap"
    log.write_bytes(run_replicate(found, 0).content)
    monkeypatch.setattr(derived_pairs, "derive_pairs", None)
    monkeypatch.setattr(conditions, "_pairs", {})
    assert reproduce_log(log).matches


def test_what_the_search_leaves_out_the_certifier_judges() -> None:
    _, problem = condition().prepare()
    bodies = problem.bodies
    unseen = set(bodies.sorted_pairs.unseen)
    assert unseen and not unseen & set(bodies.pairs)
    watched = {(int(a), int(b)) for a, b in problem.scene.pairs}
    assert {*unseen, *bodies.sorted_pairs.overlapping, *bodies.pairs} <= watched
    assert not watched & {*bodies.sorted_pairs.always, *bodies.sorted_pairs.adjacent}
    notes = " | ".join(condition().planner.notes(problem))
    assert "touch in no posture sampled, judged by the certifier only: " in notes


def test_a_scene_leaves_out_disabled_and_touching_pairs() -> None:
    assembly = robot(f"robot.srdf={DATA / 'ur5_like.srdf'}")
    built = scene(assembly, (), self_pairs=True)
    judged = {frozenset(built.pair_names(k)) for k in range(len(built.pairs))}
    everything = scene(assembly._replace(disabled=frozenset(), pairs=None), (), self_pairs=True)
    every = {frozenset(everything.pair_names(k)) for k in range(len(everything.pairs))}
    assert judged == every - unjudged_pairs(assembly) and judged < every


@pytest.mark.parametrize("content", [b"", b"[]", b'{"neighbours": 3}', b'{"neighbours": [["a"]]}'])
def test_damaged_pairs_are_refused(content: bytes) -> None:
    with pytest.raises(SettingError, match="robot.pairs: must be derived pairs of bodies"):
        DerivedPairs.from_json(content)
