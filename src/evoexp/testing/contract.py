"""The obligations of planners and operators; their modules `planner` and `operator` explain them.

Every check of a planner takes a condition, runs its replicate 0 (once for all checks) and raises
`ContractBroken` where the planner does something else.
"""

import functools
import inspect
import itertools
import pickle
import random
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy import random as numpy_random
from numpy.typing import NDArray

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.evolution.operators import operator as kinds
from evoexp.planners.planner import MEMBERS, Reproducibility
from evoexp.records import FloatArray, Generation, IntArray, generations
from evoexp.store.log import Finished
from evoexp.validation import Component

# terms of planners whose best is more than one individual: a team, or a whole plan
BETTER_THAN_ALONE = {"team_cost", "sub_path", "phase"}
STARTS_ANEW = "attempts"  # a term of planners that begin again where an attempt has failed
Check = Callable[[Condition], None]  # raises `ContractBroken`
Demand = tuple[object, str, object]  # whether an obligation is kept, what it is, what was instead
NUM_GENES, SIZE, SPARE = 6, 9, 4  # of a small population; SPARE columns pad the offspring
NOTHING = np.empty((0, 2))
CHECKS: list[Check] = []  # all obligations of a planner, each a function of a condition


class ContractBroken(AssertionError):
    """A planner or an operator that does not keep one of its obligations."""


class EvolutionRecord(NamedTuple):
    """Replicate 0 of a condition."""

    planner: Any  # the planner
    problem: Any  # its problem
    # the initial one first; their arrays are copies made before the next one was asked for
    generations: list[Generation]
    bests: list[FloatArray]  # the very arrays of the best solutions, which must keep their values
    last_population: NDArray[Any]  # the last population itself, after the planner has ended
    has_drawn: bool  # whether the planner drew from its generator
    global_randomness: bool  # whether numpy's and Python's global generators were used

    @property
    def last(self) -> Generation:
        """The last record."""
        return self.generations[-1]


@functools.lru_cache(maxsize=8)
def evolution(condition: Condition) -> EvolutionRecord:
    """Run replicate 0 of a condition and keep everything that the planner showed."""
    before, rng = _global_states(), condition.rng(0)
    untouched = rng.bit_generator.state
    planner, problem = condition.prepare()
    records, bests, population = list[Generation](), list[FloatArray](), np.empty(0)
    for each in generations(planner.evolve(problem, rng)):
        population = each.population
        bests.append(each.best)
        best, costs, copied = each.best.copy(), each.costs.copy(), population.copy()
        records.append(each._replace(best=best, costs=costs, population=copied))
    if not records:
        raise ContractBroken("evolve must yield the initial population at least; was nothing")
    has_drawn, used = rng.bit_generator.state != untouched, before != _global_states()
    return EvolutionRecord(planner, problem, records, bests, population, has_drawn, used)


@functools.lru_cache(maxsize=16)
def finished(condition: Condition, replicate: int) -> Finished:
    """Return the log and the summary of a replicate."""
    return run_replicate(condition, replicate)


def obligation(demands: Callable[[Condition], Iterator[Demand]]) -> Check:
    """Make a check of what a function demands of a condition's planner."""

    @functools.wraps(demands)
    def check(condition: Condition) -> None:
        for is_kept, must, was in demands(condition):
            if not is_kept:
                name = getattr(condition.planner, "component", type(condition.planner).__name__)
                raise ContractBroken(f"planner '{name}': {must}; was {was}")

    CHECKS.append(check)
    return check


def _global_states() -> tuple[Any, ...]:
    state: Any = numpy_random.get_state(legacy=False)  # noqa: NPY002  # its use is looked for
    return repr(state), state["state"]["key"].tobytes(), random.getstate()


# its members, its identity, its randomness


