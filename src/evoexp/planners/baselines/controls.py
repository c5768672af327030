"""Controls: at random, many starts, and searches among individuals as real vectors.

They search at a planner's own cost: CMA-ES (Hansen & Ostermeier 2001) by the package cmaes, NSGA-II
(Deb et al. 2002) by pymoo, trajectory optimisation in the manner of STOMP, iterated local search.
"""

import itertools
import math
from decimal import Decimal
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError, demand, nearest
from evoexp.numeric.elementary import exp, matrix_product, standard_normal
from evoexp.planners.planner import COPIES, Populations, Reproducibility, WrappedPlanner, num_values
from evoexp.records import BoolArray, FloatArray
from evoexp.validation import Count, Positive, Rate

SHRINKAGE = 0.1  # [-] share of a drawn covariance that is replaced by its diagonal
LEAST = 1e-6  # [-] of the mean variance: directions in which drawn individuals do not differ
SEEDS = 2**32  # of numpy's older generators
ENDLESS = 10**9  # generations: NSGA-II counts them itself


class RandomSearch(WrappedPlanner):
    """Draws individuals as the wrapped planner draws its first ones, as many as it evaluates."""

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation of new samples after the other."""
        for index in itertools.count():
            yield self.planner.sample(problem, rng, self.planner.num_evaluations(index))


class MultiStart(WrappedPlanner):
    """Draws a population, applies the planner's local operator again and again, and starts anew.

    The first generation of a start holds fresh samples; each of the next `num_sweeps` generations
    the same individuals after one more pass of the planner's `improve`. A generation evaluates as
    many as the planner would in it: where that falls, the last are left out; where it rises, fresh
    samples join.
    """

    num_sweeps: Count  # passes of the local operator per start

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        problem = super().prepare(robot, scenario)
        rng = np.random.Generator(np.random.PCG64(0))  # of a trial whose result is thrown away
        sample = self.planner.sample(problem, rng, 1)
        if self.planner.improve(problem, sample, rng) is None:
            must = f"left out: {self.planner.component} has no local operator to be repeated"
            raise SettingError("control", must, self.component)
        return problem

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one start after the other: fresh samples, then their sweeps."""
        planner, population = self.planner, np.empty(0)
        for index in itertools.count():
            count, improved = planner.num_evaluations(index), None
            if index % (self.num_sweeps + 1):
                improved = planner.improve(problem, population[..., :count], rng)
                missing = count - population.shape[-1]
            if improved is None:
                population = planner.sample(problem, rng, count)
            elif missing > 0:
                fresh = planner.sample(problem, rng, missing)
                population = np.concatenate([improved, fresh], axis=-1)
            else:
                population = improved
            yield population


