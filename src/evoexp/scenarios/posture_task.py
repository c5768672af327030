"""A task of an arm among obstacles: a start posture, and phases that each end at a goal.

A task of one phase is a reaching task; manoeuvres such as pick-and-place are a list of them
(Corsépius 2001, section 4.3: fitness functions and termination criteria together make a manoeuvre).
"""

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from evoexp.errors import SettingError, nearest
from evoexp.scenarios.obstacles import Obstacle
from evoexp.validation import Component, NonNegative, Positive, Settings, Vector

Point3 = tuple[float, float, float]


class PointGoal(Settings):
    """A point that the controlled frame shall reach."""

    kind: Literal["point"]
    point: Point3


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


class ShiftGoal(Settings):
    """Where the controlled frame is when the phase begins, moved.

    Attributes:
        offset: By how much [length unit].
        frame: Whether along the world's axes or the tool's.
    """

    kind: Literal["shift"]
    offset: Point3
    frame: Literal["world", "tool"]


AnyGoal = Annotated[PointGoal | PoseGoal | SurfaceGoal | ShiftGoal, Field(discriminator="kind")]


class Phase(Settings):
    """One manoeuvre.

    The controlled frame is the tool's or, while an object is held, the object's: its centre, its
    own axes.

    Attributes:
        name: For reports.
        goal: Where it ends.
        terms: Cost terms that count in it; empty: all of the objective.
        contacts: Pairs of names (bodies, obstacles) that may touch in it.
        then: Whether the robot takes hold of an object when the goal is met, or lets go of what it
            holds.
        object: What it takes hold of.
    """

    name: str
    goal: AnyGoal
    terms: tuple[str, ...] = ()
    contacts: tuple[tuple[str, str], ...] = ()
    then: Literal["go_on", "attach", "detach"] = "go_on"
    object: str = ""


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

    @model_validator(mode="after")
    def _holds_one_thing_at_a_time(self) -> Self:
        for k, name in enumerate(self.names):
            if name in self.names[:k]:
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
                shape = self.obstacles[self.index_of(phase.object, f"{field}.object")].shape
                if shape in ("half_space", "ellipse"):
                    raise SettingError(
                        f"{field}.object", "a sphere, box, capsule or cylinder", f"a {shape}"
                    )
            held = {"attach": phase.object, "detach": ""}.get(phase.then, held)
        if not any(self.up):
            raise SettingError("up", "a direction, not (0, 0, 0)", list(self.up))
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the obstacles."""
        return tuple(
            obstacle.name or f"obstacle_{k + 1}" for k, obstacle in enumerate(self.obstacles)
        )

    def index_of(self, name: str, field: str) -> int:
        """Return the index of an obstacle.

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
