"""Tasks of arms among obstacles: from configuration to configuration, or with places to reach.

Planar robots of two links have absolute link angles, from +x. Their postures are given by these
angles or, as in Curkovic et al. 2013, by the place of the end-effector; the setting `elbow` chooses
between the two elbows that reach it.

A posture task of one phase is a reaching task; manoeuvres such as pick-and-place are a list of them
(Corsépius 2001, section 4.3: fitness functions and termination criteria together make a manoeuvre).
"""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError, demand, demand_known
from evoexp.numeric.elementary import DEGREE, acos, atan2
from evoexp.records import FloatArray
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.scenarios.obstacles import Obstacle, ObstacleTable, SceneTask, obstacle_table
from evoexp.validation import Component, Limits, NonNegative, Positive, Settings, Vector

HALF_TURN = 180.0  # [deg] genes live in [0, π)
ROUNDING = 2.0**-48  # [-] more than the relative errors of what `_reach` computes
Point2 = tuple[float, float]


class ArmMotion(SceneTask):
    """Start and goal of every arm, and the obstacles around them."""

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

    def _check(self) -> None:
        is_one, was = (self.angles is None) != (self.tip is None), self.angles and "both"
        demand(is_one, "angles", "given, or else tip with elbow", was)
        is_pair = (self.tip is None) == (self.elbow is None)
        demand(is_pair, "elbow", "given with tip, and only then (left or right)", self.elbow)

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
            must = f"robots 0 … {len(bases) - 1}"
            demand(0 <= robot < len(bases), "scenario.stationary", must, robot)
            is_same = np.array_equal(start[robot], goal[robot])
            must = "the same as its start, since the robot is stationary"
            demand(is_same, f"scenario.q_goal[{robot}]", must, list(goal[robot]))
        return start, goal


class Docking(SceneTask):
    """A place and a load for the tip of a mobile arm (Chen & Zalzala 1995, section 4.2)."""

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


Point3 = tuple[float, float, float]


class PointGoal(Settings):
    """A point that the controlled frame shall reach, or the surface of a ball around it."""

    kind: Literal["point"]
    point: Point3  # the point
    # of the ball, whose surface is the goal; it is no obstacle. 0: the point itself is the
    # goal [length unit]
    radius: NonNegative = 0.0


class PoseGoal(Settings):
    """A point and an orientation: roll, pitch, yaw [deg] of the controlled frame."""

    kind: Literal["pose"]
    point: Point3
    rotation: Point3


class SurfaceGoal(Settings):
    """The surface of an obstacle."""

    kind: Literal["surface"]
    object: str  # its name


class PlaceGoal(Settings):
    """A disc across the direction up, on which the controlled frame's origin shall come to lie."""

    kind: Literal["place"]
    point: Point3  # its middle
    radius: Positive  # its radius [length unit]


class ShiftGoal(Settings):
    """Where the controlled frame is when the phase begins, moved."""

    kind: Literal["shift"]
    offset: Point3  # by how much [length unit]
    frame: Literal["world", "tool"]  # whether along the world's axes or the tool's


AnyGoal = Annotated[
    PointGoal | PoseGoal | SurfaceGoal | PlaceGoal | ShiftGoal, Field(discriminator="kind")
]


class Phase(Settings):
    """One manoeuvre.

    The controlled frame is the tool's or, while an object is held, the object's: its centre, its
    own axes.
    """

    name: str  # for reports
    goal: AnyGoal  # where it ends
    terms: tuple[str, ...] = ()  # cost terms that count in it; empty: all of the objective
    # pairs of names (bodies, obstacles) that may touch in it, as deep as the task's
    # `allowed_penetration`
    contacts: tuple[tuple[str, str], ...] = ()
    # whether the robot takes hold of an object when the goal is met, or lets go of what it
    # holds
    then: Literal["go_on", "attach", "detach"] = "go_on"
    object: str = ""  # what it takes hold of
    position_tolerance: Positive | None = None  # in place of the task's
    # the goal is met only with so small a tilt [deg]; None: within the hard limit of
    # `upright`, if that counts
    upright_tolerance: Positive | None = None
    # part of the planner's scope that joints may step in it [-]
    scope_share: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0


