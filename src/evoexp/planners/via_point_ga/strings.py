"""Populations of strings of via-points: the problem, their steps, compiled, and a run of them.

Rana & Zalzala 1995, section 3.4. Populations are arrays (nq, N + 1, individuals), padded to whole
vectors. Strings of robots whose bodies are covered keep within the joints' limits.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_tables import FlatTables
from evoexp.collision.bodies.clearance_kernels import least_clearances
from evoexp.collision.bodies.covered_bodies import CoveredCollision
from evoexp.collision.bodies.touching_spheres import SphereCollision
from evoexp.evolution.operators.operator import Breeding, Cross, Genome, Mutate, Select, breed
from evoexp.evolution.succession import choose_elites, copy_members, summarise
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.motion_criteria import StringTerms, count_collisions, weigh
from evoexp.paths.interpolation import interpolate
from evoexp.paths.redistribution import measure_paths, redistribute_arms, relax_points
from evoexp.planners.answers import JudgementArrays, Proofs
from evoexp.planners.arm_tasks import ArmProblem
from evoexp.planners.driver import GeneticSearch, generations_per_call
from evoexp.planners.planner import Candidate
from evoexp.planners.via_point_ga.string_operators import num_uniforms, walk_strings
from evoexp.records import Best, FloatArray, IntArray

if TYPE_CHECKING:
    from evoexp.planners.via_point_ga.planner import ViaPointGa

LANES = 8  # individuals are padded to whole vectors
PER_CALL = 16  # generations that one call of a kernel computes at most,
CACHED = 1 << 19  # [B] and the most memory that they may take


class Settings(NamedTuple):
    """Settings of the steps behind breeding, and scratch."""

    arm_slices: IntArray  # (arms, 2) rows of each arm
    redistribution: bool  # whether to redistribute (section 3.4 c)
    samples: int  # of its arc length between two via-points
    is_clamped: bool  # whether the slopes at the ends of its spline are zero
    relaxation_step: float  # delta of Eqs. 8, 9
    substeps: int  # configurations tested per segment
    weights: tuple[float, float, float]  # k1, k2, k3 of Eq. 7
    tables: FlatTables  # of the circles, spheres or covers of bodies
    limits: FloatArray  # (nq, 2) of the joints, infinite where bodies are not covered [deg]


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places."""

    strings: FloatArray  # (nq, N + 1, individuals, padded); offspring first, then the elites
    costs: FloatArray  # (individuals,)
    collisions: FloatArray  # (individuals,) colliding instants


class Scratch(NamedTuple):
    """Arrays that a generation writes on its way."""

    offspring: FloatArray  # strings
    terms: StringTerms  # of the offspring
    elites: IntArray  # places of the elites, best first
    parents: IntArray  # (offspring,) places of the parents


@kernel
def evolve(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    # (generations, numbers) those of every generation, in the order in which they are used
    uniforms: FloatArray,
    normals: FloatArray,  # normal deviates, of one generation only; see `breed`
    first: int,  # the present generation
    rules: Breeding,
    settings: Settings,
    # see `Population`: some generations; number g is at place g modulo the number of places
    table: Population,
    scratch: Scratch,
    summaries: FloatArray,  # (places, 4) written, see `summarise`
) -> None:
    """Go on from one generation to others."""
    rules, settings, scratch = borrowed((rules, settings, scratch))
    table, summaries = borrowed((table, summaries))
    (strings, costs, collisions), offspring, count = table, scratch.offspring, len(scratch.parents)
    rate = rules.mutation_rate
    for index in range(first, first + len(uniforms)):
        own, other, draws = index % len(costs), (index + 1) % len(costs), uniforms[index - first]
        # elites: the lowest costs
        choose_elites(costs[own], scratch.elites)
        # (a) reproduction, (b) cross-over, and (d) mutation before (c): a new trajectory, too, is
        # redistributed and relaxed once
        before, parents = costs[own], scratch.parents
        genomes, out = by_gene(strings[own]), by_gene(offspring)
        breed(
            select, cross, mutate, draws, normals, index, rate, rules, before, genomes, parents, out
        )
        # (c) redistribution and relaxation
        smooth(offspring, count, settings)
        # Eqs. 2–7
        judge(offspring, settings, scratch.terms)
        follow(table, own, other, scratch)
        summarise(costs[other], collisions[other] == 0.0, summaries[other])


