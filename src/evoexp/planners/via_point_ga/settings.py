"""Settings of the planner of strings of via-points."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from evoexp.collision.bodies.covered_bodies import CoveredBodies
from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.evolution.operators.breeding import Operators
from evoexp.evolution.operators.selection import FitnessRoulette
from evoexp.objectives.string_fitness import StringFitness
from evoexp.planners.proofs import Acceptance
from evoexp.planners.via_point_ga.string_operators import NewTrajectories, StringCrossover
from evoexp.validation import Count, LayoutCount, NonNegativeCount, Positive, Rate, Settings

SAMPLES = tuple(2**k for k in range(3, 11))  # per segment, that the redistribution can take


class ViaPointSettings(Settings):
    """Hyperparameters of Rana & Zalzala, Tables 1 and 3."""

    num_via_points: LayoutCount  # N; instants 1 … N are judged, 0 is the start, N the goal
    walk_step: Positive  # step length of a new trajectory, in units of its straight distance over N
    # largest random turn of a step away from the direction of the goal [deg]
    max_turn: Annotated[float, Field(ge=0.0, le=180.0)]
    num_new_trajectories: NonNegativeCount  # offspring replaced by new trajectories per generation
    crossover_distance: Positive  # strings are crossed only where they are closer than this [deg]
    relaxation_step: Rate  # delta of Eqs. 8, 9
    # whether via-points are redistributed evenly along a spline (off: an ablation)
    redistribution: bool
    spline_end: Literal["natural", "clamped"]  # end condition of that spline
    samples_per_segment: Count  # samples of its arc length between two via-points
    ga: GeneticSettings  # population, generations, elites, rates
    objective: StringFitness  # weights of Eq. 7
    # the touching circles or spheres, or covers of the bodies
    collision: TouchingSpheres | CoveredBodies
    # how the double cross-over of section 3.4b is read: `tails` exchanges what follows the
    # site in every arm's path; `segment` exchanges what lies between the two sites of the
    # whole string: the end of the first path and the beginning of the second
    crossover_reading: Literal["tails", "segment"] = "tails"
    # which motions are an answer: those that the collision model accepts at the instants it
    # tests (`model`), those of them that the exact certifier proves free of contact between
    # all instants (`certified`), or also free by the task's margins (`margin`). A string that
    # is refuted counts as colliding at one instant more
    acceptance: Acceptance = "model"

    @property
    def operators(self) -> Operators:
        """The paper's operators (section 3.4 a, b, d), where `ga` names no others."""
        ga = self.ga
        return Operators(
            ga.selection or FitnessRoulette(fitness_offset=self.objective.fitness_offset),
            ga.crossover
            or StringCrossover(
                crossover_distance=self.crossover_distance,
                exchanges_segment=self.crossover_reading == "segment",
            ),
            ga.mutation
            or NewTrajectories(
                num_new_trajectories=self.num_new_trajectories,
                walk_step=self.walk_step,
                max_turn=self.max_turn,
            ),
        )

    @model_validator(mode="after")
    def _samples_halve(self) -> Self:
        must = f"one of {', '.join(map(str, SAMPLES))}"
        self.demand("samples_per_segment", self.samples_per_segment in SAMPLES, must)
        return self
