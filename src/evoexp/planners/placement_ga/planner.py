"""Docking postures of a mobile arm (Chen & Zalzala 1995, sections 3 and 4.2).

A genetic algorithm over θ1 and θ2 in binary code; θ3 and the platform's place X_p follow from the
end-effector's target (Eqs. 17 and 18). Both values of θ3 are evaluated and the better one is kept.
The cost is E of Eq. 14; infeasible postures cost E_m. The paper's fitness is f = E_m − E.

A population is an array (2, individuals) of strings of bits, a number per angle. A solution is
flat: θ1, θ2 [deg].
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.collision.scene import Scene, scene
from evoexp.errors import demand
from evoexp.evolution.operators.operator import ScaledGenetic
from evoexp.evolution.succession import choose_parents, summarise
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.elementary import DEGREE, log
from evoexp.numeric.random_stream import Block as Uniforms
from evoexp.numeric.random_stream import draw, draw_many, used_up
from evoexp.objectives.placement_criteria import (
    COST,
    CRITERIA,
    PLATFORM,
    THETA_3,
    TORQUE,
    Model,
    PlacementCriteria,
    Task,
    measure_postures,
)
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Acceptance, in_shape, of_limits
from evoexp.planners.driver import ScaledSearch
from evoexp.planners.planner import Candidate, JudgementArrays, PlannerDefaults
from evoexp.records import Block, FloatArray, IntArray
from evoexp.robots.arms import MobileArm
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.motion_tasks import Docking
from evoexp.validation import Component, Limits

GENES = 2  # θ1, θ2
ROWS = GENES + CRITERIA + 1  # angles [deg], criteria, branch of θ3
NAMES = ("torque_norm", "torque_max", "obstacle", "manipulability")  # E1, E2, Σ γ E_obs, E_man
BRANCHES = ("", "other_")
FIRST_CRITERION = GENES  # row of the costs; the other criteria and the branch follow it
PER_CALL = 16  # generations; see `ScaledSearch`: another number needs another revision
BLOCK = 8192  # uniform numbers drawn at once, at least


class Coding(NamedTuple):
    """The meaning of strings, and settings of the operators."""

    bits: int  # B ≤ 52 per gene, a number in [0, 2^B); its highest bit comes first
    gray: bool  # whether they are reflected Gray codes
    limits: FloatArray  # (2, 2) of the angles [deg]
    num_elites: int
    multiple: float  # copies that the best one expects, in units of the mean
    crossover_rate: float  # probability per pair
    mutation_rate: float  # probability per bit


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places."""

    strings: IntArray  # (2, individuals)
    rows: FloatArray  # (ROWS, individuals)


