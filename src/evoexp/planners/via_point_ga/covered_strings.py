"""Strings of via-points of robots whose bodies are covered: they keep within the joints' limits.

A generation goes through the same steps as one of `strings`, between kernels of their own: what
covered bodies are tested for takes far longer than what Python does between the steps.
"""

from collections.abc import Iterator

import numpy as np

from evoexp.collision.models.covered_bodies import CoveredCollision
from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.evolution.selection import choose_elites
from evoexp.evolution.succession import succeed
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.string_fitness import count_collisions, weigh
from evoexp.paths.interpolation import interpolate_linear
from evoexp.paths.lengths import measure_paths
from evoexp.planners.arm_tasks import UNLIMITED
from evoexp.planners.via_point_ga import kernels
from evoexp.planners.via_point_ga.settings import ViaPointSettings
from evoexp.planners.via_point_ga.strings import JudgedGeneration, Judgement, Problem, Strings
from evoexp.records import FloatArray


class CoveredStrings(Strings):
    """The population-wide steps of one planner on one problem with covered bodies."""

    def __init__(self, planner: ViaPointSettings, problem: Problem) -> None:
        super().__init__(planner, problem)
        assert isinstance(problem.collision, CoveredCollision)
        self.collision = problem.collision
        model = problem.assembly.model
        limits = np.array([model.lowerPositionLimit, model.upperPositionLimit])
        low, high = np.clip(limits, -UNLIMITED, UNLIMITED) / DEGREE
        # ends that lie on a limit lie within it, whatever the last bit of the conversion is
        self.low = np.minimum(low, np.minimum(problem.start, problem.goal))[:, None, None]
        self.high = np.maximum(high, np.maximum(problem.start, problem.goal))[:, None, None]

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest angle of each joint, each (nq, 1, 1) [deg]."""
        return self.low, self.high

    def smooth(self, strings: FloatArray, count: int) -> None:
        """Redistribute and relax the first `count` strings; what leaves the limits is put there."""
        super().smooth(strings, count)
        own = strings[:, :, :count]
        np.minimum(np.maximum(own, self.low, out=own), self.high, out=own)

    def judge(self, strings: FloatArray, count: int) -> Judgement:
        """Judge the first `count` strings; the arrays of terms keep the padding."""
        judged = self.unjudged(strings, count)
        self._judge(strings, judged)
        return judged

    def generations(
        self, rng: np.random.Generator, population: FloatArray, costs: FloatArray, hits: FloatArray
    ) -> Iterator[JudgedGeneration]:
        """Replace a population by the next one at every step, without end; see `Strings`."""
        ga, counts, slices = self.planner.ga, self.counts, self.problem.arm_slices
        count, offspring = ga.num_offspring, self.empty(ga.num_offspring)
        judged, elites = self.unjudged(offspring, count), np.empty(ga.num_elites, int)
        terms, num_drawn = judged.terms, sum(counts) + counts.new * (1 + self.num_uniforms)
        while True:
            choose_elites(costs, elites)
            kernels.breed(
                rng.random(num_drawn), counts, slices, self.breeding, population, costs, offspring
            )
            self.smooth(offspring, count)
            self._judge(offspring, judged)
            succeed(population, offspring, count, elites)
            succeed(costs[None], terms.cost[None], count, elites)
            succeed(hits[None], terms.collisions[None], count, elites)
            num_feasible = int(np.count_nonzero(hits == 0.0))
            yield JudgedGeneration(judged, cost_statistics(costs), num_feasible)

    def _judge(self, strings: FloatArray, judged: Judgement) -> None:
        """Write the terms of strings (Eqs. 2–7)."""
        terms, count, substeps = judged.terms, len(judged.cost), self.judging.substeps
        measure_paths(strings, self.problem.arm_slices, terms.lengths, terms.unevenness)
        between = interpolate_linear(np.ascontiguousarray(strings[:, :, :count]), substeps)
        collides = self.collision.collides(between.reshape(len(between), -1))
        hits = np.where(collides, -1.0, 1.0).reshape(1, -1, substeps, count)
        count_collisions(hits, terms.collisions[:count])
        weigh(self.judging.weights, terms.lengths, terms.unevenness, terms.collisions, terms.cost)
