"""Touching spheres: the fast kernel against coal on the same shapes.

And against the obvious loop.
"""

import coal
import numpy as np
import pinocchio as pin
import pytest

from collision.touching_arms import ONE_PLANAR, THREE_PLANAR, TWO_PLANAR, TWO_SPATIAL
from evoexp.collision.bodies.touching_spheres import SphereCollision, TouchingSpheres
from evoexp.numeric.rotations import rotation_matrix
from evoexp.robots.arms import Arms
from evoexp.robots.assembly import Robot
from evoexp.robots.planar_chain import PlanarChain
from evoexp.scenarios.obstacles import BoxObstacle, CapsuleObstacle, SphereObstacle

MODEL = TouchingSpheres(spheres_per_link=5, sphere_radius=0.5, collision_substeps=1)
OBSTACLES = (
    SphereObstacle(shape="sphere", center=(3.0, 4.0), radius=0.7),
    BoxObstacle(shape="box", center=(-3.0, 4.5, 0.2), size=(1.0, 2.0), rotation=(0.0, 0.0, 35.0)),
    BoxObstacle(
        shape="box", center=(1.0, 9.0, 0.0), size=(1.0, 2.0, 0.4), rotation=(20.0, -30.0, 70.0)
    ),
    CapsuleObstacle(shape="capsule", start=(-6.0, 1.0), end=(-4.0, -2.0, 1.0), radius=0.3),
    CapsuleObstacle(shape="capsule", start=(5.0, 5.0, -1.0), end=(5.0, 5.0, 1.0), radius=0.3),
)


def coal_clearance(
    collision: SphereCollision, obstacles: tuple[object, ...], q_deg: np.ndarray
) -> tuple[float, float]:
    """Least distances by coal: spheres of different arms, and spheres and obstacles."""
    model, shapes = collision.assembly.model, collision.shapes
    data = model.createData()
    pin.forwardKinematics(model, data, np.deg2rad(q_deg))
    arms = np.concatenate(
        [[a] * (stop - first) for a, (first, stop) in enumerate(collision.arm_spheres)]
    )
    spheres = [
        (coal.CollisionObject(coal.Sphere(radius), np.eye(3), data.oMi[joint].act(center)), arm)
        for joint, center, radius, arm in zip(
            shapes.joint.tolist(), shapes.start, shapes.radius, arms, strict=True
        )
    ]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    between = [_distance(a, b, request, result) for a, m in spheres for b, n in spheres if m < n]
    outside = [
        _distance(a, coal_obstacle(o), request, result) for a, _ in spheres for o in obstacles
    ]
    return min(between, default=np.inf), min(outside, default=np.inf)


def _distance(a: object, b: object, request: object, result: object) -> float:
    result.clear()
    return coal.distance(a, b, request, result)


def coal_obstacle(obstacle: object) -> coal.CollisionObject:
    if isinstance(obstacle, SphereObstacle):
        return coal.CollisionObject(
            coal.Sphere(obstacle.radius), np.eye(3), np.array([*obstacle.center, 0.0][:3])
        )
    if isinstance(obstacle, BoxObstacle):
        shape = coal.Box(*[*obstacle.size, 1.0][:3])
        center = np.array([*obstacle.center, 0.0][:3])
        return coal.CollisionObject(shape, rotation_matrix(obstacle.rotation), center)
    start, end = (np.array([*point, 0.0][:3]) for point in (obstacle.start, obstacle.end))
    length = np.linalg.norm(end - start)
    turn = pin.Quaternion.FromTwoVectors(
        np.array([0.0, 0.0, 1.0]), (end - start) / length
    ).toRotationMatrix()
    return coal.CollisionObject(coal.Capsule(obstacle.radius, length), turn, 0.5 * (start + end))


@pytest.mark.examples(1)
@pytest.mark.parametrize(
    "robot", [TWO_PLANAR, THREE_PLANAR, TWO_SPATIAL], ids=["two planar", "three planar", "spatial"]
)
def test_clearance_agrees_with_coal(robot: Robot) -> None:
    assembly = robot.build()
    collision = MODEL.bind(assembly, OBSTACLES)
    q = np.random.default_rng(0).uniform(-360.0, 360.0, size=(assembly.model.nq, 150))
    clearance = collision.clearance(q)
    for sample in range(q.shape[1]):
        between, outside = coal_clearance(collision, OBSTACLES, q[:, sample])
        assert clearance.between_arms[sample] == pytest.approx(between, abs=1e-12)
        # coal gives penetration depths of box and sphere by iteration: compare magnitudes outside,
        # signs inside
        if outside > 0.0:
            assert clearance.to_obstacles[sample] == pytest.approx(outside, abs=1e-6)
        else:
            assert clearance.to_obstacles[sample] < 1e-9


def test_signs_agree_with_the_general_model() -> None:
    assembly = THREE_PLANAR.build()
    collision = MODEL.bind(assembly, OBSTACLES)
    q = np.random.default_rng(1).uniform(-720.0, 720.0, size=(assembly.model.nq, 333))
    exact, general = collision.clearance(q), collision.general.clearance(np.deg2rad(q))
    assert np.abs(exact.between_arms - general.between_arms).max() < 1e-12
    assert np.abs(exact.to_obstacles - general.to_obstacles).max() < 1e-12
    assert np.array_equal(collision.collides(q), exact.least < 0.0)


def test_circles_stand_joint_to_joint_and_shared_ones_count_once() -> None:
    collision = MODEL.bind(TWO_PLANAR.build(), ())
    assert collision.arm_spheres.tolist() == [[0, 9], [9, 18]]
    assert collision.spheres.local[:5, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert collision.spheres.local[5:9, 0].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_a_single_arm_meets_no_other_arm() -> None:
    clearance = MODEL.bind(ONE_PLANAR.build(), ()).clearance(np.zeros((2, 3)))
    assert np.all(np.isposinf(clearance.between_arms))
    assert np.all(np.isposinf(clearance.least))


def test_touching_is_no_collision_and_less_is() -> None:
    """Strictly less than the sum of the radii collides.

    Two parallel arms at distance 1 and just below.
    """
    for distance, collides in ((1.0, False), (np.nextafter(1.0, 0.0), True)):
        robot = Arms(
            arms=(
                PlanarChain(link_lengths=(4.0,), base_position=(0.0, 0.0)),
                PlanarChain(link_lengths=(4.0,), base_position=(0.0, float(distance))),
            )
        )
        clearance = MODEL.bind(robot.build(), ()).clearance(np.zeros((2, 1)))
        assert bool(clearance.least[0] < 0.0) is collides


def test_one_sphere_per_link_sits_in_the_middle() -> None:
    single = TouchingSpheres(spheres_per_link=1, sphere_radius=0.5, collision_substeps=1)
    assert single.bind(ONE_PLANAR.build(), ()).spheres.local[:, 0].tolist() == [2.0, 2.0]


def test_a_wrong_number_of_joints_is_refused() -> None:
    collision = MODEL.bind(TWO_PLANAR.build(), ())
    with pytest.raises(ValueError, match=r"q must have shape \(4, configurations\)"):
        collision.clearance(np.zeros((3, 5)))
