"""The compiled part of the certifier: branch and bound over a whole motion and all pairs of bodies.

An interval of the motion is judged from its middle: if a pair is d apart there and cannot approach
faster than L, it stays d − L·(half the interval) apart. Or better, across the plane that separates
the pair there: the gap if all points kept their velocities, less what accelerations can change.
Pairs of which that is not enough go on to both halves, the left one first, so that what happens
first is found first. Depth first, with the pairs that are left on each level.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.certifier.convex_distance import CONVERGED, distance_bounds, separation_later
from evoexp.collision.motion_bounds import (
    FRAME,
    approach_bounds,
    configuration,
    joint_frames,
    joint_twists,
    pair_reaches,
    reaches,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.records import FloatArray

DEPTH = 64
"""Halvings of a segment; at `NARROW` they end."""

NARROW = 1e-13  # [segments] an interval that is not halved any more

MAX_LEAVES = 100_000
"""Of a sweep; more count as a limit used up."""

POLISH_STEP = 0.02  # [segments] first step towards a local minimum

FINEST = 1e-10  # [segments] the last one is not less

SHRINK = 0.0625  # [-] of the step where neither side is closer

MAX_MOVES = 1000  # on the way to a local minimum

ROUGH_DEPTH = 5  # halvings after which a body known only by its hull is left to coal

WIDER = 1.0 + 1e-9  # on all bounds of speed: more than rounding

LEAST, FIRST, FIRST_PAIR, PROVEN, NODES, LEAVES = range(6)
"""Places in a sweep's state; see `Sweep`."""


class Task(NamedTuple):
    """A motion among bodies, as the kernels take it.

    Attributes:
        table: The kinematic table's first six fields.
        bodies: `BodyTable` as a plain tuple.
        pairs: (pairs, 2) indices of bodies.
        exact: (pairs,) whether upper bounds of distances are believed; else what cannot be excluded
            becomes a leaf.
        coefficients: (segments, 4, nq) of the motion.
        straight: Whether all segments are straight lines.
        last: The last instant: the number of segments, or 0 for a motion of one instant.
        weights: (pairs, joints) from `approach_weights`.
        by_one: (pairs,) from `moved_by_one`.
    """

    table: tuple[Any, ...]
    bodies: tuple[Any, ...]
    pairs: np.ndarray
    exact: np.ndarray
    coefficients: FloatArray
    straight: bool
    last: float
    weights: FloatArray
    by_one: np.ndarray


class Sweep(NamedTuple):
    """What a sweep found.

    Attributes:
        least: Least upper bound of a distance that was found; inf if none.
        first: t of the first distance at or below a pair's `level`; inf if none.
        first_pair: Its pair; −1 if none.
        proven: Lower bound of all distances, outside the leaves, before `first`.
        nodes: Intervals that were judged.
        done: False if `max_nodes` were used up.
        leaves: (leaves, 3) pair, begin, end [instants] of intervals left open.
        pair_least: (pairs,) like `least`, pair by pair; where upper bounds are not believed, the
            least lower bound at an instant.
        pair_least_at: (pairs,) the t of it.
    """

    least: float
    first: float
    first_pair: int
    proven: float
    nodes: int
    done: bool
    leaves: FloatArray
    pair_least: FloatArray
    pair_least_at: FloatArray


class Goal(NamedTuple):
    """What a sweep shall find out.

    Attributes:
        goal: (pairs,) distances that are to be proven at least.
        level: (pairs,) at or below it a distance is what is looked for: the first such instant.
        slack: (pairs,) below it differences of distances do not count.
        known: An upper bound of the least distance that is known already; inf if none.
        resolution: The least distance is proven up to this part of it; inf: only `goal` is proven.
        floor: Nor need it be proven closer than this [length unit].
        rounding: Of distances [length unit].
        instants: Whether all pairs are looked at at the instants first.
        refine: Whether the first instant is found exactly; else the sweep ends at any.
        max_nodes: Intervals to judge at most.
    """

    goal: FloatArray
    level: FloatArray
    slack: FloatArray
    known: float
    resolution: float
    floor: float
    rounding: float
    instants: bool
    refine: bool
    max_nodes: int


