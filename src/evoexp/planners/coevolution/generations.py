"""Generations of robots that are lines, several of them in one call of a kernel.

What other collision models do step by step (`Coevolution.evolve`) is here one kernel: with
populations of 100, Python between the steps would take a third of the time.
"""

from typing import Any, NamedTuple, Self

import numpy as np

from evoexp.evolution.best_team import BestTeam, CollisionCounts
from evoexp.evolution.hall_of_fame import Hall, HallRules
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.random_stream import DrawnAhead
from evoexp.planners.coevolution.breeder import Breeder, num_uniforms
from evoexp.planners.coevolution.kernels import NOT_FINITE, Breeding, breed, evaluate_lines, renew
from evoexp.planners.coevolution.link_problem import Problem
from evoexp.planners.coevolution.teams import Evaluated, survey
from evoexp.planners.planner import Candidate
from evoexp.planners.table_search import TableSearch, generations_per_call
from evoexp.records import BoolArray, FloatArray, IntArray

PER_CALL = 8  # generations that are computed in one call, at most
CACHED = 1 << 18  # [B] collisions of a call: beyond that, fewer generations are


class Table(NamedTuple):
    """Some generations; number g is at place g modulo the number of places."""

    populations: FloatArray  # (places, robots, 2 K, individuals)
    # (places, robots, 4, individuals) see `Evaluated`, and so are the next three
    criteria: FloatArray
    own: FloatArray  # (places, robots, individuals)
    costs: FloatArray  # (places, robots, individuals)
    collisions: CollisionCounts  # (places, pairs of robots, individuals, individuals)
    teams: IntArray  # (places, robots) the best team of each
    team_costs: FloatArray  # (places,)

    @classmethod
    def room(cls, places: int, robots: int, genes: int, count: int) -> Self:
        """Return memory for some generations."""
        own, costs = np.empty((2, places, robots, count))
        return cls(
            np.empty((places, robots, genes, count)),
            np.empty((places, robots, 4, count)),
            own,
            costs,
            np.empty((places, robots * (robots - 1) // 2, count, count), dtype=np.int16),
            np.empty((places, robots), dtype=np.int64),
            np.empty(places),
        )


class Task(NamedTuple):
    """Ends, arms and weights, by which individuals are judged; see `evaluate_lines`."""

    starts: FloatArray  # (robots, 2) [rad]
    goals: FloatArray  # (robots, 2) [rad]
    arms: FloatArray  # (robots, 4) base x, base y, lengths of both links [length unit]
    weights: tuple[float, float, float]  # of C2, C3, C4
    collision_weight: float  # of C1


class Heredity(NamedTuple):
    """The rules by which one generation follows another."""

    breeding: Breeding  # of any generation; its mutation rate is that of none
    moving: BoolArray  # (robots,) false for robots that stand still
    hall: Hall  # with room for as many teams as it may hold
    rules: HallRules  # which teams it takes
    by_genome: bool  # see `renew`; then the best team is offered, too
    numbers: IntArray  # (individuals + 1,) that breeding takes for so many offspring of a robot


@kernel
def evolve(
    uniforms: FloatArray,
    rates: FloatArray,
    first: int,
    task: Task,
    heredity: Heredity,
    table: Table,
    num_teams: IntArray,
    summaries: FloatArray,
    taken: IntArray,
) -> bool:
    """Go on from one generation to others, or judge the initial one.

    Args:
        uniforms: Numbers for all of them, in the order in which they are used.
        rates: (generations,) of mutation, on the way to each of them.
        first: The present generation; −1 if the initial one is to be judged.
        task: See `Task`.
        heredity: See `Heredity`.
        table: See `Table`, written.
        num_teams: (1,) teams that the hall holds, changed.
        summaries: (places, 4) written: see `TableSearch`.
        taken: (generations,) written: how many numbers each of them took.

    Returns:
        False if a coordinate is not finite.
    """
    table, summaries, taken = borrowed((table, summaries, taken))
    places, robots, _, count = table.populations.shape
    nobody, blocked = np.full(robots, -1), np.zeros((robots, count), dtype=np.int64)
    begin = 0
    for step in range(len(rates)):
        own, other = (first + step) % places, (first + step + 1) % places
        taken[step] = 0
        if first + step >= 0:
            taken[step] = follow(
                uniforms[begin:], rates[step], heredity, table, own, other, nobody, num_teams
            )
            begin += taken[step]
        if not evaluate_lines(
            table.populations[other],
            task.starts,
            task.goals,
            task.arms,
            task.weights,
            task.collision_weight,
            table.criteria[other],
            table.own[other],
            table.collisions[other],
            table.costs[other],
        ):
            return False
        costs, lone, hits = table.costs[other], table.own[other], table.collisions[other]
        cost, num_feasible, best, mean, std = survey(costs, lone, hits, blocked, table.teams[other])
        table.team_costs[other], summary = cost, summaries[other]
        summary[0], summary[1], summary[2], summary[3] = best, mean, std, num_feasible
    return True


@kernel
def follow(
    uniforms: FloatArray,
    rate: float,
    heredity: Heredity,
    table: Table,
    own: int,
    other: int,
    nobody: IntArray,
    num_teams: IntArray,
) -> int:
    """Renew the hall of fame, and breed the generation that follows one.

    Args:
        uniforms: At least as many as it takes.
        rate: Of mutation.
        heredity: What follows.
        table: Of generations.
        own: Place of the present one.
        other: Place of the next one, written.
        nobody: (robots,) all −1.
        num_teams: (1,) changed.

    Returns:
        How many numbers it took.
    """
    hall, rules, before = heredity.hall, heredity.rules, table.populations[own]
    if len(hall.teams):
        num_teams[0] = renew(
            before,
            table.criteria[own],
            table.collisions[own],
            table.own[own],
            table.teams[own] if heredity.by_genome else nobody,
            hall,
            num_teams[0],
            rules,
            heredity.by_genome,
        )
    breeding, moving = heredity.breeding, 0
    for robot in range(len(before)):
        moving += heredity.moving[robot]
    numbers = heredity.numbers[before.shape[2] - breeding.num_elites - num_teams[0]]
    breed(
        uniforms[: moving * numbers].reshape((moving, numbers)),
        before,
        table.costs[own],
        heredity.moving,
        hall.teams[: num_teams[0]],
        Breeding(
            breeding.num_elites,
            breeding.inverse,
            breeding.crossover_rate,
            rate,
            breeding.mutation_step,
            breeding.limit,
            breeding.symmetric,
        ),
        table.populations[other],
    )
    return int(moving * numbers)


def per_call(robots: int, count: int) -> int:
    """Return how many generations of populations of `count` are best computed in one call."""
    collisions = robots * (robots - 1) * count * count  # [B] of one generation
    return generations_per_call(PER_CALL, collisions, CACHED)


class TeamSearch(TableSearch):
    """One run of robots that are lines, and memory for its generations."""

    def __init__(self, planner: Any, problem: Problem) -> None:
        """Begin a run.

        Args:
            planner: A `Coevolution`.
            problem: Its problem.
        """
        ga, robots = planner.ga, len(problem.start)
        self._planner, self._problem, self._size = planner, problem, ga.population_size
        super().__init__(ga, per_call(robots, self._size))
        genes, breeder = 2 * planner.num_configurations, Breeder(ga, problem.moving)
        numbers = np.array([num_uniforms(count) for count in range(self._size + 1)])
        self._most, self._rate = breeder.num_moving * int(numbers.max()), ga.mutation_rate_at
        self._blocked = np.zeros((robots, self._size), dtype=np.int64)
        self._table = Table.room(self.num_places, robots, genes, self._size)
        self.costs = self._table.costs
        task = Task(
            problem.start,
            problem.goal,
            problem.arms,
            planner.objective.own_weights,
            planner.objective.collision_weight,
        )
        heredity = Heredity(
            breeder.breeding(0),
            problem.moving,
            breeder.hall,
            breeder.rules,
            breeder.by_genome,
            numbers,
        )
        num_teams = np.zeros(1, dtype=np.int64)
        self._arguments = (task, heredity, self._table, num_teams, self.summaries)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial populations."""
        self._table.populations[0] = self._planner.sample(self._problem, rng, self._size)
        self._evolve(np.empty(0), -1, 0)
        self._ahead = DrawnAhead(rng, self._most)

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Compute generations with numbers that are drawn ahead."""
        taken = self._evolve(self._ahead.draw(last - first), first, last)
        self.states = self._ahead.take(taken)
        return last

    def lowest(self, places: IntArray) -> FloatArray:
        """Return the costs of the best teams."""
        return np.asarray(self._table.team_costs[places])

    def best(self, place: int) -> Candidate:
        """Return the best team of a generation."""
        populations, found = self._table.populations[place], self._evaluated(place)
        team = self._best_team(place)
        candidate: Candidate = self._planner.candidate(self._problem, populations, found, team)
        return candidate

    def counts(self, index: int) -> tuple[int, int]:
        """Return the individuals of all populations, and the configurations of all teams."""
        evaluations = len(self._problem.start) * self._size
        return evaluations, self._planner.queries(self._problem, self._size)

    def population(self, index: int) -> FloatArray:
        """Return the populations."""
        return np.asarray(self._table.populations[index % self.num_places])

    def criteria(self, place: int) -> FloatArray | None:
        """Return the criteria of all individuals."""
        return np.asarray(self._table.criteria[place])

    def _best_team(self, place: int) -> BestTeam:
        return BestTeam(self._table.teams[place], self._table.team_costs.item(place))

    def _evaluated(self, place: int) -> Evaluated:
        _, criteria, own, costs, collisions, _, _ = self._table
        return Evaluated(
            costs[place], criteria[place], own[place], collisions[place], self._blocked
        )

    def _evolve(self, uniforms: FloatArray, first: int, last: int) -> list[int]:
        """Compute generations after one, up to another; return how many numbers each took."""
        rates = np.array([self._rate(index) for index in range(first + 1, last + 1)])
        taken = np.empty(len(rates), dtype=np.int64)
        if not evolve(uniforms, rates, first, *self._arguments, taken):
            raise ValueError(NOT_FINITE)
        return taken.tolist()
