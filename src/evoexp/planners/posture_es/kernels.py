"""One cycle of the evolution strategy on postures, compiled (Corsépius 2001, Algorithm 1).

A population is an array (nq, individuals) [rad].
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.bodies.clearance_kernels import least_clearances
from evoexp.numeric.compilation import kernel
from evoexp.objectives.posture_cost import (
    ANGLE,
    AXIAL,
    COLLISION,
    DISTANCE,
    FREE_SPACE,
    HEADING,
    MARGIN,
    PARALLEL,
    TERMS,
    UPRIGHT,
    Aim,
    rate_limits,
    rate_poses,
)
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import KinematicChain, frame_poses

COST = len(TERMS)
ROWS = COST + 1  # the terms, then the cost
TURNS = (ANGLE, AXIAL, HEADING)  # terms that must be small, too, where a goal is met


class Judging(NamedTuple):
    """Terms and limits by which postures are judged."""

    chain: KinematicChain  # the robot's joints
    joint: int  # index into the table of the joint that moves the controlled frame
    local: FloatArray  # (12,) local pose of the controlled frame
    aim: Aim  # the goal
    weights: FloatArray  # (terms,) of the cost; 0: the term does not count
    tilts: FloatArray  # (2,) hard limits of `upright` and `keep_parallel` [rad]
    limits: FloatArray  # (nq, 2) of the joints
    tables: tuple[Any, ...]  # tables of the collision model
    reach: float  # of the preference for free space [length unit]
    # (3,) of the goal's distance [length unit], of its angles and of the tilt of the up axis [rad]
    tolerances: FloatArray
    larger_angle: bool  # whether only the larger one of the two grasping angles counts
    # tables of the collision model of pairs that may touch; read only if there are any
    touching: tuple[Any, ...]
    may_touch: bool  # whether there are any


class Strategy(NamedTuple):
    """Settings of the operators."""

    scope: FloatArray  # (nq,) greatest step of each joint [rad]
    limits: FloatArray  # (nq, 2) of the joints
    gaussian: bool  # whether steps are normal deviates, not uniform ones
    mutation_std: float  # in units of the scope [-]
    by_rank: bool  # whether better parents have more offspring
    parent_std: float  # in units of μ [-]
    crossover_rate: float  # probability per child
    plus: bool  # whether parents may stay
    edge_check: int  # configurations tested between a parent and its child; 0: none


class Members(NamedTuple):
    """The parents of a cycle, the best first."""

    postures: FloatArray  # (nq, ≥ size) [rad]
    costs: FloatArray  # (≥ size,)
    size: int  # number of parents


class Memory(NamedTuple):
    """Arrays that a cycle writes."""

    offspring: FloatArray  # (nq, offspring) [rad]
    origin: IntArray  # (offspring,) index of each child's parent
    rows: FloatArray  # (ROWS, offspring) terms and cost
    feasible: BoolArray  # (offspring,)
    met: BoolArray  # (offspring,) whether each meets the goal


@kernel
def judge(
    q: FloatArray, judging: Judging, rows: FloatArray, feasible: BoolArray, met: BoolArray
) -> None:
    """Write terms and cost (ROWS, …) of postures q (nq, postures) [rad].

    And whether each is feasible, and meets the goal.
    """
    weights, reach, tables = judging.weights, judging.reach, judging.tables
    count = q.shape[1]
    pose, clearance = np.empty((12, count)), np.empty((3, count))
    # poses, limits
    frame_poses(judging.chain, judging.joint, judging.local, q, pose)
    rate_poses(count, pose, judging.aim, rows)
    rate_limits(count, q, judging.limits, rows[MARGIN])
    # collision, free space
    rows[COLLISION], rows[FREE_SPACE] = 0.0, 0.0
    if weights[COLLISION] > 0.0:
        rated = weights[FREE_SPACE] > 0.0
        least_clearances(tables, reach if rated else 0.0, not rated, q, clearance)
        for n in range(count):
            least = min(clearance[0, n], min(clearance[1, n], clearance[2, n]))
            rows[COLLISION, n] = 0.0 if least >= 0.0 else 1.0
            if rated:
                rows[FREE_SPACE, n] = min(max(1.0 - least / reach, 0.0), 1.0)
    if weights[COLLISION] > 0.0 and judging.may_touch:
        overlap = np.empty((3, count))
        least_clearances(judging.touching, 0.0, True, q, overlap)
        for n in range(count):
            if overlap[0, n] < 0.0:
                rows[COLLISION, n] = 1.0
                rows[FREE_SPACE, n] = 1.0 if weights[FREE_SPACE] > 0.0 else 0.0
    # cost, feasibility, goal
    tilts, tolerances = judging.tilts, judging.tolerances
    for n in range(count):
        cost = 0.0
        for t in range(COST):
            if weights[t] > 0.0:
                cost += weights[t] * abs(rows[t, n])
        if judging.larger_angle:
            cost -= min(weights[AXIAL] * rows[AXIAL, n], weights[HEADING] * rows[HEADING, n])
        upright = weights[UPRIGHT] == 0.0 or rows[UPRIGHT, n] <= tilts[0]
        parallel = weights[PARALLEL] == 0.0 or rows[PARALLEL, n] <= tilts[1]
        rows[COST, n] = cost if upright and parallel else np.inf
        feasible[n] = upright and parallel and rows[COLLISION, n] == 0.0
        near = abs(rows[DISTANCE, n]) <= tolerances[0]
        for t in TURNS:
            near = near and (weights[t] == 0.0 or rows[t, n] <= tolerances[1])
        near = near and (weights[UPRIGHT] == 0.0 or rows[UPRIGHT, n] <= tolerances[2])
        met[n] = near and feasible[n]


@kernel
def judge_edges(parents: FloatArray, num_between: int, judging: Judging, memory: Memory) -> None:
    """Mark children as infeasible that an infeasible configuration separates from their parent."""
    offspring, origin, feasible = memory.offspring, memory.origin, memory.feasible
    nq, count = offspring.shape
    between = np.empty((nq, count * num_between))
    for s in range(num_between):
        share = (s + 1.0) / (num_between + 1.0)
        for k in range(nq):
            for n in range(count):
                begin = parents[k, origin[n]]
                between[k, s * count + n] = begin + share * (offspring[k, n] - begin)
    rows, met = np.empty((ROWS, count * num_between)), np.empty(count * num_between, dtype=np.bool_)
    free = np.empty(count * num_between, dtype=np.bool_)
    judge(between, judging, rows, free, met)
    for s in range(num_between):
        for n in range(count):
            feasible[n] = feasible[n] and free[s * count + n]


@kernel
def breed(
    uniforms: FloatArray,  # (uniforms,) in [0, 1), taken in order
    normals: FloatArray,  # (normals,) standard normal deviates, taken in order
    num_bred: int,  # children of parents
    strategy: Strategy,  # settings of the operators
    members: Members,  # the parents
    memory: Memory,  # `offspring` and `origin` are written
) -> None:
    """Write offspring, within the limits, and the parent of each.

    A child copies a parent, is perhaps crossed with another one, and is mutated. The columns behind
    `num_bred` are immigrants, uniform within the limits; the nearest parent counts as theirs.
    """
    scope, limits, rate = strategy.scope, strategy.limits, strategy.crossover_rate
    parents, num_parents = members.postures, members.size
    offspring, origin = memory.offspring, memory.origin
    nq, u, v = len(offspring), 0, 0
    for n in range(num_bred):
        # parent: in turn, or by rank
        parent = n % num_parents
        if strategy.by_rank:
            drawn = abs(normals[v]) * strategy.parent_std * num_parents
            parent = min(int(drawn), num_parents - 1)
            v += 1
        for k in range(nq):
            offspring[k, n] = parents[k, parent]
        origin[n] = parent
        # crossover, joint by joint
        if rate > 0.0:
            other = min(int(uniforms[u + 1] * num_parents), num_parents - 1)
            if uniforms[u] < rate:
                for k in range(nq):
                    if uniforms[u + 2 + k] < 0.5:
                        offspring[k, n] = parents[k, other]
            u += 2 + nq
        # mutation
        for k in range(nq):
            if strategy.gaussian:
                step = scope[k] * strategy.mutation_std * normals[v]
                v += 1
            else:
                step = scope[k] * (2.0 * uniforms[u] - 1.0)
                u += 1
            offspring[k, n] = min(max(offspring[k, n] + step, limits[k, 0]), limits[k, 1])
        if rate > 0.0:
            origin[n] = nearest_parent(offspring, n, parents, num_parents, scope)
    # immigrants (Algorithm 1, the set Q)
    for n in range(num_bred, offspring.shape[1]):
        for k in range(nq):
            offspring[k, n] = limits[k, 0] + (limits[k, 1] - limits[k, 0]) * uniforms[u]
            u += 1
        origin[n] = nearest_parent(offspring, n, parents, num_parents, scope)


@kernel
def nearest_parent(
    offspring: FloatArray, n: int, parents: FloatArray, num_parents: int, scope: FloatArray
) -> int:
    """Return the parent that a child is nearest to, by the greatest step in units of the scope."""
    best, least = 0, np.inf
    for p in range(num_parents):
        step = 0.0
        for k in range(len(scope)):
            step = max(step, abs(offspring[k, n] - parents[k, p]) / scope[k])
        if step < least:
            best, least = p, step
    return best


@kernel
def advance(
    uniforms: FloatArray,
    normals: FloatArray,
    num_bred: int,  # children of parents; the rest are immigrants
    strategy: Strategy,  # settings of the operators
    judging: Judging,  # terms and limits
    members: Members,  # the parents
    memory: Memory,  # written
) -> tuple[IntArray, int]:
    """Breed, judge and select one cycle.

    Returns the next parents, the best first: below n offspring, from n on parents (none: all stay);
    and the winner, which meets the goal at the least cost, −1 if nobody does.
    """
    breed(uniforms, normals, num_bred, strategy, members, memory)
    judge(memory.offspring, judging, memory.rows, memory.feasible, memory.met)
    if strategy.edge_check > 0:
        judge_edges(members.postures, strategy.edge_check, judging, memory)
    return select(strategy, members, memory)


@kernel
def select(strategy: Strategy, members: Members, memory: Memory) -> tuple[IntArray, int]:
    """Select the next parents and the winner among judged offspring; see `advance`.

    Nobody meets the goal who is not feasible.
    """
    rows, feasible, met = memory.rows, memory.feasible, memory.met
    count, num_parents = memory.offspring.shape[1], members.size
    # who may be selected, at which cost; the winner
    keys = np.full(count + num_parents, np.inf)
    winner, usable = -1, 0
    for n in range(count):
        met[n] = met[n] and feasible[n]
        if feasible[n]:
            keys[n] = rows[COST, n]
            usable += 1
        if met[n] and (winner < 0 or rows[COST, n] < rows[COST, winner]):
            winner = n
    if strategy.plus:
        for p in range(num_parents):
            keys[count + p] = members.costs[p]
            usable += 1
    # selection
    order = np.argsort(keys, kind="mergesort")  # stable: the same on every machine
    return order[: min(len(members.costs), usable)], winner