def sweep_motion(task: Task, goal: Goal, work: tuple[np.ndarray, ...]) -> Sweep:
    """Judge a motion."""
    num_pairs = len(task.pairs)
    leaves, state = (
        np.empty((MAX_LEAVES + num_pairs, 3)),
        np.array([goal.known, np.inf, -1.0, np.inf, 0.0, 0.0]),
    )
    least, at = np.full(num_pairs, np.inf), np.zeros(num_pairs)
    done = _sweep(
        task, goal, work, (leaves, state, least, at), _stack(num_pairs, len(task.table[0]))
    )
    count = int(state[LEAVES])
    first_pair = int(state[FIRST_PAIR])
    return Sweep(
        state[LEAST],
        state[FIRST],
        first_pair,
        state[PROVEN],
        int(state[NODES]),
        done,
        leaves[:count],
        least,
        at,
    )


def _stack(num_pairs: int, num_joints: int) -> tuple[np.ndarray, ...]:
    """Scratch of a sweep: speeds and accelerations, of joints, too; the pairs left on each level.

    Where it stands.
    """
    lists, counts = (
        np.empty((DEPTH + 2, num_pairs), dtype=np.int64),
        np.empty(DEPTH + 2, dtype=np.int64),
    )
    lists[0], counts[0] = np.arange(num_pairs), num_pairs
    begins, ends, depths = (
        np.empty(DEPTH + 2),
        np.empty(DEPTH + 2),
        np.empty(DEPTH + 2, dtype=np.int64),
    )
    return np.empty((2, num_pairs)), np.empty(num_joints), lists, counts, depths, begins, ends


@kernel
def approach_weights(table, bodies, pairs, strokes):  # type: ignore[no-untyped-def]
    """(pairs, joints): how much a joint's speed can change a pair's distance.

    Widened against rounding.
    """
    reach = reaches(table, bodies[0], bodies[9], bodies[10], strokes)
    return pair_reaches(pairs, reach) * WIDER


def work_space(task: Task) -> tuple[np.ndarray, ...]:
    """Scratch: q, joints' frames, bodies' frames and when they were placed.

    What `distance_bounds` needs, twists.
    """
    num_joints, num_bodies = len(task.table[0]), len(task.bodies[0])
    world = np.hstack([task.bodies[3], task.bodies[4]])  # right for bodies that stand still
    stamps = np.zeros(
        num_bodies + 2, dtype=np.int64
    )  # the last but one: of the twists; the last: of q
    q, frames, twists = (
        np.zeros(num_joints),
        np.zeros((num_joints, FRAME)),
        np.zeros((num_joints, 6)),
    )
    return (
        q,
        frames,
        world,
        stamps,
        np.ones((len(task.pairs), 3)),
        np.zeros((4, 3)),
        np.zeros((3, 3)),
        twists,
    )


@inlined
def move_to(task, work, segment, u):  # type: ignore[no-untyped-def]
    """Place the joints at u on a segment."""
    q, frames, _, stamps, _, _, _, _ = work
    stamps[-1] += 1
    configuration(task.coefficients[segment], u, q)
    joint_frames(task.table, q, frames)


@inlined
def pair_distance(task, work, pair, need, enough, converged):  # type: ignore[no-untyped-def]
    """`distance_bounds` of a pair, whose bodies are placed first unless they are already."""
    _, frames, world, stamps, normals, simplex, scratch, _ = work
    for side in range(2):
        body = task.pairs[pair, side]
        joint = task.bodies[0][body]
        if joint >= 0 and stamps[body] != stamps[-1]:
            stamps[body] = stamps[-1]
            _place_body(frames[joint], task.bodies[3][body], task.bodies[4][body], world[body])
    one, two = task.pairs[pair, 0], task.pairs[pair, 1]
    return distance_bounds(
        task.bodies, world, one, two, need, enough, converged, normals[pair], simplex, scratch
    )