class RealVectors(NamedTuple):
    """The numbers of an individual that a search may change."""

    # an individual, individuals' axis left out; what is the same in all of them stays
    template: FloatArray
    changes: BoolArray  # of the same shape: which of its numbers are searched
    drawn: FloatArray  # (variables, individuals) those of the drawn individuals
    # least and greatest values of an individual's numbers, each of the template's shape
    bounds: tuple[FloatArray, FloatArray]

    def population(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (individuals, variables) as `cost` takes them, put within bounds."""
        found = np.repeat(self.template[..., None], len(vectors), axis=-1)
        found[self.changes] = vectors.T
        low, high = (bound[..., None] for bound in self.bounds)
        return np.asarray(np.minimum(np.maximum(found, low), high))

    def distribution(self) -> "Distribution":
        """Return the normal distribution of the drawn individuals, shrunk towards its diagonal."""
        count, diagonal = self.drawn.shape[1], np.eye(len(self.drawn), dtype=bool)
        mean = matrix_product(self.drawn, np.ones(count)) / count
        apart = self.drawn - mean[:, None]
        covariance = matrix_product(apart, np.ascontiguousarray(apart.T)) / count
        own = np.diag(covariance).copy()
        variance = float(matrix_product(own, np.ones(len(own)))) / len(own)
        covariance *= 1.0 - SHRINKAGE
        least = np.maximum(own, LEAST * variance)
        covariance[diagonal] = (1.0 - SHRINKAGE) * own + SHRINKAGE * least
        covariance /= variance
        return Distribution(mean, covariance, float(np.sqrt(variance)))


class Distribution(NamedTuple):
    """A normal distribution of vectors."""

    mean: FloatArray  # (variables,)
    covariance: FloatArray  # (variables, variables), of mean variance 1
    deviation: float  # root of the mean variance


class RealVectorControl(WrappedPlanner, is_base=True):
    """Base of the controls that search among the real vectors of a planner's individuals."""

    matrices: ClassVar[int] = 1  # of (variables, variables) that a search keeps
    fewest: ClassVar[int] = 2  # individuals of a generation that a search takes

    num_drawn: Count  # individuals drawn to know where vectors differ and how; not judged

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        of = self.planner.component
        must = f"left out: individuals of {of} are no vectors of real numbers"
        demand(self.planner.is_real_coded, "control", must, self.component)
        return super().prepare(robot, scenario)

    def num_evaluations(self, index: int) -> int:
        """Return the planner's evaluations of a later generation, or the fewest there may be."""
        return max(self.fewest, int(self.planner.num_evaluations(max(1, index))))

    def memory(self, problem: Any) -> int:
        """Return the planner's estimate, and that of the drawn individuals and of matrices."""
        values = num_values(self.shape(problem))
        own = 8 * values * (COPIES * self.num_drawn + self.matrices * values)
        return int(self.planner.memory(problem)) + own


def real_vectors(planner: Any, problem: Any, drawn: FloatArray) -> RealVectors:
    """Return where a search begins, by a real-coded planner's `sample` `drawn`, individuals last.

    SettingError: the individuals do not differ.
    """
    template = np.ascontiguousarray(drawn[..., 0])
    changes = np.asarray((drawn != template[..., None]).any(axis=-1))
    vectors = np.ascontiguousarray(drawn[changes])  # (variables, individuals)
    must = "one whose first individuals differ"
    demand(vectors.size, "planner", must, planner.component)
    bounds = planner.bounds(problem)  # real-coded ones have them
    return RealVectors(template, changes, vectors, bounds)


def transposed_root(matrix: FloatArray) -> FloatArray:
    """Return Lᵀ of the Cholesky factor L of a matrix; LAPACK's bits depend on processors."""
    root = np.triu(matrix)  # rows are columns of L
    for k in range(len(root)):
        for i in range(k):
            root[k, k:] -= root[i, k] * root[i, k:]
        root[k, k:] /= np.sqrt(root[k, k])
    return root


class CmaEs(RealVectorControl):
    """Adapts mean and covariance of a normal distribution of individuals to what costs least.

    It begins with individuals drawn as the planner draws its own first ones. With
    `improves` each individual goes through one pass of the planner's local operator before it is
    judged; what is told to CMA-ES is the vector before it. Where all steps have become too small to
    matter, or numbers become too large to be judged, it starts anew. Linear algebra makes the last
    bits depend on the environment.
    """

    reproducibility: ClassVar[Reproducibility] = "environment"
    matrices: ClassVar[int] = 12  # the covariance, its parts, and those of an update

    fewest: ClassVar[int] = 5

    sigma: Positive  # first standard deviation, in those of the drawn individuals [-]
    improves: bool  # whether individuals go through the planner's local operator before judgement

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation after the other, of one distribution or of several in turn."""
        from cmaes import CMA

        planner = self.planner
        vectors = real_vectors(planner, problem, planner.sample(problem, rng, self.num_drawn))
        start = vectors.distribution()
        optimizer: CMA | None = None
        for index in itertools.count():
            count = self.num_evaluations(index)
            if optimizer is None or optimizer.should_stop():
                optimizer = CMA(
                    mean=start.mean.copy(),
                    sigma=self.sigma * start.deviation,
                    cov=start.covariance.copy(),
                    seed=int(rng.integers(SEEDS)),
                    population_size=count,
                )
            asked = np.array([optimizer.ask() for _ in range(count)])
            population = vectors.population(asked)
            improved = planner.improve(problem, population, rng) if self.improves else None
            judged = yield population if improved is None else improved
            ranked = np.where(np.isfinite(judged.cost), judged.cost, np.finfo(float).max)
            optimizer.tell(list(zip(asked, ranked.tolist(), strict=True)))


class IteratedLocalSearch(RealVectorControl):
    """Improves the best of the first population, each on its own (Lourenço, Martin & Stützle 2003).

    A step adds the difference of two individuals that the planner drew at first, so that it is as
    smooth as they are, times a factor whose logarithm is uniform. With `improves` the planner's
    local operator, if it has one, is applied once. An individual of a chain is replaced by the
    cheapest of its trials in a generation unless that costs more. Chains exchange nothing.
    """

    matrices: ClassVar[int] = 0

    num_chains: Count  # individuals that are improved side by side
    improves: bool  # whether trials go through the planner's local operator before judgement
    sigma: Positive  # largest step, in those between drawn individuals over √2 [-]
    least: Annotated[float, Field(gt=0.0, le=1.0)]  # smallest step, as a share of the largest [-]

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield the first population, then the trials of all chains in turn."""
        planner = self.planner
        vectors = real_vectors(planner, problem, planner.sample(problem, rng, self.num_drawn))
        population = planner.sample(problem, rng, planner.num_evaluations(0))
        judged = yield population
        order = np.argsort(judged.cost, kind="stable")[: self.num_chains]
        chains, costs = population[..., order][vectors.changes].T, judged.cost[order]
        lowest = float(Decimal(self.least).ln())  # rounded correctly, whatever the C library does
        for index in itertools.count(1):
            count = self.num_evaluations(index)
            one, other = rng.integers(self.num_drawn, size=(2, count))
            logarithms = lowest * rng.random(count)
            sizes = self.sigma / math.sqrt(2.0) * np.array([exp(x) for x in logarithms.tolist()])
            steps = sizes * (vectors.drawn[:, one] - vectors.drawn[:, other])
            of = np.arange(count) % len(chains)
            population = vectors.population(chains[of] + steps.T)
            improved = planner.improve(problem, population, rng) if self.improves else None
            population = population if improved is None else improved
            judged = yield population
            for chain in range(min(count, len(chains))):
                trials = np.flatnonzero(of == chain)
                best = trials[np.argmin(judged.cost[trials])]
                if judged.cost[best] <= costs[chain]:
                    costs[chain] = judged.cost[best]
                    chains[chain] = population[..., best][vectors.changes]


class Nsga2(RealVectorControl):
    """Evolves a front: individuals that no other surpasses in all objectives at once.

    Objectives are terms of the planner's own judgement; the answer is the individual of the
    planner's least cost. Operators are pymoo's defaults, within the box of all individuals drawn at
    first. Linear algebra of libraries makes the last bits those of an environment.
    """

    reproducibility: ClassVar[Reproducibility] = "environment"

    fewest: ClassVar[int] = 4

    # names of terms, to be minimised; a name stands for the sum of all terms that begin with it,
    # as `length` does for the lengths of all arms
    objectives: Annotated[tuple[str, ...], Field(min_length=2)]

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        problem = super().prepare(robot, scenario)
        one = self.planner.sample(problem, np.random.Generator(np.random.PCG64(0)), 1)
        names = tuple(self.planner.cost(problem, one).named_terms(0))
        for k, name in enumerate(self.objectives):
            if not any(term.startswith(name) for term in names):
                must = f"the begin of a term ({', '.join(names)})"
                raise SettingError(f"control.objectives[{k}]", must, name, nearest(name, names))
        return problem

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation after the other."""
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.core.problem import Problem

        planner, size = self.planner, self.num_evaluations(1)
        drawn = planner.sample(problem, rng, max(self.num_drawn, size))
        coding = real_vectors(planner, problem, drawn)
        vectors = coding.drawn.T
        box = Problem(
            n_var=vectors.shape[1],
            n_obj=len(self.objectives),
            xl=vectors.min(axis=0),
            xu=vectors.max(axis=0),
        )
        search = NSGA2(pop_size=size, sampling=vectors[:size], eliminate_duplicates=False)
        forever = ("n_gen", ENDLESS)
        search.setup(box, termination=forever, seed=int(rng.integers(SEEDS)), verbose=False)
        while True:
            asked = search.ask()
            judged = yield coding.population(np.asarray(asked.get("X"), dtype=np.float64))
            rows = []
            for k, cost in enumerate(judged.cost):
                named = judged.named_terms(k).items()
                sums = [sum(v for n, v in named if n.startswith(o)) for o in self.objectives]
                rows.append(sums if np.isfinite(cost) else [np.finfo(float).max] * len(sums))
            asked.set("F", np.array(rows, dtype=np.float64))
            search.tell(infills=asked)


class Stomp(RealVectorControl):
    """Moves one trajectory by the weighted mean of noisy ones (Kalakrishnan et al. 2011).

    Noise has the covariance of the individuals that the planner draws at first. Unlike in STOMP a
    cost is that of a whole trajectory, so that all its via-points share one weight: exp(−h (S − min
    S) / (max S − min S)) (their Eq. 11). The trajectory that results is judged as the first of the
    next generation. Noise shrinks by a factor per generation; without a better trajectory for
    `patience` generations the search starts anew from an individual that the planner draws.
    """

    matrices: ClassVar[int] = 4  # the covariance, its root, and those of its factorisation

    sigma: Positive  # standard deviation of the first noise, in those of the drawn individuals [-]
    shrinkage: Rate  # share of the noise that is left after a generation [-]
    sensitivity: Positive  # h, the weight's decay from the least cost to the largest [-]
    patience: Count  # generations without a better trajectory until it starts anew

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation of noisy trajectories after the other, the middle one first."""
        planner = self.planner
        vectors = real_vectors(planner, problem, planner.sample(problem, rng, self.num_drawn))
        start = vectors.distribution()
        root, scale = transposed_root(start.covariance), start.deviation
        middle, sigma, least, idle = start.mean, self.sigma, np.inf, 0
        for index in itertools.count():
            if idle > self.patience:
                middle = planner.sample(problem, rng, 1)[vectors.changes][:, 0]
                sigma, least, idle = self.sigma, np.inf, 0
            normals = standard_normal(rng, (self.num_evaluations(index), len(middle)))
            normals[0] = 0.0
            noise = matrix_product(sigma * scale * normals, root)
            judged = yield vectors.population(middle + noise)
            idle = 0 if judged.cost.min() < least else idle + 1
            least = min(least, float(judged.cost.min()))
            middle = middle + matrix_product(self.weights(judged.cost), noise)
            sigma *= self.shrinkage

    def weights(self, costs: FloatArray) -> FloatArray:
        """Return weights of trajectories by their costs, of sum 1; 0: infeasible."""
        finite = np.isfinite(costs)
        if not finite.any():
            return np.full(len(costs), 1.0 / len(costs))
        low, high = costs[finite].min(), costs[finite].max()
        decay = self.sensitivity / (high - low) if high > low else 0.0
        found = [exp(-decay * (c - low)) if math.isfinite(c) else 0.0 for c in costs.tolist()]
        return np.array(found) / sum(found)
