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
    num_mutation_uniforms,
)
from evoexp.numeric.pcg64 import Twin
from evoexp.numeric.vectors import LANES
from evoexp.planners.redundant_ga import kernels
from evoexp.planners.redundant_ga.breeding import Breeding
from evoexp.planners.redundant_ga.kernels import SUMMARY, Generations, Memory
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic, SelectiveSettings
from evoexp.planners.redundant_ga.sub_path_costs import RESULTS, Judging
from evoexp.records import FloatArray

SELECTIONS = ("tournament", "roulette", "rank")  # in the order of the kernels' numbers
STRETCH = 8  # generations computed per call, at most,
MEMORY = 2**20  # [B] whose tables should not take more than this


class BestEnd(NamedTuple):
    """The best individual of a population."""

    cost: float  # eq. 4.
    posture: FloatArray  # (joints,) [rad]
    terms: FloatArray  # (3,) cost, position error, joint displacement


class RunMemory:
    """Generator, settings and memory for generations that the searches of one run share.

    Attributes:
        ga: Settings.
        twin: Of the run's generator.
        breeding: The operators, as kernels take them.
        num_places: Generations in memory.
        generations: See `kernels.Generations`.
        memory: See `kernels.Memory`.
        costs: Of every place (individuals,), a view.
        angles: Of every place (joints, individuals), a view [rad].
        genomes: Of every place (genes, individuals), a view.
    """

    def __init__(self, ga: SelectiveSettings, limits: FloatArray, rng: np.random.Generator) -> None:
        """Take the settings, and memory.

        Args:
            ga: Settings.
            limits: (joints, 2) [rad].
            rng: Source of all random numbers.
        """
        breeding, size, count = _breeding(ga, limits), ga.population_size, ga.num_offspring
        self.ga, self.twin, self.breeding = ga, Twin(rng), breeding
        first = breeding.num_genes if breeding.binary else 0
        rows, filled = first + len(limits) + RESULTS, -(-size // LANES) * LANES
        stretch = max(1, min(STRETCH, MEMORY // (8 * rows * filled)))
        self.num_places = min(stretch, ga.num_generations) + 1
        self.generations = Generations(
            np.zeros((self.num_places, rows, filled)),
            np.empty((self.num_places, 2), dtype=np.uint64),
            np.empty((self.num_places, SUMMARY)),
        )
        choosing, crossing, mutating = _num_uniforms(ga, breeding)
        gaussian = breeding.mutation == GAUSSIAN
        memory = Memory(
            np.empty(choosing + crossing + mutating),
            np.empty((breeding.num_genes if gaussian else 0, count)),
            np.empty(count, dtype=np.int64),
            np.empty(ga.num_elites, dtype=np.int64),
            np.empty(size + LANES, dtype=np.int64),
            np.zeros(size, dtype=np.bool_),
            choosing,
            crossing,
        )
        self.memory = memory
        tables = self.generations.tables[:, :, :size]
        self.costs, self.angles = list(tables[:, -RESULTS]), list(tables[:, first:-RESULTS])
        self.genomes = list(tables[:, : breeding.num_genes])


class Search:
    """One run of the genetic algorithm over the ends of one sub-path.

    Several generations are computed per call of a kernel, and shown one after the other.
    """

    evolving = True
    # (genes, individuals) of the population, a copy: one array for all generations
    genomes: FloatArray
    costs: FloatArray  # (individuals,) a view
    lowest: float  # the best individual's cost; elites keep it the best so far
    statistics: CostStatistics  # mean and deviation of the costs
    num_finite: int  # number of finite costs

    def __init__(
        self,
        memory: RunMemory,
        judging: Judging,
        start: FloatArray,
        stop_cost: float,
        accepts: Callable[[FloatArray], bool] | None = None,
    ) -> None:
        """Begin a search.

        Args:
            memory: Of the run, for one search after the other.
            judging: Collision model and objective of the sub-path.
            start: (joints,) where the sub-path begins [rad].
            stop_cost: The search ends where the best costs less.
            accepts: Whether a posture (joints,) may be the best one; None: any of finite cost.
        """
        self._memory, self._judging, self._accepts = memory, judging, accepts
        self._starts = np.repeat(start[:, None], memory.ga.population_size, axis=1)
        self.genomes = np.empty(memory.genomes[0].shape)
        self._stop_cost, self._known, self._place = stop_cost, 0, 0

    def begin(self) -> None:
        """Draw the initial population, uniform within the limits, and judge it."""
        run = self._memory
        run.twin.meet()
        kernels.begin(
            run.twin.words, run.breeding, self._judging, self._starts, run.generations, run.memory
        )
        self._show(0)

    def advance(self, index: int) -> None:
        """Go on from the population of generation `index` to the next one."""
        run = self._memory
        if index == self._known:
            ahead = 1 if self._accepts is not None else run.num_places - 1
            run.twin.meet()
            self._known = kernels.evolve(
                run.twin.words,
                index,
                min(index + ahead, run.ga.num_generations),
                self._stop_cost,
                self.evolving,
                run.breeding,
                self._judging,
                self._starts,
                run.generations,
                run.memory,
            )
        self._show(index + 1)

    def _show(self, index: int) -> None:
        """Show a generation that is computed; the run's generator is where it was behind it."""
        run = self._memory
        self._place = place = index % run.num_places
        run.twin.follow(run.generations.states[place])
        self.costs = run.costs[place]
        self._take(place)
        np.copyto(self.genomes, run.genomes[place][:, : len(self.costs)])

    def _take(self, place: int) -> None:
        """Take over the summary of a generation; refused ends cost inf."""
        costs, summary = self.costs, self._memory.generations.summaries[place]
        best, mean, std, finite = summary.tolist()
        self.lowest = costs.item(int(best))
        while self._accepts is not None and np.isfinite(self.lowest):
            if self._accepts(self._memory.angles[place][:, int(best)]):
                break
            costs[int(best)] = np.inf
            kernels.summarise_costs(costs, summary)
            best, mean, std, finite = summary.tolist()
            self.lowest = costs.item(int(best))
        self.statistics, self.num_finite = CostStatistics(int(best), mean, std), int(finite)

    def best(self) -> BestEnd:
        """Return a copy of the best individual."""
        run, place, k = self._memory, self._place, self.statistics.best
        posture = run.angles[place][:, k].copy()
        return BestEnd(self.lowest, posture, run.generations.tables[place, -RESULTS:, k].copy())


class DrawnSearch(Search):
    """The same search without evolution: every generation is drawn as the initial population is.

    A generation draws as many individuals as the genetic algorithm breeds, and costs as many
    evaluations. `genomes` and `costs` are those of the last draw; the best is that of all draws.
    """

    evolving = False
    _best: BestEnd | None = None

    def advance(self, index: int) -> None:
        """Draw the next population; keep the best individual of all draws so far."""
        if self._memory.ga.num_offspring:  # else all are elites: nothing is bred, and nothing drawn
            super().advance(index)

    def _take(self, place: int) -> None:
        if self._best is not None:
            count = self._memory.ga.num_offspring
            self.genomes, self.costs = self.genomes[:, :count], self.costs[:count]
        super()._take(place)
        if self._best is None or self.lowest < self._best.cost:
            self._best = super().best()
        self.lowest = self._best.cost

    def best(self) -> BestEnd:
        """Return the best individual of all draws."""
        assert self._best is not None
        return self._best


def _num_uniforms(ga: SelectiveSettings, breeding: Breeding) -> tuple[int, int, int]:
    """Count the uniform numbers of a generation: for choice, crossover and mutation."""
    count, genes = ga.num_offspring, breeding.num_genes
    pairs, one_point = count // 2, breeding.crossover == ONE_POINT
    return (
        count * (ga.tournament_size if ga.selection == "tournament" else 1),
        num_single_point_uniforms(pairs) if one_point else num_gene_uniforms(genes, pairs),
        num_mutation_uniforms(genes, count, breeding.mutation_scope),
    )


def _breeding(ga: SelectiveSettings, limits: FloatArray) -> Breeding:
    """Return the settings of the operators as the kernels take them."""
    binary = isinstance(ga, BinaryGenetic)
    crossover, alpha, mutation, scope, std, power = ONE_POINT, 0.0, NON_UNIFORM, GENE, 0.0, 0
    if isinstance(ga, RealGenetic):
        crossover, alpha = CROSSOVERS.index(ga.crossover), ga.blend_alpha
        mutation, scope = MUTATIONS.index(ga.mutation), SCOPES.index(ga.mutation_scope)
        std, power = ga.mutation_std, ga.mutation_power
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
        mutation_std=std,
        mutation_power=power,
        num_generations=ga.num_generations,
        limits=limits,
    )