@kernel
def by_gene(strings: FloatArray) -> FloatArray:
    """Return strings (nq, N + 1, individuals) as genomes (nq · (N + 1), individuals): a view."""
    return strings.reshape((strings.shape[0] * strings.shape[1], strings.shape[2]))


@kernel
def follow(table: Population, own: int, other: int, scratch: Scratch) -> None:
    """Write the population at a place that follows another: elites are not evaluated again."""
    (strings, costs, collisions), (offspring, terms, elites, parents) = table, scratch
    count, new, following = len(parents), by_gene(offspring), by_gene(strings[other])
    for row in range(len(new)):
        for k in range(count):
            following[row, k] = new[row, k]
    copy_members(by_gene(strings[own]), elites, following, count)
    costs[other, :count], collisions[other, :count] = terms.cost[:count], terms.collisions[:count]
    costs[other, count:], collisions[other, count:] = costs[own][elites], collisions[own][elites]


@kernel
def smooth(strings: FloatArray, count: int, settings: Settings) -> None:
    """Redistribute and relax the first `count` of strings (nq, N + 1, ≥ count) (section 3.4 c).

    Points that leave the limits are put there.
    """
    lanes = -(-count // 8) * 8  # whole vectors
    if settings.redistribution and count > 0 and strings.shape[1] > 2:
        arms, samples = settings.arm_slices, settings.samples
        redistribute_arms(strings, arms, lanes, samples, settings.is_clamped)
    if settings.relaxation_step > 0.0 and count > 0:
        relax_points(strings, settings.relaxation_step, lanes)
    for joint in range(len(strings)):
        low, high = settings.limits[joint]
        for point in range(strings.shape[1]):
            row = strings[joint, point]
            for k in range(count):
                row[k] = low if row[k] < low else (high if row[k] > high else row[k])


@kernel
def judge(strings: FloatArray, settings: Settings, terms: StringTerms) -> None:
    """Write the terms of strings (nq, N + 1, individuals), Eqs. 2–7.

    The instants 1 … N are the configurations that may collide.
    """
    substeps, (nq, num_points, lanes) = settings.substeps, strings.shape
    # Eqs. 2–5: lengths, and how uneven the distances of via-points are
    measure_paths(strings, settings.arm_slices, terms.lengths, terms.unevenness)
    # Eq. 6: contacts at the instants, which follow the start, and at the substeps before them
    configurations, start = strings, lanes
    if substeps > 1:
        configurations, start = np.empty((nq, (num_points - 1) * substeps, lanes)), 0
        interpolate(strings, substeps, configurations)
    angles = configurations.reshape((nq, -1))[:, start:] * DEGREE
    clearances = np.empty((3, angles.shape[1]))
    least_clearances(settings.tables, 0.0, True, angles, clearances)
    hits = np.minimum(clearances[0], np.minimum(clearances[1], clearances[2]))
    count_collisions(hits.reshape((num_points - 1, substeps, lanes)), terms.collisions)
    # Eq. 7
    weigh(settings.weights, terms)


class Problem(ArmProblem):
    """A robot and its scenario, prepared."""

    @property
    def sphere_radius(self) -> float:
        """Radius of the circles or spheres that approximate the links [length unit]."""
        return self._spheres.radius

    @property
    def _spheres(self) -> SphereCollision:
        """The paper's model: bodies that are covered have no spheres of one size."""
        assert isinstance(self.collision, SphereCollision)
        return self.collision

    def sphere_centres(self, q: FloatArray) -> list[FloatArray]:
        """Return the centres (spheres, 3) of each arm's circles or spheres at q (nq,) [deg]."""
        model, shapes = self.assembly.model, self._spheres.shapes
        data, spheres = model.createData(), zip(shapes.joint.tolist(), shapes.start, strict=True)
        pin.forwardKinematics(model, data, DEGREE * q)
        centres = np.array([data.oMi[joint].act(center) for joint, center in spheres])
        return np.split(centres, np.cumsum(self._spheres.counts)[:-1])

    def centre_distances(self, q: FloatArray) -> FloatArray:
        """Return the least distance between centres of two arms, as the paper's Figs. 7 and 13 do.

        (configurations,) [length unit] of q (nq, configurations) [deg].
        """
        return np.asarray(self.collision.clearance(q).between_arms + 2.0 * self.sphere_radius)

    def obstacle_distances(self, q: FloatArray) -> FloatArray:
        """Return the least distance from a centre to an obstacle's surface; see the one above."""
        return np.asarray(self.collision.clearance(q).to_obstacles + self.sphere_radius)


class Strings:
    """The population-wide steps of one planner on one problem."""

    def __init__(self, planner: "ViaPointGa", problem: Problem) -> None:
        self.planner, self.problem = planner, problem
        self.is_covered = isinstance(problem.collision, CoveredCollision)
        low, high = problem.limits.T if self.is_covered else (-np.inf, np.inf)
        # ends that lie on a limit lie within it, whatever the last bit of the conversion is
        low = np.minimum(low, np.minimum(problem.start, problem.goal))
        high = np.maximum(high, np.maximum(problem.start, problem.goal))
        self.num_uniforms = num_uniforms(problem.arm_slices, planner.num_via_points)
        self.settings = Settings(
            arm_slices=problem.arm_slices,
            redistribution=planner.redistribution,
            samples=planner.samples_per_segment,
            is_clamped=planner.spline_end == "clamped",
            relaxation_step=planner.relaxation_step,
            substeps=planner.collision.collision_substeps,
            weights=planner.objective.weights,
            tables=problem.collision.collision.tables,
            limits=np.column_stack([low, high]),
        )

    @property
    def genome(self) -> Genome:
        """The coordinates of via-points as operators see them; the ends of a string are fixed."""
        problem, shape = self.problem, (len(self.problem.start), self.planner.num_via_points + 1)
        limits = np.empty((*shape, 2))
        limits[...] = problem.limits[:, None]
        limits[:, 0], limits[:, -1] = problem.start[:, None], problem.goal[:, None]
        return Genome(limits.reshape(-1, 2), problem.arm_slices, shape[1])

    def padded(self, strings: FloatArray) -> FloatArray:
        """Return a copy of strings (nq, N + 1, count), padded to whole vectors by zeros."""
        count = strings.shape[2]
        copy = self.empty(count)
        copy[:, :, :count] = strings
        return copy

    def empty(self, count: int) -> FloatArray:
        """Return memory for strings, padded to whole vectors and holding zeros."""
        lanes = max(LANES, -(-count // LANES) * LANES)
        return np.zeros((len(self.problem.start), self.planner.num_via_points + 1, lanes))

    def drawn(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Return new random walks from start to goal (section 3.3), smoothed and padded."""
        problem, strings = self.problem, self.empty(count)
        uniforms, lanes = rng.random((count, self.num_uniforms)), np.arange(count)
        step, max_turn = self.planner.walk_step, DEGREE * self.planner.max_turn
        ends = problem.start, problem.goal
        walk_strings(strings, lanes, uniforms, *ends, problem.arm_slices, step, max_turn)
        smooth(strings, count, self.settings)
        return strings

    def judge(self, strings: FloatArray, count: int) -> JudgementArrays:
        """Judge the first `count` strings: the terms are C1 … C5 of Eqs. 2–6."""
        terms = self.no_terms(strings, count)
        judge(strings, self.settings, terms)
        collisions = terms.collisions[:count]
        tested = self.planner.num_via_points * self.settings.substeps * count
        named = {f"length_arm_{a + 1}_deg": row[:count] for a, row in enumerate(terms.lengths)}
        for a, row in enumerate(terms.unevenness):
            named[f"unevenness_arm_{a + 1}_deg"] = row[:count]
        named["collisions"] = collisions
        return JudgementArrays(terms.cost, collisions == 0.0, tested, named)

    def no_terms(self, strings: FloatArray, count: int) -> StringTerms:
        """Return memory for the terms of the first `count` strings; all but costs are padded."""
        lengths, unevenness = np.empty((2, len(self.problem.arm_slices), strings.shape[2]))
        return StringTerms(lengths, unevenness, np.empty(strings.shape[2]), np.empty(count))


class Search(GeneticSearch):
    """One run, and memory for its generations."""

    def __init__(self, planner: "ViaPointGa", problem: Problem) -> None:
        ga, strings = planner.ga, Strings(planner, problem)
        population, offspring = strings.empty(ga.population_size), strings.empty(ga.num_offspring)
        # testing covered bodies takes far longer than a call
        one_by_one = planner.answers_are_proven or strings.is_covered
        per_call = generations_per_call(1 if one_by_one else PER_CALL, population.nbytes, CACHED)
        super().__init__(ga, planner.operators, strings.genome, per_call)
        self._planner, self._problem, self._strings = planner, problem, strings
        self._proofs = Proofs(planner, problem) if planner.answers_are_proven else None
        costs, collisions = np.empty((2, self.num_places, ga.population_size))
        self.table = Population(np.array([population] * self.num_places), costs, collisions)
        terms = strings.no_terms(offspring, ga.num_offspring)
        self.scratch = Scratch(offspring, terms, self.elites, self.parents)
        self.costs, self._shown = self.table.costs, np.empty(self.table.strings.shape[1:])
        self.queries_each = planner.num_via_points * planner.collision.collision_substeps

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population."""
        strings, size = self._strings, self.costs.shape[1]
        self.table.strings[:] = strings.drawn(rng, size)
        judged = strings.judge(self.table.strings[0], size)
        self.costs[0], self.table.collisions[0] = judged.cost, judged.terms["collisions"]
        self._summarise(0)

    def advance(self, uniforms: FloatArray, normals: FloatArray, first: int) -> int:
        """Compute generations (section 3.4)."""
        (select, cross, mutate), settings = self.operators, self._strings.settings
        arguments = self.breeding, settings, self.table, self.scratch, self.summaries
        evolve(select, cross, mutate, uniforms, normals, first, *arguments)
        return first + len(uniforms)

    def candidate(self, place: int, individual: int) -> Candidate:
        """Return a string and its terms, judged once more by itself."""
        own = self.table.strings[place, :, :, individual, None]
        terms = self._strings.judge(self._strings.padded(own), 1).named_terms(0)
        solution = self._planner.solution(self._problem, own, 0)
        return Candidate(solution, terms, terms["collisions"] == 0.0)

    def improve(self, places: IntArray) -> list[Best]:
        """Keep the best strings; where proofs are asked for, a proven one.

        A string that is refuted costs more in the next generation.
        """
        if self._proofs is None:
            return super().improve(places)
        (place,), keeper, proofs = places.tolist(), self.keeper, self._proofs
        strings, costs, hits = (array[place] for array in self.table)
        k = settle(proofs, strings, costs, hits, keeper.cost)
        proven = np.zeros(len(costs), bool)
        if k is not None:
            proven[k] = True

        def candidate(k: int, solved: bool) -> Candidate:
            found = self.candidate(place, k)
            found.terms["certificates"] = float(proofs.num_certificates)
            return found._replace(solved=solved)

        keeper.keep_proven(costs, proven, candidate)
        self._summarise(place)
        return [keeper.standing]

    def population(self, index: int) -> FloatArray:
        """Return the strings, padded, in the same array for all generations.

        So the digest of a run that its budget ends is that of the first generation beyond it.
        """
        np.copyto(self._shown, self.table.strings[index % self.num_places])
        return self._shown

    def _summarise(self, place: int) -> None:
        free = self.table.collisions[place] == 0.0
        summarise(self.costs[place], free, self.summaries[place])


def settle(
    proofs: Proofs, strings: FloatArray, costs: FloatArray, hits: FloatArray, below: float = np.inf
) -> int | None:
    """Judge free strings (nq, N + 1, …), the cheapest first, until one is proven; return it.

    None if none is, or a cost `below` is reached. One that is refuted counts as colliding at one
    instant more, and costs as much: `costs` and `hits` (individuals,) are changed.
    """
    planner, problem = proofs.planner, proofs.problem
    open_costs = np.where((hits == 0.0) & (costs < below), costs, np.inf)
    settled = open_costs.copy()
    proven = proofs.settle(settled, lambda k: planner.solution(problem, strings, k))
    refuted = settled != open_costs
    hits[refuted] += 1.0
    costs[refuted] += planner.objective.collision_weight
    return proven
