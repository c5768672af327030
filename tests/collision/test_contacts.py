"""Yes and no for robots made of spheres, in vectors, beside the sign of the exact clearance."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from collision.built_bodies import built, num_before_contact
from evoexp.collision.bodies.body_collision import BodyCollision, Shapes, leading_free
from evoexp.collision.bodies.touching_spheres import SphereCollision, TouchingSpheres
from evoexp.numeric.elementary import DEGREE
from evoexp.robots.arms import Arms, PlanarChain, SerialChain, SerialJoint
from evoexp.robots.assembly import Robot
from evoexp.scenarios.obstacles import obstacle_table
from obstacle_samples import box, half_space, sphere
from references import arms_6r, arms_7r


def arm_7r() -> BodyCollision:
    table = obstacle_table(arms_7r.OBSTACLES)
    return built(arms_7r.model(), arms_7r.shapes(), table, arms_7r.SELF_PAIRS)


def arm_6r(geometry: Any = arms_6r.spheres) -> BodyCollision:
    model, table = arms_6r.model(), obstacle_table(arms_6r.OBSTACLES)
    shapes, ignored = arms_6r.shapes_of(geometry(model)), [(1, arms_6r.FLOOR)]
    return built(model, shapes, table, arms_6r.SELF_PAIRS, ignored)


ARMS = {
    "6R": (arm_6r, arms_6r),
    "6R of capsules": (lambda: arm_6r(arms_6r.capsules), arms_6r),
    "7R": (arm_7r, arms_7r),
}


def slider(size: float, obstacle: Any, radius: float = 0.1) -> BodyCollision:
    """A ball that slides along x, and one that turns about z at its end."""
    model = pin.Model()
    first = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    model.addJoint(first, pin.JointModelRZ(), pin.SE3.Identity(), "turn")
    center, joints = np.array([[0.0, 0.0, 0.0], [size, 0.0, 0.0]]), np.array([1, 2])
    shapes = Shapes(joints, center, center, np.array([radius, radius]), joints)
    return built(model, shapes, obstacle_table((obstacle,)), ())


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("drawn", ["random_configurations", "population"])
@pytest.mark.parametrize("count", [1, 7, 8, 9, 100, 333])
def test_answers_are_the_signs_of_the_clearances(arm: str, drawn: str, count: int) -> None:
    make, source = ARMS[arm]
    collision, q = make(), getattr(source, drawn)(count)
    exact = collision.clearance(q).least
    assert np.abs(exact).min() > 1e-9
    assert np.array_equal(collision.collides(q), exact < 0.0)
    assert num_before_contact(collision, q) == leading_free(exact < 0.0)


@pytest.mark.parametrize("drawn", ["random_configurations", "population"])
def test_a_7r_arm_agrees_with_coal(drawn: str) -> None:
    model, q = arms_7r.model(), getattr(arms_7r, drawn)(500)
    scene = arms_7r.geometry(model)
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(model, scene, 1)
    expected = pin.computeCollisionsInParallel(1, pool, q, True, False)
    assert 0 < expected.sum() < len(expected)
    assert np.array_equal(arm_7r().collides(q), expected)


@pytest.mark.parametrize("arm", ARMS)
def test_the_search_for_any_collision_ends_where_the_first_is_found(arm: str) -> None:
    make, source = ARMS[arm]
    collision, q = make(), source.random_configurations(400)
    hits = collision.clearance(q).least < 0.0
    free = q[:, ~hits]
    for place in (0, 5, 8, 50, free.shape[1]):
        mixed = np.insert(free, place, q[:, hits][:, 0], axis=1)
        assert num_before_contact(collision, mixed) == place // 8 * 8
    for count in (0, free.shape[1]):
        assert num_before_contact(collision, free[:, :count]) == count


def test_touching_bodies_are_judged_exactly() -> None:
    collision = slider(0.0, sphere((1.0, 0.0, 0.0), 0.5), radius=0.25)
    q = np.stack([0.25 + 2.0**-52 * np.array([-1.0, 0.0, 1.0]), np.zeros(3)])
    exact = collision.clearance(q).least
    assert np.array_equal(exact < 0.0, [False, False, True])
    assert np.array_equal(collision.collides(q), exact < 0.0)
    assert num_before_contact(collision, q) == 0
    assert num_before_contact(collision, q[:, :2]) == 2


def test_centres_within_boxes_without_thickness_collide() -> None:
    collision = slider(0.2, box((1.0, 0.0, 0.0), (1.0, 1.0, 1.0)), radius=0.0)
    q = np.array([[0.0, 0.29, 0.31, 0.49, 0.51, 1.0], [0.0, 0.0, 0.0, np.pi, 0.0, 1.0]])
    assert np.array_equal(collision.collides(q), [False, False, True, False, True, True])


def test_far_slides_large_angles_and_what_is_not_a_number_are_judged_exactly() -> None:
    collision = slider(0.5, half_space((0.0, 0.0, -5.0), (1e-6, 0.0, 1.0)))
    q = np.zeros((2, 7))
    q[0], q[1, 6] = [0.0, -6e6, 4e6, -1e30, np.nan, np.inf, 1e3], 1e9
    with np.errstate(invalid="ignore"):
        exact = collision.clearance(q).least
    assert np.array_equal(collision.collides(q), ~(exact >= 0.0))
    assert np.array_equal(collision.collides(q)[:3], [False, True, False])


@pytest.mark.parametrize("seed", range(20))
def test_scenes_at_random_with_sizes_of_every_scale(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-3.0, 3.0)
    model, (joint, *sizes, _) = arms_6r.model(), arms_7r.shapes()
    for k in range(1, model.njoints):
        model.jointPlacements[k].translation *= scale
    joint = np.minimum(joint, 6)
    solids = [each for each in arms_6r.OBSTACLES if each.shape in ("sphere", "box")]
    table = obstacle_table(tuple(solids))
    scaled = table._replace(center=scale * table.center, size=scale * table.size)
    collision = built(model, Shapes(joint, *(scale * size for size in sizes), joint), scaled)
    q = rng.uniform(-np.pi, np.pi, size=(6, 1)) + rng.choice([0.1, 3.0]) * rng.normal(size=(6, 203))
    assert np.array_equal(collision.collides(q), collision.clearance(q).least < 0.0)


PROGRAMME = """
import sys
sys.path.insert(0, {tests!r})
from collision.test_contacts import answers
print("\\n".join(answers()))
"""


def answers() -> list[str]:
    return [
        str(make().collides(getattr(source, drawn)(300)).astype(int).tolist())
        for make, source in ARMS.values()
        for drawn in ("random_configurations", "population")
    ]


@pytest.mark.matrix
@pytest.mark.parametrize("processor", ["generic", "haswell"])
def test_other_processors_give_the_same_answers(processor: str, tmp_path: Path) -> None:
    names = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    environment = {**os.environ, **names, "EVOEXP_CACHE": str(tmp_path)}
    programme = PROGRAMME.format(tests=str(Path(__file__).parents[1]))
    command = [sys.executable, "-c", programme]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == answers()


def planar(*lengths: float, base: tuple[float, float], angle: float = 0.0) -> PlanarChain:
    return PlanarChain(link_lengths=lengths, base_position=base, base_angle=angle)


def elbow(y: float) -> SerialChain:
    """Return a spatial 3R arm, for the kernel in space."""
    rows = ((0.0, 0.0, 1.0), 0.0, 0.0), ((0.0, 1.0, 0.0), 0.0, 1.0), ((0.0, 1.0, 0.0), 1.5, 0.0)
    joints = tuple(SerialJoint(axis=axis, offset=(x, 0.0, z)) for axis, x, z in rows)
    return SerialChain(joints=joints, tip=(1.2, 0.1, 0.0), base_position=(0.0, y, 0.0))


TWO_PLANAR = Arms(
    arms=(planar(4.0, 4.0, base=(0.0, 0.0)), planar(4.0, 4.0, base=(0.0, 8.0), angle=20.0))
)
ROBOTS = {
    "two arms": TWO_PLANAR,
    "three arms": Arms(arms=(*TWO_PLANAR.arms, planar(3.0, 2.0, 2.0, base=(9.0, 4.0)))),
    "in space": Arms(arms=(elbow(0.0), elbow(2.5))),
    "alone": planar(4.0, 4.0, base=(0.0, 4.0)),
}


def touching(
    robot: Robot, spheres: int = 5, radius: float = 0.5, obstacles: tuple[object, ...] = ()
) -> SphereCollision:
    model = TouchingSpheres(spheres_per_link=spheres, sphere_radius=radius, collision_substeps=1)
    return model.bind(robot.build(), obstacles)


@pytest.mark.parametrize("robot", ROBOTS)
def test_clearances_are_those_of_the_general_model(robot: str) -> None:
    """Which stands beside coal and a plain reference of its own."""
    rng = np.random.default_rng(1)
    for obstacles in (*((each,) for each in arms_6r.OBSTACLES), arms_6r.OBSTACLES):
        collision = touching(ROBOTS[robot], obstacles=obstacles)
        q = rng.uniform(-720.0, 720.0, size=(collision.collision.nq, 133))
        exact, general = collision.clearance(q), collision.collision.clearance(DEGREE * q)
        arms, solids = exact.between_arms, exact.to_obstacles
        assert np.allclose(arms, general.between_arms, rtol=0.0, atol=1e-12)
        assert np.allclose(solids, general.to_obstacles, rtol=0.0, atol=1e-12)
        assert np.isposinf(arms).all() == (robot == "alone")
        assert np.array_equal(collision.collides(q), exact.least < 0.0)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("spheres", [1, 2, 5, 11, 200])
@pytest.mark.parametrize("count", [1, 9, 64, 8 * 64 + 5])
def test_circles_at_equal_steps_collide_where_their_clearance_is_negative(
    robot: str, spheres: int, count: int
) -> None:
    collision = touching(ROBOTS[robot], spheres)
    rng, nq = np.random.default_rng(spheres + count), collision.collision.nq
    for spread in (180.0, 5.0):
        middle = rng.uniform(-180.0, 180.0, size=(nq, 1))
        q = middle + rng.uniform(-spread, spread, size=(nq, count))
        exact = collision.clearance(q).least
        assert np.abs(exact).min() > 1e-10
        assert np.array_equal(collision.collides(q), exact < 0.0)
        assert num_before_contact(collision.collision, DEGREE * q) == leading_free(exact < 0.0)


def test_circles_that_touch_are_measured_exactly() -> None:
    """Two links along y, whose lines are one diameter apart, and a last bit less or more."""
    arms = Arms(arms=tuple(planar(4.0, 4.0, base=(x, 0.0)) for x in (0.0, 0.75)))
    q = np.repeat(np.array([[90.0], [0.0], [90.0], [0.0]]), 9, axis=1)
    q[1, 4] = 1.0  # turned towards the other
    for radius in np.nextafter(0.375, [0.0, 0.375, 1.0]):
        collision = touching(arms, 5, float(radius))
        exact = collision.clearance(q).least
        assert np.abs(np.delete(exact, 4)).max() < 1e-15
        assert np.array_equal(collision.collides(q), exact < 0.0)


def test_large_angles_and_what_is_not_a_number_are_measured_exactly() -> None:
    collision, rng = touching(TWO_PLANAR), np.random.default_rng(0)
    q = rng.uniform(-1.0, 1.0, size=(4, 70)) * 10.0 ** rng.uniform(2.0, 9.0, size=(1, 70))
    q[1, 3], q[2, 50] = np.nan, np.inf
    with np.errstate(invalid="ignore"):
        exact = collision.clearance(q).least
    assert 0 < (exact < 0.0).sum() < 70
    assert np.array_equal(collision.collides(q), ~(exact >= 0.0))


def test_circles_stand_joint_to_joint_and_shared_ones_count_once() -> None:
    collision = touching(TWO_PLANAR)
    assert collision.counts.tolist() == [9, 9]
    assert collision.shapes.start[:9, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 1.0, 2.0, 3.0, 4.0]
    assert touching(ROBOTS["alone"], 1).shapes.start[:, 0].tolist() == [2.0, 2.0]
    with pytest.raises(ValueError, match=r"q must have shape \(4, configurations\)"):
        collision.clearance(np.zeros((3, 5)))