@inlined
def _place_body(frame, rotation, translation, out):  # type: ignore[no-untyped-def]
    for e in range(3):
        a, b, c = frame[3 * e], frame[3 * e + 1], frame[3 * e + 2]
        for k in range(3):
            out[3 * e + k] = a * rotation[k] + b * rotation[3 + k] + c * rotation[6 + k]
        out[9 + e] = frame[9 + e] + (a * translation[0] + b * translation[1] + c * translation[2])


@kernel
def _sweep(task, goal, work, found, stack):  # type: ignore[no-untyped-def]
    """Judge a motion; returns whether all of it was."""
    task, goal, work, found, stack = borrowed((task, goal, work, found, stack))
    bounds, above, lists, counts, depths, begins, ends = stack
    num_pairs, num_segments = len(task.pairs), len(task.coefficients)
    leaves, state, _, _ = found
    if goal.instants:
        _judge_instants(task, goal, work, found)
    for segment in range(num_segments):
        if task.straight:
            approach_bounds(
                task.table, task.coefficients[segment], 0.0, 1.0, task.weights, bounds, above
            )
        begins[0], ends[0], depths[0], waiting = 0.0, 1.0, 0, 1
        while waiting > 0:
            waiting -= 1
            a, b, depth = (
                begins[waiting],
                min(ends[waiting], state[FIRST] - segment),
                depths[waiting],
            )
            if state[FIRST] < np.inf and not goal.refine:
                return True
            if a >= b:
                continue
            if state[NODES] >= goal.max_nodes or state[LEAVES] + num_pairs > len(leaves):
                return False
            if not task.straight:
                approach_bounds(
                    task.table, task.coefficients[segment], a, b, task.weights, bounds, above
                )
            counts[depth + 1] = _judge_interval(
                task,
                goal,
                work,
                found,
                segment,
                a,
                b,
                depth,
                bounds,
                lists[depth, : counts[depth]],
                lists[depth + 1],
            )
            if counts[depth + 1] > 0:
                u = 0.5 * (a + b)
                begins[waiting], ends[waiting], depths[waiting] = u, b, depth + 1
                begins[waiting + 1], ends[waiting + 1], depths[waiting + 1] = a, u, depth + 1
                waiting += 2
    return True


@inlined
def _closely(goal):  # type: ignore[no-untyped-def]
    """How closely distances are bounded: a thousandth of what shall be told apart.

    Around a level, exactly.
    """
    return max(CONVERGED, 0.001 * goal.resolution) if goal.resolution < 1.0 else CONVERGED


@inlined
def _judge_instants(task, goal, work, found):  # type: ignore[no-untyped-def]
    """All pairs at the instants themselves: a good upper bound from the start."""
    _, state, least, at = found
    for instant in range(int(task.last) + 1):
        if state[FIRST] < np.inf:
            return
        segment = min(instant, len(task.coefficients) - 1)
        move_to(task, work, segment, float(instant - segment))
        for pair in range(len(task.pairs)):
            wanted = max(state[LEAST], goal.level[pair])
            low, high = pair_distance(task, work, pair, wanted, -np.inf, _closely(goal))
            distance = high if task.exact[pair] else low
            if distance < least[pair]:
                least[pair], at[pair] = distance, float(instant)
            if task.exact[pair]:
                state[LEAST] = min(state[LEAST], high)
            if task.exact[pair] and high <= goal.level[pair] and state[FIRST] == np.inf:
                state[FIRST], state[FIRST_PAIR] = float(instant), pair


