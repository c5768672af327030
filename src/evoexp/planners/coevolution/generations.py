"""One run of co-evolving populations: the way from a generation to the next (Fig. 2)."""

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evoexp.collision.certifier.certificate import PAIR
from evoexp.evolution.operators.breeding import Breeding, Cross, Mutate, Select, breed
from evoexp.evolution.operators.operator import Genome
from evoexp.evolution.succession import choose_elites, copy_members
from evoexp.evolution.teams import BestTeam, Hall, HallRules, best_team
from evoexp.numeric.compilation import kernel
from evoexp.planners.coevolution.kernels import (
    HALF_TURN,
    Evaluated,
    Heredity,
    copy_fronts,
    count_members,
    renew,
    survey,
)
from evoexp.planners.driver import TableSearch
from evoexp.planners.planner import Candidate
from evoexp.planners.proofs import Proofs
from evoexp.records import FloatArray, IntArray

if TYPE_CHECKING:
    from evoexp.planners.coevolution.planner import Coevolution, Problem

MOST = 100  # teams that are judged of one generation; the others are no answer


class Table(NamedTuple):
    """Some generations; number g is at place g modulo the number of places."""

    populations: FloatArray  # (places, robots, 2 K, individuals)
    judged: Evaluated  # of each place
    teams: IntArray  # (places, robots) the best team of each; −1 if there is none
    team_costs: FloatArray  # (places,) inf if there is none


@kernel
def at_place(judged: Evaluated, place: int) -> Evaluated:
    """Return the populations at a place, evaluated: views."""
    return Evaluated(
        judged.costs[place],
        judged.criteria[place],
        judged.own[place],
        judged.collisions[place],
        judged.blocked[place],
    )


@kernel
def follow(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    uniforms: FloatArray,  # at least as many as it takes
    index: int,  # the present generation
    rate: float,  # of mutation
    heredity: Heredity,  # the rules
    table: Table,  # generations, of which the next one is written
    num_teams: IntArray,  # (1,) changed
) -> int:
    """Renew the hall of fame, and breed the generation that follows one.

    It has offspring, then elites, then members of the hall, unchanged. Returns how many numbers it
    took: uniform in [0, 1), for each moving robot those of parents, cross-over, mutation.
    """
    rules = heredity.breeding
    own, other = index % len(table.team_costs), (index + 1) % len(table.team_costs)
    hall, before, judged = heredity.hall, table.populations[own], at_place(table.judged, own)
    if heredity.copies_fronts:
        num_teams[0] = copy_fronts(before, judged, heredity)
    elif len(hall.teams):
        num_teams[0] = renew(before, judged, table.teams[own], num_teams[0], heredity)
    teams, num_elites, taken = hall.teams[: num_teams[0]], heredity.num_elites, 0
    fewest, elites = len(teams), np.empty(num_elites, dtype=np.int64)
    for robot in range(len(before)):
        fewest = min(fewest, count_members(teams, robot))
    size = np.sum(rules.sizes[fewest])
    for robot in range(len(before)):
        held = count_members(teams, robot)
        members, count = teams[:held, robot].copy(), before.shape[2] - num_elites - held
        for k in range(held):
            teams[k, robot] = count + num_elites + k
        out, genomes = table.populations[other, robot], before[robot]
        costs, normals = judged.costs[robot], np.empty((0, 0))
        if not heredity.moving[robot]:
            out[:] = genomes
            continue
        parents = np.empty(count, dtype=np.int64)
        draws, taken = uniforms[taken : taken + size], taken + size
        breed(
            select, cross, mutate, draws, normals, index, rate, rules, costs, genomes, parents, out
        )
        # elites and members of the hall, untouched
        choose_elites(costs, elites)
        copy_members(genomes, elites, out, count)
        copy_members(genomes, members, out, count + num_elites)
    return int(taken)


