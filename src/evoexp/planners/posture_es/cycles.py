"""The evolution strategy on postures, cycle by cycle (Corsépius 2001, section 4.2)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

import numpy as np

from evoexp.collision.certifier.certificate import is_proven
from evoexp.collision.scene import Part
from evoexp.numeric.elementary import standard_normal
from evoexp.objectives.posture_cost import COLUMNS
from evoexp.paths.motion import Motion
from evoexp.planners.planner import Candidate, Keeper
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import COST, ROWS, Members, Memory, Strategy
from evoexp.planners.posture_es.phases import Problem, Stage
from evoexp.records import Block, FloatArray, IntArray
from evoexp.validation import Component, Count, NonNegativeCount, Positive, Rate

if TYPE_CHECKING:
    from evoexp.planners.posture_es.planner import PostureEs

OVERSIZED = 1.0 + 1e-9  # steps beyond the scope by more than rounding


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

    def _check(self) -> None:
        fits = self.num_parents <= self.num_offspring + self.num_immigrants
        must = f"at most num_offspring ({self.num_offspring}) with comma selection"
        self.demand("num_parents", fits or self.selection == "plus", must)

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
    """One run: phase after phase, each from the posture that ended the phase before."""

    def __init__(self, planner: "PostureEs", problem: Problem) -> None:
        """Begin with the start as the best so far."""
        self._planner, self._problem, self._ga = planner, problem, planner.ga
        self._keeper, self._chosen = Keeper(), planner.chosen
        self._num_cycles = 0  # of all phases
        self._take(Node(problem.start))

    def blocks(self, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the start and then every cycle, phase by phase; their indices go on counting."""
        problem, situation = self._problem, self._problem.first_situation
        for number in range(len(problem.phases)):
            stage = problem.begin(number, self._best.posture, situation)
            self._begin(stage)
            yield self._record()
            while not self._stop_reason:
                self._advance(rng)
                yield self._record()
            if not self._won:
                return
            situation = problem.finish(stage, self._best.posture)

    def _take(self, node: Node) -> None:
        """Take a node as the best so far: a phase's winner once there is one."""
        postures = node.path()
        self._best, self._solution = node, postures.ravel()
        self._path_terms = path_terms(postures, self._problem.scope)

    def _begin(self, stage: Stage) -> None:
        """Begin a phase: the posture that it begins with is judged, and is the first parent."""
        ga, problem, self._stage = self._ga, self._problem, stage
        self._strategy = Strategy(
            problem.scope * stage.phase.scope_share,
            problem.limits,
            ga.mutation == "gaussian",
            ga.mutation_std,
            ga.parent_choice == "gaussian",
            ga.parent_std,
            ga.crossover_rate,
            ga.selection == "plus",
            self._planner.edge_check,
        )
        self._offspring = self._best.posture[:, None].copy()  # (nq, individuals) of a cycle
        judged = stage.judge(self._offspring)
        costs = np.full(ga.num_parents, judged.cost[0])
        self._members = Members(np.repeat(self._offspring, ga.num_parents, axis=1), costs, 1)
        self._nodes = [self._best]  # of the parents
        # costs (individuals,) of the last cycle, and of those that may be selected
        self._costs, self._usable = judged.cost, np.where(judged.feasible, judged.cost, np.inf)
        # terms and cost (ROWS,) of the best so far; least cost of any feasible individual so far
        self._best_row, self._least = judged.rows[:, 0], float(judged.cost[0])
        # cycles so far, and since the last improvement; whether somebody meets the goal
        self._cycles, self._idle, self._won = 0, 0, bool(judged.met[0])

    def _advance(self, rng: np.random.Generator) -> None:
        ga, nq, members = self._ga, len(self._offspring), self._members
        bred = ga.num_offspring if self._cycles else ga.initial_size
        count = bred + ga.num_immigrants
        if self._cycles == 0 or self._offspring.shape[1] != count:
            self._offspring, origin = np.empty((nq, count)), np.empty(count, dtype=np.int64)
            rows, flags = np.empty((ROWS, count)), np.empty((2, count), dtype=np.bool_)
            self._memory = Memory(self._offspring, origin, rows, *flags)
        # all uniform numbers of the cycle are drawn first, then all normal ones
        gaussian, normal = ga.mutation == "gaussian", ga.parent_choice == "gaussian"
        per_child = (0 if gaussian else nq) + (2 + nq if ga.crossover_rate > 0.0 else 0)
        uniforms = rng.random(bred * per_child + ga.num_immigrants * nq)
        normals = standard_normal(rng, bred * ((nq if gaussian else 0) + normal))
        judging, memory = self._stage.judging, self._memory
        chosen, winner = kernels.advance(
            uniforms, normals, bred, self._strategy, judging, members, memory
        )
        if self._planner.answers_are_proven:
            chosen, winner = self._proven(chosen, winner)
        self._cycles += 1
        self._num_cycles += 1
        self._settle(chosen, winner)

    def _settle(self, chosen: IntArray, winner: int) -> None:
        """Take over the parents that `kernels.select` chose, and the winner, or a better best."""
        memory, nodes, origin = self._memory, self._nodes, self._memory.origin
        offspring, count = memory.offspring, memory.offspring.shape[1]
        self._costs, self._won = memory.rows[COST].copy(), winner >= 0
        self._usable = np.where(memory.feasible, self._costs, np.inf)
        # nodes of new parents and of the best; without a feasible offspring all parents stay
        least = int(np.argmin(self._usable))
        improved = bool(self._usable[least] < self._least)
        best, new = winner if winner >= 0 else least, set(chosen[chosen < count].tolist())
        new |= {best} if improved or winner >= 0 else set()
        born = {n: Node(offspring[:, n].copy(), nodes[origin[n]]) for n in new}
        if len(chosen):
            postures, costs, _ = self._members
            size = len(chosen)
            postures[:, :size] = np.hstack([offspring, postures])[:, chosen]
            costs[:size] = np.concatenate([self._costs, costs])[chosen]
            self._members = self._members._replace(size=size)
            self._nodes = [born[n] if n < count else nodes[n - count] for n in chosen.tolist()]
        # the best so far
        self._idle = 0 if improved else self._idle + 1
        self._least = min(self._least, float(self._usable[least]))
        if improved or winner >= 0:
            self._best_row = memory.rows[:, best].copy()
            self._take(born[best])

    def _proven(self, chosen: IntArray, winner: int) -> tuple[IntArray, int]:
        """Select again until the ways from the parents of all selected are proven.

        Who is refused is not feasible.
        """
        members, memory, planner = self._members, self._memory, self._planner
        parents, offspring, origin = members.postures, memory.offspring, memory.origin
        parts, known = (Part(self._problem.scene_of(self._stage), 0, 1),), set[int]()
        judged = planner.security_margin(self._problem), planner.acceptance == "margin"
        while True:
            asked = {n for n in (*chosen.tolist(), winner) if 0 <= n < len(origin)} - known
            known |= asked
            ways = {n: Motion(np.array([parents[:, origin[n]], offspring[:, n]])) for n in asked}
            refused = [n for n, way in ways.items() if not is_proven(parts, way, *judged)]
            if not refused:
                return chosen, winner
            memory.feasible[refused] = False
            chosen, winner = kernels.select(self._strategy, members, memory)

    @property
    def _stop_reason(self) -> str:
        if self._won:
            return "goal"
        if self._idle >= self._ga.patience:
            return "stagnation"
        return "cap" if self._cycles >= self._ga.num_generations else ""

    def _record(self) -> Block:
        """Return the record of the last cycle, or of the posture that a phase begins with."""
        phase, num_phases = self._stage.number + 1, len(self._problem.phases)
        last, reason = phase == num_phases, self._stop_reason
        counts = {"phase": float(phase), "cycles": float(self._num_cycles)}
        terms = named(self._best_row, self._chosen) | self._path_terms | counts
        terms["idle_cycles"] = float(self._idle)
        best = Candidate(self._solution, terms, self._won and last)
        self._keeper.keep(self._least if last else np.inf, best)
        costs, count = self._costs, self._offspring.shape[1]
        return self._keeper.record(
            self._usable,
            self._offspring,
            count * (1 + (self._planner.edge_check if self._cycles else 0)),
            evaluations=count,
            costs=costs[None, None] if num_phases > 1 else costs[None],
            lowest=[float(costs.min()) if last else np.inf],
            stop_reason=reason if last or reason != "goal" else "",
        )


def named(row: FloatArray, chosen: tuple[int, ...]) -> dict[str, float]:
    """Return some terms of a posture (ROWS,) by name, and its cost."""
    values = row.tolist()
    return {COLUMNS[k]: values[k] for k in chosen} | {"cost": values[COST]}


def path_terms(postures: FloatArray, scope: FloatArray) -> dict[str, float]:
    """Return the terms of a path (postures, nq): its steps in units of the scope."""
    steps = (np.abs(np.diff(postures, axis=0)) / scope).max(axis=1, initial=0.0)
    return {
        "postures": float(len(postures)),
        "longest_step_scopes": float(steps.max(initial=0.0)),
        "oversized_steps": float(np.count_nonzero(steps > OVERSIZED)),
    }
