"""The evolution strategy on postures, cycle by cycle (Corsépius 2001, section 4.2)."""

from collections.abc import Callable
from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import model_validator

from evoexp.evolution.succession import cost_statistics
from evoexp.numeric.elementary import standard_normal
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import COST, Members, Memory, Strategy
from evoexp.planners.posture_es.phases import Problem, Stage
from evoexp.records import FloatArray, IntArray
from evoexp.validation import Component, Count, NonNegativeCount, Positive, Rate


class StrategySettings(Component):
    """A (μ, λ) or (μ + λ) evolution strategy."""

    component: ClassVar[str] = "strategy"

    num_parents: Count  # μ: individuals selected for the next cycle
    num_offspring: Count  # λ: individuals generated per cycle
    initial_size: Count  # individuals generated in the first cycle, from the start alone
    # individuals added at random per cycle (Algorithm 1, the set Q)
    num_immigrants: NonNegativeCount
    num_generations: NonNegativeCount  # cycles per phase of a task, at most
    patience: Count  # cycles without improvement after which the search is given up
    # `comma`: the next parents are offspring; `plus`: parents may stay
    selection: Literal["comma", "plus"]
    # `uniform` in a box of ±scope around the parent; `gaussian` with the standard deviation
    # below
    mutation: Literal["uniform", "gaussian"]
    mutation_std: Positive  # of Gaussian mutation, in units of the scope [-]
    # `equal` shares for all parents, or `gaussian`: the better the rank the more offspring
    parent_choice: Literal["equal", "gaussian"]
    parent_std: Positive  # of Gaussian parent choice, in units of μ [-]
    crossover_rate: Rate  # probability that a child takes every joint from one of two parents

    @model_validator(mode="after")
    def _parents_fit(self) -> Self:
        fits = self.num_parents <= self.num_offspring + self.num_immigrants
        must = f"at most num_offspring ({self.num_offspring}) with comma selection"
        self.demand("num_parents", fits or self.selection == "plus", must)
        return self

    @property
    def population_size(self) -> int:
        """Individuals judged before the first cycle: the start."""
        return 1


class Node(NamedTuple):
    """A posture that became a parent, and its own parent: its line of ancestors is a path."""

    posture: FloatArray  # (nq,)
    parent: "Node | None" = None  # None: of the start

    def path(self) -> FloatArray:
        """Return the postures from the first ancestor on, (postures, nq)."""
        line: list[FloatArray] = []
        node: Node | None = self
        while node is not None:
            line.append(node.posture)
            node = node.parent
        return np.array(line[::-1])


