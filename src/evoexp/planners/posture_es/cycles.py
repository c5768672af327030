"""The evolution strategy on postures, cycle by cycle (Corsépius 2001, section 4.2)."""

from collections.abc import Callable
from typing import Any

import numpy as np

from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.numeric.pcg64 import Twin, fill_normals, fill_uniforms
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import (
    COST,
    EQUAL,
    GAUSSIAN,
    NORMAL,
    ROWS,
    UNIFORM,
    Members,
    Memory,
    Strategy,
)
from evoexp.planners.posture_es.phase_kernels import (
    Cycles,
    Nodes,
    Parents,
    Scratch,
    line_of,
    run_cycles,
    settle,
)
from evoexp.planners.posture_es.settings import StrategySettings
from evoexp.records import FloatArray, IntArray

ROOM = 256  # nodes of the ancestry that memory is first made for
STRETCH = 8  # cycles per call, at most,
MEMORY = 2**20  # [B] whose offspring and terms should not take more than this


class Ancestry:
    """Postures that became parents, and of each its own parent: the paths of all individuals.

    Attributes:
        nodes: As the kernels append to them.
    """

    def __init__(self, start: FloatArray) -> None:
        """Begin with the start (nq,) as node 0."""
        self.nodes = Nodes(
            np.empty((ROOM, len(start))), np.empty(ROOM, dtype=np.int64), np.ones(1, dtype=np.int64)
        )
        self.nodes.postures[0], self.nodes.parents[0] = start, -1

    def make_room(self, num: int) -> None:
        """Make room for more nodes."""
        postures, parents, count = self.nodes
        while count[0] + num > len(parents):
            postures = np.concatenate([postures, np.empty_like(postures)])
            parents = np.concatenate([parents, np.empty_like(parents)])
        self.nodes = Nodes(postures, parents, count)

    def posture(self, node: int) -> FloatArray:
        """Return the posture of a node, (nq,)."""
        return np.asarray(self.nodes.postures[node])

    def path(self, node: int) -> FloatArray:
        """Return the postures from the first ancestor to a node, (postures, nq)."""
        return line_of(self.nodes.postures, self.nodes.parents, node)


