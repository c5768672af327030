"""Docking postures of a mobile arm (Chen & Zalzala 1995, sections 3 and 4.2).

A genetic algorithm over θ1 and θ2 in binary code; θ3 and the platform's place X_p follow from where the end-effector
shall be (Eqs. 17 and 18). θ3 has two values, both are evaluated and the better one is kept. The cost is E of Eq. 14;
infeasible postures cost E_m, the paper's fitness is f = E_m − E.

A population is an array (bits, individuals) of 0.0 and 1.0. A solution is flat: θ1, θ2 [deg].
"""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.evolution.crossover import num_single_point_uniforms
from evoexp.evolution.remainder import num_remainder_uniforms
from evoexp.evolution.scaled_settings import ScaledGenetic
from evoexp.numerics import DEGREE
from evoexp.objectives.placement_criteria import Model, PlacementCriteria
from evoexp.objectives.placement_kernels import CRITERIA, PLATFORM, THETA_3, TORQUE
from evoexp.paths.motion import Motion
from evoexp.planners import placement_kernels
from evoexp.planners.placement_kernels import GENES, RESULTS
from evoexp.records import FloatArray, Generation
from evoexp.robots.assembly import Assembly
from evoexp.robots.mobile_arm import MobileArm
from evoexp.scenarios.docking import Docking
from evoexp.validation import Component

NAMES = ("torque_norm", "torque_max", "obstacle", "manipulability")  # E1, E2, Σ γ E_obs, E_man
BRANCHES = ("", "other_")


class Problem(NamedTuple):
    """What `prepare` made of robot and scenario.

    Attributes:
        assembly: The robot, built.
        model: What the criteria are computed from.
        angle_limits: (2, 2) of the genes θ1, θ2 [deg].
        scene: The bodies themselves, for the exact verdict on a posture; links against links, too.
        security_margin: Clearance that the task requires [length unit].
    """

    assembly: Assembly
    model: Model
    angle_limits: FloatArray
    scene: Scene
    security_margin: float


