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
from composed import composed
from evoexp.collision.bodies.body_collision import BodyCollision, leading_free
from evoexp.collision.bodies.contact_kernels import find_contacts
from evoexp.collision.bodies.packing import Shapes
from evoexp.numeric.elementary import DEGREE
from evoexp.records import BoolArray, FloatArray
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
    obstacle_table,
)
from references import arms_6r, arms_7r

COUNTS = [1, 7, 8, 9, 100, 333]


def arm_7r() -> BodyCollision:
    table = obstacle_table(arms_7r.OBSTACLES)
    return built(arms_7r.model(), arms_7r.shapes(), table, arms_7r.SELF_PAIRS)


def arm_6r() -> BodyCollision:
    model, table = arms_6r.model(), obstacle_table(arms_6r.OBSTACLES)
    return built(
        model,
        arms_6r.shapes_of(arms_6r.spheres(model)),
        table,
        arms_6r.SELF_PAIRS,
        [(1, arms_6r.FLOOR)],
    )


ARMS = {"6R": (arm_6r, arms_6r), "7R": (arm_7r, arms_7r)}


def decided(collision: BodyCollision, q: FloatArray, at_first: bool) -> tuple[int, BoolArray]:
    """Return the kernel's answer without the exact one behind it."""
    out = np.empty(q.shape[1], dtype=np.bool_)
    return find_contacts(collision.tables, at_first, np.ascontiguousarray(q), out), out


def slider(size: float, obstacles: tuple[Any, ...], radius: float = 0.1) -> BodyCollision:
    """A ball that slides along x, and one that turns about z at its end."""
    model = pin.Model()
    first = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    model.addJoint(first, pin.JointModelRZ(), pin.SE3.Identity(), "turn")
    center = np.array([[0.0, 0.0, 0.0], [size, 0.0, 0.0]])
    joints = np.array([1, 2])
    shapes = Shapes(joints, center, center, np.array([radius, radius]), joints)
    return built(model, shapes, obstacle_table(obstacles), ())


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("drawn", ["random_configurations", "population"])
@pytest.mark.parametrize("count", COUNTS)
def test_answers_are_the_signs_of_the_clearances(arm: str, drawn: str, count: int) -> None:
    make, source = ARMS[arm]
    collision, q = make(), getattr(source, drawn)(count)
    exact = collision.clearance(q).least
    doubts, found = decided(collision, q, at_first=False)
    assert doubts == 0, "none of these is within 1e-12 of contact"
    assert np.abs(exact).min() > 1e-9
    assert np.array_equal(found, exact < 0.0)
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
    collision = make()
    q = source.random_configurations(400)
    hits = collision.clearance(q).least < 0.0
    free = q[:, ~hits]
    for place in (0, 5, 8, 50, free.shape[1]):
        mixed = np.insert(free, place, q[:, hits][:, 0], axis=1)
        assert decided(collision, mixed, at_first=True)[0] == -1 - place // 8 * 8
        assert num_before_contact(collision, mixed) == place // 8 * 8
    assert decided(collision, free, at_first=True)[0] == 0
    assert num_before_contact(collision, free) == free.shape[1]
    assert num_before_contact(collision, free[:, :0]) == 0


def test_touching_bodies_are_in_doubt_and_judged_exactly() -> None:
    ball = SphereObstacle(shape="sphere", center=(1.0, 0.0, 0.0), radius=0.5)
    collision = slider(0.0, (ball,), radius=0.25)
    at = 0.25 + 2.0**-52 * np.array([-1.0, 0.0, 1.0])
    q = np.stack([at, np.zeros(3)])
    assert decided(collision, q, at_first=False)[0] == 3
    exact = collision.clearance(q).least
    assert np.array_equal(exact < 0.0, [False, False, True])
    assert np.array_equal(collision.collides(q), exact < 0.0)
    assert num_before_contact(collision, q) == 0
    assert num_before_contact(collision, q[:, :2]) == 2


def test_centres_within_boxes_without_thickness_collide() -> None:
    box = BoxObstacle(shape="box", center=(1.0, 0.0, 0.0), size=(1.0, 1.0, 1.0))
    collision = slider(0.2, (box,), radius=0.0)
    q = np.array([[0.0, 0.29, 0.31, 0.49, 0.51, 1.0], [0.0, 0.0, 0.0, np.pi, 0.0, 1.0]])
    assert np.array_equal(collision.collides(q), [False, False, True, False, True, True])


