"""Paths over a grid: random walks of a population, its costs, a run, a replicate with its log.

The truth beside it.
"""

from typing import Any

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.records import generations

TRIALS = 2000


def condition(*words: str, label: str = "(a)") -> Condition:
    return compose.expand(["experiment=chen_path", *words], only=[label])[0].conditions[0].condition


def bench_grid_walks(benchmark: Any) -> None:
    found = condition()
    planner, problem = found.prepare()
    rng = found.rng(0)
    benchmark(planner.sample, problem, rng, 100)


def bench_grid_costs(benchmark: Any) -> None:
    found = condition()
    planner, problem = found.prepare()
    population = planner.sample(problem, found.rng(0), 100)
    benchmark(planner.cost, problem, population)


def bench_grid_run(benchmark: Any) -> None:
    found = condition()
    planner, problem = found.prepare()
    benchmark(
        lambda: [
            generation.best_cost
            for generation in generations(planner.evolve(problem, found.rng(0)))
        ]
    )


def bench_grid_replicate(benchmark: Any) -> None:
    found = condition()
    text = found.to_json()
    benchmark(run_replicate, found, 0, text)


def bench_grid_frontier(benchmark: Any) -> None:
    planner, problem = condition(label="(b), exact").prepare()
    benchmark.pedantic(planner.truth, (problem,), rounds=3)
