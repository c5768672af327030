"""Cycles of a phase in one call, compiled: the next parents, the best so far, the ancestry.

A cycle's individuals are in `kernels.Memory`; here several of them follow each other, one place of
the arrays for each. Postures that become parents, or the best, are nodes of the ancestry.
"""

from typing import NamedTuple

import numpy as np

from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.pcg64 import Words, fill_normals, fill_uniforms
from evoexp.planners.posture_es.kernels import (
    COST,
    ROWS,
    Judging,
    Members,
    Memory,
    Strategy,
    advance,
)
from evoexp.records import BoolArray, FloatArray, IntArray

BEST, IDLE, WON, NUM_FEASIBLE = range(4)  # columns of `Cycles.counts`
LEAST, LOWEST, MEAN, STD = range(4)  # columns of `Cycles.costs`


class Parents(NamedTuple):
    """The parents of the next cycle, the best first."""

    postures: FloatArray  # (nq, μ) [rad]
    costs: FloatArray  # (μ,)
    nodes: IntArray  # (μ,) of the ancestry
    size: IntArray  # (1,) how many there are


class Nodes(NamedTuple):
    """The ancestry as kernels write it; there must be room for the nodes of all cycles."""

    postures: FloatArray  # (≥ nodes, nq) [rad]
    parents: IntArray  # (≥ nodes,) node of each one's parent; −1: none
    num: IntArray  # (1,) number of nodes


class Cycles(NamedTuple):
    """Some cycles; number c is at place c modulo the number of places."""

    offspring: FloatArray  # (places, nq, offspring) [rad]
    rows: FloatArray  # (places, ROWS, offspring) terms and cost
    feasible: BoolArray  # (places, offspring)
    # (places, 4) node of the best so far, cycles since the last improvement, whether somebody meets
    # the goal, number of feasible offspring
    counts: IntArray
    # (places, 4) least cost of any so far; lowest of the cycle, feasible or not; mean and deviation
    # of the feasible
    costs: FloatArray
    best_rows: FloatArray  # (places, ROWS) terms and cost of the best so far
    states: Words  # (places, 2) of the random generator behind each: high and low half

    @classmethod
    def of(cls, nq: int, count: int, num_places: int) -> "Cycles":
        """Return memory for cycles of `count` individuals."""
        return cls(
            np.empty((num_places, nq, count)),
            np.empty((num_places, ROWS, count)),
            np.empty((num_places, count), dtype=np.bool_),
            np.empty((num_places, 4), dtype=np.int64),
            np.empty((num_places, 4)),
            np.empty((num_places, ROWS)),
            np.empty((num_places, 2), dtype=np.uint64),
        )


class Scratch(NamedTuple):
    """Arrays that a cycle writes on its way."""

    uniforms: FloatArray  # uniform numbers of a cycle
    normals: FloatArray  # normal deviates of a cycle
    origin: IntArray  # (offspring,) index of each child's parent
    met: BoolArray  # (offspring,) whether each meets the goal


@kernel
def run_cycles(
    words: Words,
    first: int,
    last: int,
    num_bred: int,
    patience: int,
    strategy: Strategy,
    judging: Judging,
    parents: Parents,
    nodes: Nodes,
    cycles: Cycles,
    scratch: Scratch,
) -> int:
    """Do the cycles behind one up to another, or up to the one with which the phase ends.

    Args:
        words: The random generator, see `numeric.pcg64`.
        first: The present cycle.
        last: The last one.
        num_bred: Children of parents; the rest of the offspring are immigrants.
        patience: Cycles without improvement that end a phase.
        strategy: See `Strategy`.
        judging: See `Judging`.
        parents: See `Parents`; changed.
        nodes: See `Nodes`; changed.
        cycles: See `Cycles`; written.
        scratch: See `Scratch`; written.

    Returns:
        The last cycle that was done.
    """
    places = len(cycles.counts)
    for cycle in range(first, last):
        place = (cycle + 1) % places
        memory = Memory(
            cycles.offspring[place],
            scratch.origin,
            cycles.rows[place],
            cycles.feasible[place],
            scratch.met,
        )
        fill_uniforms(words, scratch.uniforms)
        fill_normals(words, scratch.normals)
        members = Members(parents.postures, parents.costs, parents.size[0])
        chosen, winner = advance(
            scratch.uniforms, scratch.normals, num_bred, strategy, judging, members, memory
        )
        settle(chosen, winner, cycle, memory, parents, nodes, cycles)
        cycles.states[place, 0], cycles.states[place, 1] = words[0], words[1]
        if cycles.counts[place, WON] or cycles.counts[place, IDLE] >= patience:
            return cycle + 1
    return last


