"""One cycle of the evolution strategy on postures, compiled (Corsépius 2001, Algorithm 1).

A population is an array (nq, individuals) [rad]. What postures are judged by travels as a plain
tuple, which `posture_stages` makes; settings of the strategy as another, which `posture_search`
makes.
"""

import numpy as np

from evoexp.collision.models.primitive_kernels import primitive_clearances
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
    rate_limits,
    rate_poses,
)
from evoexp.robots.poses import frame_poses

COST = len(TERMS)
ROWS = COST + 1  # the terms, then the cost
UNIFORM, GAUSSIAN = range(2)
EQUAL, NORMAL = range(2)
TURNS = (ANGLE, AXIAL, HEADING)  # terms that a goal asks for together with its distance


@kernel
def judge(q, judging, rows, feasible, met):  # type: ignore[no-untyped-def]
    """Write terms and cost of postures, whether they are feasible, and whether they meet the goal.

    Args:
        q: (nq, postures) [rad].
        judging: The kinematic table; joint and local pose of the controlled frame; aim of
            `rate_poses`; weights of the terms (0: does not count); hard limits of the two tilts
            [rad]; limits (nq, 2); tables of the collision model; reach of the preference for free
            space; tolerances [length unit, rad].
        rows: (ROWS, postures) written.
        feasible: (postures,) written.
        met: (postures,) written.
    """
    table, joint, local, aim, weights, tilts, limits, tables, reach, tolerances = judging
    count = q.shape[1]
    pose, clearance = np.empty((12, count)), np.empty((3, count))
    frame_poses(table, joint, local, q, pose)
    rate_poses(count, pose, aim, rows)
    rate_limits(count, q, limits, rows[MARGIN])
    rows[COLLISION], rows[FREE_SPACE] = 0.0, 0.0
    if weights[COLLISION] > 0.0:
        rated = weights[FREE_SPACE] > 0.0
        primitive_clearances(
            tables[0],
            tables[1],
            tables[2],
            tables[3],
            tables[4],
            reach if rated else 0.0,
            not rated,
            q,
            clearance,
        )
        for n in range(count):
            least = min(clearance[0, n], min(clearance[1, n], clearance[2, n]))
            rows[COLLISION, n] = 0.0 if least >= 0.0 else 1.0
            if rated:
                rows[FREE_SPACE, n] = min(max(1.0 - least / reach, 0.0), 1.0)
    for n in range(count):
        cost = 0.0
        for t in range(COST):
            if weights[t] > 0.0:
                cost += weights[t] * abs(rows[t, n])
        upright = weights[UPRIGHT] == 0.0 or rows[UPRIGHT, n] <= tilts[0]
        parallel = weights[PARALLEL] == 0.0 or rows[PARALLEL, n] <= tilts[1]
        rows[COST, n] = cost if upright and parallel else np.inf
        feasible[n] = upright and parallel and rows[COLLISION, n] == 0.0
        near = abs(rows[DISTANCE, n]) <= tolerances[0]
        for t in TURNS:
            near = near and (weights[t] == 0.0 or rows[t, n] <= tolerances[1])
        met[n] = near and feasible[n]


@kernel
def judge_edges(parents, origin, offspring, substeps, judging, feasible):  # type: ignore[no-untyped-def]
    """Mark children as infeasible that an infeasible configuration separates from their parent.

    Args:
        parents: (nq, ≥ parents).
        origin: (offspring,) index of each child's parent.
        offspring: (nq, offspring).
        substeps: Configurations tested between the two.
        judging: See `judge`.
        feasible: (offspring,) changed.
    """
    nq, count = offspring.shape
    between = np.empty((nq, count * substeps))
    for s in range(substeps):
        share = (s + 1.0) / (substeps + 1.0)
        for k in range(nq):
            for n in range(count):
                begin = parents[k, origin[n]]
                between[k, s * count + n] = begin + share * (offspring[k, n] - begin)
    rows, met = np.empty((ROWS, count * substeps)), np.empty(count * substeps, dtype=np.bool_)
    free = np.empty(count * substeps, dtype=np.bool_)
    judge(between, judging, rows, free, met)
    for s in range(substeps):
        for n in range(count):
            feasible[n] = feasible[n] and free[s * count + n]


