"""Redundant arms among ellipses: path checks, a generation, a replicate.

Beside straightforward versions.
"""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.planners.reaching_tasks import Problem
from evoexp.records import FloatArray, generations

NUM_PATHS = 800


def condition(experiment: str) -> Condition:
    return compose.expand([f"experiment={experiment}"])[0].conditions[0].condition


def num_tests(problem: Problem) -> int:
    """Return segment–ellipse tests that one path asks for.

    Links at M positions, chords of their ends between them.
    """
    return (
        2
        * problem.collision.path.num_positions
        * len(problem.start)
        * len(problem.collision.ellipses[0])
    )


@numba.njit(cache=True)
def straightforward(  # type: ignore[no-untyped-def]
    starts, ends, lengths, centers, semi_axes, angles, num_positions, hit
):
    """Everything in its obvious place.

    Libm's sines, one individual, one position, one segment at a time.
    """
    num = len(lengths)
    before, now = np.zeros((num + 1, 2)), np.zeros((num + 1, 2))
    for k in range(starts.shape[1]):
        hit[k] = False
        for j in range(num_positions + 1):
            before[:] = now
            angle = 0.0
            for i in range(num):
                angle += starts[i, k] + j / num_positions * (ends[i, k] - starts[i, k])
                now[i + 1, 0] = now[i, 0] + lengths[i] * np.cos(angle)
                now[i + 1, 1] = now[i, 1] + lengths[i] * np.sin(angle)
            for i in range(num):
                for e in range(len(centers)):
                    if j > 0 and (
                        touches(now[i], now[i + 1], centers[e], semi_axes[e], angles[e])
                        or touches(before[i + 1], now[i + 1], centers[e], semi_axes[e], angles[e])
                    ):
                        hit[k] = True
            if hit[k]:
                break


@numba.njit(cache=True)
def touches(p, q, center, semi_axes, angle):  # type: ignore[no-untyped-def]
    c, s = np.cos(angle), np.sin(angle)
    x_0, y_0 = p[0] - center[0], p[1] - center[1]
    x_1, y_1 = q[0] - center[0], q[1] - center[1]
    u_0, v_0 = (c * x_0 + s * y_0) / semi_axes[0], (c * y_0 - s * x_0) / semi_axes[1]
    u_1, v_1 = (c * x_1 + s * y_1) / semi_axes[0], (c * y_1 - s * x_1) / semi_axes[1]
    du, dv = u_1 - u_0, v_1 - v_0
    length = du * du + dv * dv
    share = 0.0 if length == 0.0 else min(max(-(u_0 * du + v_0 * dv) / length, 0.0), 1.0)
    u, v = u_0 + share * du, v_0 + share * dv
    return u * u + v * v <= 1.0


def paths(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return paths from the start that do not collide, so that every test is made.

    Small turns, (N, NUM_PATHS) each.
    """
    starts = np.repeat(problem.start[:, None], NUM_PATHS, axis=1)
    return starts, starts + np.random.default_rng(0).uniform(-0.05, 0.05, starts.shape)


def obvious_check(
    problem: Problem, starts: FloatArray, ends: FloatArray
) -> Callable[[], np.ndarray]:
    """Return a function that checks paths the straightforward way.

    It has found what the kernel finds.
    """
    table, hit = problem.collision.obstacles, np.empty(NUM_PATHS, dtype=np.bool_)
    angles = np.arctan2(table.rotation[:, 3], table.rotation[:, 0])
    about = (
        problem.collision.arm.lengths,
        table.center[:, :2].copy(),
        table.size[:, :2].copy(),
        angles,
    )

    def check() -> np.ndarray:
        straightforward(starts, ends, *about, problem.collision.path.num_positions, hit)
        return hit

    assert np.array_equal(check(), problem.collision.collide(starts, ends))
    return check


def bench_free_paths(beside: Any) -> None:
    """Whole path checks, no test left out by an early collision."""
    _, problem = condition("lavoie_7dof").prepare()
    starts, ends = paths(problem)
    obvious = obvious_check(problem, starts, ends)
    assert not obvious().any()
    beside(
        "segment–ellipse tests, lavoie_7dof, collision-free paths",
        lambda: problem.collision.collide(starts, ends),
        {"straightforward numba": (obvious, NUM_PATHS * num_tests(problem), 1)},
        unit="test",
        amount=NUM_PATHS * num_tests(problem),
        rounds=20,
    )


def bench_initial_population(beside: Any) -> None:
    """Paths to random postures as the first generation has them.

    A collision ends a path's tests.
    """
    planner, problem = condition("lavoie_10dof").prepare()
    ends = planner.sample(problem, np.random.default_rng(1), NUM_PATHS)[0]
    starts = np.repeat(problem.start[:, None], NUM_PATHS, axis=1)
    obvious = obvious_check(problem, starts, ends)
    beside(
        "path checks of a random population, lavoie_10dof",
        lambda: problem.collision.collide(starts, ends),
        {"straightforward numba": (obvious, NUM_PATHS, 1)},
        unit="path",
        amount=NUM_PATHS,
        rounds=20,
    )


def bench_replicates(beside: Any) -> None:
    """The same 20 replicates each round, with log and verdict."""
    given = condition("lavoie_7dof")
    planner, problem = given.prepare()

    def ours() -> None:
        for k in range(20):
            run_replicate(given, k)

    def planning() -> None:
        for k in range(20):
            for _ in generations(planner.evolve(problem, given.rng(k))):
                pass

    planning()
    beside(
        "a replicate with log and verdict, lavoie_7dof",
        ours,
        {"the planner alone": (planning, 20, 1)},
        unit="replicate",
        amount=20,
        rounds=5,
    )
