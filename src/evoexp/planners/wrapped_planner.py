"""A planner that stands beside another one and shares its problem: a control, or a reference."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import GetPydanticSchema

from evoexp.planners.planner import Keeper, Planner, PlannerDefaults, Populations
from evoexp.records import Block
from evoexp.validation import Component

# `Condition` checks that it is one, and names it as the user typed it
AnyPlanner = Annotated[Planner[Any], GetPydanticSchema(lambda _, handler: handler(Any))]


def _as_wrapped(name: str) -> Any:
    """Return a method that hands its arguments on to the wrapped planner."""

    def answer(self: "WrappedPlanner", *arguments: Any) -> Any:
        return getattr(self.planner, name)(*arguments)

    answer.__doc__ = f"Answer as `{name}` of the wrapped planner does."
    return answer


class WrappedPlanner(PlannerDefaults, Component):
    """Answers as the wrapped planner does; controls write `populations`, references `evolve`."""

    planner: AnyPlanner  # the planner that it stands beside

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        return self.planner.prepare(robot, scenario)

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield a control's populations, judged as the wrapped planner judges its own."""
        keeper, judged, populations = Keeper(), None, self.populations(problem, rng)
        for _ in range(self.planner.num_generations + 1):
            population = next(populations) if judged is None else populations.send(judged)
            judged = self.planner.cost(problem, population)
            yield keeper.record_judged(self.planner, problem, population, judged)

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield the populations of a control; each is sent back judged."""
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

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the wrapped planner's cost."""
        return float(getattr(self.planner, "cost_of_terms", super().cost_of_terms)(terms))

    num_evaluations: ClassVar[Any] = _as_wrapped("num_evaluations")
    sample: ClassVar[Any] = _as_wrapped("sample")
    cost: ClassVar[Any] = _as_wrapped("cost")
    bounds: ClassVar[Any] = _as_wrapped("bounds")  # of real-coded planners
    solution: ClassVar[Any] = _as_wrapped("solution")
    departures: ClassVar[Any] = _as_wrapped("departures")
    motion: ClassVar[Any] = _as_wrapped("motion")
    parts: ClassVar[Any] = _as_wrapped("parts")
    security_margin: ClassVar[Any] = _as_wrapped("security_margin")
    evaluate: ClassVar[Any] = _as_wrapped("evaluate")
    shape: ClassVar[Any] = _as_wrapped("shape")
    memory: ClassVar[Any] = _as_wrapped("memory")
    prior_queries: ClassVar[Any] = _as_wrapped("prior_queries")
    listing: ClassVar[Any] = _as_wrapped("listing")
    notes: ClassVar[Any] = _as_wrapped("notes")
    covers: ClassVar[Any] = _as_wrapped("covers")
