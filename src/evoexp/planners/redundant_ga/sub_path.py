"""Genetic searches for the end postures of sub-paths, one after the other, and the best plan.

Lavoie & Boudreau 2001; their hyperparameters, and operators that can be chosen.
"""

from collections.abc import Generator
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, cast

import numpy as np
from pydantic import Field

from evoexp.evolution.operators import crossover, mutation
from evoexp.evolution.operators.operator import (
    Crossover,
    Genome,
    Mutation,
    Named,
    Operators,
    PopulationSettings,
    Selection,
)
from evoexp.evolution.operators.selection import InverseRoulette, LinearRanking, Tournament
from evoexp.evolution.succession import summarise
from evoexp.numeric.generator_state import state_bytes
from evoexp.numeric.vectors import LANES
from evoexp.planners.answers import Proofs
from evoexp.planners.driver import GeneticSearch, generations_per_call
from evoexp.planners.planner import Candidate
from evoexp.planners.reaching_tasks import Problem
from evoexp.planners.redundant_ga import kernels
from evoexp.planners.redundant_ga.kernels import RESULTS, SubPath
from evoexp.records import Best, Block, FloatArray, IntArray
from evoexp.validation import Count, NonNegative, NonNegativeCount, Positive

TERMS = tuple(
    f"{name}_sp{path}{unit}"
    for path in (1, 2)
    for name, unit in (("of", ""), ("position_error", ""), ("joint_displacement", "_rad"))
)  # of both sub-paths, with unit
STRETCH = 8  # generations computed per call, at most,
MEMORY = 2**20  # [B] whose tables should not take more than this


class SelectiveSettings(PopulationSettings, is_base=True):
    """Settings of real and of binary coding; `RealGenetic` and `BinaryGenetic` add their own.

    An operator is another component, or one of these words; its settings are then those below.
    """

    # `tournament`; `roulette` with weights 1/cost; `rank`: roulette with linear weights
    selection: Literal["tournament", "roulette", "rank"] | Named[Selection]
    tournament_size: Count  # individuals per tournament [-]
    # offspring expected of the best one, in linear ranking [-]
    rank_pressure: Annotated[float, Field(ge=1.0, le=2.0)]

    @property
    def selection_operator(self) -> Selection:
        """The selection that `selection` stands for."""
        named: dict[Any, Any] = {
            "tournament": Tournament(tournament_size=self.tournament_size),
            "roulette": InverseRoulette(),
            "rank": LinearRanking(rank_pressure=self.rank_pressure),
        }
        return cast(Selection, named.get(self.selection, self.selection))


class RealGenetic(SelectiveSettings):
    """Genomes of real numbers within limits."""

    # of a pair, with probability `crossover_rate`
    crossover: Literal["one_point", "uniform", "arithmetic", "blx_alpha"] | Named[Crossover]
    # α of BLX-α: how far beyond the parents children may lie, in units of their distance [-]
    blend_alpha: NonNegative
    mutation: Literal["non_uniform", "gaussian", "uniform_reset"] | Named[Mutation]
    # whether `mutation_rate` is the probability of every `gene`, or of one gene of an
    # `individual`
    mutation_scope: Literal["gene", "individual"]
    mutation_power: NonNegativeCount  # b of non-uniform mutation [-]
    # standard deviation of Gaussian mutation, in units of a gene's range [-]
    mutation_std: Positive

    @property
    def operators(self) -> Operators:
        """The operators of a search."""
        one_gene = self.mutation_scope == "individual"
        named: dict[Any, Any] = {
            "one_point": crossover.OnePoint(),
            "uniform": crossover.UniformCrossover(),
            "arithmetic": crossover.ArithmeticCrossover(),
            "blx_alpha": crossover.BlxAlpha(blend_alpha=self.blend_alpha),
            "non_uniform": mutation.NonUniformMutation(
                one_gene=one_gene, mutation_power=self.mutation_power
            ),
            "gaussian": mutation.GaussianMutation(
                one_gene=one_gene, mutation_std=self.mutation_std
            ),
            "uniform_reset": mutation.UniformReset(one_gene=one_gene),
        }
        chosen = (named.get(own, own) for own in (self.crossover, self.mutation))
        return Operators(self.selection_operator, *chosen)


