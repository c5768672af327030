"""Paths over a grid: random walks of a population, its costs, a run, a replicate with its log.

The truth beside it.
"""

from typing import Any

import numpy as np

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.numeric.random_stream import Block
from evoexp.planners.grid_path_ga import kernels
from evoexp.planners.grid_path_ga.climbing_kernels import Ledger, climb_by_pieces
from evoexp.planners.grid_path_ga.kernels import RESULTS, Population
from evoexp.planners.grid_path_ga.path_operators import Scratch
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


def bench_climbing_trials(beside: Any) -> None:
    """Trials of path climbing on one path; beside it whole paths, settled and measured."""
    planner, problem = condition(label="(c), path climbing").prepare()
    own, rng = planner.planner, np.random.default_rng(0)
    weights, size = own.objective.weights, problem.fields.grid.num_nodes
    drawn = own.sample(problem, rng, planner.num_paths)
    paths = np.zeros((len(drawn), size + 1), dtype=np.int32)
    paths[:, : drawn.shape[1]] = drawn
    population = Population(paths, own.measured(problem, drawn))
    ledger = Ledger.of(paths, problem.world)
    draws = Block(rng.random(200 * TRIALS), np.zeros(1, dtype=np.int64))
    world = problem.world
    climb_by_pieces(draws, 0, TRIALS, world, weights, population, ledger)
    candidate = Population(np.empty((1, size + 1), dtype=np.int32), np.empty((RESULTS, 1)))
    scratch, same = Scratch.of(size), Population(paths.copy(), population.results.copy())

    def by_pieces() -> None:
        draws.taken[0] = 0
        climb_by_pieces(draws, 0, TRIALS, world, weights, population, ledger)

    def whole() -> None:
        draws.taken[0] = 0
        kernels.climb(draws, 0, TRIALS, world, weights, True, same, candidate, scratch)

    whole()
    beside(
        f"{TRIALS} trials of path climbing, Chen (c)",
        by_pieces,
        {"whole paths, settled and measured": (whole, TRIALS, 1)},
        unit="trial",
        amount=TRIALS,
    )
