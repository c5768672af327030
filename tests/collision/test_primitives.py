"""Spheres and capsules, also in special position: against coal and a slow, plain reference."""

from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from collision.built_bodies import built, default_pairs, limited
from collision.certifier_scenes import random_rotation
from evoexp.collision.bodies.body_collision import BodyCollision, Shapes
from evoexp.robots.kinematics import kinematic_table
from evoexp.scenarios.obstacles import obstacle_table
from matrix import num_cases
from obstacle_samples import box, capsule, cylinder, half_space, sphere
from references import arms_6r, primitives_numpy
from references.primitive_distances import along, to_obstacle, to_segment
from robots.robot_samples import random_tree


def random_geometry(rng: np.random.Generator, model: Any, spheres: int, capsules: int) -> Any:
    """Shapes on random joints, the world among them; some of radius or length 0."""
    geometry = pin.GeometryModel()
    for k in range(spheres + capsules):
        radius = float(rng.choice([0.0, 0.05, rng.uniform(0.01, 0.2)]))
        shape = coal.Sphere(radius)
        if k >= spheres:
            shape = coal.Capsule(radius, float(rng.choice([0.0, 0.2, 0.7])))
        joint = int(rng.integers(0, model.njoints)) if k else 1
        place = pin.SE3(random_rotation(rng, planar=False), rng.uniform(-0.3, 0.3, size=3))
        geometry.addGeometryObject(pin.GeometryObject(f"shape_{k}", joint, 0, place, shape))
    return geometry


def plain_clearances(
    model: Any, geometry: Any, table: Any, pairs: Any, arms: Any, q: np.ndarray
) -> list[float]:
    """Least clearances to obstacles, between arms, to self; by the slow reference."""
    data, places, shapes = model.createData(), geometry.createData(), []
    pin.updateGeometryPlacements(model, data, geometry, places, np.ascontiguousarray(q))
    for item, place in zip(geometry.geometryObjects, places.oMg, strict=True):
        axis = getattr(item.geometry, "halfLength", 0.0) * place.rotation[:, 2]
        ends = place.translation - axis, place.translation + axis
        shapes.append((item.parentJoint, *ends, item.geometry.radius))
    least, chosen = [np.inf, np.inf, np.inf], {frozenset(pair) for pair in pairs}
    for n, (joint, start, end, radius) in enumerate(shapes):
        for k in range(len(table.kind) if joint > 0 else 0):
            least[0] = min(least[0], along(start, end, to_obstacle(table, k)) - radius)
        for other, one, two, thick in shapes[n + 1 :]:
            if frozenset((joint, other)) in chosen and joint != other:
                row = 1 if arms[joint] != arms[other] and min(arms[joint], arms[other]) >= 0 else 2
                away = along(start, end, to_segment(one, two)) - radius - thick
                least[row] = min(least[row], away)
    return least


