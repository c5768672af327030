"""The planner of Rana & Zalzala, its steps and whole replicates, beside the same in numpy.

Both measure arc length equally well: 8 speeds per segment are about as accurate as 16 chords
(`paths.redistribution`).
"""

from itertools import islice
from typing import Any

import numpy as np
import pytest

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.planners.via_point_ga.strings import PER_CALL
from evoexp.records import generations
from evoexp.testing import conditions
from paths.string_operators import redistribute, relax
from references import rana_numpy

LATER = 50  # generation from which on single generations are measured: collisions have become rare


def condition(*overrides: str) -> Condition:
    every = conditions("experiment=rana_planar", *overrides, budget="paper")
    return next(iter(every.values()))


def crossed(given: Condition, count: int) -> Any:
    """Return smooth strings, once crossed, (individuals, arms, N + 1, joints)."""
    rana, rng = rana_numpy.from_condition(given, crossover_rate=1.0), np.random.default_rng(0)
    walks = rana_numpy.smooth(rana, rana_numpy.walks(rana, rng, count))
    return rana_numpy.crossover(rana, rng, walks)


def bench_redistribution_and_relaxation(beside: Any) -> None:
    given = condition()
    rana, strings = rana_numpy.from_condition(given), crossed(given, 50)
    arms = np.array([[0, 2], [2, 4]])
    fresh = np.zeros((4, 21, 56))
    fresh[:, :, :50] = strings.transpose(1, 3, 2, 0).reshape(4, 21, 50)
    via_points = fresh.copy()

    def ours() -> None:
        np.copyto(via_points, fresh)
        redistribute(via_points, arms, 50)
        relax(via_points, 0.5, 50)

    ours()
    found = via_points[:, :, :50].reshape(2, 2, 21, 50).transpose(3, 0, 2, 1)
    assert np.abs(found - rana_numpy.smooth(rana, strings)).max() < 1.0  # [deg], spacing about 10
    beside(
        "redistribution + relaxation of 100 paths of 21 points",
        ours,
        {"numpy + scipy": (lambda: rana_numpy.smooth(rana, strings), 100, 1)},
        unit="path",
        amount=100,
        repeat=10,
        rounds=100,
    )


def bench_generation(beside: Any) -> None:
    """One generation after another of one long run each, no log."""
    given = condition("ga.num_generations=1000000")
    planner, problem = given.prepare()
    ours = generations(planner.evolve(problem, np.random.default_rng(0)))
    theirs = rana_numpy.evolve(rana_numpy.from_condition(given), np.random.default_rng(0))
    for run in (ours, theirs):
        next(islice(run, LATER, None))
    beside(
        "a generation of the GA (population 50, 48 evaluated), no log",
        lambda: next(ours),
        {"numpy + scipy": (lambda: next(theirs), 1, 2)},
        unit="generation",
        repeat=5 * PER_CALL,  # whole calls of the kernel in every round
        rounds=25,
    )


@pytest.mark.parametrize("label", ["via-point GA", "random search"])
def bench_replicate(beside: Any, benchmark: Any, label: str) -> None:
    """A replicate of the paper's budget with its log, and its CPU seconds in the summary."""
    given, cpu = conditions("experiment=rana_planar", budget="paper")[label], list[float]()

    def ours() -> None:
        cpu.append(run_replicate(given, len(cpu)).summary.cpu_s)

    references = {}
    if label == "via-point GA":
        rana = rana_numpy.from_condition(given, num_generations=50)

        def tenth() -> None:
            for _ in rana_numpy.evolve(rana, np.random.default_rng(0)):
                pass

        references["numpy + scipy, a tenth of the generations, no log"] = (tenth, 0.1, 1)
    beside(
        f"a replicate with its log, {label} (500 generations)",
        ours,
        references,
        unit="replicate",
        rounds=20,
    )
    cpu = cpu[-20:]  # without the warm-up
    seconds = {"min": min(cpu), "median": float(np.median(cpu)), "replicates": len(cpu)}
    benchmark.extra_info["cpu_s"] = seconds
