"""Breeding and measuring co-evolving populations, compiled (Curkovic et al. 2013, section 3)."""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.arm_pairs import LARGEST, count_pairs
from evoexp.collision.planar.planar_arms import Arm, tolerance_of, write_outlines
from evoexp.evolution.best_team import CollisionCounts
from evoexp.evolution.hall_of_fame import Hall, HallRules, renew_hall
from evoexp.evolution.operators.breeding import Breeding, Cross, Mutate, Select, breed
from evoexp.evolution.pareto import pareto_front
from evoexp.evolution.succession import choose_elites, copy_members
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.motion_criteria import measure_motions
from evoexp.planners.coevolution.teams import Evaluated
from evoexp.records import BoolArray, FloatArray, IntArray

HALF_TURN = DEGREE * 180.0  # [rad] genes live in [0, π)


class Heredity(NamedTuple):
    """The rules by which one generation follows another."""

    num_elites: int  # individuals copied untouched
    breeding: Breeding  # rules of the operators
    moving: BoolArray  # (robots,) false for robots that stand still
    hall: Hall  # with room for as many teams as it may hold
    rules: HallRules  # which teams it takes
    # whether copies count as one individual, and members of the hall are offered again; else
    # members of the hall and their copies leave the fronts
    by_genome: bool
    copies_fronts: bool  # whether the hall is the front of each population, not pairs


class LineTask(NamedTuple):
    """Robots and the weights of their criteria."""

    starts: FloatArray  # (robots, 2) link angles [rad]
    goals: FloatArray  # (robots, 2) [rad]
    arms: FloatArray  # (robots, 4) base x, base y, lengths of both links [length unit]
    weights: tuple[float, float, float]  # of C2, C3, C4
    collision_weight: float  # of C1


@kernel
def breed_robots(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    # (moving robots, numbers) uniform in [0, 1): parents, then cross-over, then mutation
    uniforms: FloatArray,
    index: int,  # of the present generation
    rate: float,  # probability that an allele of an individual is mutated (Eq. 10)
    populations: FloatArray,  # (robots, genes, individuals)
    costs: FloatArray,  # (robots, individuals)
    # (teams, robots) members of the hall, −1: none; written: their places in the next populations
    teams: IntArray,
    heredity: Heredity,
    bred: FloatArray,  # like populations, written
) -> None:
    """Write the next populations: offspring, then elites, then members of the hall, unchanged."""
    num_elites, elites = heredity.num_elites, np.empty(heredity.num_elites, dtype=np.int64)
    rules, normals, row = heredity.breeding, np.empty((0, 0)), 0
    for robot in range(len(populations)):
        held = count_members(teams, robot)
        count = populations.shape[2] - num_elites - held
        members = teams[:held, robot].copy()
        for k in range(held):
            teams[k, robot] = count + num_elites + k
        if not heredity.moving[robot]:
            bred[robot] = populations[robot]
            continue
        parents = np.empty(count, dtype=np.int64)
        draws, genes, before = uniforms[row], bred[robot], populations[robot]
        own, row = costs[robot], row + 1
        breed(
            select, cross, mutate, draws, normals, index, rate, rules, own, before, parents, genes
        )
        # elites and members of the hall, untouched
        choose_elites(own, elites)
        copy_members(before, elites, genes, count)
        copy_members(before, members, genes, count + num_elites)


@kernel
def count_members(teams: IntArray, robot: int) -> int:
    """Return how many individuals of a robot's population the hall (teams, robots) holds."""
    held = 0
    while held < len(teams) and teams[held, robot] >= 0:
        held += 1
    return held