@obligation
def every_member_is_there(condition: Condition) -> Iterator[Demand]:
    """A planner has every member that one must have, with the same parameters."""
    planner = condition.planner
    must = "a planner must be a Component, so that a configuration can name it"
    yield isinstance(planner, Component), must, type(planner).__name__
    for name, wanted in MEMBERS.items():
        if not inspect.isfunction(wanted):
            continue
        method, expected = getattr(planner, name), list(inspect.signature(wanted).parameters)[1:]
        yield callable(method), f"{name} must be a method", type(method).__name__
        try:
            inspect.signature(method).bind(*expected)
        except TypeError:
            was = f"{name}{inspect.signature(method)}"
            yield False, f"{name} must take ({', '.join(expected)})", was
    choices = {"reproducibility": get_args(Reproducibility), "is_reference": (False, True)}
    for name, values in choices.items():
        value = getattr(planner, name)
        yield value in values, f"{name} must be one of {', '.join(map(repr, values))}", repr(value)
    number = planner.revision
    is_number = type(number) is int and number > 0
    yield is_number, "revision must be a whole number, at least 1", number


@obligation
def a_condition_survives_its_json(condition: Condition) -> Iterator[Demand]:
    """A condition read back from its canonical form, or unpickled, is the same with one hash."""
    forms = {
        "from its JSON": Condition.from_json(condition.to_json()),
        "from a pickle": pickle.loads(pickle.dumps(condition)),
    }
    for how, again in forms.items():
        must = f"a condition read back {how} must be equal and have the same hash"
        yield again == condition and again.id == condition.id, must, again.id[:12]


@obligation
def the_same_seed_gives_the_same_bits(condition: Condition) -> Iterator[Demand]:
    """A replicate run twice has one digest; another replicate has another one."""
    first, other = (finished(condition, k).summary.digest for k in range(2))
    again = finished.__wrapped__(condition, 0).summary.digest
    must = "two runs of one replicate must agree in every bit (keep nothing from run to run)"
    yield first == again, must, f"{first} and {again}"
    must = "another replicate must use its own random numbers and so give other bits"
    yield other != first, must, f"one digest, {first}"


@obligation
def randomness_comes_from_the_given_generator(condition: Condition) -> Iterator[Demand]:
    """Only `rng` is drawn from, only while the planner evolves, and never kept."""
    found = evolution(condition)
    must = "random numbers must come from rng, never from a global generator"
    yield not found.global_randomness, must, "another state of it"
    must = "evolve must draw its random numbers from rng"
    has_drawn = found.has_drawn or condition.is_reference
    yield has_drawn, must, "a generator that nobody drew from"
    rng = condition.rng(0)
    evolution_of_two = found.planner.evolve(found.problem, rng)
    next(evolution_of_two)
    state = rng.bit_generator.state
    for call in (found.planner.motion, found.planner.evaluate):
        call(found.problem, np.array(found.last.best))
    must = "motion and evaluate must not draw from a generator that evolve was given"
    yield rng.bit_generator.state == state, must, "another state of it"
    evolution_of_two.close()


# its records: counts, costs, finite numbers


@obligation
def generations_are_numbered(condition: Condition) -> Iterator[Demand]:
    """Generations count from 0 without a gap, and are no more than announced."""
    found = evolution(condition)
    indices = [generation.index for generation in found.generations]
    must = "generations must be numbered 0, 1, 2, …, the initial population being 0"
    yield indices == list(range(len(indices))), must, indices
    announced = found.planner.num_generations
    must = f"generations after the initial one must be at most num_generations ({announced})"
    yield STARTS_ANEW in found.last.terms or indices[-1] <= announced, must, indices[-1]


@obligation
def evaluations_add_up(condition: Condition) -> Iterator[Demand]:
    """Evaluations grow by what `num_evaluations` announces for each generation.

    The last generation may have fewer where the planner ends by itself.
    """
    found = evolution(condition)
    counts = [generation.evaluations for generation in found.generations]
    grow = all(a < b for a, b in itertools.pairwise([0, *counts]))
    yield grow, "evaluations must grow with every generation", counts
    if condition.is_reference or STARTS_ANEW in found.last.terms:
        return
    costs = found.generations[0].costs  # of several populations at once, there is a row for each
    rows = len(costs) if costs.ndim > 1 else 1
    announced = itertools.accumulate(map(found.planner.num_evaluations, range(len(counts))))
    for index, (count, was) in enumerate(zip(announced, counts, strict=True)):
        wanted, ends = rows * count, bool(found.generations[index].stop_reason)
        must = f"evaluations up to generation {index} must be the sum of num_evaluations, {wanted}"
        yield was == wanted or (ends and was < wanted), must, was


