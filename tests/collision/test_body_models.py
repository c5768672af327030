"""Covers of whole robots, and pairs of bodies, against Pinocchio's own collisions."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp import condition as conditions
from evoexp.attachments import PREFIX, keep
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log
from evoexp.collision import derived_pairs
from evoexp.collision.bodies.body_models import BodyCapsules, BodyModel, SphereSets
from evoexp.collision.derived_pairs import DerivedPairs, derive_pairs, unjudged_pairs
from evoexp.collision.scene import obstacle_shapes, scene
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table
from matrix import first
from robots.robot_samples import UR5_LIKE, task

MODELS = {"spheres": SphereSets(inflation=0.01), "capsules": BodyCapsules(padding=0.0)}
EXPERIMENTS = {
    "manus": "corsepius_bottle",
    "puma560": "corsepius_shelf",
    "snake16": "corsepius_gate_wide",
}


def robot(name: str) -> tuple[Assembly, ObstacleTable]:
    found = composed(f"experiment={EXPERIMENTS[name]}")
    return found.robot.build(), obstacle_table(found.scenario.obstacles)


def random_q(assembly: Assembly, count: int) -> FloatArray:
    low, high = assembly.model.lowerPositionLimit, assembly.model.upperPositionLimit
    return np.random.default_rng(5).uniform(low[:, None], high[:, None], (len(low), count))


def coal_contacts(assembly: Assembly, geometry: object, q: FloatArray) -> np.ndarray:
    """Return which pairs of a geometry touch, (configurations, pairs), by Pinocchio."""
    data, placements, hits = assembly.model.createData(), geometry.createData(), []
    for column in np.ascontiguousarray(q.T):
        pin.computeCollisions(assembly.model, data, geometry, placements, column, False)
        hits.append([result.isCollision() for result in placements.collisionResults])
    return np.array(hits)


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("name", first(1, EXPERIMENTS))
def test_no_hit_that_coal_sees_is_missed(name: str, kind: str) -> None:
    """By its pairs, and by all bodies that move with all obstacles."""
    assembly, obstacles = robot(name)
    model, geometry = MODELS[kind].bind(assembly), assembly.geometry.copy()
    moving = [k for k, item in enumerate(geometry.geometryObjects) if item.parentJoint > 0]
    pairs = list(model.pairs)
    for k, (shape, place) in enumerate(obstacle_shapes(obstacles)):
        body = geometry.addGeometryObject(pin.GeometryObject(f"obstacle_{k}", 0, 0, place, shape))
        pairs += [(other, body) for other in moving]
    for pair in pairs:
        geometry.addCollisionPair(pin.CollisionPair(*pair))
    q = random_q(assembly, 4000)
    seen = coal_contacts(assembly, geometry, q).any(axis=1)
    found = model.collision(obstacles).collides(q)
    assert 100 < np.count_nonzero(seen) < 4000
    assert not np.any(seen & ~found)
    assert np.count_nonzero(found & ~seen) < 0.35 * 4000, "what the covers add stays a part"


@pytest.mark.examples(1)
@pytest.mark.parametrize("name", EXPERIMENTS)
def test_pairs_that_are_left_out_never_or_always_touch(name: str) -> None:
    assembly, _ = robot(name)
    model, geometry = MODELS["spheres"].bind(assembly), assembly.geometry.copy()
    every = {(a, b) for b in range(len(model.names)) for a in range(b)}
    pairs = model.sorted_pairs
    assert sorted(every) == sorted([*model.pairs, *pairs.adjacent, *pairs.always, *pairs.never])
    for pair in (*pairs.always, *pairs.never):
        geometry.addCollisionPair(pin.CollisionPair(*pair))
    hits = coal_contacts(assembly, geometry, random_q(assembly, 1500))
    assert hits[:, : len(pairs.always)].all() and not hits[:, len(pairs.always) :].any()


def test_covers_that_always_touch_are_left_to_the_certifier() -> None:
    assembly, _ = robot("puma560")
    close, wide = (SphereSets(inflation=each).bind(assembly) for each in (0.01, 0.3))
    overlapping = wide.sorted_pairs.overlapping
    assert close.sorted_pairs.overlapping == () != overlapping
    assert sorted([*wide.pairs, *overlapping]) == sorted(close.pairs)
    assert sorted(wide.sorted_pairs.judged) == sorted(close.sorted_pairs.judged)
    # of these pairs, the covers alone would have no posture free
    free: BodyModel = wide.collision(obstacle_table(()))
    assert not free.collides(random_q(assembly, 200)).all()


def test_what_may_touch_is_not_tested() -> None:
    assembly, obstacles = robot("manus")
    model, q = MODELS["spheres"].bind(assembly), random_q(assembly, 2000)
    table = tuple((body, 1) for body in range(1, len(model.names)))
    everything, less = (model.collision(obstacles, *may) for may in ((), (table,)))
    more = everything.collides(q).astype(int) - less.collides(q)
    assert set(more.tolist()) == {0, 1}


SRDF = f"robot.srdf={UR5_LIKE / 'ur5_like.srdf'}"


def test_pairs_are_those_that_pinocchio_sees() -> None:
    assembly = task().robot.build()
    pairs, geometry = derive_pairs(assembly), assembly.geometry.copy()
    assert derive_pairs(task().robot.build()) == pairs
    assert DerivedPairs.from_json(pairs.to_json()) == pairs
    geometry.addAllCollisionPairs()
    names = [item.name for item in geometry.geometryObjects]
    every = [frozenset((names[p.first], names[p.second])) for p in geometry.collisionPairs]
    counts = coal_contacts(assembly, geometry, random_q(assembly, 600)).sum(axis=0)
    seen = dict(zip(every, counts.tolist(), strict=True))
    sorted_pairs = {*pairs.neighbours, *pairs.disabled, *pairs.always, *pairs.never}
    assert sorted_pairs < set(seen) and len(seen) == len(names) * (len(names) - 1) // 2
    assert all(seen[pair] == 600 for pair in pairs.always)
    # rarer than one in two thousand: seen by the other samples once at most
    assert all(seen[pair] <= 2 for pair in pairs.never)
    left = [pair for pair in seen if pair not in sorted_pairs]
    assert left and all(seen[pair] < 600 for pair in left)
    assert frozenset(("base_link", "shoulder_link")) in pairs.neighbours


def test_pairs_of_an_srdf_are_sorted_apart_and_neither_searched_nor_judged() -> None:
    condition = task(SRDF)
    assembly, (_, problem) = condition.robot.build(), condition.prepare()
    pairs = derive_pairs(assembly)
    assert frozenset(("shoulder_link", "forearm_link")) in pairs.disabled
    assert set(pairs.disabled) <= assembly.disabled
    assert not {*pairs.always, *pairs.never, *pairs.neighbours} & assembly.disabled
    names = problem.bodies.names
    tested = {frozenset((names[a], names[b])) for a, b in problem.bodies.pairs}
    assert tested and not tested & assembly.disabled

    def judged(robot: Assembly) -> set[Any]:
        built = scene(robot, (), self_pairs=True)
        return {frozenset(built.pair_names(k)) for k in range(len(built.pairs))}

    everything = judged(assembly._replace(disabled=frozenset(), pairs=None))
    assert judged(assembly) == everything - unjudged_pairs(assembly) < everything


def test_pairs_travel_with_the_log_and_are_not_derived_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    condition = task("ga.num_generations=3")
    pairs = condition.robot.pairs.content
    assert condition.files()[PREFIX + keep(pairs)] == pairs
    assert json.loads(pairs)["samples"] == derived_pairs.SAMPLES
    log = tmp_path / "0000.mcap"
    log.write_bytes(run_replicate(condition, 0).content)
    monkeypatch.setattr(derived_pairs, "derive_pairs", None)
    monkeypatch.setattr(conditions, "_pairs", {})
    assert reproduce_log(log).matches


def test_what_the_search_leaves_out_the_certifier_judges() -> None:
    condition = task()
    _, problem = condition.prepare()
    pairs, tested = problem.bodies.sorted_pairs, set(problem.bodies.pairs)
    assert pairs.unseen and not tested & {*pairs.unseen}
    watched = {(int(a), int(b)) for a, b in problem.scene.pairs}
    assert {*pairs.unseen, *pairs.overlapping, *tested} <= watched
    assert not watched & {*pairs.always, *pairs.adjacent}
    notes = " | ".join(condition.planner.notes(problem))
    assert "touch in no sampled posture, judged by the certifier only: " in notes


@pytest.mark.parametrize("content", [b"", b"[]", b'{"neighbours": 3}', b'{"neighbours": [["a"]]}'])
def test_damaged_pairs_are_refused(content: bytes) -> None:
    with pytest.raises(SettingError, match="robot.pairs: must be derived pairs of bodies"):
        DerivedPairs.from_json(content)
