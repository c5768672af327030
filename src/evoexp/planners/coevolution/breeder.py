"""The way from one generation of co-evolving populations to the next, and the hall of fame."""

import numpy as np

from evoexp.evolution.best_team import BestTeam
from evoexp.evolution.crossover import num_single_point_uniforms
from evoexp.evolution.hall_of_fame import Hall, HallRules
from evoexp.evolution.mutation import num_allele_uniforms
from evoexp.numeric.elementary import DEGREE
from evoexp.planners.coevolution.kernels import Breeding, breed, renew
from evoexp.planners.coevolution.settings import CoevolutionSettings
from evoexp.planners.coevolution.teams import Evaluated
from evoexp.records import BoolArray, FloatArray

HALF_TURN = DEGREE * 180.0  # [rad] genes live in [0, π)


def num_uniforms(count: int) -> int:
    """Return how many uniform numbers `breed` takes for so many offspring of a robot."""
    return count + num_single_point_uniforms(count // 2) + num_allele_uniforms(count)


class Breeder:
    """Breeds the populations of one run, whose hall of fame it holds.

    Attributes:
        num_teams: Teams that the hall holds.
    """

    def __init__(self, ga: CoevolutionSettings, moving: BoolArray) -> None:
        """Begin with an empty hall.

        Args:
            ga: Settings.
            moving: (robots,) false for robots that stand still.
        """
        self._ga, self._moving, self.num_teams = ga, moving, 0
        self.num_moving = int(np.count_nonzero(moving))
        self.by_genome = ga.hall_distinct == "genome"
        self.hall = Hall.room(ga.num_hall_teams, len(moving))
        self.rules = HallRules(
            memory=ga.hall_memory or 0,
            frozen=ga.hall_frozen,
            exclusive=moving if self.by_genome else np.ones_like(moving),
        )
        self._nobody = np.full(len(moving), -1)

    def renew_hall(self, populations: FloatArray, found: Evaluated, best: BestTeam) -> None:
        """Renew the hall of fame: members of the Pareto fronts with their best collaborators.

        With distinct genomes the best team of the generation is offered as it is, so that it is
        never lost; and a robot that stands still, which has one genome, may be in all teams.
        """
        if self._ga.num_hall_teams:
            self.num_teams = renew(
                populations,
                found.criteria,
                found.collisions,
                found.teamable,
                best.individuals if self.by_genome else self._nobody,
                self.hall,
                self.num_teams,
                self.rules,
                self.by_genome,
            )

    def bred(
        self, rng: np.random.Generator, populations: FloatArray, costs: FloatArray, index: int
    ) -> FloatArray:
        """Return the populations of a generation: offspring, elites, then the hall's members."""
        ga, bred = self._ga, np.empty_like(populations)
        count = ga.population_size - ga.num_elites - self.num_teams
        teams = self.hall.teams[: self.num_teams]
        uniforms = rng.random((self.num_moving, num_uniforms(count)))
        breed(uniforms, populations, costs, self._moving, teams, self.breeding(index), bred)
        return bred

    def breeding(self, index: int) -> Breeding:
        """Return the settings on the way to a generation."""
        ga = self._ga
        return Breeding(
            ga.num_elites,
            ga.selection == "inverse",
            ga.crossover_rate,
            ga.mutation_rate_at(index),
            DEGREE * ga.mutation_step,
            HALF_TURN,
            ga.mutation_direction == "symmetric",
        )