@obligation
def collision_queries_never_decrease(condition: Condition) -> Iterator[Demand]:
    """Collision queries are counted since the start."""
    counts = [generation.collision_queries for generation in evolution(condition).generations]
    must = "collision_queries are counted since the start: they must never decrease"
    yield all(a <= b for a, b in itertools.pairwise([0, *counts])), must, counts


@obligation
def the_best_so_far_never_gets_worse(condition: Condition) -> Iterator[Demand]:
    """The best cost is the least of all generations so far, or the least that was proven."""
    found = evolution(condition)
    costs = [generation.best_cost for generation in found.generations]
    least = np.minimum.accumulate([each.best_cost_in_generation for each in found.generations])
    if found.planner.answers_are_proven:  # and cheaper ones may be refuted
        must = "best_cost must never get worse, and be no less than the least cost so far"
        never_worse = all(a >= b for a, b in itertools.pairwise(costs))
        yield never_worse and bool(np.all(costs >= least)), must, costs
        return
    for index, (cost, lowest) in enumerate(zip(costs, least.tolist(), strict=True)):
        must = f"best_cost must be the least cost so far ({lowest!r} in generation {index})"
        yield cost == lowest, must, repr(cost)


@obligation
def costs_are_those_of_the_generation(condition: Condition) -> Iterator[Demand]:
    """Least and mean cost and the number of feasible individuals agree with the costs."""
    for generation in evolution(condition).generations:
        costs, where = generation.costs, f" in generation {generation.index}"
        must = f"num_feasible must lie between 0 and the number of costs, {costs.size},{where}"
        yield 0 <= generation.num_feasible <= costs.size, must, generation.num_feasible
        if costs.ndim != 1:  # the best is a team of several populations
            continue
        least = generation.best_cost_in_generation
        must = f"best_cost_in_generation must be the least of costs, {costs.min()!r},{where}"
        yield least == costs.min(), must, repr(least)
        if BETTER_THAN_ALONE & generation.terms.keys():
            continue
        finite = costs[np.isfinite(costs)]
        wanted = (finite.mean(), finite.std()) if finite.size else (np.nan, np.nan)
        was = (generation.mean_cost, generation.std_cost)
        size = float(np.abs(finite).max()) if finite.size else 0.0
        fits = np.allclose(was, wanted, rtol=1e-9, atol=1e-9 * size, equal_nan=True)
        must = f"mean_cost and std_cost must be those of the finite costs, {wanted},{where}"
        yield fits, must, was


@obligation
def numbers_are_finite(condition: Condition) -> Iterator[Demand]:
    """Solutions, populations and terms are finite; costs are numbers or inf, never NaN."""
    for generation in evolution(condition).generations:
        where = f" in generation {generation.index}"
        for name, values in (("best", generation.best), ("population", generation.population)):
            must = f"{name} must hold finite numbers{where}"
            yield np.all(np.isfinite(values)), must, "inf or NaN"
        must = f"costs must be numbers, or inf where an individual is infeasible{where}"
        yield not np.isnan(generation.costs).any(), must, "NaN"
        solved, terms = generation.solved, generation.terms
        yield type(solved) is bool, f"solved must be true or false{where}", repr(solved)
        wrong = {k: v for k, v in terms.items() if not isinstance(v, int | float)}
        yield not wrong, f"terms must be numbers by name{where}", wrong


# operators


def context_of(
    operator: kinds.Operator, uniforms: FloatArray, rate: float, genome: kinds.Genome
) -> kinds.Context:
    """Return the context of an operator in the initial generation, without normal deviates."""
    return kinds.Context(uniforms, NOTHING, rate, 0.0, operator.settings, genome)


