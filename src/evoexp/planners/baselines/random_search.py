"""Random search: what a planner's own sampling reaches without any evolution.

At equal evaluations.
"""

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray, Generation
from evoexp.validation import Component


class RandomSearch(Component):
    """Draws every individual as the wrapped planner draws its initial population.

    A generation draws as many individuals as the planner would evaluate in it, so that both are
    equal in evaluations at every generation.

    Attributes:
        planner: The planner whose sampling, cost and budget are used.
    """

    component: ClassVar[str] = "random_search"

    planner: Any

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        return self.planner.prepare(robot, scenario)

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield one generation of new samples after the other."""
        planner = self.planner
        best, best_cost, terms, solved = np.empty(0), np.inf, {}, False
        evaluations = queries = 0
        for index in range(planner.ga.num_generations + 1):
            count = planner.ga.num_offspring if index else planner.ga.population_size
            population = planner.sample(problem, rng, count)
            judged = planner.cost(problem, population)
            statistics = cost_statistics(judged.cost)
            evaluations += count
            queries += judged.collision_queries
            if judged.cost[statistics.best] < best_cost or index == 0:
                best_cost = float(judged.cost[statistics.best])
                best = planner.solution(problem, population, statistics.best)
                terms, solved = (
                    judged.named_terms(statistics.best),
                    bool(judged.feasible[statistics.best]),
                )
            yield Generation(
                index=index,
                best=best,
                best_cost=best_cost,
                best_cost_in_generation=float(judged.cost[statistics.best]),
                mean_cost=statistics.mean,
                std_cost=statistics.std,
                num_feasible=int(np.count_nonzero(judged.feasible)),
                evaluations=evaluations,
                collision_queries=queries,
                solved=solved,
                terms=terms,
                costs=judged.cost,
                population=population,
            )

    def sample(self, problem: Any, rng: np.random.Generator, count: int) -> FloatArray:
        """Sample as the wrapped planner does."""
        return np.asarray(self.planner.sample(problem, rng, count))

    def cost(self, problem: Any, population: FloatArray) -> Any:
        """Judge as the wrapped planner does."""
        return self.planner.cost(problem, population)

    def motion(self, problem: Any, solution: FloatArray) -> Motion | None:
        """Return the wrapped planner's motion of a solution."""
        motion: Motion | None = self.planner.motion(problem, solution)
        return motion

    def evaluate(self, problem: Any, solution: FloatArray) -> dict[str, float]:
        """Return the wrapped planner's terms of a solution."""
        return dict(self.planner.evaluate(problem, solution))

    def shape(self, problem: Any) -> Any:
        """Return the wrapped planner's shape of a solution."""
        return self.planner.shape(problem)
