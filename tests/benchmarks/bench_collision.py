"""Judging a population, and its touching circles alone, beside numpy and Pinocchio with coal.

Fresh walks are judged, smoothed once: half of the instants collide at the beginning of a run,
hardly any at its end; a population of a finished run is judged, too, because who looks at blocks of
similar configurations can skip more there.
"""

from collections.abc import Callable
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.records import generations
from evoexp.testing import conditions
from references import rana_numpy

INDIVIDUALS, INSTANTS = 100, 20
HANDFUL = 25  # configurations that coal is given per call


def population_of(planner: Any, problem: Any, when: str) -> Any:
    """Return a population, (nq, N + 1, individuals)."""
    if when == "fresh":
        return planner.sample(problem, np.random.default_rng(0), INDIVIDUALS)
    *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    return last.population[:, :, :INDIVIDUALS].copy()


def coal_collisions(collision: Any) -> Callable[[Any], Any]:
    """Return a function of q (nq, configurations) [rad] that tells which collide, by one thread."""
    model, geometry, shapes = collision.assembly.model, pin.GeometryModel(), collision.shapes
    for joint, center, _, radius in zip(*shapes[:4], strict=True):
        place, ball = pin.SE3(np.eye(3), center), coal.Sphere(radius)
        geometry.addGeometryObject(pin.GeometryObject("sphere", int(joint), 0, place, ball))
    (first, stop), (second, end) = collision.arm_spheres
    for a in range(first, stop):
        for b in range(second, end):
            geometry.addCollisionPair(pin.CollisionPair(a, b))
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(model, geometry, 1)
    return lambda q: pin.computeCollisionsInParallel(1, pool, q, True, False)


@pytest.mark.parametrize("when", ["fresh", "finished"])
def bench_judging(beside: Any, when: str) -> None:
    words = "experiment=rana_planar", f"ga.population_size={INDIVIDUALS}"
    given = next(iter(conditions(*words, budget="paper").values()))
    planner, problem = given.prepare()
    population, rana = population_of(planner, problem, when), rana_numpy.from_condition(given)
    arms = np.array([population[a:b] for a, b in problem.arm_slices])
    strings = arms.transpose(3, 0, 2, 1).copy()
    broad_phase = coal_collisions(problem.collision)
    every = population[:, 1:].reshape(len(population), -1)
    chosen = slice(0, HANDFUL * (every.shape[1] // HANDFUL), every.shape[1] // HANDFUL)
    some = np.deg2rad(every[:, chosen])
    expected = problem.collision.clearance(every).least[chosen] < 0.0
    assert np.array_equal(broad_phase(some), expected)
    costs = rana_numpy.judge(rana, strings).cost, planner.cost(problem, population).cost
    assert np.allclose(*costs, rtol=0.0, atol=1e-9)
    part = HANDFUL / INSTANTS
    beside(
        f"judge {INDIVIDUALS} individuals of {INSTANTS} instants, {when}",
        lambda: planner.cost(problem, population),
        {
            "numpy": lambda: rana_numpy.judge(rana, strings),
            "Pinocchio + coal, broad phase, collisions only": (lambda: broad_phase(some), part, 1),
        },
        unit="evaluation",
        amount=INDIVIDUALS,
        repeat=10,
    )