@kernel
def breed(uniforms, normals, parents, num_parents, num_bred, breeding, offspring, origin):  # type: ignore[no-untyped-def]
    """Write offspring and the parent of each.

    A parent, perhaps crossed with another, mutated, within the limits.

    The columns behind `num_bred` are immigrants, uniform within the limits; their parent is the
    nearest one.

    Args:
        uniforms: (uniforms,) in [0, 1), taken in order.
        normals: (normals,) standard normal deviates, taken in order.
        parents: (nq, ≥ num_parents), the best first.
        num_parents: How many there are.
        num_bred: Children of parents.
        breeding: Scope (nq,) [rad]; limits (nq, 2); mutation and its deviation; parent choice and
            its deviation; crossover rate.
        offspring: (nq, offspring) written.
        origin: (offspring,) written.
    """
    scope, limits, mutation, spread, choice, parent_spread, rate = breeding
    nq, count = offspring.shape
    u = v = 0
    for n in range(num_bred):
        parent = n % num_parents
        if choice == NORMAL:
            parent = min(int(abs(normals[v]) * parent_spread * num_parents), num_parents - 1)
            v += 1
        for k in range(nq):
            offspring[k, n] = parents[k, parent]
        origin[n] = parent
        if rate > 0.0:
            other = min(int(uniforms[u + 1] * num_parents), num_parents - 1)
            if uniforms[u] < rate:
                for k in range(nq):
                    if uniforms[u + 2 + k] < 0.5:
                        offspring[k, n] = parents[k, other]
            u += 2 + nq
        for k in range(nq):
            if mutation == GAUSSIAN:
                step = scope[k] * spread * normals[v]
                v += 1
            else:
                step = scope[k] * (2.0 * uniforms[u] - 1.0)
                u += 1
            offspring[k, n] = min(max(offspring[k, n] + step, limits[k, 0]), limits[k, 1])
        if rate > 0.0:
            origin[n] = nearest_parent(offspring, n, parents, num_parents, scope)
    for n in range(num_bred, count):
        for k in range(nq):
            offspring[k, n] = limits[k, 0] + (limits[k, 1] - limits[k, 0]) * uniforms[u]
            u += 1
        origin[n] = nearest_parent(offspring, n, parents, num_parents, scope)


@kernel
def nearest_parent(offspring, n, parents, num_parents, scope):  # type: ignore[no-untyped-def]
    """Return the parent from which the greatest step of a joint, in units of its scope.

    Is least.
    """
    best, least = 0, np.inf
    for p in range(num_parents):
        step = 0.0
        for k in range(len(scope)):
            step = max(step, abs(offspring[k, n] - parents[k, p]) / scope[k])
        if step < least:
            best, least = p, step
    return best


@kernel
def advance(uniforms, normals, bred, plus, substeps, breeding, judging, members, memory):  # type: ignore[no-untyped-def]
    """Breed, judge and select one cycle.

    Args:
        uniforms: See `breed`.
        normals: See `breed`.
        bred: Children of parents; the rest are immigrants.
        plus: Whether parents may stay.
        substeps: See `judge_edges`; 0: the motion between parent and child is not tested.
        breeding: See `breed`.
        judging: See `judge`.
        members: Parents (nq, μ), their costs (μ,), how many there are.
        memory: Offspring (nq, n), origin (n,), rows (ROWS, n), feasible (n,), met (n,): all
            written.

    Returns:
        Indices of the next parents, the best first: below n offspring, from n on parents (none: all
        parents stay); index of the winner, which meets the goal at the least cost, −1 if none does.
    """
    parents, parent_costs, num_parents = members
    offspring, origin, rows, feasible, met = memory
    count = offspring.shape[1]
    breed(uniforms, normals, parents, num_parents, bred, breeding, offspring, origin)
    judge(offspring, judging, rows, feasible, met)
    if substeps > 0:
        judge_edges(parents, origin, offspring, substeps, judging, feasible)
    keys = np.full(count + num_parents, np.inf)
    winner, usable = -1, 0
    for n in range(count):
        met[n] = met[n] and feasible[n]
        if feasible[n]:
            keys[n] = rows[COST, n]
            usable += 1
        if met[n] and (winner < 0 or rows[COST, n] < rows[COST, winner]):
            winner = n
    if plus:
        for p in range(num_parents):
            keys[count + p] = parent_costs[p]
            usable += 1
    order = np.argsort(keys, kind="mergesort")  # stable: the same on every machine
    return order[: min(len(parent_costs), usable)], winner
