"""Teams accepted by proof: what the exact certifier refutes counts as one more collision."""

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from evoexp.collision.certifier.certificate import PAIR
from evoexp.evolution.best_team import BestTeam, best_team
from evoexp.planners.coevolution.kernels import Evaluated
from evoexp.planners.proofs import Proofs
from evoexp.records import FloatArray, IntArray

if TYPE_CHECKING:
    from evoexp.planners.coevolution.planner import Coevolution, Problem

MOST = 100  # teams that are judged of one generation; the others are no answer


class ProvenTeams:
    """Judges the cheapest teams of populations, and counts collisions where one is refuted."""

    def __init__(self, planner: "Coevolution", problem: "Problem") -> None:
        """Begin with no verdict; the planner's `acceptance` is not `model`."""
        self._planner, self._problem = planner, problem
        self._proofs = Proofs(planner, problem)
        links = [arm.tolist() for arm in problem.assembly.arm_slices]
        joints = [item.parentJoint - 1 for item in problem.scene.geometry.geometryObjects]
        self._robots = {
            name: next((r for r, (first, stop) in enumerate(links) if first <= joint < stop), -1)
            for name, joint in zip(problem.scene.names, joints, strict=True)
        }

    @property
    def num_certificates(self) -> int:
        """Motions judged so far."""
        return self._proofs.num_certificates

    def settle(self, populations: FloatArray, found: Evaluated) -> BestTeam:
        """Judge teams, the cheapest first, until one is proven; return it, or one not found.

        Collisions and costs of those who are refuted are raised.
        """
        for _ in range(MOST):
            best = best_team(found.collisions, found.teamable)
            if not best.found or self._is_proven(populations, found, best.individuals):
                return best
        return BestTeam(np.full(len(found.own), -1), np.inf)

    def settle_each(self, populations: FloatArray, found: Evaluated, costs: FloatArray) -> None:
        """Judge the cheapest teams of the first robot's individuals until one is proven.

        `costs` (individuals,) are those of their cheapest teams; changed. See `settle`.
        """
        for _ in range(MOST):
            k = int(np.argmin(costs))
            if not costs[k] < np.inf or self._is_proven(populations, found, found.team_of(k)):
                return
            costs[k] = found.cost_of(found.team_of(k))
        costs[:] = np.inf

    def team_of(self, populations: FloatArray, found: Evaluated, individual: int) -> IntArray:
        """Return the cheapest proven team with an individual of the first robot; see `settle`."""
        for _ in range(MOST):
            team = found.team_of(individual)
            if not found.cost_of(team) < np.inf or self._is_proven(populations, found, team):
                break
        return team

    def _is_proven(self, populations: FloatArray, found: Evaluated, team: IntArray) -> bool:
        """Whether a team is proven; one that is refuted counts as colliding."""
        solution = self._planner.team_solution(self._problem, populations, team)
        proven = self._proofs.is_proven(solution)
        if not proven:
            self._refute(found, team, self._proofs.touching_pair(solution))
        return proven

    def _refute(self, found: Evaluated, team: IntArray, bodies: str) -> None:
        """Count one more collision of the robots that touch, or of all if none are named."""
        own = [self._robots[name] for name in bodies.split(PAIR)] if bodies else []
        touching = sorted({robot for robot in own if robot >= 0})
        if len(touching) == 1 and len(own) == 2:  # with an obstacle, whoever the others are
            robot = touching[0]
            found.blocked[robot, team[robot]] += 1
            self._raise(found, robot, team, found.costs.shape[1])
            return
        for pair, (a, b) in enumerate(combinations(range(len(team)), 2)):
            if not touching or (a in touching and b in touching):
                found.collisions[pair, team[a], team[b]] += 1
                self._raise(found, a, team, 1)
                self._raise(found, b, team, 1)

    def _raise(self, found: Evaluated, robot: int, team: IntArray, hits: int) -> None:
        """Raise C1 of a team's member, and its cost with it."""
        found.criteria[robot, 0, team[robot]] += hits
        found.costs[robot, team[robot]] += self._planner.objective.collision_weight * hits