@kernel
def copy_fronts(
    populations: FloatArray,  # (robots, genes, individuals)
    criteria: FloatArray,  # (robots, criteria, individuals), all minimised
    costs: FloatArray,  # (robots, individuals)
    heredity: Heredity,  # the hall and its rules
) -> int:
    """Let the hall hold the front of each population, the cheapest if it has too few places.

    "The Pareto front is copied to the next generation. The size of the front is limited"
    (section 3). A population whose front is smaller has members −1 at the end.

    Returns:
        Number of rows of the hall that are used.
    """
    teams, fronts, used = heredity.hall.teams, np.empty(costs.shape, dtype=np.bool_), 0
    for robot in range(len(populations)):
        fronts[robot] = pareto_front(criteria[robot])
    if heredity.by_genome:
        merge_copies(populations, criteria[:, 1], teams[:0], fronts)
    for robot in range(len(populations)):
        front = np.flatnonzero(fronts[robot])
        held = min(len(front), len(teams))
        order = np.empty(held, dtype=np.int64)
        choose_elites(costs[robot][front], order)
        teams[:, robot] = -1
        for k in range(held):
            teams[k, robot] = front[order[k]]
        used = max(used, held)
    return used


@kernel
def renew(
    populations: FloatArray,  # (robots, genes, individuals)
    criteria: FloatArray,  # (robots, criteria, individuals), all minimised
    collisions: CollisionCounts,
    own: FloatArray,
    best: IntArray,  # (robots,) the best team; −1 if there is none
    num_teams: int,  # teams of the hall at present
    heredity: Heredity,  # the hall and its rules
) -> int:
    """Renew the hall of fame from the Pareto fronts of all populations, without copies.

    Members of the fronts are offered with their best collaborators. With distinct genomes the best
    team of the generation is offered as it is, so that it is never lost; and a robot that stands
    still, which has one genome, may be in all teams.

    Returns:
        Number of teams that the hall holds then.
    """
    hall = heredity.hall
    fronts = np.empty(own.shape, dtype=np.bool_)
    for robot in range(len(populations)):
        fronts[robot] = pareto_front(criteria[robot])
    if heredity.by_genome:
        merge_copies(populations, criteria[:, 1], hall.teams[:num_teams], fronts)
        offered = best
    else:
        drop_copies(populations, hall.teams[:num_teams], fronts)
        offered = np.full(len(populations), -1)
    return int(renew_hall(collisions, own, fronts, hall, num_teams, offered, heredity.rules))


@kernel
def merge_copies(
    populations: FloatArray, marks: FloatArray, teams: IntArray, fronts: BoolArray
) -> None:
    """Let the first of equal genomes stand for all of them, and offer the hall's members again.

    Args:
        populations: (robots, genes, individuals).
        marks: (robots, individuals) a number that equal genomes have in common, to find them by.
        teams: (teams, robots) members of the hall, rewritten.
        fronts: (robots, individuals) changed: copies leave them, members of the hall join them.
    """
    mark = np.empty(populations.shape[2])
    for robot in range(len(populations)):
        genes, front = populations[robot], fronts[robot]
        first = np.arange(genes.shape[1])
        for member in range(len(mark)):
            mark[member] = marks[robot, member]
        for member in range(1, len(mark)):
            # few have a mark in common: counting those, eight at once, is faster than looking
            own, num_alike = mark[member], 0
            for other in range(member):
                num_alike += 1 if mark[other] == own else 0
            if num_alike == 0:
                continue
            for other in range(member):
                if mark[other] == own and same_genome(genes, other, member):
                    first[member] = other
                    front[member] = False
                    break
        for k in range(len(teams)):
            teams[k, robot] = first[teams[k, robot]]
            front[teams[k, robot]] = True


@kernel
def drop_copies(populations: FloatArray, teams: IntArray, fronts: BoolArray) -> None:
    """Take copies of other members, and of the hall's, off the fronts.

    They would fill the hall with one pair. On fronts (robots, individuals), of equal genomes the
    first stays, none if the hall has one; `teams` (teams, robots) are the members of the hall.
    """
    for robot in range(len(populations)):
        genes, front = populations[robot], fronts[robot]
        # genomes known so far: the hall's, then those that stay on the front
        known = np.empty(len(teams) + genes.shape[1], dtype=np.int64)
        num_known = len(teams)
        for k in range(num_known):
            known[k] = teams[k, robot]
        for member in range(genes.shape[1]):
            if front[member]:
                for k in range(num_known):
                    front[member] &= not same_genome(genes, member, known[k])
            if front[member]:
                known[num_known] = member
                num_known += 1