@kernel
def settle(
    chosen: IntArray,
    winner: int,
    cycle: int,
    memory: Memory,
    parents: Parents,
    nodes: Nodes,
    cycles: Cycles,
) -> None:
    """Take over the selected parents, and the winner or else the best if it is an improvement.

    Args:
        chosen: Of `select`: below n offspring, from n on parents.
        winner: Index of the offspring that meets the goal at the least cost; −1: nobody does.
        cycle: The one before.
        memory: Offspring of the cycle.
        parents: Changed.
        nodes: New parents, and a new best, are appended.
        cycles: Written: best so far and statistics.
    """
    places = len(cycles.counts)
    before, place, count = cycle % places, (cycle + 1) % places, memory.offspring.shape[1]
    costs, feasible = memory.rows[COST], memory.feasible
    # the least cost of the feasible, and statistics
    usable, least, num_feasible, lowest = np.empty(count), 0, 0, costs[0]
    for n in range(count):
        usable[n] = costs[n] if feasible[n] else np.inf
        num_feasible += feasible[n]
        least = n if usable[n] < usable[least] else least
        lowest = min(lowest, costs[n])
    _, mean, std = cost_statistics(usable)
    improved = usable[least] < cycles.costs[before, LEAST]
    # the best so far, whose node is appended behind those of the parents
    best, origin = winner if winner >= 0 else least, -1
    renewed = improved or winner >= 0
    if renewed:
        origin = parents.nodes[memory.origin[best]]
    node = _take_parents(chosen, best, memory, parents, nodes)
    if renewed and node < 0:  # it is no parent
        node = _append(memory.offspring, best, origin, nodes)
    # records
    counts, own = cycles.counts[place], cycles.costs[place]
    counts[BEST] = node if renewed else cycles.counts[before, BEST]
    counts[IDLE] = 0 if improved else cycles.counts[before, IDLE] + 1
    counts[WON], counts[NUM_FEASIBLE] = winner >= 0, num_feasible
    own[LEAST] = min(cycles.costs[before, LEAST], usable[least])
    own[LOWEST], own[MEAN], own[STD] = lowest, mean, std
    for row in range(ROWS):
        given = memory.rows[row, best] if renewed else cycles.best_rows[before, row]
        cycles.best_rows[place, row] = given


@kernel
def _take_parents(
    chosen: IntArray, best: int, memory: Memory, parents: Parents, nodes: Nodes
) -> int:
    """Take over the selected parents; return the node of offspring `best`, −1 if it is none."""
    offspring, count, size, found = memory.offspring, memory.offspring.shape[1], len(chosen), -1
    if size == 0:  # nobody is feasible, and the parents stay
        return found
    postures, costs, old = parents.postures.copy(), parents.costs.copy(), parents.nodes.copy()
    for place in range(size):
        n = chosen[place]
        if n < count:
            parents.nodes[place] = _append(offspring, n, old[memory.origin[n]], nodes)
            found = parents.nodes[place] if n == best else found
            parents.costs[place] = memory.rows[COST, n]
            for k in range(len(offspring)):
                parents.postures[k, place] = offspring[k, n]
        else:
            parents.nodes[place], parents.costs[place] = old[n - count], costs[n - count]
            for k in range(len(offspring)):
                parents.postures[k, place] = postures[k, n - count]
    parents.size[0] = size
    return found


@kernel
def _append(offspring: FloatArray, n: int, origin: int, nodes: Nodes) -> int:
    """Append offspring n to the ancestry; return its node."""
    node = nodes.num[0]
    for k in range(len(offspring)):
        nodes.postures[node, k] = offspring[k, n]
    nodes.parents[node] = origin
    nodes.num[0] = node + 1
    return int(node)


@kernel
def line_of(postures: FloatArray, parents: IntArray, node: int) -> FloatArray:
    """Return the postures from the first ancestor to a node, (postures, nq)."""
    postures, parents = borrowed((postures, parents))
    num, at = 0, node
    while at >= 0:
        num, at = num + 1, parents[at]
    line, at = np.empty((num, postures.shape[1])), node
    for place in range(num - 1, -1, -1):
        for k in range(postures.shape[1]):
            line[place, k] = postures[at, k]
        at = parents[at]
    return line


@kernel
def rate_steps(postures: FloatArray, scope: FloatArray, oversized: float) -> tuple[float, int]:
    """Return the longest step of a path in units of the scope, and how many are oversized.

    Args:
        postures: (postures, nq) [rad].
        scope: (nq,) [rad].
        oversized: Steps longer than this count, in units of the scope.
    """
    longest, count = 0.0, 0
    for n in range(1, len(postures)):
        step = 0.0
        for k in range(len(scope)):
            step = max(step, abs(postures[n, k] - postures[n - 1, k]) / scope[k])
        longest, count = max(longest, step), count + (step > oversized)
    return longest, count