class PostureTask(SceneTask):
    """Start posture, phases and surroundings of one arm; obstacles may be grasped."""

    # posture at the start [deg], lengths for sliding joints
    q_start: Annotated[Vector, Field(min_length=1)]
    # what is to be done, one after the other
    phases: Annotated[tuple[Phase, ...], Field(min_length=1)]
    subgoals: tuple[Point3, ...] = ()  # points that the tool passes before the first phase
    position_tolerance: Positive  # A goal is met this close [length unit]
    angle_tolerance: Positive  # and with orientations this close [deg]
    up: Point3 = (0.0, 0.0, 1.0)  # the direction that counts as up
    # whether a goal that no posture can reach is refused; false: it is searched all the same
    check_reach: bool = True
    # how deep pairs that may touch may overlap; None where no phase has such pairs [length
    # unit]
    allowed_penetration: Positive | None = None
    # whether all obstacles are taken away, except the ones that a goal or a grasp names: the
    # control by which obstacles are judged
    empty_scene: bool = False

    def _check(self) -> None:
        for k, name in enumerate(self.all_names):
            must = "a name that no other obstacle has"
            demand(name not in self.all_names[:k], f"obstacles[{k}].name", must, name)
        held = ""
        for k, phase in enumerate(self.phases):
            field, is_grasp = f"phases[{k}]", phase.then == "attach"
            must = "given with then: attach, and only then"
            demand(is_grasp == bool(phase.object), f"{field}.object", must, phase.object or None)
            must = f"detach before anything else is taken ({held} is held)"
            demand(not (is_grasp and held), f"{field}.then", must, "attach")
            is_held = held or phase.then != "detach"
            demand(is_held, f"{field}.then", "attach in a phase before", "detach")
            if isinstance(phase.goal, SurfaceGoal):
                must = "another object than the one held"
                demand(phase.goal.object != held, f"{field}.goal.object", must, held)
                self.index_of(phase.goal.object, f"{field}.goal.object")
            if is_grasp:
                shape = self.objects[self.index_of(phase.object, f"{field}.object")].shape
                is_solid = shape in ("sphere", "box", "capsule", "cylinder")
                must = "a sphere, box, capsule or cylinder"
                demand(is_solid, f"{field}.object", must, f"a {shape}")
            held = {"attach": phase.object, "detach": ""}.get(phase.then, held)
            is_given = self.allowed_penetration is not None or not phase.contacts
            demand(
                is_given, "allowed_penetration", f"given: {field}.contacts allows contacts", None
            )
        demand(any(self.up), "up", "a direction, not (0, 0, 0)", list(self.up))

    @property
    def objects(self) -> tuple[Obstacle, ...]:
        """The obstacles that stand around: all, or those of an empty scene."""
        return tuple(self._named_objects.values())

    @property
    def all_names(self) -> tuple[str, ...]:
        """Names of all obstacles, even if an empty scene takes them away."""
        return tuple(one.name or f"obstacle_{k + 1}" for k, one in enumerate(self.obstacles))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of `objects`."""
        return tuple(self._named_objects)

    @property
    def _named_objects(self) -> dict[str, Obstacle]:
        goals = (phase.goal for phase in self.phases)
        needed = {goal.object for goal in goals if isinstance(goal, SurfaceGoal)}
        needed |= {phase.object for phase in self.phases}
        named = zip(self.all_names, self.obstacles, strict=True)
        return {name: one for name, one in named if name in needed or not self.empty_scene}

    def index_of(self, name: str, field: str) -> int:
        """Return the index of one of `objects`."""
        must = f"the name of an obstacle ({', '.join(self.names) or 'there is none'})"
        demand_known(name, self.names, field, must)
        return self.names.index(name)

    @property
    def all_phases(self) -> tuple[Phase, ...]:
        """Subgoals, as phases that rate distance and collisions, then the phases themselves."""
        points = (PointGoal(kind="point", point=point) for point in self.subgoals)
        ways = [Phase(name=f"subgoal_{k + 1}", goal=goal) for k, goal in enumerate(points)]
        return (*ways, *self.phases)

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        goals = ((phase.name, phase.goal) for phase in self.all_phases)
        return [
            (name, goal.point) for name, goal in goals if isinstance(goal, PointGoal | PoseGoal)
        ]