@kernel
def same_genome(genes: FloatArray, one: int, other: int) -> bool:
    """Return whether two individuals of a population (genes, individuals) are copies."""
    gene = 0
    while gene < len(genes) and genes[gene, one] == genes[gene, other]:
        gene += 1
    return gene == len(genes)


@kernel
def measure(
    populations: FloatArray,  # (robots, 2 K, individuals) link angles [rad]
    task: LineTask,
    # (robots, K + 2, 2, individuals) written: link angles, start and goal included
    paths: FloatArray,
    points: FloatArray,  # (robots, K + 2, 4, individuals) written: elbow x, y, tip x, y
    criteria: FloatArray,  # (robots, 4, individuals), C2, C3, C4 written
    own: FloatArray,  # (robots, individuals) written: their weighted sum
) -> None:
    """Lay out all paths, and measure their costs whoever their collaborators are."""
    starts, goals, last = task.starts, task.goals, paths.shape[1] - 1
    for r in range(len(populations)):
        path, genes = paths[r], populations[r]
        # start, genes, goal
        for link in range(2):
            path[0, link], path[last, link] = starts[r, link], goals[r, link]
            for k in range(1, last):
                path[k, link] = genes[2 * (k - 1) + link]
        # where the links are (Eq. 11), then Eqs. 6–8
        write_outlines(path, line_arm(task.arms, r), points[r])
        measure_motions(path, points[r], task.weights, criteria[r, 1:], own[r])


@kernel
def line_arm(arms: FloatArray, robot: int) -> Arm:
    """Return a robot's arm without an envelope; arms as of `LineTask`."""
    return Arm((arms[robot, 0], arms[robot, 1]), (arms[robot, 2], arms[robot, 3]), 0.0, 0.0)


@kernel
def evaluate_lines(
    populations: FloatArray,  # (robots, 2 K, individuals) link angles [rad]
    task: LineTask,
    found: Evaluated,  # written, all but `blocked`: there are no obstacles
) -> bool:
    """Evaluate everybody against everybody of the other robots, where robots are lines (Eq. 4).

    One call does what `Coevolution.evaluated` does step by step with other models; between the
    steps Python would take a third of the time.

    Returns:
        False if a coordinate is not finite.
    """
    costs, criteria, own, collisions = found.costs, found.criteria, found.own, found.collisions
    robots, genes, count = populations.shape
    last = genes // 2 + 1
    paths, points = np.empty((robots, last + 1, 2, count)), np.empty((robots, last + 1, 4, count))
    # C2 … C4 (Eqs. 6–8)
    measure(populations, task, paths, points, criteria, own)
    # C1 (Eqs. 4, 5) at the configurations between start and goal
    rows, columns = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    sums, pair = np.zeros((robots, count), dtype=np.int64), 0
    for a in range(robots):
        for b in range(a + 1, robots):
            one, two = line_arm(task.arms, a), line_arm(task.arms, b)
            first, second, near = points[a][1:last], points[b][1:last], tolerance_of(one, two)
            count_pairs(one, first, two, second, near, collisions[pair], rows, columns)
            for k in range(count):
                sums[a, k] += rows[k]
                sums[b, k] += columns[k]
            pair += 1
    for r in range(robots):
        for k in range(count):
            if not abs(own[r, k]) < LARGEST:
                return False
            criteria[r, 0, k] = sums[r, k]
            costs[r, k] = task.collision_weight * sums[r, k] + own[r, k]
    return True
