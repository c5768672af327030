"""Docking postures of a mobile arm (Chen & Zalzala 1995, sections 3 and 4.2).

A genetic algorithm over θ1 and θ2 in binary code; θ3 and the platform's place X_p follow from where
the end-effector shall be (Eqs. 17 and 18). θ3 has two values, both are evaluated and the better one
is kept. The cost is E of Eq. 14; infeasible postures cost E_m, the paper's fitness is f = E_m − E.

A population is an array (2, individuals) of strings of bits, a number per angle. A solution is
flat: θ1, θ2 [deg].
"""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.evolution.scaled_settings import ScaledGenetic
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.placement_criteria import Model, PlacementCriteria
from evoexp.objectives.placement_kernels import PLATFORM, THETA_3, TORQUE
from evoexp.paths.motion import Motion
from evoexp.planners.placement_ga import kernels
from evoexp.planners.placement_ga.kernels import GENES, ROWS
from evoexp.planners.planner import PlannerDefaults
from evoexp.planners.stretches import Found, Stretches
from evoexp.records import FloatArray, Generation
from evoexp.robots.assembly import Assembly
from evoexp.robots.mobile_arm import MobileArm
from evoexp.scenarios.docking import Docking
from evoexp.validation import Component

NAMES = ("torque_norm", "torque_max", "obstacle", "manipulability")  # E1, E2, Σ γ E_obs, E_man
BRANCHES = ("", "other_")
FIRST_CRITERION = GENES  # row of the costs, which the other criteria and the branch follow
STRETCH = 16  # generations that are computed in one call of a kernel, at most
BLOCK = 8192  # uniform numbers drawn at once, at least


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


