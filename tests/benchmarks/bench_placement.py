"""Docking postures: criteria of a population, a run, a replicate with its log.

The truths beside it.
"""

from typing import Any

import numpy as np

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.records import generations


def condition(*words: str) -> Condition:
    return (
        compose.expand(["experiment=chen_placement", *words], only=["A torque norm"])[0]
        .conditions[0]
        .condition
    )


def bench_placement_criteria(benchmark: Any) -> None:
    _, problem = condition().prepare()
    angles = np.random.default_rng(0).uniform(-180.0, 180.0, (2, 5000))
    benchmark(problem.model.measure, angles)


def bench_placement_run(benchmark: Any) -> None:
    found = condition()
    planner, problem = found.prepare()
    benchmark(
        lambda: [
            generation.best_cost
            for generation in generations(planner.evolve(problem, found.rng(0)))
        ]
    )


def bench_placement_replicate(benchmark: Any) -> None:
    found = condition()
    text = found.to_json()
    benchmark(run_replicate, found, 0, text)


def bench_placement_optimum(benchmark: Any) -> None:
    planner, problem = condition("reference=placement_optimum").prepare()
    benchmark.pedantic(planner.truth, (problem,), rounds=3)


def bench_placement_conventional(benchmark: Any) -> None:
    planner, problem = condition(
        "reference=placement_conventional", "objective=chen_minimax"
    ).prepare()
    benchmark.pedantic(planner.truth, (problem,), rounds=3)