class Judgement(NamedTuple):
    """A population judged.

    Attributes:
        cost: (individuals,) E of Eq. 14; E_m where infeasible.
        feasible: (individuals,) whether the end-effector reaches its target within all limits.
        terms: (4, individuals) the criteria, see NAMES.
    """

    cost: FloatArray
    feasible: np.ndarray
    terms: FloatArray
    collision_queries: int = 0

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the criteria of one individual by name."""
        return dict(zip(NAMES, self.terms[:, individual].tolist(), strict=True))


class PlacementGa(Component):
    """The algorithm of Chen & Zalzala, section 3.2.

    Attributes:
        angle_range: Least and greatest θ1 and θ2 that genes stand for [deg].
        bits_per_gene: Of either angle; both ends of the range are values [-].
        coding: Plain binary numbers, or Gray codes.
        ga: Population, generations, rates, scaling.
        objective: Weights of Eq. 14.
    """

    component: ClassVar[str] = "placement_ga"

    angle_range: tuple[float, float]
    bits_per_gene: Annotated[int, Field(ge=1, le=52)]
    coding: Literal["binary", "gray"]
    ga: ScaledGenetic
    objective: PlacementCriteria

    def prepare(self, robot: MobileArm, scenario: Docking) -> Problem:
        """Build the robot and check that the end-effector can reach its target.

        Raises:
            SettingError: If it cannot, or settings contradict each other.
        """
        if not self.angle_range[0] < self.angle_range[1]:
            must = "[least, greatest] with least < greatest"
            raise SettingError("planner.angle_range", must, list(self.angle_range))
        reach = sum(robot.link_lengths)
        if abs(scenario.target[1]) > reach:
            must = f"within the arm's reach: Y_e between −{reach:g} and {reach:g} (the links' lengths together)"
            raise SettingError("scenario.target", must, list(scenario.target))
        task = np.array([*robot.link_lengths, *scenario.target, *scenario.force])
        avoided = self.objective.avoided(scenario.obstacle_points())
        model = Model(task, self.objective.weights, avoided, robot.limits)
        assembly, limits = robot.build(), np.array([self.angle_range] * GENES)
        bodies = scene(assembly, scenario.obstacles, self_pairs=True)
        return Problem(assembly, model, limits, bodies, scenario.security_margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the generations."""
        search = _Search(self, problem)
        best, best_cost, terms, solved = np.empty(0), np.inf, {}, False
        for index in range(self.ga.num_generations + 1):
            found, mean, std, num_feasible = search.advance(rng) if index else search.begin(rng)
            costs = search.costs
            if costs[found] < best_cost:
                best_cost, best, terms = float(costs[found]), search.angles[:, found].copy(), search.terms(found)
                solved = bool(search.branches[found] >= 0.0)
            yield Generation(
                index=index,
                best=best,
                best_cost=best_cost,
                best_cost_in_generation=float(costs[found]),
                mean_cost=mean,
                std_cost=std,
                num_feasible=num_feasible,
                evaluations=self.ga.population_size + index * self.ga.num_offspring,
                collision_queries=0,
                solved=solved,
                terms=terms,
                costs=costs,
                population=search.bits,
            )

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return random bits, (bits, count)."""
        return np.floor(2.0 * rng.random((GENES * self.bits_per_gene, count)))

    def cost(self, problem: Problem, population: FloatArray) -> Judgement:
        """Judge a population of bits (bits, individuals)."""
        table = self._judged(problem, population)
        results = table[len(population) + GENES :]
        return Judgement(results[0], results[CRITERIA] >= 0.0, results[1:CRITERIA])

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return θ1 and θ2 of an individual [deg]."""
        table = self._judged(problem, population[:, individual : individual + 1])
        return table[len(population) : len(population) + GENES, 0].copy()

    def _judged(self, problem: Problem, population: FloatArray) -> FloatArray:
        num_bits, count = population.shape
        table, plain = np.empty((num_bits + GENES + RESULTS, count)), np.empty((num_bits, count))
        table[:num_bits] = population
        model, gray = tuple(problem.model), self.coding == "gray"
        placement_kernels.judge(table, count, gray, problem.angle_limits, model, plain)
        return table

    def motion(self, problem: Problem, solution: FloatArray) -> Motion | None:
        """Return the posture of a solution as a motion that stays there; None if it is infeasible.

        The answer of the algorithm is a posture: how to get there is another question. Its bodies are judged all the
        same, by their exact distances.
        """
        branch, own, _ = problem.model.posture(*_two(solution))
        if branch < 0:
            return None
        q = np.array([own[PLATFORM], *(DEGREE * np.array([*solution, own[THETA_3]]))])
        return Motion(np.stack([q, q]))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return everything about both values of θ3: the better one plain, the other one as `other_…`.

        `branch` is 0 where the third link points to +x, 1 to −x, −1 where no θ3 is feasible. What cannot be reached is
        NaN, its criteria and its cost are E_m.

        Raises:
            ValueError: If the solution has another size than 2.
        """
        branch, *both = problem.model.posture(*_two(solution))
        named = {"branch": float(branch), "theta_1_deg": float(solution[0]), "theta_2_deg": float(solution[1])}
        for prefix, numbers in zip(BRANCHES, both, strict=True):
            named |= {f"{prefix}cost": float(numbers[0])}
            named |= {f"{prefix}{name}": float(numbers[1 + k]) for k, name in enumerate(NAMES)}
            named |= {f"{prefix}theta_3_deg": float(numbers[THETA_3]), f"{prefix}platform_x": float(numbers[PLATFORM])}
            named |= {f"{prefix}torque_{k + 1}": float(numbers[TORQUE + k]) for k in range(3)}
        return named

    def shape(self, problem: Problem) -> tuple[tuple[()], ...]:
        """Return the documented shape of a solution: two numbers, θ1 and θ2."""
        return ((),) * GENES


class _Search:
    """The memory of one run, and its calls of kernels."""

    def __init__(self, planner: PlacementGa, problem: Problem) -> None:
        ga, num_bits = planner.ga, GENES * planner.bits_per_gene
        size, count = ga.population_size, ga.num_offspring
        rows = num_bits + GENES + RESULTS
        table, self._plain = np.empty((rows, size)), np.empty((num_bits, size))
        scratch = np.empty(size), np.empty(size, dtype=np.int64), np.empty(count, dtype=np.int64)
        elites = np.empty(ga.num_elites, dtype=np.int64)
        self._memory = (table, np.empty((rows, count)), self._plain, *scratch, elites)
        self._table, self._problem, self._gray = table, problem, planner.coding == "gray"
        self.bits, self.angles = table[:num_bits], table[num_bits : num_bits + GENES]
        results = table[num_bits + GENES :]
        self.costs, self._terms, self.branches = results[0], results[1:CRITERIA], results[CRITERIA]
        crossing = num_remainder_uniforms(size, count)
        mutating = crossing + num_single_point_uniforms(count // 2)
        self._num_uniforms = mutating + num_bits * count
        rates = ga.scaling_multiple, ga.crossover_rate, ga.mutation_rate
        self._breeding = (crossing, mutating, *rates, self._gray, problem.angle_limits)
        self._model = tuple(problem.model)

    def begin(self, rng: np.random.Generator) -> tuple[int, float, float, int]:
        """Draw and judge the initial population; return what `placement_kernels.summary` does."""
        self.bits[:] = np.floor(2.0 * rng.random(self.bits.shape))
        size = len(self.costs)
        limits = self._problem.angle_limits
        placement_kernels.judge(self._table, size, self._gray, limits, self._model, self._plain)
        return _plain(placement_kernels.summary(self.costs, self.branches))

    def advance(self, rng: np.random.Generator) -> tuple[int, float, float, int]:
        """Replace the population by the next one; return what `placement_kernels.summary` does."""
        uniforms = rng.random(self._num_uniforms)
        return _plain(placement_kernels.advance(uniforms, self._breeding, self._model, self._memory))

    def terms(self, individual: int) -> dict[str, float]:
        """Return the criteria of one individual by name."""
        return dict(zip(NAMES, self._terms[:, individual].tolist(), strict=True))


def _plain(found: Any) -> tuple[int, float, float, int]:
    best, mean, std, feasible = found
    return int(best), float(mean), float(std), int(feasible)


def _two(solution: FloatArray) -> tuple[float, float]:
    if solution.shape != (GENES,):
        raise ValueError(f"a solution has {GENES} values, was {solution.shape}")
    return float(solution[0]), float(solution[1])
