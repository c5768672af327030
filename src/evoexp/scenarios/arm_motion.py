"""Arms that shall move from one configuration to another among obstacles."""

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import SceneTask
from evoexp.validation import NonNegative, Vector


class ArmMotion(SceneTask):
    """Start and goal of every arm, and the obstacles around them."""

    component: ClassVar[str] = "arm_motion"

    # configuration of every arm at the start, arm by arm [deg]
    q_start: Annotated[tuple[Vector, ...], Field(min_length=1)]
    q_goal: Annotated[tuple[Vector, ...], Field(min_length=1)]  # at the goal [deg]
    # clearance that the task requires between a link and an obstacle; None: the security
    # margin, as between two arms
    obstacle_margin: NonNegative | None = None

    def ends(self, arm_slices: np.ndarray) -> tuple[FloatArray, FloatArray]:
        """Return start and goal of all arms together, each (nq,) [deg]."""
        sizes = [int(stop - first) for first, stop in arm_slices]
        for name, given in (("q_start", self.q_start), ("q_goal", self.q_goal)):
            if [len(arm) for arm in given] != sizes:
                counts = ", ".join(map(str, sizes))
                must = f"one list per arm of the robot, with {counts} joint angles"
                raise SettingError(f"scenario.{name}", must, [list(arm) for arm in given])
        return np.concatenate(self.q_start), np.concatenate(self.q_goal)
