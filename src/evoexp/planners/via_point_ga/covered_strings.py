"""Strings of via-points of robots whose bodies are covered: they keep within the joints' limits.

A generation goes through the same steps as one of `strings`, between kernels of their own: what
covered bodies are tested for takes far longer than what Python does between the steps.
"""

from collections.abc import Callable

import numpy as np

from evoexp.collision.bodies.covered_bodies import CoveredCollision
from evoexp.evolution.selection import choose_elites
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.string_fitness import count_collisions, weigh
from evoexp.paths.interpolation import interpolate_linear
from evoexp.paths.lengths import measure_paths
from evoexp.planners.arm_tasks import UNLIMITED
from evoexp.planners.via_point_ga import kernels
from evoexp.planners.via_point_ga.settings import ViaPointSettings
from evoexp.planners.via_point_ga.strings import Judgement, Problem, Strings
from evoexp.records import FloatArray


class CoveredStrings(Strings):
    """The population-wide steps of one planner on one problem with covered bodies."""

    generations_per_call = 1

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

    def evolver(
        self, table: kernels.Population, summaries: FloatArray
    ) -> Callable[[FloatArray, int], None]:
        """Return a function that goes on from a generation to those behind it; see `Strings`."""
        scratch, counts, places = self.scratch(), self.counts, len(summaries)
        judged = Judgement(scratch.terms.cost, scratch.terms, 0)

        def go_on(uniforms: FloatArray, first: int) -> None:
            for step, drawn in enumerate(uniforms, start=first):
                population, following = (
                    kernels.Population(*(array[g % places] for array in table))
                    for g in (step, step + 1)
                )
                strings, costs, _ = population
                choose_elites(costs, scratch.elites)
                slices, offspring = self.problem.arm_slices, scratch.offspring
                kernels.breed(drawn, counts, slices, self.breeding, strings, costs, offspring)
                self.smooth(offspring, counts.offspring)
                self._judge(offspring, judged)
                kernels.follow(population, scratch, counts.offspring, following)
                kernels.summarise_strings(*following[1:], summaries[(step + 1) % places])

        return go_on

    def _judge(self, strings: FloatArray, judged: Judgement) -> None:
        """Write the terms of strings (Eqs. 2–7)."""
        terms, count, substeps = judged.terms, len(judged.cost), self.judging.substeps
        measure_paths(strings, self.problem.arm_slices, terms.lengths, terms.unevenness)
        between = interpolate_linear(np.ascontiguousarray(strings[:, :, :count]), substeps)
        collides = self.collision.collides(between.reshape(len(between), -1))
        hits = np.where(collides, -1.0, 1.0).reshape(1, -1, substeps, count)
        count_collisions(hits, terms.collisions[:count])
        weigh(self.judging.weights, terms.lengths, terms.unevenness, terms.collisions, terms.cost)
