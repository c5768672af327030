"""Tasks of arms among obstacles: from configuration to configuration, or with places to reach.

Planar robots of two links have absolute link angles, from +x. Their postures are given by these
angles or, as in Curkovic et al. 2013, by the place of the end-effector; the setting `elbow` chooses
between the two elbows that reach it.
"""

from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from evoexp.errors import SettingError, demand
from evoexp.numeric.elementary import DEGREE, acos, atan2
from evoexp.records import FloatArray
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.scenarios.obstacles import ObstacleTable, SceneTask, obstacle_table
from evoexp.validation import Component, Limits, NonNegative, Settings, Vector

HALF_TURN = 180.0  # [deg] genes live in [0, π)
ROUNDING = 2.0**-48  # [-] more than the relative errors of what `_reach` computes
Point2 = tuple[float, float]


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


class Posture(Settings):
    """A posture of one robot: link angles, or the end-effector's place with an elbow."""

    # of the links, absolute, from +x [deg]
    angles: Annotated[Vector, Field(min_length=2, max_length=2)] | None = None
    tip: tuple[float, float] | None = None  # of the end-effector (x, y) [length unit of the scene]
    # which of the two elbows that reach `tip`: the one to its left or to its right, seen from
    # the base
    elbow: Literal["left", "right"] | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.angles is None) == (self.tip is None):
            was = None if self.angles is None else "both"
            raise SettingError("angles", "given, or else tip with elbow", was)
        if (self.tip is None) != (self.elbow is None):
            raise SettingError("elbow", "given with tip, and only then (left or right)", self.elbow)
        return self

    def link_angles(self, field: str, base: FloatArray, lengths: FloatArray) -> FloatArray:
        """Return the link angles (2,) [deg] of a robot at a base (2,), with link lengths (2,)."""
        if self.angles is not None:
            angles = np.array(self.angles)
        else:
            side = 1.0 if self.elbow == "left" else -1.0
            angles = _reach(f"{field}.tip", np.array(self.tip) - base, lengths, side)
        for k, angle in enumerate(angles):
            must = "within [0, 180] deg, where the genes live"
            demand(0.0 <= angle <= HALF_TURN, f"{field}.angles[{k}]", must, float(angle))
        return angles


