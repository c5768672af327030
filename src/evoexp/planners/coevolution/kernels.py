"""Breeding and measuring co-evolving populations, compiled (Curkovic et al. 2013, section 3)."""

import numpy as np

from evoexp.collision.models.link_crossing_kernels import link_points
from evoexp.evolution.crossover import cross_single_point
from evoexp.evolution.hall_of_fame import renew_hall
from evoexp.evolution.mutation import mutate_allele
from evoexp.evolution.pareto import non_dominated
from evoexp.evolution.selection import (
    choose_elites,
    difference_weights,
    inverse_weights,
    spin_roulette,
)
from evoexp.numeric.compilation import kernel
from evoexp.objectives.motion_criteria import measure_motions


@kernel
def breed(uniforms, populations, costs, moving, teams, settings, bred):  # type: ignore[no-untyped-def]
    """Write the next populations: offspring, then elites, then the members of the hall, unchanged.

    Args:
        uniforms: (moving robots, numbers) uniform in [0, 1): parents, then cross-over, then
            mutation.
        populations: (robots, genes, individuals).
        costs: (robots, individuals).
        moving: (robots,) false for robots that stand still: their populations are copied.
        teams: (teams, robots) members of the hall.
        settings: num_elites; whether weights are inverse costs; crossover_rate; mutation rate,
            step, limit, symmetric.
        bred: Like populations, written.
    """
    num_elites, inverse, crossover_rate, rate, step, limit, symmetric = settings
    size, kept = populations.shape[2], num_elites + len(teams)
    count = size - kept
    last = count + 2 * (count // 2)  # behind the numbers of cross-over
    weights, parents = np.empty(size), np.empty(count, dtype=np.int64)
    chosen = np.empty(num_elites, dtype=np.int64)
    row = 0
    for robot in range(len(populations)):
        if not moving[robot]:
            bred[robot] = populations[robot]
            continue
        draws, genes, before = uniforms[row], bred[robot], populations[robot]
        row += 1
        if inverse:
            inverse_weights(costs[robot], weights)
        else:
            difference_weights(costs[robot], weights)
        spin_roulette(weights, draws[:count], parents)
        cross_single_point(draws[count:last], before, parents, crossover_rate, genes)
        mutate_allele(draws[last:], genes, count, rate, step, limit, symmetric)
        choose_elites(costs[robot], chosen)
        for gene in range(len(genes)):
            for k in range(num_elites):
                genes[gene, count + k] = before[gene, chosen[k]]
            for k in range(len(teams)):
                genes[gene, count + num_elites + k] = before[gene, teams[k, robot]]


@kernel
def renew(populations, criteria, collisions, own, settings, teams, ages, num_teams, keys):  # type: ignore[no-untyped-def]
    """Renew the hall of fame from the Pareto fronts of all populations, without copies.

    Return how many teams it holds.

    Args:
        populations: (robots, genes, individuals).
        criteria: (robots, criteria, individuals), all minimised.
        collisions: See `hall_of_fame`.
        own: Likewise.
        settings: Memory of the hall (0: no rule), whether it is frozen; see `update_hall`.
        teams: (depth, robots) places of the members, rewritten.
        ages: (depth,) rewritten.
        num_teams: How many teams there are.
        keys: Collisions and costs of the teams, each (depth,), written.
    """
    count = populations.shape[2]
    fronts = np.empty((len(populations), count), dtype=np.bool_)
    for robot in range(len(populations)):
        non_dominated(criteria[robot], count, fronts[robot])
    drop_copies(populations, teams[:num_teams], fronts)
    return renew_hall(
        collisions,
        own,
        fronts,
        count,
        teams,
        ages,
        num_teams,
        settings[0],
        settings[1],
        keys[0],
        keys[1],
    )


@kernel
def drop_copies(populations, teams, fronts):  # type: ignore[no-untyped-def]
    """Take copies of other members, and of the hall's, off the fronts.

    They would fill the hall with one pair.

    Args:
        populations: (robots, genes, individuals).
        teams: (teams, robots) members of the hall.
        fronts: (robots, individuals) bool, changed: of equal genomes the first stays, none if the
            hall has one.
    """
    for robot in range(len(populations)):
        genes, front = populations[robot], fronts[robot]
        known = np.empty(len(teams) + genes.shape[1], dtype=np.int64)
        num_known = len(teams)
        for k in range(num_known):
            known[k] = teams[k, robot]
        for member in range(genes.shape[1]):
            if not front[member]:
                continue
            fresh = True
            for k in range(num_known):
                same = True
                for gene in range(len(genes)):
                    if genes[gene, member] != genes[gene, known[k]]:
                        same = False
                        break
                if same:
                    fresh = False
                    break
            front[member] = fresh
            if fresh:
                known[num_known] = member
                num_known += 1


@kernel
def measure(populations, starts, goals, arms, weights, paths, points, criteria, own):  # type: ignore[no-untyped-def]
    """Lay out all paths, and measure what each costs whoever its collaborators are.

    Args:
        populations: (robots, 2 K, individuals) link angles [rad].
        starts: (robots, 2) [rad].
        goals: (robots, 2) [rad].
        arms: (robots, 4) base x, base y, lengths of both links [length unit].
        weights: Of C2, C3, C4.
        paths: (robots, K + 2, 2, individuals) written: link angles, start and goal included.
        points: (robots, K + 2, 4, individuals) written: elbow x, y, tip x, y.
        criteria: (robots, 4, individuals), C2, C3, C4 written.
        own: (robots, individuals) written: their weighted sum.
    """
    last = paths.shape[1] - 1
    for r in range(len(populations)):
        path, genes = paths[r], populations[r]
        for link in range(2):
            path[0, link], path[last, link] = starts[r, link], goals[r, link]
            for k in range(1, last):
                path[k, link] = genes[2 * (k - 1) + link]
        link_points(path, arms[r, 0], arms[r, 1], arms[r, 2], arms[r, 3], points[r])
        measure_motions(path, points[r], weights, criteria[r, 1:], own[r])
