"""The evolution strategy on postures, slow and obvious.

Individuals are lists, everybody remembers the whole line.
"""

from typing import Any

import numpy as np

from evoexp.planners.posture_es.kernels import COST
from evoexp.planners.posture_es.phases import Problem, begin, judge


def path(
    problem: Problem, ga: Any, rng: np.random.Generator, mutant: str = ""
) -> tuple[Any, int, str]:
    """Search the first phase; return postures, evaluations, and why it ended.

    Args:
        problem: The problem.
        ga: Settings, with comma selection, uniform mutation, equal shares and no immigrants.
        rng: Drawn from as the planner does.
        mutant: An error to make: `no_selection`, `best_of_generation`, `half_scope`.
    """
    stage = begin(problem, 0, problem.start, problem.first_situation)
    scope = problem.scope * (0.5 if mutant == "half_scope" else 1.0)
    first = judge(stage, problem.start[:, None])
    parents, best, best_cost = [[problem.start]], [problem.start], float(first.rows[COST, 0])
    generations = [problem.start]
    evaluations = 1
    idle = 0
    for cycle in range(ga.num_generations):
        count = ga.num_offspring if cycle else ga.initial_size
        uniforms = rng.random((count, len(scope)))
        children = []
        for n in range(count):
            line = parents[n % len(parents)]
            child = np.clip(
                line[-1] + scope * (2.0 * uniforms[n] - 1.0),
                problem.limits[:, 0],
                problem.limits[:, 1],
            )
            children.append([*line, child])
        judged = judge(stage, np.array([line[-1] for line in children]).T)
        evaluations += count
        cost = [
            float(c) if ok else np.inf
            for c, ok in zip(judged.rows[COST], judged.feasible, strict=True)
        ]
        ranked = sorted((n for n in range(count) if cost[n] < np.inf), key=lambda n: (cost[n], n))
        generations.append(children[ranked[0]][-1])
        met = [n for n in ranked if judged.met[n]]
        idle = 0 if cost[ranked[0]] < best_cost else idle + 1
        if met or cost[ranked[0]] < best_cost:
            best = children[met[0] if met else ranked[0]]
            best_cost = min(best_cost, cost[ranked[0]])
        if met:
            return (generations if mutant == "best_of_generation" else best), evaluations, "goal"
        if idle >= ga.patience:
            return best, evaluations, "stagnation"
        chosen = range(ga.num_parents) if mutant == "no_selection" else ranked[: ga.num_parents]
        parents = [children[n] for n in chosen]
    return best, evaluations, "cap"
