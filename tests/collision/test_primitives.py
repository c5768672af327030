"""Spheres and capsules: the kernels against Pinocchio, coal and a slow.

Plain reference on the same shapes.
"""

from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from collision.built_bodies import built, default_pairs, limited
from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.collision.bodies.packing import Shapes
from evoexp.robots.kinematics import UnsupportedJoint, kinematic_table
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    CapsuleObstacle,
    CylinderObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
    obstacle_table,
)
from references import arms_6r, primitives_numpy
from references.primitive_distances import along, to_obstacle, to_segment


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    return pin.Quaternion(rng.normal(size=4)).normalized().toRotationMatrix()


def random_tree(rng: np.random.Generator, size: int, chain: bool = False) -> Any:
    """A model of random axes and placements, revolute and prismatic, with one branch or several."""
    model = pin.Model()
    for k in range(size):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        kinds: list[Any] = [
            pin.JointModelRevoluteUnaligned(axis),
            pin.JointModelRX(),
            pin.JointModelRZ(),
        ]
        if not chain:
            kinds += [pin.JointModelPrismaticUnaligned(axis), pin.JointModelPY()]
        parent = k if chain else int(rng.integers(0, k + 1))
        place = pin.SE3(random_rotation(rng), rng.uniform(-0.5, 0.5, size=3))
        model.addJoint(parent, kinds[rng.integers(len(kinds))], place, f"joint_{k + 1}")
    return model


def random_geometry(rng: np.random.Generator, model: Any, spheres: int, capsules: int) -> Any:
    """Shapes on random joints, the world among them; some of radius or length 0."""
    geometry = pin.GeometryModel()
    for k in range(spheres + capsules):
        radius = float(rng.choice([0.0, 0.05, rng.uniform(0.01, 0.2)]))
        shape = (
            coal.Sphere(radius)
            if k < spheres
            else coal.Capsule(radius, float(rng.choice([0.0, 0.2, 0.7])))
        )
        joint = int(rng.integers(0, model.njoints)) if k else 1
        place = pin.SE3(random_rotation(rng), rng.uniform(-0.3, 0.3, size=3))
        geometry.addGeometryObject(pin.GeometryObject(f"shape_{k}", joint, 0, place, shape))
    return geometry


def random_obstacles(rng: np.random.Generator) -> tuple[Any, ...]:
    def point(reach: float = 1.5) -> tuple[float, ...]:
        return tuple(rng.uniform(-reach, reach, size=3).tolist())

    def size() -> float:
        return float(rng.uniform(0.05, 0.5))

    return (
        SphereObstacle(shape="sphere", center=point(), radius=size()),
        BoxObstacle(
            shape="box", center=point(), size=(size(), size(), size()), rotation=point(180.0)
        ),
        BoxObstacle(shape="box", center=point(), size=(1.0, size(), 0.02), rotation=point(180.0)),
        CapsuleObstacle(shape="capsule", start=point(), end=point(), radius=size()),
        CylinderObstacle(shape="cylinder", start=point(), end=point(), radius=size()),
        CylinderObstacle(
            shape="cylinder", start=(0.5, 0.9, 0.1), end=(0.5, 0.9, 0.2), radius=size()
        ),
        HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0, -0.8), normal=point()),
    )


def placed(
    model: Any, geometry: Any, q: np.ndarray
) -> list[tuple[int, np.ndarray, np.ndarray, float]]:
    """Joint, both ends of the axis and radius of every shape in the world, by Pinocchio."""
    data, places = model.createData(), geometry.createData()
    pin.updateGeometryPlacements(model, data, geometry, places, np.ascontiguousarray(q))
    found = []
    for one, place in zip(geometry.geometryObjects, places.oMg, strict=True):
        half = one.geometry.halfLength if isinstance(one.geometry, coal.Capsule) else 0.0
        axis = half * place.rotation[:, 2]
        found.append(
            (
                one.parentJoint,
                place.translation - axis,
                place.translation + axis,
                one.geometry.radius,
            )
        )
    return found


