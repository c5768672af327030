"""Spheres and capsules of a 6R arm among ten obstacles, batches of 100.

Beside Pinocchio with coal and beside numpy.

Two kinds of batches: configurations at random, of which two in five collide, and configurations of
a converged population, which hardly differ. coal answers for the same arm as 11 capsules and as the
same 59 spheres; it stops at a configuration's first contact, as `collides` does.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from collision.built_bodies import built, num_before_contact
from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.robots.kinematics import kinematic_table
from evoexp.scenarios.obstacles import obstacle_table
from references import arms_6r, arms_7r, primitives_numpy

SIZE, MANY = 100, 4000
IGNORED = [(1, arms_6r.FLOOR)]
DRAWN = {"random": arms_6r.random_configurations, "population": arms_6r.population}
DRAWN_7R = {"random": arms_7r.random_configurations, "population": arms_7r.population}


def collision_of(shapes: str) -> BodyCollision:
    model = arms_6r.model()
    table = obstacle_table(arms_6r.OBSTACLES)
    return built(
        model,
        arms_6r.shapes_of(getattr(arms_6r, shapes)(model)),
        table,
        arms_6r.SELF_PAIRS,
        IGNORED,
    )


def collision_of_7r() -> BodyCollision:
    table = obstacle_table(arms_7r.OBSTACLES)
    return built(arms_7r.model(), arms_7r.shapes(), table, arms_7r.SELF_PAIRS)


def coal_collisions(shapes: str, broad_phase: bool) -> Callable[[Any], Any]:
    """Return a function of q (nq, configurations): which collide, by a pool of one thread."""
    model = arms_6r.model()
    scene = arms_6r.with_obstacles(
        getattr(arms_6r, shapes)(model), arms_6r.OBSTACLES, arms_6r.SELF_PAIRS, IGNORED
    )
    if broad_phase:
        pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(model, scene, 1)
    else:
        pool = pin.GeometryPool(model, scene, 1)
    return lambda q: pin.computeCollisionsInParallel(1, pool, q, True, False)


def numpy_clearance() -> Callable[[Any], Any]:
    """Return a function of q (nq, configurations): the least clearance of the spheres."""
    model = arms_6r.model()
    table = obstacle_table(arms_6r.OBSTACLES)
    shapes = arms_6r.shapes_of(arms_6r.spheres(model))
    chain = kinematic_table(model)
    local = np.array([chain.local(j, p) for j, p in zip(shapes.joint, shapes.start, strict=True)])
    checked = np.ones((len(shapes.joint), len(table.kind)), dtype=bool)
    for joint, k in IGNORED:
        checked[shapes.joint == joint, k] = False
    scene = arms_6r.with_obstacles(
        arms_6r.spheres(model), arms_6r.OBSTACLES, arms_6r.SELF_PAIRS, IGNORED
    )
    pairs = np.array(
        [(p.first, p.second) for p in scene.collisionPairs if p.second < len(shapes.joint)]
    )

    def clearance(q: Any) -> Any:
        centers = primitives_numpy.sphere_centers(chain, shapes.joint - 1, local, q)
        outside = primitives_numpy.to_obstacles(centers, shapes.radius, table, checked)
        return np.minimum(outside, primitives_numpy.to_self(centers, shapes.radius, *pairs.T))

    return clearance


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize("shapes", ["spheres", "capsules"])
def bench_collides(beside: Any, shapes: str, drawn: str) -> None:
    collision, q = collision_of(shapes), DRAWN[drawn](SIZE)
    references = {
        "coal, broad phase, 11 capsules": coal_collisions("capsules", broad_phase=True),
        "coal, broad phase, 59 spheres": coal_collisions("spheres", broad_phase=True),
        "coal, pair by pair, 11 capsules": coal_collisions("capsules", broad_phase=False),
    }
    same = coal_collisions(shapes, broad_phase=True)
    assert np.array_equal(collision.collides(q), same(q))
    beside(
        f"collisions of a 6R arm, {shapes}, {SIZE} {drawn} configurations",
        lambda: collision.collides(q),
        {name: (lambda one=one: one(q), SIZE, 1) for name, one in references.items()},
        unit="configuration",
        amount=SIZE,
        repeat=10,
    )


@pytest.mark.parametrize("size", [SIZE, MANY])
@pytest.mark.parametrize("drawn", DRAWN)
def bench_collides_7r(beside: Any, drawn: str, size: int) -> None:
    """A 7R arm of 59 spheres among ten spheres: all answers, and whether any collides.

    Of `MANY` configurations no processor remembers which way the branches went the last time.
    """
    model, collision = arms_7r.model(), collision_of_7r()
    q = DRAWN_7R[drawn](size)
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(
        model, arms_7r.geometry(model), 1
    )
    some = np.ascontiguousarray(q[:, :SIZE])
    hits = pin.computeCollisionsInParallel(1, pool, some, True, False)
    assert np.array_equal(collision.collides(q)[:SIZE], hits)
    edges = [np.ascontiguousarray(q[:, k : k + 20]) for k in range(0, SIZE, 20)]
    beside(
        f"collisions of a 7R arm, 59 spheres, {size} {drawn} configurations",
        lambda: collision.collides(q),
        {
            "coal, broad phase, 59 spheres": (
                lambda: pin.computeCollisionsInParallel(1, pool, some, True, False),
                SIZE,
                1,
            ),
            "whether any of 20 collides": (
                lambda: [num_before_contact(collision, edge) for edge in edges],
                SIZE,
                10,
            ),
        },
        unit="configuration",
        amount=size,
        repeat=10 if size == SIZE else 1,
    )


@pytest.mark.parametrize("limit", [0.05, np.inf])
@pytest.mark.parametrize("drawn", DRAWN)
def bench_clearance(beside: Any, drawn: str, limit: float) -> None:
    collision, q, plain = collision_of("spheres"), DRAWN[drawn](SIZE), numpy_clearance()
    broad_phase = coal_collisions("capsules", broad_phase=True)
    assert (
        np.abs(
            np.minimum(plain(q), limit) - np.minimum(collision.clearance(q, limit).least, limit)
        ).max()
        < 1e-12
    )
    beside(
        f"clearances of 59 spheres below {limit}, {SIZE} {drawn} configurations",
        lambda: collision.clearance(q, limit),
        {
            "numpy": (lambda: plain(q), SIZE, 1),
            "coal, broad phase, 11 capsules, collisions only": (lambda: broad_phase(q), SIZE, 1),
        },
        unit="configuration",
        amount=SIZE,
        repeat=10,
    )


@pytest.mark.parametrize("shapes", ["spheres", "capsules"])
def bench_collides_one_by_one(beside: Any, shapes: str) -> None:
    """What a planner pays that asks for one configuration at a time: eight are computed."""
    collision, q = collision_of(shapes), arms_6r.random_configurations(SIZE)
    every = [np.ascontiguousarray(q[:, k : k + 1]) for k in range(SIZE)]
    broad_phase = coal_collisions("capsules", broad_phase=True)
    beside(
        f"collisions of a 6R arm, {shapes}, a single configuration",
        lambda: [collision.collides(one) for one in every],
        {
            "coal, broad phase, 11 capsules": (
                lambda: [broad_phase(one) for one in every],
                SIZE,
                1,
            )
        },
        unit="configuration",
        amount=SIZE,
    )


def bench_collides_one_by_one_7r(beside: Any) -> None:
    model, collision = arms_7r.model(), collision_of_7r()
    q = arms_7r.random_configurations(SIZE)
    every = [np.ascontiguousarray(q[:, k : k + 1]) for k in range(SIZE)]
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(
        model, arms_7r.geometry(model), 1
    )
    beside(
        "collisions of a 7R arm, 59 spheres, a single configuration",
        lambda: [collision.collides(one) for one in every],
        {
            "coal, broad phase, 59 spheres": (
                lambda: [
                    pin.computeCollisionsInParallel(1, pool, one, True, False) for one in every
                ],
                SIZE,
                1,
            )
        },
        unit="configuration",
        amount=SIZE,
    )
