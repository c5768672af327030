"""The places that a task names, to be marked in pictures."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray


class Target(NamedTuple):
    """A place that a tool or a robot is to reach."""

    name: str  # name beside the mark
    point: FloatArray  # (3,) in the world [length unit]


def targets(scenario: Any, robot: Any) -> tuple[Target, ...]:
    """Return the places that a scenario names for a robot; none if it names configurations.

    Args:
        scenario: One that names places has a method `named_places(robot)`, which returns names and
            points, in the plane or in space.
    """
    if not hasattr(scenario, "named_places"):
        return ()
    return tuple(
        Target(name.replace("_", " "), np.array([*point, 0.0][:3]))
        for name, point in scenario.named_places(robot)
    )