def plain_clearances(
    model: Any, geometry: Any, table: Any, pairs: Any, arms: Any, q: np.ndarray
) -> list[float]:
    """Least clearances to obstacles, between arms, to self; by the slow reference."""
    shapes = placed(model, geometry, q)
    least = [np.inf, np.inf, np.inf]
    chosen = {frozenset(pair) for pair in pairs}
    for n, (joint, start, end, radius) in enumerate(shapes):
        for k in range(len(table.kind)):
            if joint > 0:
                least[0] = min(least[0], along(start, end, to_obstacle(table, k)) - radius)
        for other, one, two, thick in shapes[n + 1 :]:
            if frozenset((joint, other)) in chosen and joint != other:
                row = 1 if arms[joint] != arms[other] and min(arms[joint], arms[other]) >= 0 else 2
                least[row] = min(
                    least[row], along(start, end, to_segment(one, two)) - radius - thick
                )
    return least


def agree(found: Any, expected: list[float], deepest: float) -> None:
    """Compare clearances; below `deepest` (an axis inside an obstacle) both are only below it."""
    for row, (one, two) in enumerate(zip(found, expected, strict=True)):
        if row == 0 and two <= deepest:
            assert one <= deepest + 1e-12
        else:
            assert one == pytest.approx(two, abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_spheres_on_random_trees_agree_with_the_plain_reference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_tree(rng, 7)
    geometry = random_geometry(rng, model, 12, 0)
    check_against_plain(rng, model, geometry, -np.inf)


@pytest.mark.examples(2)
@pytest.mark.parametrize("seed", range(6))
def test_capsules_on_random_trees_agree_with_the_plain_reference(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    model = random_tree(rng, 7)
    geometry = random_geometry(rng, model, 4, 8)
    check_against_plain(
        rng, model, geometry, -min(one.geometry.radius for one in geometry.geometryObjects)
    )


def check_against_plain(
    rng: np.random.Generator, model: Any, geometry: Any, deepest: float
) -> None:
    table = obstacle_table(random_obstacles(rng))
    shapes, arms = arms_6r.shapes_of(geometry), [-1, *rng.integers(0, 2, size=model.nq).tolist()]
    pairs, collision = default_pairs(model, shapes), built(model, shapes, table, arms=arms)
    q = rng.uniform(-np.pi, np.pi, size=(model.nq, 5))
    found = collision.clearance(q)
    for sample in range(q.shape[1]):
        expected = plain_clearances(model, geometry, table, pairs, arms, q[:, sample])
        agree([row[sample] for row in found], expected, deepest)


def coal_least(geometry: Any, placed_scene: Any, robot: int, row: str, exact: bool) -> float:
    """Least distance by coal over the scene's pairs.

    `exact` leaves out capsules beside boxes and cylinders.
    """
    least = np.inf
    for pair in geometry.collisionPairs:
        if (max(pair.first, pair.second) >= robot) is not (row == "obstacles"):
            continue
        one, two = (geometry.geometryObjects[k].geometry for k in (pair.first, pair.second))
        iterated = isinstance(one, coal.Capsule) and isinstance(two, coal.Box | coal.Cylinder)
        if iterated and exact:
            continue
        places = [placed_scene.oMg[k] for k in (pair.first, pair.second)]
        objects = [
            coal.CollisionObject(shape, place.rotation, place.translation)
            for shape, place in zip((one, two), places, strict=True)
        ]
        least = min(least, coal.distance(*objects, coal.DistanceRequest(), coal.DistanceResult()))
    return least


@pytest.mark.parametrize("shapes", ["spheres", "capsules"])
def test_a_6r_arm_agrees_with_coal(shapes: str) -> None:
    """All obstacles of all kinds.

    1e-12 where coal has a formula and nothing overlaps, 1e-6 where it iterates.
    """
    model = arms_6r.model()
    geometry = getattr(arms_6r, shapes)(model)
    ignored = [(1, arms_6r.FLOOR)]
    collision = built(
        model,
        arms_6r.shapes_of(geometry),
        obstacle_table(arms_6r.OBSTACLES),
        arms_6r.SELF_PAIRS,
        ignored,
    )
    scene = arms_6r.with_obstacles(geometry, arms_6r.OBSTACLES, arms_6r.SELF_PAIRS, ignored)
    data, places = model.createData(), scene.createData()
    q = arms_6r.random_configurations(40)
    found = collision.clearance(q)
    assert np.all(np.isposinf(found.between_arms))
    tolerance = 1e-12 if shapes == "spheres" else 1e-6
    for sample in range(q.shape[1]):
        pin.updateGeometryPlacements(model, data, scene, places, np.ascontiguousarray(q[:, sample]))
        outside = coal_least(scene, places, geometry.ngeoms, "obstacles", exact=False)
        if outside > 0.0:
            assert found.to_obstacles[sample] == pytest.approx(outside, abs=tolerance)
        else:
            assert found.to_obstacles[sample] < 1e-9
        own = coal_least(scene, places, geometry.ngeoms, "self", exact=True)
        assert found.to_self[sample] == pytest.approx(own, abs=1e-12)


def test_depths_agree_with_plain_numpy_in_a_crowd_of_large_obstacles() -> None:
    """Centres deep inside boxes and cylinders.

    Where a ball around a body is nearer than it is deep.
    """
    model, rng = arms_6r.model(), np.random.default_rng(7)
    shapes = arms_6r.shapes_of(arms_6r.spheres(model))
    obstacles = (*arms_6r.OBSTACLES, *random_obstacles(rng)[:-1])
    large = (
        BoxObstacle(
            shape="box", center=(0.9, 0.0, 0.9), size=(1.2, 1.5, 1.8), rotation=(10.0, 20.0, 30.0)
        ),
        CylinderObstacle(
            shape="cylinder", start=(-0.8, 0.0, -1.0), end=(-0.9, 0.2, 2.0), radius=0.6
        ),
        HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0, 0.6), normal=(0.1, 0.2, 1.0)),
    )
    table = obstacle_table(obstacles + large)
    collision = built(model, shapes, table)
    q = arms_6r.random_configurations(1000)
    chain = kinematic_table(model)
    local = np.array([chain.local(j, p) for j, p in zip(shapes.joint, shapes.start, strict=True)])
    centers = primitives_numpy.sphere_centers(chain, shapes.joint - 1, local, q)
    every = np.ones((len(local), len(table.kind)), dtype=bool)
    expected = primitives_numpy.to_obstacles(centers, shapes.radius, table, every)
    found = collision.clearance(q).to_obstacles
    assert expected.min() < -0.5
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
    assert np.array_equal(collision.collides(q), collision.clearance(q).least < 0.0)


