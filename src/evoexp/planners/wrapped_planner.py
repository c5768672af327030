"""A planner that stands beside another one and shares its problem: a control, or a reference."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from evoexp.planners.planner import MEMBERS, Keeper, PlannerDefaults, Populations
from evoexp.records import Block
from evoexp.validation import Component


class WrappedPlanner(PlannerDefaults, Component):
    """Answers as the wrapped planner does; controls write `populations`, references `evolve`."""

    planner: Any  # the planner that it stands beside; `Condition` checks that it is one

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


def _as_wrapped(name: str) -> Any:
    """Return a member that is the wrapped planner's."""
    if callable(MEMBERS[name]):
        return lambda self, *arguments: getattr(self.planner, name)(*arguments)
    return property(lambda self: getattr(self.planner, name))


_OWN = {"component", "revision", "reproducibility", "is_reference", "is_real_coded", "improve"}
for _name in MEMBERS.keys() - vars(WrappedPlanner).keys() - _OWN:
    setattr(WrappedPlanner, _name, _as_wrapped(_name))
