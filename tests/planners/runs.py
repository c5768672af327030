"""Runs of conditions, and verdicts on what they found."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.certifier.certificate import Certificate
from evoexp.condition import Condition
from evoexp.planners.answers import judge_motion
from evoexp.records import generations


class Run(NamedTuple):
    """A planner, its problem, and the generations of a run with their own copies of the costs."""

    planner: Any
    problem: Any
    records: list[Any]

    @property
    def last(self) -> Any:
        """The last generation."""
        return self.records[-1]

    def verdict(self) -> Certificate:
        """Judge the last solution."""
        return verdict(self.planner, self.problem, self.last.best)


def ran(chosen: Condition, seed: Any = 0) -> Run:
    """Run a condition with a seed, or a generator."""
    planner, problem = chosen.prepare()
    return Run(planner, problem, evolved(planner, problem, seed))


def evolved(planner: Any, problem: Any, seed: Any = 0) -> list[Any]:
    """Return all generations of a run with a seed, or a generator."""
    found = generations(planner.evolve(problem, np.random.default_rng(seed)))
    return [
        each._replace(costs=each.costs.copy(), population=each.population.copy()) for each in found
    ]


def verdict(planner: Any, problem: Any, solution: Any) -> Certificate:
    """Judge a solution by the exact bodies."""
    return judge_motion(planner, problem, planner.motion(problem, solution))
