"""The loop of Lavoie & Boudreau 2001 with uniform draws or descents in place of evolution."""

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from pydantic import field_validator

from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.generator_state import state_bytes
from evoexp.planners.planner import WrappedPlanner
from evoexp.planners.reaching_tasks import Problem
from evoexp.planners.redundant_ga import kernels
from evoexp.planners.redundant_ga.planner import RedundantGa
from evoexp.planners.redundant_ga.sub_path import DrawnSearch, RealGenetic
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.robots.planar_ends import PlanarArm, bring_tip_to
from evoexp.scenarios.pick_and_place import PickAndPlace
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


@kernel
def bring_tips_to(ends: FloatArray, target: FloatArray, limits: FloatArray, arm: PlanarArm) -> None:
    """Bring the tips of postures (joints, individuals) [rad] to a place; see `bring_tip_to`."""
    q = np.empty(len(ends))
    for k in range(ends.shape[1]):
        q[:] = ends[:, k]
        bring_tip_to(q, target, limits, arm)
        ends[:, k] = q


class DescendingSearch(DrawnSearch):
    """Draws postures between the start p of the sub-path and uniform ones, and moves their tips."""

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population; see `Search`."""
        self._descend(rng.random(self._num_genes * self._ga.population_size), 0)
        self.states = [state_bytes(rng.bit_generator)]
        self.end = super(DrawnSearch, self)._best_end(0)

    def advance(self, uniforms: FloatArray, normals: FloatArray, first: int) -> int:
        """Compute one generation; see `Search`."""
        self.costs = self.costs[:, :, : self._ga.num_offspring]
        self._descend(uniforms[0], (first + 1) % self.num_places)
        return first + 1

    def _descend(self, uniforms: FloatArray, place: int) -> None:
        """Write and judge p + s (r − p) after the descent, s = 0 … 1, r by (joints · count,)."""
        begin, judging, count = self._postures[-1], self._sub_path.judging, self.costs.shape[2]
        limits, shares = self._problem.joint_limits, np.linspace(0.0, 1.0, count)
        low, high = limits.T[:, :, None]
        drawn = low + (high - low) * uniforms.reshape(len(low), count)
        ends = (1.0 - shares) * begin[:, None] + shares * drawn
        bring_tips_to(ends, judging.target, limits, judging.arm)
        costs = kernels.judge_paths(self._sub_path.starts[:, :count].copy(), ends, judging)
        self._tables[place, :, :count] = np.concatenate([ends, costs])
        self._summarise(place)


class InverseKinematics(SequentialSearch):
    """Searches SP1, then SP2, by damped least squares from many postures; one may be enough.

    An evaluation is a posture that is judged, wherever its descent ended. The steps of the descent
    count as none: compare CPU time, too. The paper compares its algorithm by way of others with the
    pseudoinverse method (section 6); damped least squares of Nakamura & Hanafusa 1986 stand for it.
    """

    component: ClassVar[str] = "inverse_kinematics"
    search: ClassVar[type[DrawnSearch]] = DescendingSearch

    def prepare(self, robot: Robot, scenario: PickAndPlace) -> Any:
        """Prepare the planner's problem; a SettingError refuses genes that are no joint angles."""
        if not isinstance(self.planner.ga, RealGenetic):
            must = "a real_genetic, whose genes are joint angles"
            raise SettingError("ga", must, self.planner.ga.component)
        return super().prepare(robot, scenario)
