"""The evolution strategy on postures, cycle by cycle (Corsépius 2001, section 4.2)."""

from collections.abc import Callable
from typing import Any

import numpy as np

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
from evoexp.planners.posture_es.settings import StrategySettings
from evoexp.records import FloatArray, IntArray

ROOM = 256  # nodes of the ancestry that memory is first made for


class Ancestry:
    """Postures that became parents, and of each its own parent: the paths of all individuals.

    Attributes:
        count: Number of postures.
    """

    def __init__(self, nq: int) -> None:
        self.postures, self.parents = np.empty((ROOM, nq)), np.empty(ROOM, dtype=np.int64)
        self.count = 0

    def add(self, postures: FloatArray, parents: Any) -> IntArray:
        """Append postures (n, nq) with their parents' nodes (−1: none); return their nodes."""
        stop = self.count + len(postures)
        while stop > len(self.parents):
            self.postures = np.concatenate([self.postures, np.empty_like(self.postures)])
            self.parents = np.concatenate([self.parents, np.empty_like(self.parents)])
        nodes = np.arange(self.count, stop)
        self.postures[nodes], self.parents[nodes] = postures, parents
        self.count = stop
        return nodes

    def path(self, node: int) -> FloatArray:
        """Return the postures from the first ancestor to a node, (postures, nq)."""
        line = [node]
        while self.parents[line[-1]] >= 0:
            line.append(int(self.parents[line[-1]]))
        return np.asarray(self.postures[line[::-1]])


class Search:
    """One phase being searched.

    Attributes:
        memory: The individuals of the last cycle.
        best: Node of the best so far: the winner once there is one.
        best_row: (ROWS,) its terms and cost.
        least_cost: Least cost of any so far.
        cycles: Cycles so far.
        idle: Cycles since the last improvement.
        won: Whether somebody meets the goal.
    """

    def __init__(
        self,
        ga: StrategySettings,
        problem: Any,
        stage: Any,
        edge_check: int,
        ancestry: Ancestry,
        node: int,
        accepts: Callable[[FloatArray, FloatArray], bool] | None = None,
    ) -> None:
        """Begin a phase.

        Args:
            ga: Settings.
            problem: The prepared task.
            stage: The phase.
            edge_check: As in `kernels.Strategy`.
            ancestry: Of all phases.
            node: Where the phase begins.
            accepts: Whether a parent (nq,) may have a child (nq,); None: any.
        """
        self._accepts = accepts
        self.ga, self.judging, self.ancestry = ga, stage.judging, ancestry
        self._nq, room = len(problem.scope), ga.num_parents
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
        self._members = Members(np.empty((self._nq, room)), np.empty(room), 1)
        self._nodes = np.full(room, node)
        # the posture that the phase begins with is judged, and is the first parent
        self.memory = Memory.of(self._nq, 1)
        self.memory.offspring[:, 0] = self._members.postures[:, 0] = ancestry.postures[node]
        kernels.judge(self.memory.offspring, self.judging, *self.memory[2:])
        self.best, self.best_row = node, self.memory.rows[:, 0].copy()
        self._members.costs[0] = self.least_cost = float(self.best_row[COST])
        self.cycles = self.idle = 0
        self.won = bool(self.memory.met[0])

    def advance(self, rng: np.random.Generator) -> None:
        """Do one cycle."""
        ga, nq = self.ga, self._nq
        bred = ga.num_offspring if self.cycles else ga.initial_size
        count = bred + ga.num_immigrants
        if self.memory.offspring.shape[1] != count or not self.cycles:
            self.memory = Memory.of(nq, count)
        # random numbers
        gaussian, normal = ga.mutation == "gaussian", ga.parent_choice == "gaussian"
        per_child = (0 if gaussian else nq) + (2 + nq if ga.crossover_rate > 0.0 else 0)
        uniforms = rng.random(bred * per_child + ga.num_immigrants * nq)
        deviates = bred * ((nq if gaussian else 0) + normal)
        normals = standard_normal(rng, deviates) if deviates else _NONE
        # the cycle
        chosen, winner = kernels.advance(
            uniforms, normals, bred, self._strategy, self.judging, self._members, self.memory
        )
        if self._accepts is not None:
            chosen, winner = self._accepted(chosen, int(winner), self._accepts)
        self.cycles += 1
        origins = self._nodes[self.memory.origin]
        self._take_best(int(winner), self._take_parents(chosen, count, origins), origins)

    def _accepted(
        self, chosen: IntArray, winner: int, accepts: Callable[[FloatArray, FloatArray], bool]
    ) -> tuple[IntArray, int]:
        """Select again until everybody selected is accepted; who is refused is not feasible."""
        offspring, origin = self.memory.offspring, self.memory.origin
        known: set[int] = set()
        while True:
            count = offspring.shape[1]
            asked = {n for n in (*chosen.tolist(), winner) if 0 <= n < count} - known
            known |= asked
            parents = self._members.postures
            refused = [n for n in asked if not accepts(parents[:, origin[n]], offspring[:, n])]
            if not refused:
                return chosen, winner
            self.memory.feasible[refused] = False
            chosen, winner = kernels.select(self._strategy, self._members, self.memory)

    def _take_parents(self, chosen: IntArray, count: int, origins: IntArray) -> dict[int, int]:
        """Take over the selected parents of a cycle of `count` offspring.

        Returns:
            The nodes of new parents by their places among the offspring.
        """
        offspring, costs_of = self.memory.offspring, self.memory.rows[COST]
        postures, costs, _ = self._members
        new = chosen[chosen < count]
        nodes = self.ancestry.add(offspring[:, new].T, origins[new])
        if len(chosen):  # else nobody is feasible, and the parents stay
            size, is_new, place = len(chosen), chosen < count, np.maximum(chosen - count, 0)
            kept = postures[:, place], costs[place], self._nodes[place]
            kept[0][:, is_new], kept[1][is_new] = offspring[:, new], costs_of[new]
            kept[2][is_new] = nodes
            postures[:, :size], costs[:size], self._nodes[:size] = kept
            self._members = self._members._replace(size=size)
        return dict(zip(new.tolist(), nodes.tolist(), strict=True))

    def _take_best(self, winner: int, nodes: dict[int, int], origins: IntArray) -> None:
        """Take over the winner, or else the best individual if it is an improvement."""
        rows = self.memory.rows
        usable = np.where(self.memory.feasible, rows[COST], np.inf)
        least = int(np.argmin(usable))
        improved = usable[least] < self.least_cost
        if improved or winner >= 0:
            best = winner if winner >= 0 else least
            if best not in nodes:  # it is no parent
                posture = self.memory.offspring[:, [best]].T
                nodes[best] = int(self.ancestry.add(posture, origins[[best]])[0])
            self.best, self.best_row, self.won = nodes[best], rows[:, best].copy(), winner >= 0
        self.least_cost = min(self.least_cost, float(usable[least]))
        self.idle = 0 if improved else self.idle + 1

    @property
    def stop_reason(self) -> str:
        """The reason for which the phase ends; nothing while it goes on."""
        if self.won:
            return "goal"
        if self.idle >= self.ga.patience:
            return "stagnation"
        return "cap" if self.cycles >= self.ga.num_generations else ""


_NONE = np.empty(0)
