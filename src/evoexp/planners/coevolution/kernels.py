"""Co-evolving populations, measured all against all, and their teams (Curkovic et al. 2013).

A team is one individual of every population: its paths are executed together.
"""

from itertools import combinations
from typing import NamedTuple, Self

import numpy as np

from evoexp.collision.planar.arm_pairs import LARGEST, count_pairs
from evoexp.collision.planar.planar_arms import Arm, tolerance_of, write_outlines
from evoexp.evolution.operators.operator import Breeding
from evoexp.evolution.succession import choose_elites, cost_statistics, pareto_front
from evoexp.evolution.teams import (
    BestTeam,
    CollisionCounts,
    Hall,
    HallRules,
    best_team,
    pair_index,
    rate_team,
    renew_hall,
)
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.motion_criteria import measure_motions
from evoexp.records import BoolArray, FloatArray, IntArray

HALF_TURN = DEGREE * 180.0  # [rad] genes live in [0, π)


class Evaluated(NamedTuple):
    """Populations evaluated all against all."""

    costs: FloatArray  # (robots, individuals) C1 + C2 + C3 + C4, weighted
    criteria: FloatArray  # (robots, 4, individuals) C1 … C4
    own: FloatArray  # (robots, individuals) C2 + C3 + C4, weighted
    # (pairs of robots, individuals, individuals) colliding configurations
    collisions: CollisionCounts
    blocked: IntArray  # (robots, individuals) configurations that collide with obstacles

    @classmethod
    def room(cls, robots: int, count: int) -> Self:
        """Return memory for populations of `count` individuals."""
        own, costs = np.empty((2, robots, count))
        pairs = np.empty((robots * (robots - 1) // 2, count, count), dtype=np.int16)
        blocked = np.zeros((robots, count), dtype=np.int64)
        return cls(costs, np.empty((robots, 4, count)), own, pairs, blocked)

    @property
    def teamable(self) -> FloatArray:
        """(robots, individuals) own cost; inf if it collides with an obstacle."""
        return np.asarray(teamable_costs(self.own, self.blocked))

    def team_of(self, individual: int) -> IntArray:
        """Return the cheapest collision-free team (robots,) with an individual of the first robot.

        Where there is none, everybody else is who collides least with that individual.
        """
        own = self.teamable.copy()
        alone = own[0, individual]
        own[0] = np.inf
        own[0, individual] = alone
        best = best_team(self.collisions, own)
        if best.found:
            return best.individuals
        team = np.zeros(len(own), dtype=np.int64)
        team[0] = individual
        for other in range(1, len(own)):
            team[other] = int(np.argmin(self.collisions[other - 1, individual]))
        return team

    def cost_of(self, team: IntArray) -> float:
        """Return the summed own cost of a team (robots,); inf if it collides."""
        hits, cost = rate_team(self.collisions, self.own, team)
        return np.inf if hits or any(self.blocked[range(len(team)), team]) else cost

    def terms_of(self, team: IntArray) -> dict[str, float]:
        """Return C1 … C4 of every robot of a team, C1 against the team's other robots only."""
        members = team.tolist()
        met = [self.blocked.item(r, i) for r, i in enumerate(members)]
        total = sum(met)
        for pair, (a, b) in enumerate(combinations(range(len(members)), 2)):
            hits = self.collisions.item(pair, members[a], members[b])
            total, met[a], met[b] = total + hits, met[a] + hits, met[b] + hits
        terms = {
            "team_cost": float(sum(self.own.item(r, i) for r, i in enumerate(members))),
            "team_collisions": float(total),
        }
        for r, individual in enumerate(members):
            _, path, rotation, evenness = self.criteria[r, :, individual].tolist()
            terms[f"collisions_robot_{r + 1}"] = float(met[r])
            terms[f"tip_path_robot_{r + 1}"] = path
            terms[f"rotation_robot_{r + 1}_rad"] = rotation
            terms[f"tip_unevenness_robot_{r + 1}"] = evenness
        return terms


class Generation(NamedTuple):
    """Populations, judged."""

    populations: FloatArray  # (robots, 2 K, individuals)
    judged: Evaluated  # all against all
    best: BestTeam  # the best team, if there is one


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
    half_width: float  # of the robots' envelopes, 0.0 of lines [length unit]
    tcp_radius: float  # of the circles around their tips, 0.0: none


@kernel
def count_members(teams: IntArray, robot: int) -> int:
    """Return how many individuals of a robot's population the hall (teams, robots) holds.

    −1 stands for none, at the end.
    """
    held = 0
    while held < len(teams) and teams[held, robot] >= 0:
        held += 1
    return held


@kernel
def copy_fronts(present: Generation, heredity: Heredity) -> None:
    """Let the hall hold the front of each population, the cheapest if it has too few places.

    "The Pareto front is copied to the next generation. The size of the front is limited"
    (section 3). Where a front is smaller than others, members −1 stand at the end.
    """
    (populations, judged, _), teams, used = present, heredity.hall.teams, 0
    criteria, costs = judged.criteria, judged.costs
    fronts = np.empty(costs.shape, dtype=np.bool_)
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
    heredity.hall.num_teams[0] = used


@kernel
def renew(present: Generation, heredity: Heredity) -> None:
    """Renew the hall of fame from the Pareto fronts of all populations, without copies.

    Members of the fronts are offered with their best collaborators. With distinct genomes the best
    team of the generation is offered as it is, so that it is never lost; and a robot that stands
    still, which has one genome, may be in all teams.
    """
    (populations, judged, best), hall, criteria = present, heredity.hall, present.judged.criteria
    teams = hall.teams[: hall.num_teams[0]]
    own = teamable_costs(judged.own, judged.blocked)
    fronts = np.empty(own.shape, dtype=np.bool_)
    for robot in range(len(populations)):
        fronts[robot] = pareto_front(criteria[robot])
    if heredity.by_genome:
        merge_copies(populations, criteria[:, 1], teams, fronts)
        offered = best.individuals
    else:
        drop_copies(populations, teams, fronts)
        offered = np.full(len(populations), -1)
    renew_hall(judged.collisions, own, fronts, hall, offered, heredity.rules)


@kernel
def merge_copies(
    populations: FloatArray, marks: FloatArray, teams: IntArray, fronts: BoolArray
) -> None:
    """Let the first of equal genomes stand for all of them, and offer the hall's members again.

    `marks` (robots, individuals) are numbers that equal genomes have in common. `teams` (teams,
    robots) are rewritten; copies leave the fronts (robots, individuals), members of the hall join
    them.
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
        write_outlines(path, arm_of(task, r), points[r])
        measure_motions(path, points[r], task.weights, criteria[r, 1:], own[r])


@kernel
def arm_of(task: LineTask, robot: int) -> Arm:
    """Return a robot's arm."""
    x, y, first, second = task.arms[robot]
    return Arm((x, y), (first, second), task.half_width, task.tcp_radius)


@kernel
def count_crossings(
    outlines: FloatArray,  # (robots, configurations, 4 | 8, individuals) see `planar_arms`
    untested: int,  # configurations at either end that are not tested
    task: LineTask,
    found: Evaluated,  # `costs`, `collisions` and C1 are written
) -> bool:
    """Count the collisions of everybody with everybody of the other robots (Eqs. 4, 5).

    Returns False if a coordinate is not finite.
    """
    own, (robots, count) = found.own, found.own.shape
    last = outlines.shape[1] - untested
    rows, columns = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    sums, pair = found.blocked * count, 0  # an obstacle is in the way of every team
    for a in range(robots):
        for b in range(a + 1, robots):
            one, two = arm_of(task, a), arm_of(task, b)
            first, second = outlines[a][untested:last], outlines[b][untested:last]
            near, counts = tolerance_of(one, two), found.collisions[pair]
            count_pairs(one, first, two, second, near, counts, rows, columns)
            for k in range(count):
                sums[a, k] += rows[k]
                sums[b, k] += columns[k]
            pair += 1
    for r in range(robots):
        for k in range(count):
            if not abs(own[r, k]) < LARGEST:
                return False
            found.criteria[r, 0, k] = sums[r, k]
            found.costs[r, k] = task.collision_weight * sums[r, k] + own[r, k]
    return True


@kernel
def survey(found: Evaluated, summary: FloatArray) -> BestTeam:
    """Return the best team, and write a summary.

    It is: index of the best individual of all populations, mean and deviation of all costs, and how
    many of the first robot have a collision-free partner in every population.
    """
    summary[0], summary[1], summary[2] = cost_statistics(found.costs.reshape(-1))
    summary[3] = count_partnered(found.collisions, found.blocked)
    return best_team(found.collisions, teamable_costs(found.own, found.blocked))


@kernel
def teamable_costs(own: FloatArray, blocked: IntArray) -> FloatArray:
    """Return own costs (robots, individuals); inf if one collides with an obstacle."""
    teamable = np.empty(own.shape)
    for r in range(len(own)):
        for k in range(own.shape[1]):
            teamable[r, k] = np.inf if blocked[r, k] > 0 else own[r, k]
    return teamable


@kernel
def count_partnered(collisions: CollisionCounts, blocked: IntArray) -> int:
    """Count the individuals of the first robot with a collision-free partner everywhere."""
    count = 0
    for i in range(blocked.shape[1]):
        partnered = blocked[0, i] == 0
        for other in range(1, len(blocked)):
            row, found = collisions[pair_index(len(blocked), 0, other), i], False
            for j in range(blocked.shape[1]):
                found |= (row[j] == 0) & (blocked[other, j] == 0)
            partnered &= found
        count += 1 if partnered else 0
    return count