class TeamSearch(TableSearch):
    """One run, and memory for its generations."""

    def __init__(self, planner: "Coevolution", problem: "Problem") -> None:
        """Begin a run."""
        ga, robots = planner.ga, len(problem.start)
        self._planner, self._problem, self._size = planner, problem, ga.population_size
        self._proven = ProvenTeams(planner, problem) if planner.answers_are_proven else None
        super().__init__(ga, 1)
        num_genes, free = 2 * planner.num_configurations, self._size - ga.num_elites
        self._table = Table(
            np.empty((self.num_places, robots, num_genes, self._size)),
            Evaluated.room(self.num_places, robots, self._size),
            np.empty((self.num_places, robots), dtype=np.int64),
            np.empty(self.num_places),
        )
        self.costs, self._waiting = self._table.judged.costs, 0
        by_genome, operators = ga.hall_distinct == "genome", ga.operators
        genome = Genome.of(np.repeat([[0.0, HALF_TURN]], num_genes, axis=0))
        counts = [free - teams for teams in range(ga.num_hall_teams + 1)]
        self._operators = operators.addresses
        self._heredity = Heredity(
            ga.num_elites,
            Breeding.of(operators, genome, ga, counts),
            problem.moving,
            Hall.room(ga.num_hall_teams, robots),
            HallRules(
                memory=ga.hall_memory or 0,
                frozen=ga.hall_frozen,
                exclusive=problem.moving if by_genome else np.ones_like(problem.moving),
            ),
            by_genome,
            ga.num_hall_teams > 0 and ga.hall_members == "front",
        )
        self._num_teams = np.zeros(1, dtype=np.int64)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial populations."""
        self._table.populations[0] = self._planner.sample(self._problem, rng, self._size)
        self._judge(0)
        most = int(np.count_nonzero(self._problem.moving))
        most *= int(self._heredity.breeding.sizes.sum(axis=1).max())
        self._most_drawn = max(most, self._table.populations[0].size)

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Breed and judge the generation behind one."""
        state, uniforms = rng.bit_generator.state, rng.random(self._most_drawn)
        taken = self._follow(uniforms, first)
        rng.bit_generator.state = state  # the generator goes on behind the numbers that were taken
        rng.random(taken)
        self._judge(last % self.num_places)
        return last

    def _follow(self, uniforms: FloatArray, index: int) -> int:
        """Breed the generation behind one, or begin anew; return how many numbers that took."""
        self._waiting, ga = 0 if self.keeper.best.solved else self._waiting + 1, self._planner.ga
        if ga.restart_after is None or self._waiting < ga.restart_after:
            rate, (select, cross, mutate) = ga.mutation_rate_at(index + 1), self._operators
            rules = self._heredity, self._table, self._num_teams
            return int(follow(select, cross, mutate, uniforms, index, rate, *rules))
        # "If no convergence has occurred, …, the algorithm generates new populations" (section 3)
        populations = self._table.populations[(index + 1) % self.num_places]
        own = uniforms[: populations.size].reshape(populations.shape)
        populations[:] = self._planner.populations_of(self._problem, own)
        self._waiting = self._num_teams[0] = 0
        return int(populations.size)

    def _judge(self, place: int) -> None:
        """Evaluate the populations at a place, whatever the model is; see who is proven."""
        populations, found = self._table.populations[place], at_place(self._table.judged, place)
        evaluated = self._planner.evaluated(self._problem, populations)
        for array, values in zip(found, evaluated, strict=True):
            array[...] = values
        settled = self._proven.settle(populations, found) if self._proven else None
        team = self._table.teams[place]
        self._table.team_costs[place] = survey(found, team, self.summaries[place])
        if settled is not None:
            team[:], self._table.team_costs[place] = settled

    def lowest(self, places: IntArray) -> FloatArray:
        """Return the costs of the best teams."""
        return np.asarray(self._table.team_costs[places])

    def best(self, place: int) -> Candidate:
        """Return the best team, or the best of every population where no team was found."""
        found = at_place(self._table.judged, place)
        best = BestTeam(self._table.teams[place], self._table.team_costs.item(place))
        team = best.individuals if best.found else found.costs.argmin(axis=1)
        populations = self._table.populations[place]
        solution = self._planner.team_solution(self._problem, populations, team)
        return Candidate(solution, found.terms_of(team), best.found)

    def counts(self, index: int) -> tuple[int, int]:
        """Return the individuals of all populations, and the configurations of all teams."""
        evaluations = len(self._problem.start) * self._size
        return evaluations, self._planner.queries(self._problem, self._size)

    def population(self, index: int) -> FloatArray:
        """Return the populations."""
        return np.asarray(self._table.populations[index % self.num_places])

    def criteria(self, place: int) -> FloatArray | None:
        """Return the criteria of all individuals."""
        return np.asarray(self._table.judged.criteria[place])


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
