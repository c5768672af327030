"""Postures as individuals: a whole search, its collisions in batches of 100.

Beside an obvious version and coal.
"""

from typing import Any

import numpy as np
import pinocchio as pin

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.records import generations
from references import posture_es_python

SIZE = 100


def condition(experiment: str) -> Condition:
    return compose.expand([f"experiment={experiment}"])[0].conditions[0].condition


def bench_search(beside: Any) -> None:
    """The same path, bit by bit: ours through records and ancestry, the reference with lists.

    On the same kernels.
    """
    found = condition("corsepius_bottle")
    planner, problem = found.prepare()
    evaluations = posture_es_python.path(problem, planner, found.rng(0))[1]

    def ours() -> None:
        for _ in generations(planner.evolve(problem, found.rng(0))):
            pass

    beside(
        f"a search of {evaluations} postures, without its log",
        ours,
        {
            "lists": (
                lambda: posture_es_python.path(problem, planner, found.rng(0)),
                evaluations,
                1,
            )
        },
        unit="posture",
        amount=evaluations,
        rounds=10,
    )


def bench_collisions(beside: Any) -> None:
    """The MANUS arm, its sphere sets, before table and bottle; coal with the bodies themselves."""
    _, problem = condition("corsepius_bottle").prepare()
    stage = problem.begin(0, problem.start, problem.first_situation)
    scene = problem.scene_of(stage)
    collision = problem.bodies.collision(problem.obstacles)
    low, high = problem.limits.T
    q = np.random.default_rng(0).uniform(low[:, None], high[:, None], (len(low), SIZE))
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(scene.model, scene.geometry, 1)
    coals = pin.computeCollisionsInParallel(1, pool, q, True, False)
    assert not np.any(coals & ~collision.collides(q))
    beside(
        f"collisions of the MANUS arm's {problem.bodies.num_shapes} spheres, {SIZE} random "
        "postures",
        lambda: collision.collides(q),
        {
            "coal, broad phase, the bodies": (
                lambda: pin.computeCollisionsInParallel(1, pool, q, True, False),
                SIZE,
                1,
            )
        },
        unit="posture",
        amount=SIZE,
        repeat=10,
    )


def bench_replicate(beside: Any) -> None:
    found = condition("corsepius_ball")
    beside(
        "a replicate of corsepius_ball, log and verdict included",
        lambda: run_replicate(found, 0),
        {},
        "replicate",
    )