class LinkMotion(SceneTask):
    """Start and goal of every planar robot of two links, and the obstacles around them."""

    component: ClassVar[str] = "link_motion"

    # posture of every robot at the start
    q_start: Annotated[tuple[Posture, ...], Field(min_length=2)]
    q_goal: Annotated[tuple[Posture, ...], Field(min_length=2)]  # at the goal
    # robots (counted from 0) that keep their start posture; their goal must be the same
    stationary: tuple[int, ...] = ()

    def ends(self, bases: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return link angles of all robots at start and goal, each (robots, 2) [deg].

        The robots have bases and lengths of their links, (robots, 2) each.
        """
        ends = []
        for name, postures in (("q_start", self.q_start), ("q_goal", self.q_goal)):
            must = f"one posture per robot ({len(bases)})"
            demand(len(postures) == len(bases), f"scenario.{name}", must, len(postures))
            fields = [f"scenario.{name}[{robot}]" for robot in range(len(bases))]
            ends.append(np.array([*map(Posture.link_angles, postures, fields, bases, lengths)]))
        start, goal = ends
        for robot in self.stationary:
            if not 0 <= robot < len(bases):
                raise SettingError("scenario.stationary", f"robots 0 … {len(bases) - 1}", robot)
            if not np.array_equal(start[robot], goal[robot]):
                must = "the same as its start, since the robot is stationary"
                raise SettingError(f"scenario.q_goal[{robot}]", must, list(goal[robot]))
        return start, goal


class Docking(SceneTask):
    """A place and a load for the tip of a mobile arm (Chen & Zalzala 1995, section 4.2)."""

    component: ClassVar[str] = "docking"

    target: Point2  # X_e, Y_e of the end-effector [length unit]
    force: Point2  # F that acts on it (x, y)

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        return [("target", self.target)]

    def obstacle_points(self) -> FloatArray:
        """Return the middles of the obstacles, from which criteria measure: X_o, (obstacles, 2)."""
        return np.array(obstacle_table(self.obstacles).center[:, :2])


class Mission(Component):
    """Both examples of Chen & Zalzala 1995: a platform drives over a grid, then its arm docks."""

    component: ClassVar[str] = "mission"

    grid: GridMotion  # the floor; its goal is where the platform is expected to dock
    docking: Docking  # the task of the arm, in a plane whose origin is at `task_origin`
    # where on the floor the task's X = 0 is (x, y); X points along x, the task's Y = 0 is the
    # height of the arm's first joint [length unit]
    task_origin: Point2
    travel_posture: tuple[float, float, float]  # θ1, θ2, θ3 while the platform drives [deg]

    @property
    def length_unit(self) -> str:
        """Of the grid."""
        return self.grid.length_unit

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        (x, y), (along, up) = self.task_origin, self.docking.target
        return [("target", (x + along, y, robot.body_height + up))]


class PickAndPlace(SceneTask):
    """Start posture, via point and goal point of a planar arm's tip (Lavoie & Boudreau 2001, 4)."""

    component: ClassVar[str] = "pick_and_place"

    # posture at the start, joint angles relative to the link before [rad]
    q_start: Annotated[Vector, Field(min_length=1)]
    # where the tip shall be at the end of the first sub-path (x, y) [length unit]
    via_point: Point2
    goal_point: Point2  # where it shall be at the end of the second one
    # of the box in which the tip must be at the end of the second sub-path
    box_x: Limits
    box_y: Limits
    obstacle_shift: Point2  # by how much obstacles and box are moved together (dx, dy)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least x, greatest x, least y, greatest y of the box where it stands."""
        (dx, dy), (left, right), (bottom, top) = self.obstacle_shift, self.box_x, self.box_y
        return left + dx, right + dx, bottom + dy, top + dy

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        return [("via point", self.via_point), ("goal point", self.goal_point)]

    def obstacle_table(self) -> ObstacleTable:
        """Return the obstacles where they stand."""
        table = obstacle_table(self.obstacles)
        table.center[:, :2] += self.obstacle_shift
        return table


def _reach(field: str, tip: FloatArray, lengths: FloatArray, side: float) -> FloatArray:
    """Return the link angles (2,) [deg] in [−180, 360) that bring the end-effector to a place.

    The place (2,) is from the base; so seen, the elbow is on the left (side 1) or right (−1).
    """
    x, y = tip
    squared = float(x * x + y * y)
    first, second = (float(length) for length in lengths)
    cosine = (squared - first * first - second * second) / (2.0 * first * second)
    # a stretched or folded arm is one up to rounding, which an arccosine would blow up to 1e-8
    rounding = ROUNDING * (squared + first * first + second * second) / (first * second)
    if abs(abs(cosine) - 1.0) <= rounding:
        cosine = 1.0 if cosine > 0.0 else -1.0
    must = f"{abs(first - second):g} to {first + second:g} away from the robot's base"
    demand(-1.0 <= cosine <= 1.0, field, must, f"{float(np.sqrt(squared)):g} away")
    # of the second link against the first: an elbow on the left bends to the right
    bend = -side * acos(cosine)
    sine_bend = -side * np.sqrt(max(0.0, 1.0 - cosine * cosine))
    one = atan2(float(y), float(x)) - atan2(second * sine_bend, first + second * cosine)
    angles = np.array([one, one + bend]) / DEGREE
    # 0 and 180 deg bound the genes: rounding must not put an arm outside
    for bound in (0.0, HALF_TURN):
        angles[np.abs(angles - bound) <= ROUNDING * HALF_TURN] = bound
    return angles