class PlacementGa(PlannerDefaults, Component):
    """The algorithm of Chen & Zalzala, section 3.2.

    Attributes:
        angle_range: Least and greatest θ1 and θ2 that genes stand for [deg].
        bits_per_gene: Of either angle; both ends of the range are values [-].
        coding: Plain binary numbers, or Gray codes.
        ga: Population, generations, rates, scaling.
        objective: Weights of Eq. 14.
    """

    component: ClassVar[str] = "placement_ga"
    revision: ClassVar[int] = 2

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
            must = (
                f"within the arm's reach: Y_e between −{reach:g} and {reach:g} (the links' "
                "lengths together)"
            )
            raise SettingError("scenario.target", must, list(scenario.target))
        task = np.array([*robot.link_lengths, *scenario.target, *scenario.force])
        avoided = self.objective.avoided(scenario.obstacle_points())
        model = Model(task, self.objective.weights, avoided, robot.limits)
        assembly, limits = robot.build(), np.array([self.angle_range] * GENES)
        bodies = scene(assembly, scenario.obstacles, self_pairs=True)
        return Problem(assembly, model, limits, bodies, scenario.security_margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial population, then every generation."""
        return _Search(self, problem).generations(rng)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return random strings, (2, count)."""
        return np.floor(2.0**self.bits_per_gene * rng.random((GENES, count))).astype(np.int64)

    def cost(self, problem: Problem, population: np.ndarray) -> Judgement:
        """Judge a population of strings (2, individuals)."""
        criteria = self._judged(problem, population)[FIRST_CRITERION:]
        return Judgement(criteria[0], criteria[-1] >= 0.0, criteria[1:-1])

    def solution(self, problem: Problem, population: np.ndarray, individual: int) -> FloatArray:
        """Return θ1 and θ2 of an individual [deg]."""
        return self._judged(problem, population[:, individual : individual + 1])[:GENES, 0].copy()

    def _judged(self, problem: Problem, population: np.ndarray) -> FloatArray:
        rows = np.empty((ROWS, population.shape[1]))
        strings = np.ascontiguousarray(population, dtype=np.int64)
        kernels.judge(strings, self.coded(problem), tuple(problem.model), population.shape[1], rows)
        return rows

    def coded(self, problem: Problem) -> tuple[int, bool, FloatArray]:
        """Return what kernels decode strings by.

        Bits per gene, whether they are Gray codes, limits [deg].
        """
        return self.bits_per_gene, self.coding == "gray", problem.angle_limits

    def motion(self, problem: Problem, solution: FloatArray) -> Motion | None:
        """Return the posture of a solution as a motion that stays there; None if it is infeasible.

        The answer of the algorithm is a posture: how to get there is another question. Its bodies
        are judged all the same, by their exact distances.
        """
        branch, own, _ = problem.model.posture(*_two(solution))
        if branch < 0:
            return None
        q = np.array([own[PLATFORM], *(DEGREE * np.array([*solution, own[THETA_3]]))])
        return Motion(np.stack([q, q]))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return everything about both values of θ3.

        The better one plain, the other one as `other_…`.

        `branch` is 0 where the third link points to +x, 1 to −x, −1 where no θ3 is feasible. What
        cannot be reached is NaN, its criteria and its cost are E_m.

        Raises:
            ValueError: If the solution has another size than 2.
        """
        branch, *both = problem.model.posture(*_two(solution))
        named = {
            "branch": float(branch),
            "theta_1_deg": float(solution[0]),
            "theta_2_deg": float(solution[1]),
        }
        for prefix, numbers in zip(BRANCHES, both, strict=True):
            named |= {f"{prefix}cost": float(numbers[0])}
            named |= {f"{prefix}{name}": float(numbers[1 + k]) for k, name in enumerate(NAMES)}
            named |= {
                f"{prefix}theta_3_deg": float(numbers[THETA_3]),
                f"{prefix}platform_x": float(numbers[PLATFORM]),
            }
            named |= {f"{prefix}torque_{k + 1}": float(numbers[TORQUE + k]) for k in range(3)}
        return named

    def shape(self, problem: Problem) -> tuple[tuple[()], ...]:
        """Return the documented shape of a solution: two numbers, θ1 and θ2."""
        return ((),) * GENES


class _Search(Stretches):
    """One run, and memory for its kernels."""

    def __init__(self, planner: PlacementGa, problem: Problem) -> None:
        ga, size = planner.ga, planner.ga.population_size
        super().__init__(ga, STRETCH, BLOCK)
        self._planner, self._problem = planner, problem
        self._strings = np.empty((self.num_places, GENES, size), dtype=np.int64)
        self._rows = np.empty((self.num_places, ROWS, size))
        self.costs = self._rows[:, FIRST_CRITERION]
        parents, elites = (
            np.empty(ga.num_offspring, dtype=np.int64),
            np.empty(ga.num_elites, dtype=np.int64),
        )
        memory = np.empty(size), np.empty(size, dtype=np.int64), parents, elites
        rates = ga.scaling_multiple, ga.crossover_rate, ga.mutation_rate
        self._judging = planner.coded(problem), tuple(problem.model)
        self._arguments = (rates, *self._judging, (self._strings, self._rows), memory, self.records)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population."""
        size = self._strings.shape[2]
        self._strings[0] = self._planner.sample(self._problem, rng, size)
        kernels.judge(self._strings[0], *self._judging, size, self._rows[0])
        kernels.record(self._rows[0], self.records[0])

    def go_on(self, draws: tuple[np.ndarray, np.ndarray], first: int, last: int) -> int:
        """Compute generations."""
        return int(kernels.evolve(draws, (first, last), *self._arguments))

    def found(self, place: int, individual: int) -> Found:
        """Return angles, criteria and whether they are feasible."""
        angles, own = (
            self._rows[place, :GENES, individual].copy(),
            self._rows[place, FIRST_CRITERION:, individual],
        )
        _, *criteria, branch = own.tolist()
        return Found(angles, dict(zip(NAMES, criteria, strict=True)), branch >= 0.0)

    def population(self, place: int, is_last: bool) -> np.ndarray:
        """Return the strings."""
        return np.asarray(self._strings[place])


def _two(solution: FloatArray) -> tuple[float, float]:
    if solution.shape != (GENES,):
        raise ValueError(f"a solution has {GENES} values, was {solution.shape}")
    return float(solution[0]), float(solution[1])
