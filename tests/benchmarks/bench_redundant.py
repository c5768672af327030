"""Redundant arms among ellipses: path checks and replicates, beside straightforward versions."""

from typing import Any

import numba
import numpy as np

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.records import generations
from evoexp.testing import conditions

NUM_PATHS = 800


def lavoie() -> Condition:
    return next(iter(conditions("experiment=lavoie_7dof", budget="paper").values()))


@numba.njit(cache=True)
def straightforward(  # type: ignore[no-untyped-def]
    starts, ends, lengths, centers, semi_axes, angles, num_positions, hit
):
    """Everything in its obvious place: one individual, one position, one segment at a time."""
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


def bench_free_paths(beside: Any) -> None:
    """Whole path checks: small turns from the start, so that no collision leaves out a test."""
    _, problem = lavoie().prepare()
    starts = np.repeat(problem.start[:, None], NUM_PATHS, axis=1)
    ends = starts + np.random.default_rng(0).uniform(-0.05, 0.05, starts.shape)
    table, hit = problem.collision.obstacles, np.empty(NUM_PATHS, dtype=np.bool_)
    angles = np.arctan2(table.rotation[:, 3], table.rotation[:, 0])
    about = problem.collision.arm.lengths, table.center[:, :2].copy(), table.size[:, :2].copy()
    num_positions = problem.collision.path.num_positions

    def obvious() -> None:
        straightforward(starts, ends, *about, angles, num_positions, hit)

    obvious()
    assert not hit.any() and np.array_equal(hit, problem.collision.collide(starts, ends))
    # links at M positions, chords of their ends between them
    places = 2 * num_positions * len(problem.start)
    beside(
        "segment–ellipse tests, lavoie_7dof, collision-free paths",
        lambda: problem.collision.collide(starts, ends),
        {"straightforward numba": obvious},
        unit="test",
        amount=NUM_PATHS * places * len(problem.collision.ellipses[0]),
        rounds=20,
    )


def bench_replicates(beside: Any) -> None:
    """The same 20 replicates each round, with log and verdict."""
    given = lavoie()
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
        {"the planner alone": planning},
        unit="replicate",
        amount=20,
        rounds=5,
    )
