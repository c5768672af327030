"""One run of co-evolving populations: its settings, and the way to the next generation (Fig. 2)."""

import math
from itertools import combinations
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from evoexp.collision.certifier.certificate import PAIR
from evoexp.evolution.operators import operator
from evoexp.evolution.operators.crossover import OnePoint
from evoexp.evolution.operators.mutation import AlleleMutation
from evoexp.evolution.operators.selection import DifferenceRoulette, InverseRoulette
from evoexp.evolution.succession import choose_elites, copy_members
from evoexp.evolution.teams import BestTeam, Hall, HallRules, best_team
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.planners.answers import Proofs
from evoexp.planners.coevolution import kernels
from evoexp.planners.driver import TableSearch
from evoexp.planners.planner import Candidate
from evoexp.records import FloatArray, IntArray
from evoexp.validation import Count, Positive, Rate

if TYPE_CHECKING:
    from evoexp.planners.coevolution.planner import Coevolution, Problem

MOST = 100  # teams that are judged of one generation; the others are no answer
_FLOOR_GUARD = 1e-9  # [-] 0.29 × 100 is 28.999999999999996


class CoevolutionSettings(operator.PopulationSettings):
    """Settings of co-evolving populations, the same for each (Curkovic et al. 2013, section 3)."""

    component: ClassVar[str] = "coevolutionary"

    # difference of `mutation_rate`, that of one allele of an individual, between the first and the
    # last generation (Eq. 10) [-]; 0: it is constant
    mutation_decay: Rate
    mutation_step: Positive  # largest change of an allele (Eq. 9) [deg]
    # `one_sided` as Eq. 9 is printed (alleles only grow), or `symmetric`
    mutation_direction: Literal["one_sided", "symmetric"]
    # weight on the roulette wheel: the `inverse` of the cost, or its `difference` to the
    # highest
    selection: Literal["inverse", "difference"] | operator.Named[operator.Selection]
    hall_depth: Rate  # share of a population that the hall of fame may hold [-]; 0: no hall
    # generations after which a team of the hall gives way to any new one [-]; None: never
    hall_memory: Count | None
    hall_frozen: bool  # whether a full hall stays as it is (an ablation)
    # generations without a feasible team before fresh populations are drawn [-]; None: never
    restart_after: Count | None
    # nobody is in two teams of the hall. `genome`: copies count as one, and members of the
    # hall are offered again, so that one may find a better partner. `index`: copies count as
    # others, so the hall may fill with copies of one team; members of the hall are not
    # offered again. Runs by index are bit for bit those of revision 1 of `coevolution`,
    # unless a link's angle is exactly a multiple of 90°
    hall_distinct: Literal["genome", "index"] = "genome"
    # what the hall holds. `pairs`: teams of members of the fronts, until a better one is found;
    # `front`: the present front of each population, the cheapest first, copied to the next
    hall_members: Literal["pairs", "front"] = "pairs"

    crossover: operator.Named[operator.Crossover] | None = None  # None: at one point
    mutation: operator.Named[operator.Mutation] | None = None  # None: of one allele (Eq. 9)

    def _check(self) -> None:
        super()._check()
        rate, demand = self.mutation_rate, self.demand
        demand("mutation_decay", self.mutation_decay <= rate, f"at most mutation_rate ({rate})")
        has_hall, no_hall = self.hall_depth > 0.0, "where there is no hall (hall_depth is 0)"
        must = "0, or large enough for one pair (at least 1/population_size)"
        demand("hall_depth", not has_hall or self.num_hall_teams > 0, must)
        demand("hall_memory", has_hall or self.hall_memory is None, f"null {no_hall}")
        demand("hall_frozen", has_hall or not self.hall_frozen, f"false {no_hall}")
        demand("hall_distinct", has_hall or self.hall_distinct == "genome", f"genome {no_hall}")
        pairs, no_pairs = self.hall_members == "pairs", "where fronts are copied"
        demand("hall_members", has_hall or pairs, f"pairs {no_hall}")
        demand("hall_memory", pairs or self.hall_memory is None, f"null {no_pairs}")
        demand("hall_frozen", pairs or not self.hall_frozen, f"false {no_pairs}")
        must = "null where the hall is frozen (hall_frozen)"
        demand("hall_memory", not self.hall_frozen or self.hall_memory is None, must)
        most = self.population_size - self.num_hall_teams
        must = f"at most population_size less the hall's teams ({most})"
        demand("num_elites", self.num_offspring >= 0, must)
        takes_normals = self.mutation is not None and self.mutation.takes_normals
        demand("mutation", not takes_normals, "one that takes uniform numbers only")

    @property
    def num_hall_teams(self) -> int:
        """Teams that the hall of fame may hold; each takes one individual of every population."""
        return math.floor(self.hall_depth * self.population_size + _FLOOR_GUARD)

    @property
    def num_offspring(self) -> int:
        """Individuals of a population that are new beside the elites and a full hall."""
        return self.population_size - self.num_elites - self.num_hall_teams

    @property
    def operators(self) -> operator.Operators:
        """The paper's operators, where the settings name no others."""
        named: dict[Any, Any] = {"inverse": InverseRoulette(), "difference": DifferenceRoulette()}
        step, symmetric = DEGREE * self.mutation_step, self.mutation_direction == "symmetric"
        return operator.Operators(
            named.get(self.selection, self.selection),
            self.crossover or OnePoint(),
            self.mutation or AlleleMutation(step=step, symmetric=symmetric),
        )

    def mutation_rate_at(self, index: int) -> float:
        """Return the rate on the way to a generation (Eq. 10: 1 − 0.9 t/G)."""
        share = index / self.num_generations if self.num_generations > 0 else 0.0
        return min(max(self.mutation_rate - self.mutation_decay * share, 0.0), 1.0)


