"""Spheres and capsules among ten obstacles in batches, beside Pinocchio with coal.

Two kinds of batches: configurations at random, of which two in five collide, and configurations of
a converged population, which hardly differ. coal answers for the same arm as 11 capsules and as the
same 59 spheres; it stops at a configuration's first contact, as `collides` does.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from collision.built_bodies import built, num_before_contact
from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.scenarios.obstacles import obstacle_table
from references import arms_6r, arms_7r

SIZE, MANY = 100, 4000
IGNORED = [(1, arms_6r.FLOOR)]
TABLE = obstacle_table(arms_6r.OBSTACLES)
DRAWN = ("random", "population")
SPHERES, CAPSULES = "coal, broad phase, 59 spheres", "coal, broad phase, 11 capsules"


def drawn_from(arm: Any, drawn: str, size: int = SIZE) -> Any:
    return (arm.random_configurations if drawn == "random" else arm.population)(size)


def collision_of(shapes: str) -> BodyCollision:
    model = arms_6r.model()
    packed = arms_6r.shapes_of(getattr(arms_6r, shapes)(model))
    return built(model, packed, TABLE, arms_6r.SELF_PAIRS, IGNORED)


def collision_of_7r() -> BodyCollision:
    obstacles = obstacle_table(arms_7r.OBSTACLES)
    return built(arms_7r.model(), arms_7r.shapes(), obstacles, arms_7r.SELF_PAIRS)


def scene_of(shapes: str) -> tuple[Any, Any]:
    """Return the 6R arm's model, and its geometry among the obstacles."""
    model = arms_6r.model()
    geometry = getattr(arms_6r, shapes)(model)
    pairs = (arms_6r.OBSTACLES, arms_6r.SELF_PAIRS, IGNORED)
    return model, arms_6r.with_obstacles(geometry, *pairs)


def scene_of_7r() -> tuple[Any, Any]:
    model = arms_7r.model()
    return model, arms_7r.geometry(model)


def broad_phase(scene: tuple[Any, Any]) -> Callable[[Any], Any]:
    """Return a function of q (nq, configurations): which collide, by a pool of one thread."""
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(*scene, 1)
    return lambda q: pin.computeCollisionsInParallel(1, pool, q, True, False)


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize("shapes", ["spheres", "capsules"])
def bench_collides(beside: Any, shapes: str, drawn: str) -> None:
    collision, q = collision_of(shapes), drawn_from(arms_6r, drawn)
    references = {
        CAPSULES: broad_phase(scene_of("capsules")),
        SPHERES: broad_phase(scene_of("spheres")),
    }
    same = references[SPHERES if shapes == "spheres" else CAPSULES]
    assert np.array_equal(collision.collides(q), same(q))
    beside(
        f"collisions of a 6R arm, {shapes}, {SIZE} {drawn} configurations",
        lambda: collision.collides(q),
        {name: partial(reference, q) for name, reference in references.items()},
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
    collision, q, coal = (
        collision_of_7r(),
        drawn_from(arms_7r, drawn, size),
        broad_phase(scene_of_7r()),
    )
    some = np.ascontiguousarray(q[:, :SIZE])
    assert np.array_equal(collision.collides(q)[:SIZE], coal(some))
    edges = [np.ascontiguousarray(q[:, k : k + 20]) for k in range(0, SIZE, 20)]

    def any_of_20() -> None:
        for edge in edges:
            num_before_contact(collision, edge)

    beside(
        f"collisions of a 7R arm, 59 spheres, {size} {drawn} configurations",
        lambda: collision.collides(q),
        {
            SPHERES: (lambda: coal(some), SIZE, 1),
            "whether any of 20 collides": (any_of_20, SIZE, 10),
        },
        unit="configuration",
        amount=size,
        repeat=10 if size == SIZE else 1,
    )


@pytest.mark.parametrize("drawn", DRAWN)
def bench_clearance(beside: Any, drawn: str) -> None:
    collision, q = collision_of("spheres"), drawn_from(arms_6r, drawn)
    coal = broad_phase(scene_of("capsules"))
    beside(
        f"clearances of 59 spheres, {SIZE} {drawn} configurations",
        lambda: collision.clearance(q),
        {f"{CAPSULES}, collisions only": lambda: coal(q)},
        unit="configuration",
        amount=SIZE,
        repeat=10,
    )


@pytest.mark.parametrize("arm", ["6R arm, spheres", "6R arm, capsules", "7R arm, 59 spheres"])
def bench_collides_one_by_one(beside: Any, arm: str) -> None:
    """What a planner pays that asks for one configuration at a time: eight are computed."""
    own, is_6r = (arms_6r, True) if arm.startswith("6R") else (arms_7r, False)
    collision = collision_of(arm.partition(", ")[2]) if is_6r else collision_of_7r()
    coal = broad_phase(scene_of("capsules") if is_6r else scene_of_7r())
    q = drawn_from(own, "random")
    every = [np.ascontiguousarray(q[:, k : k + 1]) for k in range(SIZE)]
    beside(
        f"collisions of a {arm}, a single configuration",
        lambda: [collision.collides(one) for one in every],
        {CAPSULES if is_6r else SPHERES: lambda: [coal(one) for one in every]},
        unit="configuration",
        amount=SIZE,
    )