def selected(
    operator: kinds.Selection, rng: np.random.Generator, costs: FloatArray, count: int
) -> IntArray:
    """Return the indices of `count` parents, drawn by costs (individuals,)."""
    parents = np.full(count, -1)
    uniforms = rng.random(operator.num_uniforms(len(costs), count))
    operator.select(costs, context_of(operator, uniforms, 1.0, kinds.Genome.of(NOTHING)), parents)
    return parents


def crossed(
    operator: kinds.Crossover,
    rng: np.random.Generator,
    genomes: FloatArray,
    parents: IntArray,
    rate: float,
    genome: kinds.Genome,
) -> FloatArray:
    """Return the offspring (genes, parents) of a population (genes, individuals)."""
    out = np.full((len(genomes), len(parents) + SPARE), np.nan)
    uniforms = rng.random(operator.num_uniforms(genome, len(parents)))
    operator.cross(genomes, parents, context_of(operator, uniforms, rate, genome), out)
    _check(bool(np.isnan(out[:, len(parents) :]).all()), operator, "leaves the padding alone")
    return out[:, : len(parents)]


def mutated(
    operator: kinds.Mutation,
    rng: np.random.Generator,
    genomes: FloatArray,
    rate: float,
    genome: kinds.Genome,
    progress: float = 0.0,
) -> FloatArray:
    """Return the mutants (genes, individuals) of individuals, at t / T = `progress`."""
    num_genes, count = genomes.shape
    out = np.pad(genomes, [(0, 0), (0, SPARE)], constant_values=np.nan)
    uniforms = rng.random(operator.num_uniforms(genome, count))
    normals = rng.standard_normal((num_genes, count) if operator.takes_normals else (0, 0))
    context = context_of(operator, uniforms, rate, genome)
    operator.mutate(out, count, context._replace(normals=normals, progress=progress))
    _check(bool(np.isnan(out[:, count:]).all()), operator, "leaves the padding alone")
    return out[:, :count]


def check_operator(operator: kinds.Operator) -> None:
    """Check the obligations of an operator on small populations.

    Parents are individuals; at the rate 0 nobody is changed; every gene is written and within its
    limits; the same numbers give the same bits.

    Raises:
        ContractBroken: For the first obligation that it does not keep.
    """
    for seed in range(20):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(0, SIZE))
        if isinstance(operator, kinds.Selection):
            costs = np.where(rng.random(SIZE) < 0.3, np.inf, rng.random(SIZE))
            parents = selected(operator, rng, costs, count)
            _check(bool(((parents >= 0) & (parents < SIZE)).all()), operator, "draws individuals")
        elif isinstance(operator, kinds.Crossover | kinds.Mutation):
            _check_children(operator, rng, rng.integers(0, SIZE, count))


def _check_children(
    operator: kinds.Crossover | kinds.Mutation, rng: np.random.Generator, parents: IntArray
) -> None:
    genome = kinds.Genome.of(np.sort(rng.uniform(-5.0, 5.0, (NUM_GENES, 2))))
    low, high = genome.limits.T[:, :, None]
    genomes = rng.uniform(low, high, (NUM_GENES, SIZE))
    before = genomes[:, parents]

    def children(rate: float) -> FloatArray:
        numbers = np.random.default_rng(0)
        if isinstance(operator, kinds.Crossover):
            return crossed(operator, numbers, genomes, parents, rate, genome)
        return mutated(operator, numbers, before, rate, genome, 0.3)

    _check(np.array_equal(children(0.0), before), operator, "changes nobody at the rate 0")
    found = children(0.8)
    _check(bool(((low <= found) & (found <= high)).all()), operator, "keeps genes within limits")
    _check(np.array_equal(found, children(0.8)), operator, "gives the same bits again")


def _check(is_kept: bool, operator: kinds.Operator, obligation: str) -> None:
    if not is_kept:
        raise ContractBroken(f"operator {operator.component!r}: is one that {obligation}")
