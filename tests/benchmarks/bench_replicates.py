"""Whole replicates: that of Rana & Zalzala beside numpy, that of Lavoie beside its search."""

from typing import Any

import numpy as np

from evoexp.batch.replicate import run_replicate
from evoexp.records import generations
from evoexp.testing import conditions
from references import rana_numpy


def bench_rana_planar(beside: Any, benchmark: Any) -> None:
    """A replicate of the paper's budget, and its CPU seconds in the summary."""
    condition = conditions("experiment=rana_planar", budget="paper")["via-point GA"]
    rana, cpu = rana_numpy.from_condition(condition, num_generations=50), list[float]()

    def ours() -> None:
        cpu.append(run_replicate(condition, len(cpu)).summary.cpu_s)

    def tenth() -> None:
        for _ in rana_numpy.evolve(rana, np.random.default_rng(0)):
            pass

    beside(
        "a replicate with its log, via-point GA (500 generations)",
        ours,
        {"numpy + scipy, a tenth of the generations, no log": (tenth, 0.1, 1)},
        unit="replicate",
        rounds=20,
    )
    cpu = cpu[-20:]  # without the warm-up
    seconds = {"min": min(cpu), "median": float(np.median(cpu)), "replicates": len(cpu)}
    benchmark.extra_info["cpu_s"] = seconds


def bench_lavoie_7dof(beside: Any) -> None:
    """The same 20 replicates each round."""
    condition = next(iter(conditions("experiment=lavoie_7dof", budget="paper").values()))
    planner, problem = condition.prepare()

    def ours() -> None:
        for k in range(20):
            run_replicate(condition, k)

    def planning() -> None:
        for k in range(20):
            for _ in generations(planner.evolve(problem, condition.rng(k))):
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
