"""One genetic search for the end posture of a sub-path (Lavoie & Boudreau 2001).

Its memory, its calls of kernels.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.evolution.crossover import num_single_point_uniforms
from evoexp.evolution.gene_crossover import CROSSOVERS, ONE_POINT, num_gene_uniforms
from evoexp.evolution.gene_mutation import (
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
from evoexp.planners.redundant_ga import kernels
from evoexp.planners.redundant_ga.kernels import RESULTS
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic, SelectiveSettings
from evoexp.records import FloatArray
from evoexp.robots.planar_ends import LANES

SELECTIONS = ("tournament", "roulette", "rank")  # in the order of the kernels' numbers


class Found(NamedTuple):
    """The best individual of a population.

    Attributes:
        cost: Eq. 4.
        posture: (joints,) [rad].
        terms: (3,) cost, position error, joint displacement.
    """

    cost: float
    posture: FloatArray
    terms: FloatArray


class Summary(NamedTuple):
    """What a generation's costs say."""

    best: int
    mean: float
    std: float
    num_finite: int


class Search:
    """One run of the genetic algorithm over the ends of one sub-path.

    Attributes:
        genomes: (genes, individuals) of the population; a view.
        costs: (individuals,) a view.
        best: A copy of the best individual; elites keep it the best so far.
        summary: Of the costs.
    """

    def __init__(
        self, ga: SelectiveSettings, limits: FloatArray, judging: tuple[Any, ...], start: FloatArray
    ) -> None:
        """Take the settings, and memory for a population.

        Args:
            ga: Settings of a real or a binary genetic algorithm.
            limits: (joints, 2) of the joint angles [rad].
            judging: See `kernels.judge`.
            start: (joints,) where the sub-path starts [rad].
        """
        joints, size, count = len(start), ga.population_size, ga.num_offspring
        self._ga, self._limits, self._judging = ga, limits, judging
        self._binary = isinstance(ga, BinaryGenetic)
        self._num_genes = joints * ga.bits_per_gene if isinstance(ga, BinaryGenetic) else joints
        first = self._num_genes if self._binary else 0
        table, offspring = (
            np.empty((first + joints + RESULTS, size)),
            np.empty((first + joints + RESULTS, count)),
        )
        parents, elites = np.empty(count, dtype=np.int64), np.empty(ga.num_elites, dtype=np.int64)
        self._lanes, self._hit = np.arange(size + LANES), np.zeros(size, dtype=np.bool_)
        self._memory = (table, offspring, parents, elites, self._lanes, self._hit)
        self._starts = np.repeat(start[:, None], size, axis=1)
        self.genomes, self._angles, self._results = (
            table[: self._num_genes],
            table[first:-RESULTS],
            table[-RESULTS:],
        )
        self.costs = self._results[0]
        self._count, self._mutation = count, _mutation(ga)
        selecting = (SELECTIONS.index(ga.selection), ga.tournament_size, ga.rank_pressure)
        crossing = _crossing(ga)
        self._breeding = (self._num_genes, self._binary, selecting, crossing)
        self._stops = self._places(crossing[0])
        self.best, self.summary = Found(np.inf, start, np.empty(0)), Summary(0, np.nan, np.nan, 0)

    def _places(self, crossover: int) -> tuple[int, int, int]:
        """Return where a generation's uniform numbers for crossover and for mutation begin.

        And how many there are.
        """
        ga, count, num_genes = self._ga, self._count, self._num_genes
        pairs = count // 2
        chosen = count * (ga.tournament_size if ga.selection == "tournament" else 1)
        crossed = (
            num_single_point_uniforms(pairs)
            if crossover == ONE_POINT
            else num_gene_uniforms(num_genes, pairs)
        )
        mutated = (
            num_genes * count
            if self._binary
            else num_mutation_uniforms(num_genes, count, self._mutation[1])
        )
        return chosen, chosen + crossed, chosen + crossed + mutated

    def begin(self, rng: np.random.Generator) -> None:
        """Draw the initial population, uniform within the limits, and judge it."""
        size = len(self.costs)
        if self._binary:
            self.genomes[:] = np.floor(2.0 * rng.random(self.genomes.shape))
            decode_bits(self.genomes, size, self._limits, self._angles)
        else:
            low, high = self._limits.T
            self._angles[:] = low[:, None] + (high - low)[:, None] * rng.random(self._angles.shape)
        judged = (self._judging, self._results, self._hit)
        kernels.judge(self._starts, self._angles, self._lanes, size, *judged)
        self._summarise(kernels.summary(self.costs))

    def advance(self, rng: np.random.Generator, index: int) -> None:
        """Replace the population of generation `index` by the next one."""
        crossing, mutating, end = self._stops
        uniforms = rng.random(end)
        kind, scope, rate, spread = self._mutation
        if kind == NON_UNIFORM and isinstance(self._ga, RealGenetic):
            spread = float(
                non_uniform_spread(index, self._ga.num_generations, self._ga.mutation_power)
            )
        normals = (
            standard_normal(rng, (self._num_genes, self._count))
            if kind == GAUSSIAN
            else _NO_NORMALS
        )
        draws = (uniforms[:crossing], uniforms[crossing:mutating], uniforms[mutating:], normals)
        breeding = (*self._breeding, (kind, scope, rate, spread), self._limits)
        found = kernels.advance(draws, breeding, self._judging, self._starts, self._memory)
        self._summarise(found)

    def _summarise(self, found: tuple[int, float, float, int]) -> None:
        self.summary = Summary(*found)
        terms = self._results[:, self.summary.best].copy()
        self.best = Found(float(terms[0]), self._angles[:, self.summary.best].copy(), terms)


_NO_NORMALS = np.empty((0, 0))


def _crossing(ga: SelectiveSettings) -> tuple[int, float, float]:
    """Return crossover, its rate, α."""
    if not isinstance(ga, RealGenetic):
        return ONE_POINT, ga.crossover_rate, 0.0
    return CROSSOVERS.index(ga.crossover), ga.crossover_rate, ga.blend_alpha


def _mutation(ga: SelectiveSettings) -> tuple[int, int, float, float]:
    """Return mutation, its scope, its rate, its spread."""
    if not isinstance(ga, RealGenetic):
        return NON_UNIFORM, GENE, ga.mutation_rate, 0.0
    return (
        MUTATIONS.index(ga.mutation),
        SCOPES.index(ga.mutation_scope),
        ga.mutation_rate,
        ga.mutation_std,
    )
