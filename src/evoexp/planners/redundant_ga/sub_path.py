"""One genetic search for the end posture of a sub-path (Lavoie & Boudreau 2001)."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from evoexp.evolution.cost_statistics import CostStatistics
from evoexp.evolution.crossover import (
    CROSSOVERS,
    ONE_POINT,
    num_gene_uniforms,
    num_single_point_uniforms,
)
from evoexp.evolution.mutation import (
    GAUSSIAN,
    GENE,
    MUTATIONS,
    NON_UNIFORM,
    SCOPES,
    decode_bits,
    non_uniform_spread,
    num_mutation_uniforms,
)
from evoexp.numeric.elementary import standard_normal
from evoexp.numeric.named_tuples import plain
from evoexp.numeric.vectors import LANES
from evoexp.planners.redundant_ga import kernels
from evoexp.planners.redundant_ga.kernels import RESULTS, Breeding, Draws, Judging, Memory
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic, SelectiveSettings
from evoexp.records import FloatArray

SELECTIONS = ("tournament", "roulette", "rank")  # in the order of the kernels' numbers
_NO_NORMALS = np.empty((0, 0))


class BestEnd(NamedTuple):
    """The best individual of a population.

    Attributes:
        cost: Eq. 4.
        posture: (joints,) [rad].
        terms: (3,) cost, position error, joint displacement.
    """

    cost: float
    posture: FloatArray
    terms: FloatArray


class Search:
    """One run of the genetic algorithm over the ends of one sub-path.

    Attributes:
        genomes: (genes, individuals) of the population; a view.
        costs: (individuals,) a view.
        best: A copy of the best individual; elites keep it the best so far.
        statistics: Mean and deviation of the costs.
        num_finite: Number of finite costs.
    """

    best: BestEnd
    statistics: CostStatistics
    num_finite: int

    def __init__(
        self,
        ga: SelectiveSettings,
        limits: FloatArray,
        judging: Judging,
        start: FloatArray,
        accepts: Callable[[FloatArray], bool] | None = None,
    ) -> None:
        """Take the settings, and memory for a population.

        Args:
            ga: Settings of a real or a binary genetic algorithm.
            limits: (joints, 2) of the joint angles [rad].
            judging: Collision model and objective.
            start: (joints,) where the sub-path starts [rad].
            accepts: Whether an end (joints,) [rad] may be the best one; None: any of finite cost.
        """
        self._accepts = accepts
        joints, size, count = len(start), ga.population_size, ga.num_offspring
        self._ga, self._judging, self._breeding = ga, judging, _breeding(ga, limits)
        first = self._breeding.num_genes if self._breeding.binary else 0
        rows = first + joints + RESULTS
        self._memory = Memory(
            np.empty((rows, size)),
            np.empty((rows, count)),
            np.empty(count, dtype=np.int64),
            np.empty(ga.num_elites, dtype=np.int64),
            np.arange(size + LANES),
            np.zeros(size, dtype=np.bool_),
        )
        self._plain = plain(self._breeding), plain(judging), plain(self._memory)
        table = self._memory.population
        self._starts = np.repeat(start[:, None], size, axis=1)
        self._angles, self._results = table[first:-RESULTS], table[-RESULTS:]
        self.genomes, self.costs = table[: self._breeding.num_genes], self._results[0]
        self._stops = self._places()

    def _places(self) -> list[int]:
        """Return where the uniform numbers for choice, crossover and mutation end."""
        ga, breeding, count = self._ga, self._breeding, self._ga.num_offspring
        pairs, genes = count // 2, breeding.num_genes
        one_point, scope = breeding.crossover == ONE_POINT, breeding.mutation_scope
        numbers = (
            count * (ga.tournament_size if ga.selection == "tournament" else 1),
            num_single_point_uniforms(pairs) if one_point else num_gene_uniforms(genes, pairs),
            num_mutation_uniforms(genes, count, scope),
        )
        return [int(stop) for stop in np.cumsum(numbers)]

    def begin(self, rng: np.random.Generator) -> None:
        """Draw the initial population, uniform within the limits, and judge it."""
        size = len(self._starts[0])
        self._take(self._draw(rng, size), size)

    def _draw(self, rng: np.random.Generator, count: int) -> tuple[int, float, float, int]:
        """Draw the first `count` individuals anew and judge them; return their summary."""
        limits, angles = self._breeding.limits, self._angles[:, :count]
        if self._breeding.binary:
            self.genomes[:, :count] = np.floor(2.0 * rng.random((len(self.genomes), count)))
            decode_bits(self.genomes, count, limits, self._angles)
        else:
            low, high = limits.T
            angles[:] = low[:, None] + (high - low)[:, None] * rng.random(angles.shape)
        lanes, judged = self._memory.lanes, (self._judging, self._results, self._memory.hit)
        lanes[:] = np.arange(len(lanes))
        kernels.judge(self._starts, self._angles, lanes, count, *judged)
        found: tuple[int, float, float, int] = kernels.summary(self._results[0, :count])
        return found

    def advance(self, rng: np.random.Generator, index: int) -> None:
        """Replace the population of generation `index` by the next one."""
        ga, breeding = self._ga, self._breeding
        chosen, crossed, end = self._stops
        uniforms, normals, spread = rng.random(end), _NO_NORMALS, 0.0
        if isinstance(ga, RealGenetic) and breeding.mutation == NON_UNIFORM:
            spread = float(non_uniform_spread(index, ga.num_generations, ga.mutation_power))
        elif isinstance(ga, RealGenetic) and breeding.mutation == GAUSSIAN:
            normals, spread = (
                standard_normal(rng, (breeding.num_genes, ga.num_offspring)),
                ga.mutation_std,
            )
        draws = Draws(uniforms[:chosen], uniforms[chosen:crossed], uniforms[crossed:], normals)
        settings, judging, memory = self._plain
        found = kernels.advance(tuple(draws), spread, settings, judging, self._starts, memory)
        self._take(found, len(self._starts[0]))

    def _take(self, summary: tuple[int, float, float, int], count: int) -> None:
        """Take over the summary of the first `count` individuals; refused ends cost inf."""
        costs = self._results[0, :count]
        while self._accepts is not None and np.isfinite(costs[summary[0]]):
            if self._accepts(self._angles[:, summary[0]]):
                break
            costs[summary[0]] = np.inf
            summary = kernels.summary(costs)
        self.statistics, self.num_finite = CostStatistics(*summary[:3]), summary[3]
        terms = self._results[:, summary[0]].copy()
        self.best = BestEnd(float(terms[0]), self._angles[:, summary[0]].copy(), terms)


class DrawnSearch(Search):
    """The same search without evolution: every generation is drawn as the initial population is.

    A generation draws as many individuals as the genetic algorithm breeds, and costs as many
    evaluations. `genomes` and `costs` are those of the last draw.
    """

    def advance(self, rng: np.random.Generator, index: int) -> None:
        """Draw the next population; keep the best individual of all draws so far."""
        before, count = self.best, self._ga.num_offspring
        if count == 0:  # all are elites: nothing is bred, and nothing drawn
            return
        self._take(self._draw(rng, count), count)
        self.genomes, self.costs = self.genomes[:, :count], self._results[0, :count]
        self.best = self.best if self.best.cost < before.cost else before


def _breeding(ga: SelectiveSettings, limits: FloatArray) -> Breeding:
    """Return the settings of the operators as the kernels take them."""
    binary = isinstance(ga, BinaryGenetic)
    crossover, alpha, mutation, scope = ONE_POINT, 0.0, NON_UNIFORM, GENE
    if isinstance(ga, RealGenetic):
        crossover, alpha = CROSSOVERS.index(ga.crossover), ga.blend_alpha
        mutation, scope = MUTATIONS.index(ga.mutation), SCOPES.index(ga.mutation_scope)
    return Breeding(
        num_genes=len(limits) * (ga.bits_per_gene if isinstance(ga, BinaryGenetic) else 1),
        binary=binary,
        selection=SELECTIONS.index(ga.selection),
        tournament_size=ga.tournament_size,
        rank_pressure=ga.rank_pressure,
        crossover=crossover,
        crossover_rate=ga.crossover_rate,
        blend_alpha=alpha,
        mutation=mutation,
        mutation_scope=scope,
        mutation_rate=ga.mutation_rate,
        limits=limits,
    )
