"""Tasks of a platform on a floor, in the words of planners of arms: joints that slide."""

import numpy as np

from evoexp.errors import SettingError
from evoexp.planners.moveit_tasks import moving_joints
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.arm_motion import ArmMotion
from evoexp.scenarios.grid_motion import GridMotion


def within_floor(assembly: Assembly, task: GridMotion) -> Assembly:
    """Return a platform whose joints slide from the first node of the grid to the last one.

    Raises:
        SettingError: If the robot does not slide along each direction of the grid.
    """
    slides = moving_joints(assembly).slides
    if len(slides) != len(task.size) or not slides.all():
        must = f"one that slides along the {len(task.size)} directions of the grid"
        named = [str(name) for name in list(assembly.model.names)[1:]]
        raise SettingError("robot", must, f"one of joints {', '.join(named)}")
    model = assembly.model.copy()
    model.lowerPositionLimit = np.zeros(len(slides))
    model.upperPositionLimit = np.array(task.size, dtype=np.float64) - 1.0
    return assembly._replace(model=model)


def floor_motion(task: GridMotion) -> ArmMotion:
    """Return the way over a grid as a motion from one place to another [length unit].

    Raises:
        SettingError: If an obstacle stands on the start or the goal.
    """
    task.blocked()  # refuses ends that are blocked
    return ArmMotion(
        q_start=(tuple(map(float, task.start)),),
        q_goal=(tuple(map(float, task.goal)),),
        security_margin=task.security_margin,
        length_unit=task.length_unit,
        obstacles=task.bodies(),
    )
