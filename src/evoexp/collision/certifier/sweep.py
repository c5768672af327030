"""The compiled part of the certifier: branch and bound over a whole motion and all pairs of bodies.

An interval of the motion is judged from its middle: if a pair is d apart there and cannot approach
faster than L, it stays d − L·(half the interval) apart. A better bound is taken across the plane
that separates the pair there: the gap if all points kept their velocities, less the change by
accelerations. Pairs for which no bound suffices go on to both halves, the left one first, so that
the first contact is found first. The search goes depth first and keeps the list of remaining pairs
of each level.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.certifier.convex_distance import CONVERGED
from evoexp.collision.certifier.task import (
    Task,
    Workspace,
    least_separation,
    move_to,
    pair_distance,
)
from evoexp.collision.motion_bounds import approach_bounds
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.records import FloatArray, IntArray

DEPTH = 64
"""Most halvings of a segment; they end earlier, at `NARROW`."""

NARROW = 1e-13  # [segments] an interval that is not halved any more

MAX_LEAVES = 100_000
"""Most leaves of a sweep; more count as a limit used up."""

ROUGH_DEPTH = 5  # halvings after which a body known only by its hull is left to coal


class Goal(NamedTuple):
    """The question that a sweep answers."""

    goal: FloatArray  # (pairs,) distances that are to be proven at least
    level: FloatArray  # (pairs,) the first instant is wanted at which a distance is at or below it
    slack: FloatArray  # (pairs,) below it differences of distances do not count
    known: float  # an upper bound of the least distance that is known already; inf if none
    # the least distance is proven up to this part of it; inf: only `goal` is proven
    resolution: float
    floor: float  # nor need it be proven closer than this [length unit]
    rounding: float  # of distances [length unit]
    instants: bool  # whether all pairs are looked at at the instants first
    refine: bool  # whether the first instant is found exactly; else the sweep ends at any
    max_nodes: int  # most intervals to judge


class Sweep(NamedTuple):
    """The findings of a sweep, of which those of one number are (1,)."""

    least: FloatArray  # least upper bound of a distance that was found; inf if none
    first: FloatArray  # t of the first distance at or below a pair's `level`; inf if none
    first_pair: IntArray  # its pair; −1 if none
    proven: FloatArray  # lower bound of all distances, outside the leaves, before `first`
    nodes: IntArray  # intervals that were judged
    num_leaves: IntArray  # intervals left open
    leaves: FloatArray  # (MAX_LEAVES + pairs, 3) pair, begin, end [instants] of these
    # (pairs,) like `least`, pair by pair; where upper bounds are not believed, the least lower
    # bound at an instant
    pair_least: FloatArray
    pair_least_at: FloatArray  # (pairs,) the t of it


class Levels(NamedTuple):
    """The intervals that wait, and the pairs that each level of halving has left."""

    bounds: FloatArray  # (2, pairs) from `approach_bounds`
    above: FloatArray  # (joints,) its scratch
    lists: IntArray  # (DEPTH + 2, pairs) pairs left on each level
    counts: IntArray  # (DEPTH + 2,) how many
    depths: IntArray  # (DEPTH + 2,) level of each interval that waits
    begins: FloatArray  # (DEPTH + 2,) where it begins on its segment
    ends: FloatArray  # (DEPTH + 2,) where it ends


def sweep_motion(task: Task, goal: Goal, work: Workspace) -> tuple[Sweep, bool]:
    """Judge a motion; return the findings, and whether `max_nodes` sufficed for all of it."""
    num_pairs = len(task.pairs)
    found = Sweep(
        least=np.array([goal.known]),
        first=np.array([np.inf]),
        first_pair=np.array([-1]),
        proven=np.array([np.inf]),
        nodes=np.array([0]),
        num_leaves=np.array([0]),
        leaves=np.empty((MAX_LEAVES + num_pairs, 3)),
        pair_least=np.full(num_pairs, np.inf),
        pair_least_at=np.zeros(num_pairs),
    )
    levels = Levels(
        bounds=np.empty((2, num_pairs)),
        above=np.empty(len(task.chain.parent)),
        lists=np.empty((DEPTH + 2, num_pairs), dtype=np.int64),
        counts=np.empty(DEPTH + 2, dtype=np.int64),
        depths=np.empty(DEPTH + 2, dtype=np.int64),
        begins=np.empty(DEPTH + 2),
        ends=np.empty(DEPTH + 2),
    )
    levels.lists[0], levels.counts[0] = np.arange(num_pairs), num_pairs  # of whole segments
    return found, _sweep(task, goal, work, found, levels)


@kernel
def _sweep(task: Task, goal: Goal, work: Workspace, found: Sweep, levels: Levels) -> bool:
    task, goal, work, found, levels = borrowed((task, goal, work, found, levels))
    bounds, lists, counts = levels.bounds, levels.lists, levels.counts
    begins, ends, depths = levels.begins, levels.ends, levels.depths
    if goal.instants:
        _judge_instants(task, goal, work, found)
    for segment in range(len(task.coefficients)):
        # on a straight segment the bounds hold throughout
        piece = task.coefficients[segment]
        if task.straight:
            approach_bounds(task.chain, piece, 0.0, 1.0, task.weights, bounds, levels.above)
        begins[0], ends[0], depths[0], waiting = 0.0, 1.0, 0, 1
        while waiting > 0:
            # the leftmost interval, up to the first contact known
            waiting -= 1
            a, depth = begins[waiting], depths[waiting]
            b = min(ends[waiting], found.first[0] - segment)
            if found.first[0] < np.inf and not goal.refine:
                return True
            if a >= b:
                continue
            if found.nodes[0] >= goal.max_nodes or found.num_leaves[0] > MAX_LEAVES:
                return False
            if not task.straight:
                approach_bounds(task.chain, piece, a, b, task.weights, bounds, levels.above)
            given, left = lists[depth, : counts[depth]], lists[depth + 1]
            counts[depth + 1] = _judge_interval(
                task, goal, work, found, segment, a, b, depth, bounds, given, left
            )
            # its halves, if pairs are left: the left one is taken next
            if counts[depth + 1] > 0:
                u = 0.5 * (a + b)
                begins[waiting], ends[waiting], depths[waiting] = u, b, depth + 1
                begins[waiting + 1], ends[waiting + 1], depths[waiting + 1] = a, u, depth + 1
                waiting += 2
    return True


@inlined
def _closely(goal: Goal) -> float:
    """Return the convergence of distances [-]: a thousandth of the resolution, or exact."""
    return max(CONVERGED, 0.001 * goal.resolution) if goal.resolution < 1.0 else CONVERGED


@inlined
def _judge_instants(task: Task, goal: Goal, work: Workspace, found: Sweep) -> None:
    """Measure all pairs at the instants themselves: a good upper bound from the start."""
    least, at = found.pair_least, found.pair_least_at
    for instant in range(int(task.last) + 1):
        if found.first[0] < np.inf:
            return
        segment = min(instant, len(task.coefficients) - 1)
        move_to(task, work, segment, float(instant - segment))
        for pair in range(len(task.pairs)):
            wanted = max(found.least[0], goal.level[pair])
            low, high = pair_distance(task, work, pair, wanted, -np.inf, _closely(goal))
            distance = high if task.exact[pair] else low
            if distance < least[pair]:
                least[pair], at[pair] = distance, float(instant)
            if task.exact[pair]:
                found.least[0] = min(found.least[0], high)
            if task.exact[pair] and high <= goal.level[pair] and found.first[0] == np.inf:
                found.first[0], found.first_pair[0] = float(instant), pair


@inlined
def _judge_interval(
    task: Task,
    goal: Goal,
    work: Workspace,
    found: Sweep,
    segment: int,
    a: float,
    b: float,
    depth: int,
    bounds: FloatArray,
    given: IntArray,
    left: IntArray,
) -> int:
    """Judge the given pairs on [a, b] from its middle.

    Writes the pairs that must be judged on its halves to `left`, and returns their number.
    """
    leaves, least, at = found.leaves, found.pair_least, found.pair_least_at
    found.nodes[0] += 1
    u, half, count = 0.5 * (a + b), 0.5 * (b - a), 0
    move_to(task, work, segment, u)
    for pair in given:
        # the distance that is to be proven
        way, wanted = bounds[0, pair] * half + goal.rounding, goal.goal[pair]
        upper = found.least[0]
        if goal.resolution < np.inf and 0.0 < upper < np.inf:
            wanted = max(wanted, upper - min(max(goal.resolution * upper, goal.floor), 0.5 * upper))
        # the distance in the middle
        low, high = pair_distance(task, work, pair, wanted + way, wanted, _closely(goal))
        if task.exact[pair] and high < least[pair]:
            least[pair], at[pair] = high, segment + u
            found.least[0] = min(found.least[0], high)
        if task.exact[pair] and high <= goal.level[pair] and segment + u < found.first[0]:
            found.first[0], found.first_pair[0] = segment + u, pair
        slack = goal.slack[pair]
        near = (
            way <= 0.25 * slack and low > goal.level[pair] - 0.5 * slack and high > goal.level[pair]
        )
        # its bound over the interval; by the plane, whose least gap is not above the gap now
        bound = low - way
        change = 0.5 * half * half * bounds[1, pair] + goal.rounding
        if bound < wanted <= low - change and task.by_one[pair]:
            bound = max(bound, least_separation(task, work, pair, segment, u, half) - change)
        # proven, left to coal, or left to the halves
        if bound >= wanted or near:
            found.proven[0] = min(found.proven[0], bound)
        elif b - a < NARROW or (depth >= ROUGH_DEPTH and not task.exact[pair]):
            if segment + b < found.first[0]:
                leaf = found.num_leaves[0]
                leaves[leaf, 0], leaves[leaf, 1], leaves[leaf, 2] = pair, segment + a, segment + b
                found.num_leaves[0] += 1
        else:
            left[count] = pair
            count += 1
    return count
