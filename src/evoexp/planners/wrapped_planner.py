"""A planner that stands beside another one and shares its problem: a control, or a reference."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import GetPydanticSchema

from evoexp.collision.scene import Part
from evoexp.paths.motion import Motion
from evoexp.planners.answers import CoverShape, Listing
from evoexp.planners.planner import Judgement, Planner, PlannerDefaults, Shape
from evoexp.records import Block, FloatArray
from evoexp.validation import Component

# `Condition` checks that it is one, and names it as the user typed it
AnyPlanner = Annotated[Planner, GetPydanticSchema(lambda _, handler: handler(Any))]


class WrappedPlanner(PlannerDefaults, Component):
    """Answers as the wrapped planner does, except in `evolve`, which a subclass writes."""

    planner: AnyPlanner  # the planner that it stands beside

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        return self.planner.prepare(robot, scenario)

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the generations of the control or reference."""
        raise NotImplementedError

    @property
    def answers_are_proven(self) -> bool:
        """Whether the wrapped planner's answers are proven."""
        return getattr(self.planner, "answers_are_proven", False)

    @property
    def goal_is_region(self) -> bool:  # type: ignore[override]  # not of the class: of the planner
        """Whether the wrapped planner's goal is a region."""
        return getattr(self.planner, "goal_is_region", False)

    @property
    def num_generations(self) -> int:
        """Generations of the wrapped planner."""
        return self.planner.num_generations

    def num_evaluations(self, index: int) -> int:
        """Return the wrapped planner's evaluations of a generation."""
        return self.planner.num_evaluations(index)

    def sample(self, problem: Any, rng: np.random.Generator, count: int) -> FloatArray:
        """Sample as the wrapped planner does."""
        return self.planner.sample(problem, rng, count)

    def cost(self, problem: Any, population: FloatArray) -> Judgement:
        """Judge as the wrapped planner does."""
        return self.planner.cost(problem, population)

    def bounds(self, problem: Any) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of the wrapped planner, a real-coded one."""
        real_coded: Any = self.planner
        low, high = real_coded.bounds(problem)
        return low, high

    def solution(self, problem: Any, population: FloatArray, individual: int) -> FloatArray:
        """Return an individual as the wrapped planner does."""
        return self.planner.solution(problem, population, individual)

    def departures(self, problem: Any, solution: FloatArray) -> Sequence[str]:
        """Compare with the task as the wrapped planner does."""
        return self.planner.departures(problem, solution)

    def motion(self, problem: Any, solution: FloatArray) -> Motion | None:
        """Return the wrapped planner's motion of a solution."""
        return self.planner.motion(problem, solution)

    def parts(self, problem: Any, motion: Motion) -> Sequence[Part]:
        """Return the wrapped planner's pieces of a motion."""
        return self.planner.parts(problem, motion)

    def security_margin(self, problem: Any) -> float:
        """Return the wrapped planner's margin."""
        return self.planner.security_margin(problem)

    def evaluate(self, problem: Any, solution: FloatArray) -> dict[str, float]:
        """Return the wrapped planner's terms of a solution."""
        return self.planner.evaluate(problem, solution)

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the wrapped planner's cost."""
        return float(getattr(self.planner, "cost_of_terms", super().cost_of_terms)(terms))

    def shape(self, problem: Any) -> Shape:
        """Return the wrapped planner's shape of a solution."""
        return self.planner.shape(problem)

    def memory(self, problem: Any) -> int:
        """Return the wrapped planner's estimate; a subclass that takes more adds to it."""
        return self.planner.memory(problem)

    def prior_queries(self, problem: Any) -> int:
        """Return how many configurations the wrapped planner's task answers by itself."""
        return self.planner.prior_queries(problem)

    def listing(self, problem: Any, solution: FloatArray) -> Listing | None:
        """Return the wrapped planner's table of a solution."""
        return self.planner.listing(problem, solution)

    def notes(self, problem: Any) -> Sequence[str]:
        """Return the wrapped planner's remarks."""
        return self.planner.notes(problem)

    def covers(self, problem: Any) -> Sequence[CoverShape]:
        """Return the wrapped planner's covers."""
        return self.planner.covers(problem)