@kernel
def follow(
    select: operator.Select,
    cross: operator.Cross,
    mutate: operator.Mutate,
    uniforms: FloatArray,  # at least as many as it takes
    index: int,  # the present generation
    rate: float,  # of mutation
    heredity: kernels.Heredity,  # the rules
    present: kernels.Generation,
) -> tuple[FloatArray, int]:
    """Renew the hall of fame, and breed the populations that follow a generation.

    They have offspring, then elites, then members of the hall, unchanged. Returns them, and how
    many numbers were taken: uniform in [0, 1), for each moving robot those of parents, cross-over,
    mutation.
    """
    rules, hall, (before, judged, _) = heredity.breeding, heredity.hall, present
    if heredity.copies_fronts:
        kernels.copy_fronts(present, heredity)
    elif len(hall.teams):
        kernels.renew(present, heredity)
    teams, num_elites, taken = hall.teams[: hall.num_teams[0]], heredity.num_elites, 0
    fewest, elites = len(teams), np.empty(num_elites, dtype=np.int64)
    for robot in range(len(before)):
        fewest = min(fewest, kernels.count_members(teams, robot))
    size, following = np.sum(rules.sizes[fewest]), np.empty(before.shape)
    for robot in range(len(before)):
        held = kernels.count_members(teams, robot)
        members, count = teams[:held, robot].copy(), before.shape[2] - num_elites - held
        for k in range(held):
            teams[k, robot] = count + num_elites + k
        out, genomes = following[robot], before[robot]
        costs, normals = judged.costs[robot], np.empty((0, 0))
        if not heredity.moving[robot]:
            out[:] = genomes
            continue
        parents = np.empty(count, dtype=np.int64)
        draws, taken = uniforms[taken : taken + size], taken + size
        operator.breed(
            select, cross, mutate, draws, normals, index, rate, rules, costs, genomes, parents, out
        )
        # elites and members of the hall, untouched
        choose_elites(costs, elites)
        copy_members(genomes, elites, out, count)
        copy_members(genomes, members, out, count + num_elites)
    return following, int(taken)