@pytest.mark.examples(3)
@pytest.mark.parametrize(
    ("spheres", "capsules", "seed"),
    [*((12, 0, seed) for seed in range(6)), *((4, 8, 100 + seed) for seed in range(6))],
)
def test_shapes_on_random_trees_agree_with_the_plain_reference(
    spheres: int, capsules: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    model = random_tree(rng, 7)
    geometry = random_geometry(rng, model, spheres, capsules)
    # an axis inside an obstacle is only known to be that deep
    radii = [item.geometry.radius for item in geometry.geometryObjects]
    deepest = -min(radii) if capsules else -np.inf
    table = obstacle_table(arms_6r.OBSTACLES)
    shapes, arms = arms_6r.shapes_of(geometry), [-1, *rng.integers(0, 2, size=model.nq).tolist()]
    pairs, collision = default_pairs(model, shapes), built(model, shapes, table, arms=arms)
    q = rng.uniform(-np.pi, np.pi, size=(model.nq, 5))
    for column, clearances in zip(q.T, np.array(collision.clearance(q)).T, strict=True):
        expected = plain_clearances(model, geometry, table, pairs, arms, column)
        if expected[0] <= deepest:
            assert clearances[0] <= deepest + 1e-12
            clearances[0] = expected[0]
        assert clearances == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("shapes", ["spheres", "capsules"])
@pytest.mark.parametrize("drawn", ["random_configurations", "population"])
def test_verdicts_agree_with_coal(shapes: str, drawn: str) -> None:
    model, q = arms_6r.model(), getattr(arms_6r, drawn)(400)
    geometry, table = getattr(arms_6r, shapes)(model), obstacle_table(arms_6r.OBSTACLES)
    pairs, ignored = arms_6r.SELF_PAIRS, [(1, arms_6r.FLOOR)]
    collision = built(model, arms_6r.shapes_of(geometry), table, pairs, ignored)
    scene = arms_6r.with_obstacles(geometry, arms_6r.OBSTACLES, pairs, ignored)
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(model, scene, 1)
    expected = pin.computeCollisionsInParallel(1, pool, q, True, False)
    assert 0 < expected.sum() < len(expected)
    assert np.array_equal(collision.collides(q), expected)


def test_depths_agree_with_plain_numpy_in_a_crowd_of_large_obstacles() -> None:
    """Centres deep inside: where a ball around a body is nearer than it is deep."""
    model = arms_6r.model()
    shapes = arms_6r.shapes_of(arms_6r.spheres(model))
    large = (
        box((0.9, 0.0, 0.9), (1.2, 1.5, 1.8), (10.0, 20.0, 30.0)),
        cylinder((-0.8, 0.0, -1.0), (-0.9, 0.2, 2.0), 0.6),
        half_space((0.0, 0.0, 0.6), (0.1, 0.2, 1.0)),
    )
    table = obstacle_table((*arms_6r.OBSTACLES, *large))
    collision, q = built(model, shapes, table), arms_6r.random_configurations(1000)
    joints = kinematic_table(model)
    local = np.array([joints.local(j, p) for j, p in zip(shapes.joint, shapes.start, strict=True)])
    centers = primitives_numpy.sphere_centers(joints.chain, shapes.joint - 1, local, q)
    every = np.ones((len(local), len(table.kind)), dtype=bool)
    expected = primitives_numpy.to_obstacles(centers, shapes.radius, table, every)
    clearance = collision.clearance(q)
    assert expected.min() < -0.5
    np.testing.assert_allclose(clearance.to_obstacles, expected, rtol=0.0, atol=1e-12)
    assert np.array_equal(collision.collides(q), clearance.least < 0.0)


def collision_of(seed: int, arms: int = 2) -> tuple[BodyCollision, np.random.Generator]:
    rng = np.random.default_rng(seed)
    model = random_tree(rng, 6, is_chain=True)
    geometry = random_geometry(rng, model, 20, 6)
    cut = [-1, *(k * arms // model.nq for k in range(model.nq))]
    table = obstacle_table(arms_6r.OBSTACLES)
    return built(model, arms_6r.shapes_of(geometry), table, arms=cut), rng


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("count", [1, 63, 64, 65, 128, 129, 300])
def test_a_batch_is_its_configurations_one_by_one(seed: int, count: int) -> None:
    collision, rng = collision_of(seed)
    q = rng.uniform(-np.pi, np.pi, size=(6, count))
    for limit in (np.inf, 0.1):
        together = np.array(limited(collision, q, limit))
        assert np.array_equal(np.array(limited(collision, q[:, ::-1], limit))[:, ::-1], together)
        for k in range(0, count, 7):
            alone = np.array(limited(collision, q[:, k : k + 1], limit))
            assert np.array_equal(together[:, k : k + 1], alone)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("limit", [-0.05, 0.0, 0.1, 1.0])
def test_a_limit_skips_only_what_is_not_asked(seed: int, limit: float) -> None:
    collision, rng = collision_of(seed, arms=1 + seed % 2)
    near = rng.uniform(-np.pi, np.pi, size=(6, 1)) + 0.1 * rng.normal(size=(6, 150))
    for q in (near, rng.uniform(-np.pi, np.pi, size=(6, 150))):
        exact, bounded = collision.clearance(q), limited(collision, q, limit)
        assert np.array_equal(np.minimum(exact, limit), np.array(bounded))


def test_no_configurations_and_what_is_not_a_number() -> None:
    collision, _ = collision_of(0)
    assert collision.clearance(np.empty((6, 0))).least.shape == (0,)
    assert collision.collides(np.empty((6, 0))).shape == (0,)
    q = np.zeros((6, 3))
    q[2, 1] = np.nan
    least = collision.clearance(q).least
    assert np.array_equal(np.isnan(least), [False, True, False])
    assert collision.collides(q)[1]
    assert np.array_equal(collision.clearance(np.zeros((6, 1))).least, least[:1])


def test_wrong_arguments_are_refused() -> None:
    collision, _ = collision_of(1)
    with pytest.raises(ValueError, match=r"q must have shape \(6, configurations\), was \(5, 2\)"):
        collision.collides(np.zeros((5, 2)))
    with pytest.raises(ValueError, match=r"q must have shape \(6, configurations\), was \(6,\)"):
        collision.clearance(np.zeros(6))


Point = tuple[float, float, float]

GRID = st.sampled_from([-1.0, -0.5, 0.0, 0.25, 0.5, 1.0])
FINE = st.floats(-1.0, 1.0).map(lambda x: round(x, 9))
POINTS = st.one_of(st.tuples(GRID, GRID, GRID), st.tuples(FINE, FINE, FINE))
RADII = st.sampled_from([0.0, 0.1, 0.5])

OBSTACLES = (
    sphere((0.25, 0.0, 0.5), 0.25),
    box((0.0, 0.0, 0.0), (1.0, 0.5, 0.02)),
    box((0.0, 0.5, 0.0), (0.5, 0.5, 0.5), (45.0, 0.0, 0.0)),
    capsule((0.0, 0.0, -0.5), (0.0, 0.0, 0.5), 0.1),
    cylinder((0.0, 0.0, -0.5), (0.0, 0.0, 0.5), 0.25),
    cylinder((0.0, -0.5, 0.5), (0.5, -1.0, 0.5), 0.1),
    half_space((0.0, 0.0, -0.5), (0.0, 0.0, 1.0)),
)
ORIGIN = (0.0, 0.0, 0.0)


def clearance(joints: Any, starts: Any, ends: Any, radii: Any, *obstacles: Any) -> Any:
    """Clearances of shapes on a hinge at rest, and on the world beside it."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    shapes = Shapes(*(np.array(column) for column in (joints, starts, ends, radii, joints)))
    pairs = [(0, 1)] if len(joints) > 1 else []
    return built(model, shapes, obstacle_table(obstacles), pairs).clearance(np.zeros((1, 1)))


def to_one(a: Point, b: Point, radius: float, obstacle: Any) -> float:
    """Clearance of a capsule and an obstacle."""
    return float(clearance([1], [a], [b], [radius], obstacle).to_obstacles[0])


@settings(max_examples=num_cases(25, 300), deadline=None)
@given(POINTS, POINTS, POINTS, POINTS, RADII, RADII)
@example((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.25, 0.5, 0.0), (0.5, 0.5, 0.0), 0.1, 0.1)
@example((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, 0.0)
@example((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, 0.0, 0.0), 0.0, 0.0)
@example((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.5, 0.0, 0.0), 0.0, 0.0)
@example((-1.0, 0.0, 0.0), (1.0, 0.0, 1e-7), (-1.0, 0.0, 1e-7), (1.0, 0.0, 0.0), 0.0, 0.0)
@example((-1.0, 0.0, 0.0), (1.0, 1e-9, 0.0), (-1.0, 1e-9, 1e-3), (1.0, 0.0, 1e-3), 0.0, 0.0)
@example((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 1.0, 0.0), 0.1, 0.0)
def test_two_capsules(a: Point, b: Point, c: Point, d: Point, one: float, two: float) -> None:
    expected = along(np.array(a), np.array(b), to_segment(np.array(c), np.array(d))) - one - two
    for joints, order in (([0, 1], 1), ([1, 0], -1)):
        starts, ends, radii = [a, c][::order], [b, d][::order], [one, two][::order]
        found = clearance(joints, starts, ends, radii).to_self[0]
        assert found == pytest.approx(expected, abs=1e-12)


@settings(max_examples=num_cases(25, 300), deadline=None)
@given(POINTS, POINTS, RADII, st.integers(0, len(OBSTACLES) - 1))
@example((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, 1)  # along the middle of a thin box
@example((-1.0, 0.25, 0.01), (1.0, 0.25, 0.01), 0.1, 1)  # along an edge
@example((-1.0, -1.0, 0.05), (1.0, 1.0, 0.05), 0.0, 1)  # parallel to a face
@example((0.25, 0.0, -1.0), (0.25, 0.0, 1.0), 0.0, 4)  # along the mantle
@example((0.5, 0.0, -1.0), (0.5, 0.0, 1.0), 0.0, 4)  # beside it
@example((-1.0, 0.25, 0.5), (1.0, 0.25, 0.5), 0.1, 4)  # touches the rim
@example((-1.0, 0.5, 0.75), (1.0, 0.5, 0.75), 0.1, 4)  # passes the rim
@example((0.0, 0.0, 1.0), (0.0, 0.0, 0.75), 0.1, 4)  # on the axis, above
@example(ORIGIN, ORIGIN, 0.1, 1)  # a centre deep inside
@example(ORIGIN, ORIGIN, 0.1, 4)
def test_a_capsule_and_an_obstacle(a: Point, b: Point, radius: float, k: int) -> None:
    obstacle = OBSTACLES[k]
    expected = along(np.array(a), np.array(b), to_obstacle(obstacle_table(OBSTACLES), k)) - radius
    found = to_one(a, b, radius, obstacle)
    if expected <= -radius and obstacle.shape in ("box", "cylinder") and a != b:
        # the depth of a point inside, perhaps not the deepest
        assert expected - 1e-12 <= found <= -radius + 1e-12
    else:
        assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("obstacle", [OBSTACLES[1], OBSTACLES[4]])
def test_a_line_through_a_box_or_a_cylinder_collides(obstacle: Any) -> None:
    assert to_one((-3.0, 0.1, 0.002), (3.0, 0.12, 0.001), 0.0, obstacle) < 0.0
    assert to_one((0.1, 0.1, -3.0), (0.11, 0.1, 3.0), 0.0, obstacle) < 0.0


@pytest.mark.parametrize("length", [1e-300, 1e-160, 1e-101, 1e-99, 1e-30, 1e-12])
def test_very_short_capsules_are_points(length: float) -> None:
    b, c, d = (length, 0.0, 0.0), (1.0, 0.0, 1.0), (1.0, length, 1.0)
    apart = clearance([0, 1], [ORIGIN, c], [b, d], [0.1, 0.2]).to_self[0]
    assert apart == pytest.approx(np.sqrt(2.0) - 0.3, abs=1e-11)
    for k, obstacle in enumerate(OBSTACLES):
        away = float(to_obstacle(obstacle_table(OBSTACLES), k)(np.array(c, dtype=np.longdouble)))
        assert to_one(c, d, 0.1, obstacle) == pytest.approx(away - 0.1, abs=1e-11)


def test_touching_is_no_collision_and_less_is() -> None:
    for height, collides in ((1.0, False), (np.nextafter(1.0, 0.0), True)):
        centers = [ORIGIN, (0.0, 0.0, height)]
        assert (clearance([0, 1], centers, centers, [0.5, 0.5]).least[0] < 0.0) == collides
