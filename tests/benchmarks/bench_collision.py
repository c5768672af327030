"""Judging a population, and its touching circles alone.

Beside numpy and beside Pinocchio with coal.

Fresh walks are judged, smoothed once: half of the instants collide at the beginning of a run,
hardly any at its end; a population of a finished run is judged, too, because who looks at blocks of
similar configurations can skip more there.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.records import generations
from references import rana_numpy

INDIVIDUALS, INSTANTS = 100, 20
HANDFUL = 25  # configurations that coal is given per call


def condition() -> Condition:
    return (
        compose.expand(["experiment=rana_planar", "ga.population_size=100"])[0]
        .conditions[0]
        .condition
    )


def population_of(when: str) -> Any:
    """Return a population, (nq, N + 1, individuals)."""
    given = condition()
    planner, problem = given.prepare()
    if when == "fresh":
        return planner.sample(problem, np.random.default_rng(0), INDIVIDUALS)
    *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
    return last.population[:, :, :INDIVIDUALS].copy()


def coal_collisions(collision: Any) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    """Return two functions of q (nq, configurations) [rad] that tell which collide.

    Pair by pair, and by broad phase.

    The first is called once per configuration and stops at the first contact. The second takes all
    configurations in one call (a pool with one thread and a tree per configuration).
    """
    model, geometry = collision.assembly.model, pin.GeometryModel(collision.geometry)
    (first, stop), (second, end) = collision.arm_spheres
    for a in range(first, stop):
        for b in range(second, end):
            geometry.addCollisionPair(pin.CollisionPair(a, b))
    data, geometry_data = model.createData(), geometry.createData()
    pool = pin.BroadPhaseManagerPool_DynamicAABBTreeCollisionManager(model, geometry, 1)

    def pair_by_pair(q: Any) -> Any:
        return np.array(
            [pin.computeCollisions(model, data, geometry, geometry_data, one, True) for one in q.T]
        )

    def broad_phase(q: Any) -> Any:
        return pin.computeCollisionsInParallel(1, pool, q, True, False)

    return pair_by_pair, broad_phase


@pytest.mark.parametrize("when", ["fresh", "finished"])
def bench_judging(beside: Any, when: str) -> None:
    given = condition()
    planner, problem = given.prepare()
    population = population_of(when)
    rana = rana_numpy.from_condition(given)
    strings = (
        np.array([population[a:b] for a, b in problem.arm_slices]).transpose(3, 0, 2, 1).copy()
    )
    pair_by_pair, broad_phase = coal_collisions(problem.collision)
    every = population[:, 1:].reshape(len(population), -1)
    some = np.deg2rad(every[:, :: every.shape[1] // HANDFUL][:, :HANDFUL])
    expected = (
        problem.collision.clearance(every).least[:: every.shape[1] // HANDFUL][:HANDFUL] < 0.0
    )
    assert np.array_equal(pair_by_pair(some), expected)
    assert np.array_equal(broad_phase(some), expected)
    assert np.allclose(
        rana_numpy.judge(rana, strings).cost,
        planner.cost(problem, population).cost,
        rtol=0.0,
        atol=1e-9,
    )
    beside(
        f"judge {INDIVIDUALS} individuals of {INSTANTS} instants, {when}",
        lambda: planner.cost(problem, population),
        {
            "numpy": (lambda: rana_numpy.judge(rana, strings), INDIVIDUALS, 1),
            "Pinocchio + coal, pair by pair, collisions only": (
                lambda: pair_by_pair(some),
                HANDFUL / INSTANTS,
                1,
            ),
            "Pinocchio + coal, broad phase, collisions only": (
                lambda: broad_phase(some),
                HANDFUL / INSTANTS,
                1,
            ),
        },
        unit="evaluation",
        amount=INDIVIDUALS,
        repeat=10,
    )
