"""Runs of co-evolving robots (Curkovic et al. 2013), each evaluation in one call or step by step.

Step by step is how robots with envelopes, or among obstacles, are evaluated.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from evoexp.collision.planar.link_collision import LinkCollision
from evoexp.configuration import compose
from evoexp.records import generations

GENERATIONS = 40


@contextmanager
def step_by_step() -> Iterator[None]:
    """Have lines evaluated as other models are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LinkCollision, "is_lines", False)
        yield


@pytest.mark.parametrize("label", ["I", "VIII"])
def bench_run(beside: Any, label: str) -> None:
    words = ["experiment=curkovic_methods", f"ga.num_generations={GENERATIONS}"]
    given = compose.expand(words, only=[label])[0].conditions[0].condition
    planner, problem = given.prepare()

    def run() -> float:
        return min(
            generation.best_cost
            for generation in generations(planner.evolve(problem, given.rng(0)))
        )

    def steps() -> float:
        with step_by_step():
            return run()

    assert run() == steps()
    beside(
        f"a run of co-evolution, method {label}, evaluated in one call",
        run,
        {"step by step": (steps, GENERATIONS + 1, 1)},
        unit="generation",
        amount=GENERATIONS + 1,
        rounds=20,
    )
