"""Populations evaluated all against all, and the teams in them (Curkovic et al. 2013, Eqs. 4–8).

A team is one individual of every population: its paths are executed together. `Evaluated` holds the
costs of individuals and how often they collide; everything else here reads it.
"""

from itertools import combinations
from typing import NamedTuple, Self

import numpy as np

from evoexp.evolution.best_team import CollisionCounts, best_team, pair_index
from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.evolution.hall_of_fame import rate_team
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


class Evaluated(NamedTuple):
    """Populations evaluated all against all."""

    costs: FloatArray  # (robots, individuals) C1 + C2 + C3 + C4, weighted
    criteria: FloatArray  # (robots, 4, individuals) C1 … C4
    own: FloatArray  # (robots, individuals) C2 + C3 + C4, weighted
    # (pairs of robots, individuals, individuals) colliding configurations
    collisions: CollisionCounts
    blocked: IntArray  # (robots, individuals) configurations that collide with obstacles

    @classmethod
    def room(cls, *shape: int) -> Self:
        """Return memory for populations of a shape (…, robots, individuals)."""
        *places, robots, count = shape
        own, costs = np.empty((2, *shape))
        pairs = np.empty((*places, robots * (robots - 1) // 2, count, count), dtype=np.int16)
        blocked = np.zeros(shape, dtype=np.int64)
        return cls(costs, np.empty((*places, robots, 4, count)), own, pairs, blocked)

    @property
    def teamable(self) -> FloatArray:
        """(robots, individuals) own cost; inf for those that collide with an obstacle."""
        return np.asarray(teamable_costs(self.own, self.blocked))

    def team_of(self, individual: int) -> IntArray:
        """Return the cheapest collision-free team with an individual of the first robot.

        Where there is none, everybody else is who collides least with that individual.

        Returns:
            (robots,) index of the member in each population.
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
        """Return C1 … C4 of every robot of a team (robots,) by name.

        C1 against the team's other robots only.
        """
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


@kernel
def survey(found: Evaluated, team: IntArray, summary: FloatArray) -> float:
    """Write the best team (robots,), −1 if there is none, and a summary; return the team's cost.

    The summary has the index of the best individual of all populations, mean and deviation of all
    costs, and the number of individuals of the first robot with a collision-free partner in every
    population.
    """
    teamable = teamable_costs(found.own, found.blocked)
    best = best_team(found.collisions, teamable)
    team[:] = best.individuals
    summary[0], summary[1], summary[2] = cost_statistics(found.costs.reshape(-1))
    summary[3] = count_partnered(found.collisions, found.blocked)
    return best.cost


@kernel
def teamable_costs(own: FloatArray, blocked: IntArray) -> FloatArray:
    """Return own costs (robots, individuals); inf of those that collide with an obstacle."""
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