def test_far_slides_large_angles_and_what_is_not_a_number_are_judged_exactly() -> None:
    floor = HalfSpaceObstacle(shape="half_space", point=(0.0, 0.0, -5.0), normal=(1e-6, 0.0, 1.0))
    collision = slider(0.5, (floor,))
    q = np.array(
        [[0.0, -6e6, 4e6, -1e30, np.nan, np.inf, 1e3], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e9]]
    )
    with np.errstate(invalid="ignore"):
        exact = collision.clearance(q).least
    assert decided(collision, q, at_first=False)[0] == 6
    assert np.array_equal(collision.collides(q), ~(exact >= 0.0))
    assert np.array_equal(collision.collides(q)[:3], [False, True, False])


@pytest.mark.parametrize("seed", range(20))
def test_scenes_at_random_with_sizes_of_every_scale(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-3.0, 3.0)
    model, own = arms_6r.model(), arms_7r.shapes()
    for joint in range(1, model.njoints):
        model.jointPlacements[joint].translation *= scale
    joint = np.minimum(own.joint, 6)
    fitting = own._replace(joint=joint, body=joint)
    shapes = fitting._replace(
        start=scale * own.start, end=scale * own.end, radius=scale * own.radius
    )
    obstacles = tuple(
        one.model_copy(
            update={
                "center": tuple(scale * x for x in one.center),
                **(
                    {"radius": scale * one.radius}
                    if isinstance(one, SphereObstacle)
                    else {"size": tuple(scale * x for x in one.size)}
                ),
            }
        )
        for one in arms_6r.OBSTACLES
        if isinstance(one, SphereObstacle | BoxObstacle)
    )
    collision = built(model, shapes, obstacle_table(obstacles))
    q = rng.uniform(-np.pi, np.pi, size=(6, 1)) + rng.choice([0.1, 3.0]) * rng.normal(size=(6, 203))
    doubts, found = decided(collision, q, at_first=False)
    assert doubts == 0
    assert np.array_equal(found, collision.clearance(q).least < 0.0)


def test_capsules_are_answered_in_full() -> None:
    model, table = arms_6r.model(), obstacle_table(arms_6r.OBSTACLES)
    collision = built(
        model,
        arms_6r.shapes_of(arms_6r.capsules(model)),
        table,
        arms_6r.SELF_PAIRS,
        [(1, arms_6r.FLOOR)],
    )
    q = arms_6r.random_configurations(50)
    hits = collision.collides(q)
    assert num_before_contact(collision, q) == leading_free(hits)
    assert num_before_contact(collision, q[:, ~hits]) == (~hits).sum()


@pytest.mark.parametrize("experiment", ["rana_planar", "rana_obstacles", "rana_puma"])
def test_touching_spheres_find_any_collision(experiment: str) -> None:
    planner, problem = composed(f"experiment={experiment}").prepare()
    collision = problem.collision
    strings = planner.sample(problem, np.random.default_rng(0), 24)
    q = np.ascontiguousarray(strings.reshape(len(strings), -1))
    hits = collision.clearance(q).least < 0.0
    assert 0 < hits.sum() < len(hits)
    assert np.array_equal(collision.collides(q), hits)
    general, q = collision.general, DEGREE * q
    assert num_before_contact(general, q) == leading_free(hits)
    free = q[:, ~hits]
    assert num_before_contact(general, free) == free.shape[1]
    for count in (1, 7, 8, 9, 20):
        few = q[:, :count]
        assert num_before_contact(general, few) == leading_free(hits[:count])
        mixed = np.hstack([free[:, :count], q[:, hits][:, :1]])
        assert num_before_contact(general, mixed) == count // 8 * 8


PROGRAMME = """
import sys
import numpy as np
sys.path.insert(0, {tests!r})
from collision.test_contacts import ARMS
for make, source in ARMS.values():
    for drawn in ("random_configurations", "population"):
        print(make().collides(getattr(source, drawn)(300)).astype(int).tolist())
"""


@pytest.mark.matrix
@pytest.mark.parametrize("processor", ["generic", "haswell"])
def test_other_processors_give_the_same_answers(processor: str, tmp_path: Path) -> None:
    names = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    environment = {**os.environ, **names, "EVOEXP_CACHE": str(tmp_path)}
    programme = PROGRAMME.format(tests=str(Path(__file__).parents[1]))
    done = subprocess.run(
        [sys.executable, "-c", programme],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    expected = [
        str(make().collides(getattr(source, drawn)(300)).astype(int).tolist())
        for make, source in ARMS.values()
        for drawn in ("random_configurations", "population")
    ]
    assert done.stdout.splitlines() == expected