@pytest.mark.parametrize("shapes", ["spheres", "capsules"])
@pytest.mark.parametrize("drawn", ["random_configurations", "population"])
def test_verdicts_agree_with_coal(shapes: str, drawn: str) -> None:
    model = arms_6r.model()
    geometry = getattr(arms_6r, shapes)(model)
    ignored = [(1, arms_6r.FLOOR)]
    table = obstacle_table(arms_6r.OBSTACLES)
    collision = built(model, arms_6r.shapes_of(geometry), table, arms_6r.SELF_PAIRS, ignored)
    scene = arms_6r.with_obstacles(geometry, arms_6r.OBSTACLES, arms_6r.SELF_PAIRS, ignored)
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(model, scene, 1)
    q = getattr(arms_6r, drawn)(400)
    expected = pin.computeCollisionsInParallel(1, pool, q, True, False)
    assert 0 < expected.sum() < len(expected)
    assert np.array_equal(collision.collides(q), expected)


def collision_of(
    seed: int, size: int = 6, arms: int = 2
) -> tuple[BodyCollision, np.random.Generator]:
    rng = np.random.default_rng(seed)
    model = random_tree(rng, size, chain=True)
    geometry = random_geometry(rng, model, 20, 6)
    cut = [-1, *(k * arms // model.nq for k in range(model.nq))]
    table = obstacle_table(random_obstacles(rng))
    return built(model, arms_6r.shapes_of(geometry), table, arms=cut), rng


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("count", [1, 63, 64, 65, 128, 129, 300])
def test_a_batch_is_its_configurations_one_by_one(seed: int, count: int) -> None:
    collision, rng = collision_of(seed)
    q = rng.uniform(-np.pi, np.pi, size=(6, count))
    for limit in (np.inf, 0.1):
        together = np.array(limited(collision, q, limit))
        backwards = np.array(limited(collision, q[:, ::-1], limit))[:, ::-1]
        alone = np.hstack(
            [np.array(limited(collision, q[:, k : k + 1], limit)) for k in range(0, count, 7)]
        )
        assert np.array_equal(together, backwards)
        assert np.array_equal(together[:, ::7], alone)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("limit", [-0.05, 0.0, 0.1, 1.0])
def test_a_limit_skips_only_what_is_not_asked(seed: int, limit: float) -> None:
    collision, rng = collision_of(seed, arms=1 + seed % 2)
    near = rng.uniform(-np.pi, np.pi, size=(6, 1)) + 0.1 * rng.normal(size=(6, 150))
    for q in (near, rng.uniform(-np.pi, np.pi, size=(6, 150))):
        for exact, bounded in zip(
            collision.clearance(q), limited(collision, q, limit), strict=True
        ):
            below = exact < limit
            assert np.array_equal(bounded[below], exact[below])
            assert np.all(bounded[~below] == limit)


def test_no_configurations_and_what_is_not_a_number() -> None:
    collision, _ = collision_of(0)
    assert collision.clearance(np.empty((6, 0))).least.shape == (0,)
    assert collision.collides(np.empty((6, 0))).shape == (0,)
    q = np.zeros((6, 3))
    q[2, 1] = np.nan
    clearance = collision.clearance(q)
    assert np.array_equal(np.isnan(clearance.least), [False, True, False])
    assert collision.collides(q)[1]
    assert np.array_equal(collision.clearance(np.zeros((6, 1))).least, clearance.least[:1])


def test_pairs_arms_and_ignored_obstacles_are_the_callers() -> None:
    model, floor = (
        two_sticks(),
        HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0), normal=(0.0, 0.0, 1.0)),
    )
    ends = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    shapes = Shapes(np.arange(3), np.zeros((3, 3)), ends, np.ones(3), np.arange(3))
    q = np.zeros((2, 1))

    def clearance(**options: Any) -> list[float]:
        collision = built(model, shapes, obstacle_table((floor,)), **options)
        return [float(row[0]) for row in collision.clearance(q)]

    two = {"arms": (-1, 0, 1)}
    assert clearance(**two) == [-1.0, 3.0, np.inf]  # 5 m apart; the world is their parent
    assert clearance(pairs=[(1, 2)], ignored=[(1, 0), (2, 0)], **two) == [np.inf, 3.0, np.inf]
    assert clearance(pairs=[(0, 2)]) == [-1.0, np.inf, 3.0]
    assert clearance(arms=(-1, 0, 0)) == [-1.0, np.inf, 3.0]


def two_sticks() -> Any:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "one")
    model.addJoint(0, pin.JointModelRZ(), pin.SE3(np.eye(3), np.array([0.0, 5.0, 0.0])), "two")
    return model


def test_wrong_arguments_are_refused() -> None:
    collision, _ = collision_of(1)
    with pytest.raises(ValueError, match=r"q must have shape \(6, configurations\), was \(5, 2\)"):
        collision.collides(np.zeros((5, 2)))
    with pytest.raises(ValueError, match=r"q must have shape \(6, configurations\), was \(6,\)"):
        collision.clearance(np.zeros(6))
    free = pin.Model()
    free.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "free")
    with pytest.raises(UnsupportedJoint):
        kinematic_table(free)