class Search:
    """One phase being searched; several cycles are done per call, and shown one after the other.

    Attributes:
        offspring: (nq, individuals) of the last cycle, a copy: one array for all of a size [rad].
        costs: (individuals,) of the last cycle; a view.
        summary: Least cost of any so far; lowest of the cycle, feasible or not; mean and deviation
            of the feasible.
        num_feasible: Feasible individuals of the cycle.
        best: Node of the best so far: the winner once there is one.
        best_row: (ROWS,) its terms and cost; a view.
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
        twin: Twin,
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
            twin: Of the generator, the source of all random numbers.
            accepts: Whether a parent (nq,) may have a child (nq,); None: any.
        """
        self._accepts, self._twin = accepts, twin
        self.ga, self._judging, self.ancestry = ga, stage.judging, ancestry
        nq, room = len(problem.scope), ga.num_parents
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
        self._parents = Parents(
            np.empty((nq, room)),
            np.empty(room),
            np.full(room, node),
            np.ones(1, dtype=np.int64),
        )
        # the posture that the phase begins with is judged, and is the first parent
        self._done, memory = Cycles.of(nq, 1, 1), Memory.of(nq, 1)
        self.offspring = ancestry.posture(node)[:, None].copy()
        self._parents.postures[:, 0] = self.offspring[:, 0]
        kernels.judge(self.offspring, self._judging, *memory[2:])
        costs, feasible = memory.rows[COST], memory.feasible
        usable = cost_statistics(np.where(feasible, costs, np.inf))
        self._parents.costs[0] = costs[0]
        self._done.rows[0], self._done.best_rows[0] = memory.rows, memory.rows[:, 0]
        self._done.counts[0] = node, 0, memory.met[0], feasible[0]
        self._done.costs[0] = costs[0], costs[0], usable.mean, usable.std
        self._known = self.cycles = 0
        self._show(0)

    def advance(self) -> None:
        """Go on to the next cycle."""
        if self.cycles == self._known:
            self._known = self._go_on()
        self.cycles += 1
        place = self.cycles % len(self._done.counts)
        self._twin.follow(self._done.states[place])
        np.copyto(self.offspring, self._done.offspring[place])
        self._show(place)

    def _show(self, place: int) -> None:
        """Show a cycle that is done."""
        done = self._done
        self.costs, self.best_row = done.rows[place, COST], done.best_rows[place]
        self.summary: list[float] = done.costs[place].tolist()
        self.best, self.idle, won, self.num_feasible = done.counts[place].tolist()
        self.won = won > 0

    def _go_on(self) -> int:
        """Do the next cycles; return the last one that was done."""
        ga, first = self.ga, self.cycles
        bred = ga.num_offspring if first else ga.initial_size
        room = 8 * (len(self.offspring) + ROWS) * (bred + ga.num_immigrants)
        stretch = max(1, min(STRETCH, MEMORY // room))
        if self._accepts is not None or (first == 0 and ga.initial_size != ga.num_offspring):
            stretch = 1
        if first == 0 or self.offspring.shape[1] != bred + ga.num_immigrants:
            self._enter(bred, min(stretch, ga.num_generations - first) + 1)
        last = min(first + min(stretch, len(self._done.counts) - 1), ga.num_generations)
        self.ancestry.make_room((last - first) * (ga.num_parents + 1))
        self._twin.meet()
        if self._accepts is not None:
            self._do_one(bred, self._accepts)
            return last
        arrays = self._parents, self.ancestry.nodes, self._done, self._scratch
        limits, words = (first, last, bred, ga.patience), self._twin.words
        return run_cycles(words, *limits, self._strategy, self._judging, *arrays)

    def _enter(self, bred: int, num_places: int) -> None:
        """Take memory for cycles of another size, and the present cycle's records along."""
        ga, nq, before = self.ga, len(self.offspring), self._done
        count = bred + ga.num_immigrants
        self._done, self.offspring = Cycles.of(nq, count, num_places), np.empty((nq, count))
        own, other = self.cycles % num_places, self.cycles % len(before.counts)
        self._done.counts[own], self._done.costs[own] = before.counts[other], before.costs[other]
        self._done.best_rows[own] = before.best_rows[other]
        gaussian, normal = ga.mutation == "gaussian", ga.parent_choice == "gaussian"
        per_child = (0 if gaussian else nq) + (2 + nq if ga.crossover_rate > 0.0 else 0)
        self._scratch = Scratch(
            np.empty(bred * per_child + ga.num_immigrants * nq),
            np.empty(bred * ((nq if gaussian else 0) + normal)),
            np.empty(count, dtype=np.int64),
            np.empty(count, dtype=np.bool_),
        )

    def _do_one(self, bred: int, accepts: Callable[[FloatArray, FloatArray], bool]) -> None:
        """Do one cycle whose parents must be accepted."""
        done, (uniforms, normals, origin, met) = self._done, self._scratch
        place, words = (self.cycles + 1) % len(done.counts), self._twin.words
        fill_uniforms(words, uniforms)
        fill_normals(words, normals)
        memory = Memory(done.offspring[place], origin, done.rows[place], done.feasible[place], met)
        postures, costs, _, size = self._parents
        members = Members(postures, costs, int(size[0]))
        chosen, winner = kernels.advance(
            uniforms, normals, bred, self._strategy, self._judging, members, memory
        )
        chosen, winner = self._accepted(chosen, int(winner), members, memory, accepts)
        arrays = self._parents, self.ancestry.nodes, done
        settle(chosen, winner, self.cycles, memory, *arrays)
        done.states[place] = words[:2]

    def _accepted(
        self,
        chosen: IntArray,
        winner: int,
        members: Members,
        memory: Memory,
        accepts: Callable[[FloatArray, FloatArray], bool],
    ) -> tuple[IntArray, int]:
        """Select again until everybody selected is accepted; who is refused is not feasible."""
        offspring, origin, parents = memory.offspring, memory.origin, members.postures
        known: set[int] = set()
        while True:
            count = offspring.shape[1]
            asked = {n for n in (*chosen.tolist(), winner) if 0 <= n < count} - known
            known |= asked
            refused = [n for n in asked if not accepts(parents[:, origin[n]], offspring[:, n])]
            if not refused:
                return chosen, int(winner)
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
