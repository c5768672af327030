"""The evolution strategy on postures, cycle by cycle (Corsépius 2001, section 4.2)."""

from collections.abc import Callable

import numpy as np

from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.numeric.elementary import standard_normal
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import (
    COST,
    EQUAL,
    GAUSSIAN,
    NORMAL,
    UNIFORM,
    Members,
    Memory,
    Strategy,
)
from evoexp.planners.posture_es.phases import Problem, Stage
from evoexp.planners.posture_es.settings import StrategySettings
from evoexp.records import FloatArray, IntArray


class Ancestry:
    """Postures that became parents, and of each its own parent: the paths of all individuals."""

    def __init__(self, start: FloatArray) -> None:
        """Begin with the start (nq,) as node 0."""
        self._postures, self._parents = [start], [-1]

    def append(self, posture: FloatArray, parent: int) -> int:
        """Append the child (nq,) of a node; return its own node."""
        self._postures.append(posture)
        self._parents.append(parent)
        return len(self._parents) - 1

    def posture(self, node: int) -> FloatArray:
        """Return the posture of a node, (nq,)."""
        return self._postures[node]

    def path(self, node: int) -> FloatArray:
        """Return the postures from the first ancestor to a node, (postures, nq)."""
        line = []
        while node >= 0:
            line.append(self._postures[node])
            node = self._parents[node]
        return np.array(line[::-1])


class Search:
    """One phase being searched."""

    def __init__(
        self,
        ga: StrategySettings,
        problem: Problem,  # the prepared task
        stage: Stage,
        edge_check: int,  # as in `kernels.Strategy`
        ancestry: Ancestry,  # of all phases
        node: int,  # where the phase begins
        # whether a parent (nq,) may have a child (nq,); None: any
        accepts: Callable[[FloatArray, FloatArray], bool] | None = None,
    ) -> None:
        """Begin a phase."""
        self.ga, self._judging, self.ancestry, self._accepts = ga, stage.judging, ancestry, accepts
        self._strategy = Strategy(
            problem.scope * stage.phase.scope_share,
            problem.limits,
            GAUSSIAN if ga.mutation == "gaussian" else UNIFORM,
            ga.mutation_std,
            NORMAL if ga.parent_choice == "gaussian" else EQUAL,
            ga.parent_std,
            ga.crossover_rate,
            ga.selection == "plus",
            edge_check,
        )
        # the posture that the phase begins with is judged, and is the first parent
        self.offspring = ancestry.posture(node)[:, None].copy()  # (nq, individuals) of a cycle
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
        born = {n: self.ancestry.append(offspring[:, n].copy(), nodes[origin[n]]) for n in new}
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
