"""A 7R arm of 59 spheres among ten spheres, beside Pinocchio with coal.

Two kinds of batches: configurations at random, and those of a converged population, which hardly
differ. coal stops at a configuration's first contact, as `collides` does.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from collision.built_bodies import built, num_before_contact
from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.scenarios.obstacles import obstacle_table
from references import arms_7r

SIZE, MANY = 100, 4000
SPHERES = "coal, broad phase, 59 spheres"


def collision_of_7r() -> BodyCollision:
    obstacles = obstacle_table(arms_7r.OBSTACLES)
    return built(arms_7r.model(), arms_7r.shapes(), obstacles, arms_7r.SELF_PAIRS)


def broad_phase() -> Callable[[Any], Any]:
    """Return a function of q (nq, configurations): which collide, by a pool of one thread."""
    model = arms_7r.model()
    scene = model, arms_7r.geometry(model)
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(*scene, 1)
    return lambda q: pin.computeCollisionsInParallel(1, pool, q, True, False)


@pytest.mark.parametrize("size", [SIZE, MANY])
@pytest.mark.parametrize("drawn", ["random", "population"])
def bench_collides(beside: Any, drawn: str, size: int) -> None:
    """All answers, and whether any collides.

    Of `MANY` configurations no processor remembers which way the branches went the last time.
    """
    draw = arms_7r.random_configurations if drawn == "random" else arms_7r.population
    collision, q, coal = collision_of_7r(), draw(size), broad_phase()
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


def bench_collides_one_by_one(beside: Any) -> None:
    """What a planner pays that asks for one configuration at a time: eight are computed."""
    collision, coal, q = collision_of_7r(), broad_phase(), arms_7r.random_configurations(SIZE)
    every = [np.ascontiguousarray(q[:, k : k + 1]) for k in range(SIZE)]
    beside(
        "collisions of a 7R arm, 59 spheres, a single configuration",
        lambda: [collision.collides(one) for one in every],
        {SPHERES: lambda: [coal(one) for one in every]},
        unit="configuration",
        amount=SIZE,
    )
