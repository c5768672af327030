"""The evolution strategy on postures, slow and obvious: individuals are lists of postures.

Everybody remembers the whole line of ancestors, the start first. Postures are judged by the phase;
numbers are drawn as the planner does.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.elementary import standard_normal
from evoexp.planners.posture_es.kernels import COST
from evoexp.planners.posture_es.phases import Problem


class Cycle(NamedTuple):
    """One generation of a phase."""

    postures: Any  # (nq, individuals) as they were generated
    costs: Any  # (individuals,)
    feasible: Any  # (individuals,)
    best: list[Any]  # the line of the best so far
    best_cost: float  # least cost so far
    evaluations: int  # since the start
    reason: str  # why the phase ends here; nothing if it goes on


class _Numbers:
    """Numbers of one cycle: all uniform ones are drawn first, then all normal ones."""

    def __init__(self, rng: np.random.Generator, uniforms: int, normals: int) -> None:
        self._uniforms = iter(rng.random(uniforms))
        self._normals = iter(standard_normal(rng, normals) if normals else ())

    def uniforms(self, count: int) -> Any:
        return np.array([next(self._uniforms) for _ in range(count)])

    def normals(self, count: int) -> Any:
        return np.array([next(self._normals) for _ in range(count)])


def cycles(problem: Problem, planner: Any, rng: np.random.Generator) -> Iterator[Cycle]:
    """Yield all generations of all phases."""
    line, evaluations, situation = [problem.start], 0, problem.first_situation
    for index in range(len(problem.phases)):
        stage = problem.begin(index, line[-1], situation)
        for cycle in _phase(problem, planner, rng, stage, line, evaluations):
            yield cycle
        if cycle.reason != "goal":
            return
        line, evaluations = cycle.best, cycle.evaluations
        situation = problem.finish(stage, line[-1])


def _phase(
    problem: Problem, planner: Any, rng: np.random.Generator, stage: Any, line: list[Any],
    evaluations: int,
) -> Iterator[Cycle]:  # fmt: skip
    ga, nq = planner.ga, len(problem.scope)
    judged = stage.judge(line[-1][:, None])
    best, best_cost, idle, evaluations = line, float(judged.rows[COST, 0]), 0, evaluations + 1
    parents = [(best_cost, line)]
    reason = "goal" if judged.met[0] else "cap" if ga.num_generations == 0 else ""
    first = line[-1][:, None], judged.rows[COST], judged.feasible
    yield Cycle(*first, best, best_cost, evaluations, reason)
    for cycle in range(1, ga.num_generations + 1):
        if reason:
            return
        bred = ga.initial_size if cycle == 1 else ga.num_offspring
        per_child = 2 + nq if ga.crossover_rate > 0.0 else 0
        gaussian, ranked = ga.mutation == "gaussian", ga.parent_choice == "gaussian"
        numbers = _Numbers(
            rng,
            bred * (per_child + (0 if gaussian else nq)) + ga.num_immigrants * nq,
            bred * ((nq if gaussian else 0) + ranked),
        )
        scope = problem.scope * stage.phase.scope_share
        children = [_bred(problem, ga, numbers, parents, n, scope) for n in range(bred)]
        children += [_immigrant(problem, numbers, parents, scope) for _ in range(ga.num_immigrants)]
        postures = np.array([child[-1] for child in children]).T
        judged = stage.judge(postures)
        feasible = judged.feasible.copy()
        for k in range(planner.edge_check):  # between parent and child
            share = (k + 1.0) / (planner.edge_check + 1.0)
            between = [child[-2] + share * (child[-1] - child[-2]) for child in children]
            feasible &= stage.judge(np.array(between).T).feasible
        costs, evaluations = judged.rows[COST], evaluations + len(children)
        usable = [(float(costs[n]), n) for n in range(len(children)) if feasible[n]]
        met = [(cost, n) for cost, n in usable if judged.met[n]]
        idle = 0 if usable and min(usable)[0] < best_cost else idle + 1
        if met or idle == 0:
            best = children[min(met or usable)[1]]
        if idle == 0:
            best_cost = min(usable)[0]
        reason = "goal" if met else "stagnation" if idle >= ga.patience else ""
        reason = reason or ("cap" if cycle == ga.num_generations else "")
        yield Cycle(postures, costs, feasible, best, best_cost, evaluations, reason)
        members = [(cost, children[n]) for cost, n in usable]
        members += parents if ga.selection == "plus" else []
        members = sorted(members, key=lambda member: member[0])  # stable: the first among equals
        parents = members[: ga.num_parents] or parents


def _bred(
    problem: Problem, ga: Any, numbers: _Numbers, parents: list[Any], n: int, scope: Any,
) -> list[Any]:  # fmt: skip
    """Return a child of the n-th choice of a parent: perhaps crossed, then mutated."""
    nq, number = len(problem.scope), n % len(parents)
    if ga.parent_choice == "gaussian":
        drawn = abs(numbers.normals(1)[0]) * ga.parent_std * len(parents)
        number = min(int(drawn), len(parents) - 1)
    line = parents[number][1]
    child = line[-1].copy()
    if ga.crossover_rate > 0.0:
        (decision, place), taken = numbers.uniforms(2), numbers.uniforms(nq) < 0.5
        if decision < ga.crossover_rate:
            child = np.where(taken, parents[int(place * len(parents))][1][-1], child)
    gaussian = ga.mutation == "gaussian"
    step = ga.mutation_std * numbers.normals(nq) if gaussian else 2.0 * numbers.uniforms(nq) - 1.0
    child = np.clip(child + scope * step, *problem.limits.T)
    return [*(_nearest(parents, child, scope) if ga.crossover_rate > 0.0 else line), child]


def _immigrant(problem: Problem, numbers: _Numbers, parents: list[Any], scope: Any) -> list[Any]:
    """Return somebody from anywhere, as a child of the nearest parent."""
    low, high = problem.limits.T
    child = low + (high - low) * numbers.uniforms(len(low))
    return [*_nearest(parents, child, scope), child]


def _nearest(parents: list[Any], child: Any, scope: Any) -> list[Any]:
    steps = [float((np.abs(child - line[-1]) / scope).max()) for _, line in parents]
    line: list[Any] = parents[int(np.argmin(steps))][1]
    return line
