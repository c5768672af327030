import coal
import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.collision.bodies.body_models import BodyCapsules, BodyModel, SphereSets
from evoexp.collision.scene import obstacle_shapes
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table
from matrix import first

MODELS = {"spheres": SphereSets(inflation=0.01), "capsules": BodyCapsules(padding=0.0)}
EXPERIMENTS = {
    "manus": "corsepius_bottle",
    "puma560": "corsepius_shelf",
    "snake16": "corsepius_gate_wide",
}


def robot(name: str) -> tuple[Assembly, ObstacleTable]:
    found = composed(f"experiment={EXPERIMENTS[name]}")
    return found.robot.build(), obstacle_table(found.scenario.obstacles)  # type: ignore[attr-defined]


def random_q(assembly: Assembly, count: int) -> np.ndarray:
    low, high = assembly.model.lowerPositionLimit, assembly.model.upperPositionLimit
    return np.random.default_rng(5).uniform(low[:, None], high[:, None], (len(low), count))


def coal_collisions(model: BodyModel, obstacles: ObstacleTable, q: np.ndarray) -> np.ndarray:
    """Return which configurations collide on coal's geometry.

    Tested pairs, and all bodies with all obstacles.
    """
    assembly = model.assembly
    geometry = assembly.geometry.copy()
    count = len(model.names)
    for k, (shape, placement) in enumerate(obstacle_shapes(obstacles)):
        geometry.addGeometryObject(pin.GeometryObject(f"obstacle_{k}", 0, 0, placement, shape))
    pairs = list(model.pairs)
    moving = [k for k, item in enumerate(assembly.geometry.geometryObjects) if item.parentJoint > 0]
    pairs += [(body, count + k) for body in moving for k in range(len(obstacles.kind))]
    for a, b in pairs:
        geometry.addCollisionPair(pin.CollisionPair(a, b))
    data, placements = assembly.model.createData(), geometry.createData()
    return np.array(
        [
            pin.computeCollisions(
                assembly.model, data, geometry, placements, np.ascontiguousarray(one), True
            )
            for one in q.T
        ]
    )


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("name", first(1, EXPERIMENTS))
def test_no_hit_that_coal_sees_is_missed(name: str, kind: str) -> None:
    assembly, obstacles = robot(name)
    model = MODELS[kind].bind(assembly)
    q = random_q(assembly, 4000)
    seen, found = coal_collisions(model, obstacles, q), model.collision(obstacles).collides(q)
    assert 100 < np.count_nonzero(seen) < 4000
    assert not np.any(seen & ~found)
    assert np.count_nonzero(found & ~seen) < 0.35 * 4000, "what the covers add stays a part"


@pytest.mark.examples(1)
@pytest.mark.parametrize("name", EXPERIMENTS)
def test_pairs_that_are_left_out_never_or_always_touch(name: str) -> None:
    assembly, _ = robot(name)
    model = MODELS["spheres"].bind(assembly)
    every = {(a, b) for a in range(len(model.names)) for b in range(a + 1, len(model.names))}
    found = model.sorted_pairs
    assert sorted(every) == sorted([*model.pairs, *found.adjacent, *found.always, *found.never])
    items = assembly.geometry.geometryObjects
    data = assembly.model.createData()
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    for one in random_q(assembly, 1500).T:
        pin.forwardKinematics(assembly.model, data, np.ascontiguousarray(one))
        for pairs, expected in ((found.never, False), (found.always, True)):
            for pair in pairs:
                places = [data.oMi[items[k].parentJoint] * items[k].placement for k in pair]
                frames = [coal.Transform3s(place.rotation, place.translation) for place in places]
                result.clear()
                shapes = [items[k].geometry for k in pair]
                hit = coal.collide(shapes[0], frames[0], shapes[1], frames[1], request, result) > 0
                assert hit == expected


def test_the_derived_pairs_are_those_one_would_name() -> None:
    assembly, _ = robot("manus")
    model = MODELS["spheres"].bind(assembly)
    named = lambda pairs: {frozenset((model.names[a], model.names[b])) for a, b in pairs}  # noqa: E731
    assert frozenset(("wrist", "hand")) in named(model.sorted_pairs.always)
    assert frozenset(("upper_arm", "wrist")) in named(model.sorted_pairs.never)
    assert frozenset(("upper_arm", "hand")) in named(model.pairs)
    assert frozenset(("hand", "finger_left")) in named(model.sorted_pairs.adjacent)


def test_covers_that_always_touch_are_left_to_the_certifier() -> None:
    assembly, _ = robot("puma560")
    close, wide = (SphereSets(inflation=each).bind(assembly) for each in (0.01, 0.3))
    assert close.sorted_pairs.overlapping == ()
    overlapping = wide.sorted_pairs.overlapping
    assert overlapping
    assert sorted([*wide.pairs, *overlapping]) == sorted(close.pairs)
    assert sorted(wide.sorted_pairs.judged) == sorted(close.sorted_pairs.judged)
    # of these pairs, the covers alone would have no posture free
    q = random_q(assembly, 200)
    assert not wide.collision(obstacle_table(())).collides(q).all()


def test_what_may_touch_is_not_tested() -> None:
    assembly, obstacles = robot("manus")
    model = MODELS["spheres"].bind(assembly)
    q = random_q(assembly, 2000)
    table = tuple((body, 1) for body in range(1, len(model.names)))
    everything, less = model.collision(obstacles), model.collision(obstacles, table)
    assert np.all(everything.collides(q) | ~less.collides(q))
    assert np.any(everything.collides(q) & ~less.collides(q))
