"""A task of an arm among obstacles: a start posture, and phases that each end at a goal.

A task of one phase is a reaching task; manoeuvres such as pick-and-place are a list of them
(Corsépius 2001, section 4.3: fitness functions and termination criteria together make a manoeuvre).
"""

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from evoexp.errors import SettingError, demand, demand_known
from evoexp.scenarios.obstacles import Obstacle, SceneTask
from evoexp.validation import NonNegative, Positive, Settings, Vector

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

    component: ClassVar[str] = "posture_task"

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
    # whether all obstacles are taken away but those that a goal or a grasp names: the control
    # by which obstacles are judged
    empty_scene: bool = False

    @model_validator(mode="after")
    def _holds_one_thing_at_a_time(self) -> Self:
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
                if shape in ("half_space", "ellipse", "hull"):
                    must = "a sphere, box, capsule or cylinder"
                    raise SettingError(f"{field}.object", must, f"a {shape}")
            held = {"attach": phase.object, "detach": ""}.get(phase.then, held)
            if phase.contacts and self.allowed_penetration is None:
                must = f"given: {field}.contacts allows contacts"
                raise SettingError("allowed_penetration", must, None)
        demand(any(self.up), "up", "a direction, not (0, 0, 0)", list(self.up))
        return self

    @property
    def objects(self) -> tuple[Obstacle, ...]:
        """The obstacles that stand around: all, or those of an empty scene."""
        return tuple(self._named_objects.values())

    @property
    def all_names(self) -> tuple[str, ...]:
        """Names of the obstacles, those that an empty scene takes away included."""
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