@kernel
def advance(
    draws: Uniforms,
    coding: Coding,  # the meaning of strings, and settings of the operators
    model: Model,  # task, weights and limits of the criteria
    population: Population,
    following: Population,  # written
) -> bool:
    """Write the population that follows another: its offspring, then the elites, best first.

    Returns whether the draws sufficed; if not, what is written is not complete.
    """
    draws, coding, model = borrowed((draws, coding, model))
    population, following = borrowed((population, following))
    strings, rows, children = population.strings, population.rows, following.strings
    costs = rows[GENES + COST]
    parents, elites = choose_parents(draws, costs, coding.multiple, coding.num_elites)
    if used_up(draws):
        return False
    count = len(parents)
    crossing = draw_many(draws, 2 * (count // 2))
    if used_up(draws):
        return False
    # crossover, mutation, criteria
    cross_strings(crossing, strings, coding, parents, children)
    flip_strings(draws, children, coding, count)
    if used_up(draws):
        return False
    judge(children, coding, model, count, following.rows)
    # elites
    for e in range(len(elites)):
        for gene in range(GENES):
            children[gene, count + e] = strings[gene, elites[e]]
        for row in range(ROWS):
            following.rows[row, count + e] = rows[row, elites[e]]
    return True


@kernel
def decode_strings(strings: IntArray, count: int, coding: Coding, out: FloatArray) -> None:
    """Decode numbers n of B bits of the first individuals: l + (h − l) n / (2^B − 1)."""
    greatest = float((1 << coding.bits) - 1)
    for gene in range(len(strings)):
        low, high = coding.limits[gene, 0], coding.limits[gene, 1]
        for k in range(count):
            number = strings[gene, k]
            if coding.gray:  # a bit is the parity of its own Gray bit and all above it
                for shift in (1, 2, 4, 8, 16, 32):
                    number ^= number >> shift
            out[gene, k] = low + (high - low) * (float(number) / greatest)


@kernel
def cross_strings(
    uniforms: FloatArray,  # (2 × pairs,): decision, site
    strings: IntArray,  # (genes, individuals)
    coding: Coding,
    parents: IntArray,  # (offspring,) indices of individuals
    out: IntArray,  # (genes, ≥ offspring), written
) -> None:
    """Cut pairs of parents at one site and exchange their tails (Chen & Zalzala 1995, section 3.2).

    Parents 2k and 2k + 1 form a pair; an odd last one stays alone. A pair is cut before one of the
    bits 1 … all − 1, each equally likely, or copied.
    """
    genes, count, bits = len(strings), len(parents), coding.bits
    # copies of the parents
    for gene in range(genes):
        for k in range(count):
            out[gene, k] = strings[gene, parents[k]]
    # pairs exchange the bits behind their site, gene by gene
    last = genes * bits - 1
    for pair in range(count // 2):
        first, second = 2 * pair, 2 * pair + 1
        if last > 0 and uniforms[first] < coding.crossover_rate:
            site = 1 + min(int(uniforms[second] * last), last - 1)
            for gene in range(genes):
                behind = min(max((gene + 1) * bits - site, 0), bits)
                different = (out[gene, first] ^ out[gene, second]) & ((1 << behind) - 1)
                out[gene, first] ^= different
                out[gene, second] ^= different


@kernel
def flip_strings(draws: Uniforms, strings: IntArray, coding: Coding, count: int) -> None:
    """Flip every bit of the first `count` strings with probability p, in place (Holland 1975).

    The number of bits that stay before the next flipped one is geometrically distributed, ⌊ln(1 −
    u) / ln(1 − p)⌋ (Devroye 1986, section X.2); so a uniform number is taken per flipped bit.
    """
    bits, num = coding.bits, len(strings) * coding.bits
    staying, place = log(1.0 - coding.mutation_rate), -1  # −inf: each is flipped
    while staying < 0.0:
        passed = log(1.0 - draw(draws)) / staying
        if not passed < num * count - 1 - place:
            break
        place += 1 + int(passed)
        individual, bit = place // num, place % num
        strings[bit // bits, individual] ^= 1 << (bits - 1 - bit % bits)


@kernel
def judge(strings: IntArray, coding: Coding, model: Model, count: int, rows: FloatArray) -> None:
    """Decode and measure the first individuals: fill their rows."""
    decode_strings(strings, count, coding, rows[:GENES])
    measure_postures(rows[:GENES], count, model, rows[GENES:])


class Problem(NamedTuple):
    """Robot and scenario, prepared for the search."""

    assembly: Assembly  # the robot, built
    model: Model  # task, weights and limits of the criteria
    angle_limits: FloatArray  # (2, 2) of the genes θ1, θ2 [deg]
    # the bodies themselves, links against links too, for the exact verdict on a posture
    scene: Scene
    security_margin: float  # clearance that the task requires [length unit]


class PlacementGa(PlannerDefaults, Component):
    """The algorithm of Chen & Zalzala, section 3.2."""

    revision: ClassVar[int] = 2

    angle_range: Limits  # least and greatest θ1 and θ2 that genes stand for [deg]
    # of either angle; both ends of the range are values [-]
    bits_per_gene: Annotated[int, Field(ge=1, le=52)]
    coding: Literal["binary", "gray"]  # plain binary numbers, or Gray codes
    ga: ScaledGenetic  # population, generations, rates, scaling
    objective: PlacementCriteria  # weights of Eq. 14
    # `model`: other planners may prove motions, here there are none
    acceptance: Acceptance = "model"

    def _check(self) -> None:
        must = "'model': the answer is a posture, there is no motion to prove"
        self.demand("acceptance", self.acceptance == "model", must)

    def prepare(self, robot: MobileArm, scenario: Docking) -> Problem:
        """Build the robot and check that the end-effector can reach its target."""
        reach = sum(robot.link_lengths)
        must = f"within the arm's reach: Y_e between −{reach:g} and {reach:g} "
        must += "(the links' lengths together)"
        demand(abs(scenario.target[1]) <= reach, "scenario.target", must, list(scenario.target))
        task = Task(*robot.link_lengths, *scenario.target, *scenario.force)
        avoided = self.objective.avoided(scenario.obstacle_points())
        model = Model(task, self.objective.weights, avoided, robot.limits)
        limits = np.array([self.angle_range] * GENES)
        assembly, bodies = _built(robot, scenario)
        return Problem(assembly, model, limits, bodies, scenario.security_margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the initial population, then every generation."""
        return _Search(self, problem).blocks(rng)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return random strings, (2, count)."""
        return np.floor(2.0**self.bits_per_gene * rng.random((GENES, count))).astype(np.int64)

    def cost(self, problem: Problem, population: np.ndarray) -> JudgementArrays:
        """Judge a population of strings (2, individuals)."""
        criteria = self._judged(problem, population)[FIRST_CRITERION:]
        terms = dict(zip(NAMES, criteria[1:-1], strict=True))
        return JudgementArrays(criteria[0], criteria[-1] >= 0.0, 0, terms)

    def solution(self, problem: Problem, population: np.ndarray, individual: int) -> FloatArray:
        """Return θ1 and θ2 of an individual [deg]."""
        return self._judged(problem, population[:, individual : individual + 1])[:GENES, 0].copy()

    def _judged(self, problem: Problem, population: np.ndarray) -> FloatArray:
        rows = np.empty((ROWS, population.shape[1]))
        strings = np.ascontiguousarray(population, dtype=np.int64)
        judge(strings, self.strings_of(problem), problem.model, population.shape[1], rows)
        return rows

    def strings_of(self, problem: Problem) -> Coding:
        """Return the meaning of strings and the operators' settings, as the kernels take them."""
        coding, ga = (self.bits_per_gene, self.coding == "gray", problem.angle_limits), self.ga
        rates = ga.scaling_multiple, ga.crossover_rate, ga.mutation_rate
        return Coding(*coding, ga.num_elites, *rates)

    def motion(self, problem: Problem, solution: FloatArray) -> Motion | None:
        """Return the posture as a motion that stays there; None: it is infeasible."""
        branch, own, _ = problem.model.posture(*in_shape(solution, GENES))
        if branch < 0:
            return None
        q = np.array([own[PLATFORM], *(DEGREE * np.array([*solution, own[THETA_3]]))])
        return Motion(np.stack([q, q]))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return all numbers of both values of θ3, those of the worse one as `other_…`.

        `branch` is 0 where the third link points to +x, 1 to −x, −1 where no θ3 is feasible.
        """
        branch, *both = problem.model.posture(*in_shape(solution, GENES))
        one, two = solution.tolist()
        named = {"branch": float(branch), "theta_1_deg": one, "theta_2_deg": two}
        for prefix, numbers in zip(BRANCHES, both, strict=True):
            values = numbers.tolist()
            criteria = zip(("cost", *NAMES), values, strict=False)
            named |= {f"{prefix}{name}": value for name, value in criteria}
            named[f"{prefix}theta_3_deg"] = values[THETA_3]
            named[f"{prefix}platform_x"] = values[PLATFORM]
            named |= {f"{prefix}torque_{k + 1}": values[TORQUE + k] for k in range(3)}
        return named

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Compare θ1 and θ2 with their limits, and ask for a θ3 that reaches the target."""
        angles = in_shape(solution, GENES)
        beyond = of_limits(["θ1", "θ2"], angles[:, None], problem.angle_limits, "deg")
        is_feasible = problem.model.posture(*angles)[0] >= 0
        return beyond + ([] if is_feasible else ["no θ3 reaches the target within all limits"])

    def memory(self, problem: Problem) -> int:
        """Return the memory of the tables of the generations of a call."""
        return 8 * (PER_CALL + 2) * (GENES + ROWS) * self.ga.population_size

    def shape(self, problem: Problem) -> tuple[tuple[()], ...]:
        """Return the documented shape of a solution: two numbers, θ1 and θ2."""
        return ((),) * GENES


class _Search(ScaledSearch):
    def __init__(self, planner: PlacementGa, problem: Problem) -> None:
        ga, size = planner.ga, planner.ga.population_size
        super().__init__(ga, PER_CALL, BLOCK)
        self._planner, self._problem = planner, problem
        self._judging = planner.strings_of(problem), problem.model
        self.table = Population(
            np.empty((self.num_places, GENES, size), dtype=np.int64),
            np.empty((self.num_places, ROWS, size)),
        )
        self.costs = self.table.rows[:, FIRST_CRITERION]

    def begin(self, rng: np.random.Generator) -> None:
        strings, rows = present = self.at(0)
        strings[:] = self._planner.sample(self._problem, rng, strings.shape[1])
        judge(strings, *self._judging, strings.shape[1], rows)
        self.note(present, 0)

    def breed(self, present: Population, following: Population) -> bool:
        return bool(advance(self.draws.block, *self._judging, present, following))

    def note(self, population: Population, place: int) -> None:
        rows = population.rows
        summarise(rows[FIRST_CRITERION], rows[-1] >= 0.0, self.summaries[place])

    def candidate(self, place: int, individual: int) -> Candidate:
        angles = self.table.rows[place, :GENES, individual].copy()
        _, *criteria, branch = self.table.rows[place, FIRST_CRITERION:, individual].tolist()
        return Candidate(angles, dict(zip(NAMES, criteria, strict=True)), branch >= 0.0)

    def population(self, index: int) -> IntArray:
        return np.asarray(self.at(index).strings)


@lru_cache(maxsize=32)
def _built(robot: MobileArm, scenario: Docking) -> tuple[Assembly, Scene]:
    """Build the robot and its scene, kept for planners that differ in weights and rates alone."""
    assembly = robot.build()
    return assembly, scene(assembly, scenario.obstacles, self_pairs=True)