class TeamSearch(TableSearch):
    """One run."""

    present: kernels.Generation  # the one computed last

    def __init__(self, planner: "Coevolution", problem: "Problem") -> None:
        ga, robots = planner.ga, len(problem.start)
        self._planner, self._problem, self._size = planner, problem, ga.population_size
        self._proven = ProvenTeams(planner, problem) if planner.answers_are_proven else None
        super().__init__(ga, 1)
        num_genes, free = 2 * planner.num_configurations, self._size - ga.num_elites
        self.costs = np.empty((self.num_places, robots, self._size))
        by_genome, operators = ga.hall_distinct == "genome", ga.operators
        genome = operator.Genome.of(np.repeat([[0.0, kernels.HALF_TURN]], num_genes, axis=0))
        depth = ga.num_hall_teams
        counts = [free - teams for teams in range(depth + 1)]
        self._operators, self._waiting = operators.addresses, 0
        self._heredity = kernels.Heredity(
            ga.num_elites,
            operator.Breeding.of(operators, genome, ga, counts),
            problem.moving,
            Hall(
                teams=np.empty((depth, robots), dtype=np.int64),
                ages=np.empty(depth, dtype=np.int64),
                num_teams=np.zeros(1, dtype=np.int64),
            ),
            HallRules(
                memory=ga.hall_memory or 0,
                frozen=ga.hall_frozen,
                exclusive=problem.moving if by_genome else np.ones_like(problem.moving),
            ),
            by_genome,
            depth > 0 and ga.hall_members == "front",
        )
        # uniform numbers that a generation takes at most
        most = int(np.count_nonzero(problem.moving))
        most *= int(self._heredity.breeding.sizes.sum(axis=1).max())
        self._most_drawn = max(most, robots * num_genes * self._size)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial populations."""
        self._judge(self._planner.sample(self._problem, rng, self._size), 0)

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Breed and judge the generation behind one, or begin anew."""
        state, uniforms = rng.bit_generator.state, rng.random(self._most_drawn)
        self._waiting, ga = 0 if self.keeper.best.solved else self._waiting + 1, self._planner.ga
        if ga.restart_after is None or self._waiting < ga.restart_after:
            rate, rules = ga.mutation_rate_at(last), (self._heredity, self.present)
            populations, taken = follow(*self._operators, uniforms, first, rate, *rules)
        else:
            # "If no convergence has occurred, …, the algorithm generates new populations" (section
            # 3)
            shape = self.present.populations.shape
            taken = math.prod(shape)
            own = uniforms[:taken].reshape(shape)
            populations = self._planner.populations_of(self._problem, own)
            self._waiting = self._heredity.hall.num_teams[0] = 0
        rng.bit_generator.state = state  # the generator goes on behind the numbers that were taken
        rng.random(taken)
        self._judge(populations, last % self.num_places)
        return last

    def _judge(self, populations: FloatArray, place: int) -> None:
        """Evaluate populations, whatever the model is; see who is proven."""
        found = self._planner.evaluated(self._problem, populations)
        settled = self._proven.settle(populations, found) if self._proven else None
        best = kernels.survey(found, self.summaries[place])
        self.present = kernels.Generation(populations, found, settled or best)
        self.costs[place] = found.costs

    def lowest(self, places: IntArray) -> FloatArray:
        """Return the cost of the best team."""
        return np.array([self.present.best.cost])

    def best(self, place: int) -> Candidate:
        """Return the best team, or the best of every population where no team was found."""
        populations, found, best = self.present
        team = best.individuals if best.found else found.costs.argmin(axis=1)
        solution = self._planner.team_solution(self._problem, populations, team)
        return Candidate(solution, found.terms_of(team), best.found)

    def counts(self, index: int) -> tuple[int, int]:
        """Return the individuals of all populations, and the configurations of all teams."""
        evaluations = len(self._problem.start) * self._size
        return evaluations, self._planner.queries(self._problem, self._size)

    def population(self, index: int) -> FloatArray:
        """Return the populations."""
        return self.present.populations

    def criteria(self, place: int) -> FloatArray | None:
        """Return the criteria of all individuals."""
        return self.present.judged.criteria


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

    def settle(self, populations: FloatArray, found: kernels.Evaluated) -> BestTeam:
        """Judge teams, the cheapest first, until one is proven; return it, or one not found.

        Collisions and costs of those who are refuted are raised.
        """
        for _ in range(MOST):
            best = best_team(found.collisions, found.teamable)
            if not best.found or self._is_proven(populations, found, best.individuals):
                return best
        return BestTeam(np.full(len(found.own), -1), np.inf)

    def settle_each(
        self, populations: FloatArray, found: kernels.Evaluated, costs: FloatArray
    ) -> None:
        """Judge the cheapest teams of the first robot's individuals until one is proven.

        `costs` (individuals,) are those of their cheapest teams; changed. See `settle`.
        """
        for _ in range(MOST):
            k = int(np.argmin(costs))
            if not costs[k] < np.inf or self._is_proven(populations, found, found.team_of(k)):
                return
            costs[k] = found.cost_of(found.team_of(k))
        costs[:] = np.inf

    def team_of(
        self, populations: FloatArray, found: kernels.Evaluated, individual: int
    ) -> IntArray:
        """Return the cheapest proven team with an individual of the first robot; see `settle`."""
        for _ in range(MOST):
            team = found.team_of(individual)
            if not found.cost_of(team) < np.inf or self._is_proven(populations, found, team):
                break
        return team

    def _is_proven(self, populations: FloatArray, found: kernels.Evaluated, team: IntArray) -> bool:
        """Whether a team is proven; one that is refuted counts as colliding."""
        solution = self._planner.team_solution(self._problem, populations, team)
        proven = self._proofs.is_proven(solution)
        if not proven:
            self._refute(found, team, self._proofs.touching_pair(solution))
        return proven

    def _refute(self, found: kernels.Evaluated, team: IntArray, bodies: str) -> None:
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

    def _raise(self, found: kernels.Evaluated, robot: int, team: IntArray, hits: int) -> None:
        """Raise C1 of a team's member, and its cost with it."""
        found.criteria[robot, 0, team[robot]] += hits
        found.costs[robot, team[robot]] += self._planner.objective.collision_weight * hits
