"""Strings of via-points of robots whose bodies are covered: they keep within the joints' limits.

A generation goes through the same steps as one of `strings`, each a call of its own: testing
covered bodies takes far longer than Python takes between the steps.
"""

from typing import TYPE_CHECKING

import numpy as np

from evoexp.collision.bodies.covered_bodies import CoveredCollision
from evoexp.evolution.operators.breeding import breed
from evoexp.evolution.succession import choose_elites
from evoexp.objectives.string_fitness import StringTerms, count_collisions, weigh
from evoexp.paths.interpolation import interpolate_linear
from evoexp.paths.lengths import measure_paths
from evoexp.planners.via_point_ga import kernels
from evoexp.planners.via_point_ga.settings import ViaPointSettings
from evoexp.planners.via_point_ga.strings import Problem, Strings
from evoexp.records import FloatArray

if TYPE_CHECKING:
    from evoexp.planners.via_point_ga.search import Search


class CoveredStrings(Strings):
    """The population-wide steps of one planner on one problem with covered bodies."""

    generations_per_call = 1

    def __init__(self, planner: ViaPointSettings, problem: Problem) -> None:
        super().__init__(planner, problem)
        assert isinstance(problem.collision, CoveredCollision)
        self.collision = problem.collision
        low, high = problem.limits.T
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

    def evolve(self, run: "Search", uniforms: FloatArray, normals: FloatArray, first: int) -> None:
        """Go on from a generation to the next one; see `Strings`."""
        (offspring, terms, elites, parents), rules = run.scratch, run.breeding
        here, there = first % len(run.summaries), (first + 1) % len(run.summaries)
        before, after = (
            kernels.Population(*(array[place] for array in run.table)) for place in (here, there)
        )
        choose_elites(before.costs, elites)
        (select, cross, mutate), rate = run.operators, rules.mutation_rate
        genomes, out = kernels.by_gene(before.strings), kernels.by_gene(offspring)
        rest = first, rate, rules, before.costs, genomes, parents, out
        breed(select, cross, mutate, uniforms[0], normals, *rest)
        self.smooth(offspring, len(parents))
        self.write_terms(offspring, terms)
        kernels.follow(before, run.scratch, after)
        kernels.summarise_strings(*after[1:], run.summaries[there])

    def write_terms(self, strings: FloatArray, terms: StringTerms) -> None:
        """Write the terms of strings (Eqs. 2–7)."""
        count, substeps = len(terms.cost), self.settings.substeps
        measure_paths(strings, self.problem.arm_slices, terms.lengths, terms.unevenness)
        between = interpolate_linear(np.ascontiguousarray(strings[:, :, :count]), substeps)
        collides = self.collision.collides(between.reshape(len(between), -1))
        hits = np.where(collides, -1.0, 1.0).reshape(1, -1, substeps, count)
        count_collisions(hits, terms.collisions[:count])
        weigh(self.settings.weights, terms.lengths, terms.unevenness, terms.collisions, terms.cost)