@inlined
def _judge_interval(task, goal, work, found, segment, a, b, depth, bounds, given, left):  # type: ignore[no-untyped-def]
    """Judge the given pairs on [a, b] from its middle.

    Write those for its halves to `left`, return their number.
    """
    leaves, state, least, at = found
    state[NODES] += 1.0
    u, half, count = 0.5 * (a + b), 0.5 * (b - a), 0
    move_to(task, work, segment, u)
    for pair in given:
        way, wanted = bounds[0, pair] * half + goal.rounding, goal.goal[pair]
        upper = state[LEAST]
        if goal.resolution < np.inf and 0.0 < upper < np.inf:
            wanted = max(wanted, upper - min(max(goal.resolution * upper, goal.floor), 0.5 * upper))
        low, high = pair_distance(task, work, pair, wanted + way, wanted, _closely(goal))
        if task.exact[pair] and high < least[pair]:
            least[pair], at[pair] = high, segment + u
            state[LEAST] = min(state[LEAST], high)
        if task.exact[pair] and high <= goal.level[pair] and segment + u < state[FIRST]:
            state[FIRST], state[FIRST_PAIR] = segment + u, pair
        slack = goal.slack[pair]
        near = (
            way <= 0.25 * slack and low > goal.level[pair] - 0.5 * slack and high > goal.level[pair]
        )
        bound = low - way
        change = 0.5 * half * half * bounds[1, pair] + goal.rounding
        if (
            bound < wanted <= low - change and task.by_one[pair]
        ):  # the least gap is not above the gap now
            bound = max(bound, least_separation(task, work, pair, segment, u, half) - change)
        if bound >= wanted or near:
            state[PROVEN] = min(state[PROVEN], bound)
        elif b - a < NARROW or (depth >= ROUGH_DEPTH and not task.exact[pair]):
            if segment + b < state[FIRST]:
                leaf = int(state[LEAVES])
                leaves[leaf, 0], leaves[leaf, 1], leaves[leaf, 2] = pair, segment + a, segment + b
                state[LEAVES] += 1.0
        else:
            left[count] = pair
            count += 1
    return count


@inlined
def least_separation(task, work, pair, segment, u, half):  # type: ignore[no-untyped-def]
    """Least gap across a pair's last normal within `half` before and after u.

    If velocities did not change.
    """
    _, frames, world, stamps, normals, _, scratch, twists = work
    if stamps[-2] != stamps[-1]:
        stamps[-2] = stamps[-1]
        joint_twists(task.table, task.coefficients[segment], u, frames, twists)
    one, two, normal = task.pairs[pair, 0], task.pairs[pair, 1], normals[pair]
    before = separation_later(task.bodies, world, twists, one, two, normal, -half, scratch)
    return min(
        before, separation_later(task.bodies, world, twists, one, two, normal, half, scratch)
    )


@kernel
def polish(task, work, pairs, t, distances):  # type: ignore[no-untyped-def]
    """Walk from given instants to local minima of pairs' distances.

    At a step to both sides that finds nothing less, the vertex of the parabola through the three is
    tried, and the step shrinks: a smooth minimum takes some 25 distances, one at an instant, where
    the motion bends, no more.

    Args:
        task: The motion.
        work: From `work_space`.
        pairs: (walks,) whose distance.
        t: (walks,) where to begin; where the walk ended is written.
        distances: (walks,) written.
    """
    task, work, pairs, t, distances = borrowed((task, work, pairs, t, distances))
    for walk in range(len(pairs)):
        here, best, step = t[walk], np.inf, POLISH_STEP
        for move in range(MAX_MOVES):
            after = before = np.inf
            closer = False
            for k in range(1 if move > 0 else 0, 4):
                ahead = 0.0
                if k == 1:
                    ahead = step
                elif k == 2:
                    ahead = -step
                elif k == 3:
                    bend = (after - best) + (before - best)
                    ahead = 0.5 * step * (before - after) / bend if 0.0 < bend < np.inf else 0.0
                tried = min(max(here + ahead, 0.0), task.last)
                if tried == here and k > 0:
                    continue
                segment = min(int(tried), len(task.coefficients) - 1)
                move_to(task, work, segment, tried - segment)
                _, distance = pair_distance(task, work, pairs[walk], np.inf, -np.inf, CONVERGED)
                after = distance if k == 1 else after
                before = distance if k == 2 else before
                if distance < best:
                    here, best, closer = tried, distance, k in (1, 2)
                    if closer:
                        break
            step *= 1.0 if closer else SHRINK
            if step < FINEST:
                break
        t[walk], distances[walk] = here, best
