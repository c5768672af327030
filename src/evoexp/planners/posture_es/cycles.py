"""The evolution strategy on postures, cycle by cycle, with the ancestry of everybody.

Corsépius 2001, section 4.2.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.elementary import standard_normal
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import COST, EQUAL, GAUSSIAN, NORMAL, ROWS, UNIFORM
from evoexp.planners.posture_es.settings import StrategySettings
from evoexp.records import FloatArray

ROOM = 256  # nodes of the ancestry that memory is first made for


class Ancestry:
    """Postures that became parents, and of each its own parent: enough to tell everybody's path.

    Attributes:
        count: How many there are.
    """

    def __init__(self, nq: int) -> None:
        self.postures, self.parents, self.count = (
            np.empty((ROOM, nq)),
            np.empty(ROOM, dtype=np.int64),
            0,
        )

    def add(self, postures: FloatArray, parents: Any) -> np.ndarray:
        """Append postures (n, nq) with the nodes of their parents (−1: none).

        Return their nodes.
        """
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


class Memory(NamedTuple):
    """Arrays that a cycle writes; see `kernels.advance`."""

    offspring: FloatArray
    origin: np.ndarray
    rows: FloatArray
    feasible: np.ndarray
    met: np.ndarray

    @classmethod
    def of(cls, nq: int, count: int) -> "Memory":
        """Return memory for `count` individuals."""
        flags = np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.bool_)
        return cls(
            np.empty((nq, count)), np.empty(count, dtype=np.int64), np.empty((ROWS, count)), *flags
        )


class Search:
    """One phase being searched.

    Attributes:
        memory: The individuals of the last cycle.
        best: Node of the best so far: the winner once there is one.
        best_row: (ROWS,) its terms and cost.
        least_cost: Least cost of any so far.
        cycles: Done so far.
        idle: Cycles since the last improvement.
        won: Whether somebody meets the goal.
    """

    def __init__(
        self,
        ga: StrategySettings,
        problem: Any,
        judging: tuple[Any, ...],
        substeps: int,
        ancestry: Ancestry,
        node: int,
    ) -> None:
        self.ga, self.judging, self.substeps, self.ancestry = ga, judging, substeps, ancestry
        nq, size = len(problem.scope), ga.num_parents
        self._nq, room = nq, max(size, 1)
        self._breeding = (
            problem.scope,
            problem.limits,
            GAUSSIAN if ga.mutation == "gaussian" else UNIFORM,
            ga.mutation_std,
            NORMAL if ga.parent_choice == "gaussian" else EQUAL,
            ga.parent_std,
            ga.crossover_rate,
        )
        self._parents, self._costs, self._nodes = (
            np.empty((nq, room)),
            np.empty(room),
            np.empty(room, dtype=np.int64),
        )
        self._num_parents = 1
        self._parents[:, 0], self._nodes[0] = ancestry.postures[node], node
        self.memory = Memory.of(nq, 1)
        self.memory.offspring[:, 0] = ancestry.postures[node]
        kernels.judge(self.memory.offspring, judging, *self.memory[2:])
        self.best, self.best_row = node, self.memory.rows[:, 0].copy()
        self._costs[0] = self.least_cost = float(self.best_row[COST])
        self.cycles = self.idle = 0
        self.won = bool(self.memory.met[0])

    def advance(self, rng: np.random.Generator) -> None:
        """Do one cycle."""
        ga, nq = self.ga, self._nq
        bred = ga.num_offspring if self.cycles else ga.initial_size
        count = bred + ga.num_immigrants
        if self.memory.offspring.shape[1] != count or not self.cycles:
            self.memory = Memory.of(nq, count)
        gaussian, normal = ga.mutation == "gaussian", ga.parent_choice == "gaussian"
        per_child = (0 if gaussian else nq) + (2 + nq if ga.crossover_rate > 0.0 else 0)
        uniforms = rng.random(bred * per_child + ga.num_immigrants * nq)
        deviates = bred * ((nq if gaussian else 0) + normal)
        normals = standard_normal(rng, deviates) if deviates else _NONE
        members = (self._parents, self._costs, self._num_parents)
        plus = ga.selection == "plus"
        chosen, winner = kernels.advance(
            uniforms,
            normals,
            bred,
            plus,
            self.substeps,
            self._breeding,
            self.judging,
            members,
            tuple(self.memory),
        )
        self.cycles += 1
        self._succeed(chosen, int(winner), count)

    def _succeed(self, chosen: np.ndarray, winner: int, count: int) -> None:
        """Take over what was selected, and note the best."""
        offspring, origin, rows, feasible, _ = self.memory
        old = self._nodes[: self._num_parents].copy()
        new = chosen[chosen < count]
        nodes = self.ancestry.add(offspring[:, new].T, old[origin[new]])
        costs = rows[COST]
        usable = np.where(feasible, costs, np.inf)
        self.least = int(np.argmin(usable))
        improved = usable[self.least] < self.least_cost
        if improved or winner >= 0:
            best = winner if winner >= 0 else self.least
            place = np.flatnonzero(new == best)
            self.best = (
                int(nodes[place[0]])
                if len(place)
                else int(self.ancestry.add(offspring[:, [best]].T, old[origin[[best]]])[0])
            )
            self.best_row = rows[:, best].copy()
            self.won = winner >= 0
        self.least_cost = min(self.least_cost, float(usable[self.least]))
        self.idle = 0 if improved else self.idle + 1
        if len(chosen):  # else nobody is feasible, and the parents stay
            staying = chosen >= count
            parents = self._parents[:, np.where(staying, chosen - count, 0)]
            parents[:, ~staying] = offspring[:, new]
            kept = self._costs[np.where(staying, chosen - count, 0)]
            kept[~staying] = costs[new]
            own = old[np.where(staying, chosen - count, 0)]
            own[~staying] = nodes
            size = self._num_parents = len(chosen)
            self._parents[:, :size], self._costs[:size], self._nodes[:size] = parents, kept, own

    @property
    def stop_reason(self) -> str:
        """Why the search of this phase ends; nothing while it goes on."""
        if self.won:
            return "goal"
        if self.idle >= self.ga.patience:
            return "stagnation"
        return "cap" if self.cycles >= self.ga.num_generations else ""


_NONE = np.empty(0)
