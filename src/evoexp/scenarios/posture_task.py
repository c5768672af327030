"""A task of an arm among obstacles: a start posture, and phases that each end at a goal.

A task of one phase is a reaching task; manoeuvres such as pick-and-place are a list of them
(Corsépius 2001, section 4.3: fitness functions and termination criteria together make a manoeuvre).
"""

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from evoexp.errors import SettingError, nearest
from evoexp.scenarios.obstacles import Obstacle
from evoexp.validation import Component, NonNegative, Positive, Settings, Vector

Point3 = tuple[float, float, float]


class PointGoal(Settings):
    """A point that the controlled frame shall reach, or the surface of a ball around it.

    Attributes:
        point: The point.
        radius: Of the ball, whose surface is the goal; it is no obstacle. 0: the point itself is
            the goal [length unit].
    """

    kind: Literal["point"]
    point: Point3
    radius: NonNegative = 0.0


class PoseGoal(Settings):
    """A point and an orientation: roll, pitch, yaw [deg] of the controlled frame."""

    kind: Literal["pose"]
    point: Point3
    rotation: Point3


class SurfaceGoal(Settings):
    """The surface of an obstacle.

    Attributes:
        object: Its name.
    """

    kind: Literal["surface"]
    object: str


class PlaceGoal(Settings):
    """A disc across the direction up, on which the controlled frame's origin shall come to lie.

    Attributes:
        point: Its middle.
        radius: Its radius [length unit].
    """

    kind: Literal["place"]
    point: Point3
    radius: Positive


class ShiftGoal(Settings):
    """Where the controlled frame is when the phase begins, moved.

    Attributes:
        offset: By how much [length unit].
        frame: Whether along the world's axes or the tool's.
    """

    kind: Literal["shift"]
    offset: Point3
    frame: Literal["world", "tool"]


AnyGoal = Annotated[
    PointGoal | PoseGoal | SurfaceGoal | PlaceGoal | ShiftGoal, Field(discriminator="kind")
]


class Phase(Settings):
    """One manoeuvre.

    The controlled frame is the tool's or, while an object is held, the object's: its centre, its
    own axes.

    Attributes:
        name: For reports.
        goal: Where it ends.
        terms: Cost terms that count in it; empty: all of the objective.
        contacts: Pairs of names (bodies, obstacles) that may touch in it, as deep as the task's
            `allowed_penetration`.
        then: Whether the robot takes hold of an object when the goal is met, or lets go of what it
            holds.
        object: What it takes hold of.
        position_tolerance: In place of the task's.
        upright_tolerance: The goal is met only with so small a tilt [deg]; None: within the hard
            limit of `upright`, if that counts.
        scope_share: Part of the planner's scope that joints may step in it [-].
    """

    name: str
    goal: AnyGoal
    terms: tuple[str, ...] = ()
    contacts: tuple[tuple[str, str], ...] = ()
    then: Literal["go_on", "attach", "detach"] = "go_on"
    object: str = ""
    position_tolerance: Positive | None = None
    upright_tolerance: Positive | None = None
    scope_share: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0


class PostureTask(Component):
    """Start posture, phases and surroundings of one arm.

    Attributes:
        q_start: Posture at the start [deg], lengths for sliding joints.
        phases: What is to be done, one after the other.
        subgoals: Points that the tool passes before the first phase.
        position_tolerance: A goal is met this close [length unit].
        angle_tolerance: And with orientations this close [deg].
        up: The direction that counts as up.
        security_margin: Clearance between bodies that the task requires [length unit].
        length_unit: Name of the scene's unit of length.
        check_reach: Whether a goal that no posture can reach is refused; false: it is searched all
            the same.
        obstacles: What stands around, things to be grasped included.
        allowed_penetration: How deep pairs that may touch may overlap; None where no phase has
            such pairs [length unit].
        empty_scene: Whether all obstacles are taken away but those that a goal or a grasp names:
            the control by which obstacles are judged.
    """

    component: ClassVar[str] = "posture_task"

    q_start: Annotated[Vector, Field(min_length=1)]
    phases: Annotated[tuple[Phase, ...], Field(min_length=1)]
    subgoals: tuple[Point3, ...] = ()
    position_tolerance: Positive
    angle_tolerance: Positive
    up: Point3 = (0.0, 0.0, 1.0)
    security_margin: NonNegative
    length_unit: str
    check_reach: bool = True
    obstacles: tuple[Obstacle, ...] = ()
    allowed_penetration: Positive | None = None
    empty_scene: bool = False

    @model_validator(mode="after")
    def _holds_one_thing_at_a_time(self) -> Self:
        for k, name in enumerate(self.all_names):
            if name in self.all_names[:k]:
                raise SettingError(
                    f"obstacles[{k}].name", "a name that no other obstacle has", name
                )
        held = ""
        for k, phase in enumerate(self.phases):
            field = f"phases[{k}]"
            if (phase.then == "attach") != bool(phase.object):
                raise SettingError(
                    f"{field}.object",
                    "given with then: attach, and only then",
                    phase.object or None,
                )
            if phase.then == "attach" and held:
                raise SettingError(
                    f"{field}.then",
                    f"detach before anything else is taken ({held} is held)",
                    "attach",
                )
            if phase.then == "detach" and not held:
                raise SettingError(f"{field}.then", "attach in a phase before", "detach")
            if isinstance(phase.goal, SurfaceGoal) and phase.goal.object == held:
                raise SettingError(f"{field}.goal.object", "another object than the one held", held)
            if isinstance(phase.goal, SurfaceGoal):
                self.index_of(phase.goal.object, f"{field}.goal.object")
            if phase.then == "attach":
                shape = self.objects[self.index_of(phase.object, f"{field}.object")].shape
                if shape in ("half_space", "ellipse", "hull"):
                    raise SettingError(
                        f"{field}.object", "a sphere, box, capsule or cylinder", f"a {shape}"
                    )
            held = {"attach": phase.object, "detach": ""}.get(phase.then, held)
            if bool(phase.contacts) and self.allowed_penetration is None:
                raise SettingError(
                    "allowed_penetration", f"given: {field}.contacts allows contacts", None
                )
        if not any(self.up):
            raise SettingError("up", "a direction, not (0, 0, 0)", list(self.up))
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
        """Return the index of one of `objects`.

        Raises:
            SettingError: If none has this name.
        """
        if name not in self.names:
            raise SettingError(
                field,
                f"the name of an obstacle ({', '.join(self.names) or 'there is none'})",
                name,
                nearest(name, self.names),
            )
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
