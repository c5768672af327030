"""Sequential search: the loop of Lavoie & Boudreau 2001 with drawing in place of evolution."""

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from pydantic import field_validator

from evoexp.errors import SettingError
from evoexp.planners.planner import WrappedPlanner
from evoexp.planners.reaching_tasks import Problem
from evoexp.planners.redundant_ga.planner import RedundantGa
from evoexp.planners.redundant_ga.sub_path import DrawnSearch
from evoexp.records import Block
from evoexp.validation import Component


class SequentialSearch(WrappedPlanner):
    """Searches SP1, then SP2, by uniform draws; everything but the operators is as in the planner.

    Every generation is drawn anew, and the best individual drawn so far ends the sub-path. (Random
    search draws both sub-paths at once and must succeed in both with one draw.)
    """

    component: ClassVar[str] = "sequential_search"

    search: ClassVar[type[DrawnSearch]] = DrawnSearch

    planner: RedundantGa  # the planner whose loop, sampling and budget are used

    @field_validator("planner", mode="before")
    @classmethod
    def _planner_fits(cls, planner: Any) -> Any:
        if isinstance(planner, Component) and not isinstance(planner, RedundantGa):
            must = f"redundant_ga, whose sub-paths {cls.component} draws"
            raise SettingError("planner", must, planner.component)
        return planner

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the generations of all draws; their indices go on counting."""
        return self.planner.search_in_turn(problem, rng, self.search)