class BinaryGenetic(SelectiveSettings):
    """Genomes of bits: every gene a plain binary number.

    One-point crossover between bits, mutation bit by bit.
    """

    # B; a gene takes 2^B values, its limits included [-]
    bits_per_gene: Annotated[int, Field(ge=1, le=52)]

    @property
    def operators(self) -> Operators:
        """The operators of a search."""
        return Operators(self.selection_operator, crossover.OnePoint(), mutation.BitFlips())


if TYPE_CHECKING:
    from evoexp.planners.redundant_ga.planner import RedundantGa


class BestEnd(NamedTuple):
    """The best end of a sub-path."""

    cost: float  # eq. 4.
    posture: FloatArray  # (joints,) [rad]
    terms: FloatArray  # (3,) cost, position error, joint displacement


class Search(GeneticSearch):
    """One run: searches for the ends of SP1 and SP2 in turn, in the same memory."""

    evolving = True
    end: BestEnd  # of the present search

    def __init__(self, planner: "RedundantGa", problem: Problem, rng: np.random.Generator) -> None:
        ga, limits = planner.ga, problem.joint_limits
        assert isinstance(ga, RealGenetic | BinaryGenetic), "prepare refuses others"
        size, bits = ga.population_size, ga.bits_per_gene if isinstance(ga, BinaryGenetic) else 0
        genome = Genome.of(np.repeat([[0.0, 1.0]], bits * len(limits), axis=0) if bits else limits)
        num_genes = len(genome.limits)
        first = num_genes if bits else 0
        rows, filled = first + len(limits) + RESULTS, -(-size // LANES) * LANES
        per_call = generations_per_call(STRETCH, 8 * rows * filled, MEMORY)
        one_by_one = planner.answers_are_proven
        super().__init__(ga, ga.operators, genome, 1 if one_by_one else per_call)
        if not self.evolving:
            self.num_drawn, self.num_normals = num_genes * ga.num_offspring, (0, 0)
        self._planner, self._problem = planner, problem
        self._proofs = Proofs(planner, problem) if planner.answers_are_proven else None
        self._rng, self._tables = rng, np.zeros((self.num_places, rows, filled))
        lanes, hit = np.empty(size + LANES, dtype=np.int64), np.zeros(size, dtype=np.bool_)
        self._fixed = num_genes, bits > 0, limits, self.parents, self.elites, lanes, hit
        self._num_genes, self.queries_each = num_genes, problem.collision.queries
        self._angles = self._tables[:, first:-RESULTS]
        self._attempts, self._path = 0, 0
        self._via_cost = np.inf  # of the posture A that takes the place of a plan

    def sub_path(self, *postures: FloatArray) -> Generator[Block, None, BestEnd]:
        """Search the end of SP1, or of SP2 behind a posture A; return the best one.

        The postures (joints,) are the start, and A if SP2 is searched [rad].
        """
        self._postures, self._path = postures, len(postures) - 1
        if self._path == 0:
            self._attempts += 1
        else:
            self._via = self.end
        size, judging = self._ga.population_size, self._planner.judging(self._problem, self._path)
        self._sub_path = SubPath(*self._fixed, np.repeat(postures[-1][:, None], size, 1), judging)
        self.costs = self._tables[:, None, -RESULTS, :size]
        self._shown = np.empty((self._num_genes, size))
        best = self.keeper.best
        self.keeper.best = best._replace(terms=best.terms | self._counts)
        yield from self.blocks(self._rng)
        return self.end

    @property
    def _counts(self) -> dict[str, float]:
        return {"attempts": float(self._attempts), "sub_path": self._path + 1.0}

    @property
    def _stop_cost(self) -> float:
        return float(self._planner.stop_costs[self._path])

    @property
    def is_done(self) -> bool:  # type: ignore[override]
        """Whether the best end is good enough."""
        return self.end.cost < self._stop_cost

    def begin(self, rng: np.random.Generator) -> None:
        """Draw the initial population, uniform within the limits, and judge it."""
        uniforms = rng.random(self._num_genes * self._ga.population_size)
        kernels.begin(uniforms, self._sub_path, self._tables)
        self.states = [state_bytes(rng.bit_generator)]
        self._summarise(0)

    def advance(self, uniforms: FloatArray, normals: FloatArray, first: int) -> int:
        """Compute generations, as far as the best end is not good enough."""
        (select, cross, mutate), stop_cost = self.operators, self._stop_cost
        numbers = uniforms, normals, first, stop_cost, self.evolving
        rules = self.breeding, self._sub_path, self._tables, self.summaries
        reached = kernels.evolve(select, cross, mutate, *numbers, *rules)
        self._summarise(reached % self.num_places)
        return int(reached)

    def _summarise(self, place: int) -> None:
        """Summarise a generation; refute the ends that are not proven, if proofs are asked for."""
        postures, costs, ends = self._postures, self.costs[place, 0], self._angles[place]
        if self._proofs is not None:
            self._proofs.settle(
                costs, lambda k: np.concatenate([*postures, *[ends[:, k]] * (3 - len(postures))])
            )
        summarise(costs, np.isfinite(costs), self.summaries[place])

    def improve(self, places: IntArray) -> list[Best]:
        """Keep the best plan of the generations at some places; return the bests of their block."""
        bests = {0: self.keeper.standing}
        keeper, problem = self.keeper, self._problem
        for k, place in enumerate(places.tolist()):
            end = self.end = self._best_end(place)
            if self._path == 1 and end.cost < keeper.cost:
                cost, via, terms = end.cost, self._via, np.array([self._via.terms, end.terms])
                plan = np.concatenate([problem.start, via.posture, end.posture])
            elif self._path == 0 and (
                keeper.index < 0 or (keeper.cost == np.inf and end.cost < self._via_cost)
            ):
                # without a plan of finite cost, the best posture A is a plan that stays there
                cost, self._via_cost = np.inf, end.cost
                plan = np.concatenate([problem.start, end.posture, end.posture])
                terms = self._planner.judge_plan(problem, plan)
            else:
                continue
            named = dict(zip(TERMS, terms.ravel().tolist(), strict=True)) | self._counts
            keeper.keep(cost, Candidate(plan, named, bool(self._planner.successful(1, cost))))
            bests[k] = keeper.standing._replace(place=k)
        return [*bests.values()]

    def _best_end(self, place: int) -> BestEnd:
        """Return the best individual of a generation; elites keep it the best so far."""
        best = int(self.summaries[place, 0])
        terms = self._tables[place, -RESULTS:, best].copy()
        return BestEnd(terms.item(0), self._angles[place][:, best].copy(), terms)

    def lowest(self, places: IntArray) -> FloatArray:
        """Return the lowest costs of generations; inf in SP1, which has no whole plans."""
        if self._path == 0:
            return np.full(len(places), np.inf)
        return np.asarray(self.costs[places, 0, self.summaries[places, 0].astype(np.int64)])

    def population(self, index: int) -> FloatArray:
        """Return the genomes of a generation, in the same array for all of a search."""
        count = self.costs.shape[2]
        shown = self._shown[:, :count]
        np.copyto(shown, self._tables[index % self.num_places, : self._num_genes, :count])
        return shown


class DrawnSearch(Search):
    """The same search without evolution: every generation is drawn as the initial population is.

    A generation draws as many individuals as would be bred; the best end is that of all draws.
    """

    evolving = False

    @property
    def is_done(self) -> bool:  # type: ignore[override]
        """Whether the best end is good enough, or nothing is bred, and so nothing drawn."""
        return super().is_done or not self._ga.num_offspring

    def begin(self, rng: np.random.Generator) -> None:
        """Draw the initial population; see `Search`."""
        super().begin(rng)
        self.end = super()._best_end(0)

    def advance(self, uniforms: FloatArray, normals: FloatArray, first: int) -> int:
        """Draw generations; see `Search`."""
        self.costs = self.costs[:, :, : self._ga.num_offspring]
        return super().advance(uniforms, normals, first)

    def _best_end(self, place: int) -> BestEnd:
        drawn = super()._best_end(place)
        return drawn if drawn.cost < self.end.cost else self.end