class Search:
    """One phase being searched."""

    def __init__(
        self,
        ga: StrategySettings,
        problem: Problem,  # the prepared task
        stage: Stage,
        edge_check: int,  # as in `kernels.Strategy`
        node: Node,  # where the phase begins
        # whether a parent (nq,) may have a child (nq,); None: any
        accepts: Callable[[FloatArray, FloatArray], bool] | None = None,
    ) -> None:
        """Begin a phase."""
        self.ga, self._judging, self._accepts = ga, stage.judging, accepts
        self._strategy = Strategy(
            problem.scope * stage.phase.scope_share,
            problem.limits,
            ga.mutation == "gaussian",
            ga.mutation_std,
            ga.parent_choice == "gaussian",
            ga.parent_std,
            ga.crossover_rate,
            ga.selection == "plus",
            edge_check,
        )
        # the posture that the phase begins with is judged, and is the first parent
        self.offspring = node.posture[:, None].copy()  # (nq, individuals) of a cycle
        judged = stage.judge(self.offspring)
        costs = np.full(ga.num_parents, judged.cost[0])
        self._members = Members(np.repeat(self.offspring, ga.num_parents, axis=1), costs, 1)
        self._nodes = [node]  # of the parents
        self.costs = judged.cost  # (individuals,) of the last cycle
        # of the best so far, the winner once there is one: terms and cost (ROWS,), and node
        self.best_row, self.best = judged.rows[:, 0], node
        # least cost of any feasible individual so far; lowest of the cycle, feasible or not
        self.least = self.lowest = float(judged.cost[0])
        # cycles so far, and since the last improvement; whether somebody meets the goal
        self.cycles, self.idle, self.won = 0, 0, bool(judged.met[0])
        self._count(np.where(judged.feasible, judged.cost, np.inf))

    def advance(self, rng: np.random.Generator) -> None:
        """Go on to the next cycle."""
        ga, nq, members = self.ga, len(self.offspring), self._members
        bred = ga.num_offspring if self.cycles else ga.initial_size
        count = bred + ga.num_immigrants
        if self.cycles == 0 or self.offspring.shape[1] != count:
            self._memory = Memory.of(nq, count)
            self.offspring = self._memory.offspring
        # all uniform numbers of the cycle are drawn first, then all normal ones
        gaussian, normal = ga.mutation == "gaussian", ga.parent_choice == "gaussian"
        per_child = (0 if gaussian else nq) + (2 + nq if ga.crossover_rate > 0.0 else 0)
        uniforms = rng.random(bred * per_child + ga.num_immigrants * nq)
        normals = standard_normal(rng, bred * ((nq if gaussian else 0) + normal))
        chosen, winner = kernels.advance(
            uniforms, normals, bred, self._strategy, self._judging, members, self._memory
        )
        if self._accepts is not None:
            chosen, winner = self._accepted(chosen, winner, self._accepts)
        self.cycles += 1
        self._settle(chosen, winner)

    def _settle(self, chosen: IntArray, winner: int) -> None:
        """Take over the parents that `kernels.select` chose, and the winner, or a better best."""
        memory, nodes, origin = self._memory, self._nodes, self._memory.origin
        offspring, count = memory.offspring, memory.offspring.shape[1]
        self.costs, self.won = memory.rows[COST].copy(), winner >= 0
        usable = np.where(memory.feasible, self.costs, np.inf)
        self._count(usable)
        # nodes of new parents and of the best; without a feasible offspring all parents stay
        least = int(np.argmin(usable))
        improved = bool(usable[least] < self.least)
        best, new = winner if winner >= 0 else least, set(chosen[chosen < count].tolist())
        new |= {best} if improved or winner >= 0 else set()
        born = {n: Node(offspring[:, n].copy(), nodes[origin[n]]) for n in new}
        if len(chosen):
            postures, costs, _ = self._members
            size = len(chosen)
            postures[:, :size] = np.hstack([offspring, postures])[:, chosen]
            costs[:size] = np.concatenate([self.costs, costs])[chosen]
            self._members = self._members._replace(size=size)
            self._nodes = [born[n] if n < count else nodes[n - count] for n in chosen.tolist()]
        # records
        self.idle = 0 if improved else self.idle + 1
        self.least, self.lowest = min(self.least, float(usable[least])), float(self.costs.min())
        if improved or winner >= 0:
            self.best, self.best_row = born[best], memory.rows[:, best].copy()

    def _count(self, usable: FloatArray) -> None:
        """Count the individuals of finite cost (individuals,), and take mean and deviation."""
        _, self.mean, self.std = cost_statistics(usable)
        self.num_feasible = int(np.count_nonzero(np.isfinite(usable)))

    def _accepted(
        self, chosen: IntArray, winner: int, accepts: Callable[[FloatArray, FloatArray], bool]
    ) -> tuple[IntArray, int]:
        """Select again until everybody selected is accepted; who is refused is not feasible."""
        members, memory, offspring = self._members, self._memory, self.offspring
        parents, known, count = members.postures, set[int](), offspring.shape[1]
        while True:
            asked = {n for n in (*chosen.tolist(), winner) if 0 <= n < count} - known
            known |= asked
            origin = memory.origin
            refused = [n for n in asked if not accepts(parents[:, origin[n]], offspring[:, n])]
            if not refused:
                return chosen, winner
            memory.feasible[refused] = False
            chosen, winner = kernels.select(self._strategy, members, memory)

    @property
    def stop_reason(self) -> str:
        """The reason for which the phase ends; nothing while it goes on."""
        if self.won:
            return "goal"
        if self.idle >= self.ga.patience:
            return "stagnation"
        return "cap" if self.cycles >= self.ga.num_generations else ""
