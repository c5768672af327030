"""Motions of arms between two configurations: start and goal in degrees, bodies, covers.

Tasks from MoveIt get the same form: joints by name, pairs that may touch.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_models import BodyModel
from evoexp.collision.bodies.covered_bodies import ArmCollision, CoveredBodies, CoveredCollision
from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.collision.box_support import coal
from evoexp.collision.scene import Part, Scene, obstacle_pairs, scene
from evoexp.errors import SettingError, demand
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion
from evoexp.planners.answers import CoverShape, joint_names, of_limits, of_place
from evoexp.planners.planner import PlannerDefaults
from evoexp.records import FloatArray, IntArray
from evoexp.robots.assembly import Assembly, Robot
from evoexp.robots.kinematics import frame_pose, local_pose
from evoexp.robots.meshes import convex_shape, loaded_mesh
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.scenarios.motion_tasks import (
    ArmMotion,
    LinkMotion,
    Phase,
    PointGoal,
    PoseGoal,
    PostureTask,
)
from evoexp.scenarios.moveit import LinkGoal, MoveitTask
from evoexp.scenarios.moveit_files import Pose

ROUNDING = 1e-9  # [rad, m] by which an end may lie beyond a limit
UNLIMITED = 1e6  # [rad] a joint without limits has larger ones in the model
FIELDS = "scenario.q_start", "scenario.q_goal"
ArmTask = ArmMotion | LinkMotion | MoveitTask | GridMotion
"""Scenarios in which robots go from one configuration to another."""


@dataclass(frozen=True)
class ArmProblem:
    """A robot and its scenario, prepared."""

    assembly: Assembly  # the robot, built
    # the touching circles or spheres on it, or its covered bodies
    collision: ArmCollision
    start: FloatArray  # (nq,) [deg]
    goal: FloatArray  # (nq,) [deg]
    scene: Scene  # the bodies themselves, for the exact verdict on a motion
    security_margin: float  # clearance that the task requires between two arms [length unit]
    obstacle_margin: float  # the same between a link and an obstacle
    length_unit: str  # name of the scene's unit of length

    @property
    def arm_slices(self) -> IntArray:
        """(arms, 2) rows of each arm."""
        return self.assembly.arm_slices

    @property
    def margins(self) -> FloatArray:
        """(pairs of the scene,) clearance that the task requires of each [length unit]."""
        among = obstacle_pairs(self.assembly, self.scene)
        return np.where(among, self.obstacle_margin, self.security_margin)

    @property
    def limits(self) -> FloatArray:
        """(nq, 2) least and greatest value of each joint [deg]; large where it has no limits."""
        model = self.assembly.model
        limits = np.column_stack([model.lowerPositionLimit, model.upperPositionLimit])
        return np.asarray(np.clip(limits, -UNLIMITED, UNLIMITED) / DEGREE)


class ArmDefaults(PlannerDefaults):
    """The usual answers of a planner of motions between two configurations."""

    def path(self, problem: Any, solution: FloatArray) -> FloatArray:
        """Return the configurations of a flat solution, (instants, nq) [deg]."""
        raise NotImplementedError

    def parts(self, problem: Any, motion: Motion) -> tuple[Part, ...]:
        """Return the whole motion; arms and obstacles have margins of their own."""
        return (Part(problem.scene, 0, motion.num_segments, problem.margins),)

    def departures(self, problem: Any, solution: FloatArray) -> list[str]:
        """Compare start and goal of every arm with the task's, and angles with their limits."""
        path = self.path(problem, solution)
        found = ["there is no path, one configuration only"] if len(path) == 1 else []
        for arm, (a, b) in enumerate(problem.arm_slices):
            for end, row, wanted in (("start", 0, problem.start), ("goal", -1, problem.goal)):
                name = f"the {end} of arm {arm + 1}"
                found += of_place(name, path[row, a:b], wanted[a:b], "deg")
        return found + of_limits(joint_names(path.shape[1]), path.T, problem.limits, "deg")

    def notes(self, problem: Any) -> list[str]:
        """Describe the covers of bodies, where bodies are covered."""
        collision, bodies = problem.collision, problem.scene
        if not isinstance(collision, CoveredCollision):
            return []
        first = collision.assembly.geometry.ngeoms  # the robot's bodies, then the obstacles
        obstacles = zip(bodies.names[first:], bodies.shapes[first:], strict=True)
        hulls = [name for name, (shape, _, _) in obstacles if isinstance(shape, coal.ConvexBase)]
        return [*collision.notes(problem.length_unit), *hull_notes(hulls)]

    def covers(self, problem: Any) -> tuple[CoverShape, ...]:
        """Return the circles, spheres and capsules that the search tests."""
        return cover_shapes(problem.collision)


def arm_problem(
    robot: Robot, scenario: ArmTask, model: TouchingSpheres | CoveredBodies
) -> ArmProblem:
    """Build the robot; a SettingError refuses a start or goal that does not fit it, or collides."""
    assembly = robot.build()
    if isinstance(scenario, MoveitTask):
        assembly = with_allowed_pairs(assembly, scenario)
    elif isinstance(scenario, GridMotion):
        # a platform whose joints slide from the first node of the grid to the last one
        slides = assembly.table.slides
        must = f"one that slides along the {len(scenario.size)} directions of the grid"
        named = f"one of joints {', '.join(list(assembly.model.names)[1:])}"
        demand(len(slides) == len(scenario.size) and slides.all(), "robot", must, named)
        floor = assembly.model.copy()
        floor.lowerPositionLimit = np.zeros(len(slides))
        floor.upperPositionLimit = np.array(scenario.size, dtype=np.float64) - 1.0
        assembly = assembly._replace(model=floor)
    task = _arm_motion(assembly, scenario)
    # a metre of a sliding joint counts as a radian, 57.3 degrees
    units = np.where(assembly.table.slides, 1.0 / DEGREE, 1.0)
    start, goal = (q * units for q in task.ends(assembly.arm_slices))
    collision: ArmCollision
    if isinstance(model, CoveredBodies):
        collision, bodies = _covered(model, assembly, task, scenario, (start, goal))
    else:
        collision = model.bind(assembly, task.obstacles)
        given = ("q_start", start, task.q_start), ("q_goal", goal, task.q_goal)
        for name, q, typed in given:
            clearance = collision.clearance(q[:, None])
            if clearance.least[0] < 0.0:
                who = "two arms" if clearance.between_arms[0] < 0.0 else "an arm and an obstacle"
                depth = f"{-clearance.least[0]:.3g} {task.length_unit}"
                must = f"free of collision ({who} overlap by {depth})"
                raise SettingError(f"scenario.{name}", must, [list(arm) for arm in typed])
        bodies = scene(assembly, collision.obstacles)
    own, margin = task.obstacle_margin, task.security_margin
    both = margin, margin if own is None else own
    return ArmProblem(assembly, collision, start, goal, bodies, *both, task.length_unit)


def _arm_motion(assembly: Assembly, task: ArmTask) -> ArmMotion:
    """Return a task as a motion between configurations, all joints relative to the link before."""
    if isinstance(task, GridMotion):
        task.blocked()  # refuses ends that are blocked
        start, goal = ([tuple(map(float, end))] for end in (task.start, task.goal))
        return as_motion(task, start, goal, task.bodies())
    if not isinstance(task, LinkMotion):
        return arm_motion(assembly, task)
    from evoexp.collision.planar.link_collision import two_link_arms  # and its kernels

    must = "empty: this planner moves all robots"
    demand(not task.stationary, "scenario.stationary", must, list(task.stationary))
    arms = two_link_arms(assembly)
    ends = task.ends(np.array([arm.base for arm in arms]), np.array([arm.lengths for arm in arms]))
    q_start, q_goal = ([(one, two - one) for one, two in end.tolist()] for end in ends)
    return as_motion(task, q_start, q_goal, task.obstacles)


def cover_shapes(collision: ArmCollision | BodyModel) -> tuple[CoverShape, ...]:
    """Return the circles, spheres and capsules that a collision model tests."""
    joint, start, end, radius, _ = collision.shapes
    columns = joint.tolist(), start, end, radius.tolist()
    return tuple(CoverShape(*shape) for shape in zip(*columns, strict=True))


def check_limits(assembly: Assembly, ends: tuple[FloatArray, FloatArray]) -> None:
    """Refuse a start or goal beyond the limits of a joint, by a SettingError that names it."""
    model, slides = assembly.model, assembly.table.slides
    for field, q in zip(FIELDS, ends, strict=True):
        low, high = model.lowerPositionLimit, model.upperPositionLimit
        beyond = (DEGREE * q < low - ROUNDING) | (DEGREE * q > high + ROUNDING)
        if beyond.any():
            k = int(np.argmax(beyond))
            unit, word = (1.0, "m") if slides[k] else (DEGREE, "deg")
            name = assembly.joint_names[k]
            limits = f"{low[k] / unit:g} to {high[k] / unit:g} {word}"
            must = f"within the limits of '{name}', {limits}"
            raise SettingError(field, must, float(DEGREE * q[k] / unit))


def _covered(
    model: CoveredBodies,
    assembly: Assembly,
    task: ArmMotion,  # its obstacles, by which contacts are named
    given: ArmTask,  # the task as the scenario has it; names the pairs that may touch
    ends: tuple[FloatArray, FloatArray],
) -> tuple[CoveredCollision, Scene]:
    """Return the covered bodies, and the exact ones, pairs of one arm included; check both ends."""
    ignored: tuple[tuple[int, int], ...] = ()
    bodies = scene(assembly, task.obstacles, self_pairs=True)
    if isinstance(given, MoveitTask):
        ignored, first = touching(assembly, given), assembly.geometry.ngeoms
        allowed = {(body, first + obstacle) for body, obstacle in ignored}
        is_judged = [(int(a), int(b)) not in allowed for a, b in bodies.pairs]
        bodies = bodies.of_pairs(np.array(is_judged, dtype=np.bool_))
    names = tuple(each.name or f"obstacle_{k + 1}" for k, each in enumerate(task.obstacles))
    bodies = bodies._replace(names=(*bodies.names[: assembly.geometry.ngeoms], *names))
    check_limits(assembly, ends)
    for field, q in zip(FIELDS, ends, strict=True):
        check_bodies(bodies, DEGREE * q, field, task.length_unit)
    collision = model.bind(assembly, task.obstacles, np.column_stack(ends), ignored)
    return collision, bodies._replace(maps=collision.bodies.maps)


def check_bodies(bodies: Scene, q: FloatArray, field: str, unit: str) -> None:
    """Refuse q (nq,) [rad, m] at which exact bodies touch, by the pair that overlaps most."""
    data, placements = bodies.model.createData(), bodies.geometry.createData()
    pin.updateGeometryPlacements(bodies.model, data, bodies.geometry, placements, q)
    worst, found = 0.0, ""
    for k, (a, b) in enumerate(bodies.pairs):
        pair = bodies.geometry.findCollisionPair(pin.CollisionPair(int(a), int(b)))
        distance = pin.computeDistance(bodies.geometry, placements, pair).min_distance
        if distance <= min(worst, float(bodies.tolerances[k])):
            one, two = bodies.pair_names(k)
            how = f"overlap by {-distance:.3g} {unit}"
            if distance >= 0.0:  # the surfaces of meshes, of which coal tells no depth
                how = f"overlap by at most {_hull_depth(bodies, placements, a, b):.3g} {unit}"
            worst, found = distance, f"{one} and {two} {how}"
    demand(not found, field, "free of contact between bodies", found)


def _hull_depth(bodies: Scene, placements: Any, one: int, two: int) -> float:
    """Return how deep the convex hulls of two bodies overlap; 0 if they do not."""
    given = []
    for k in (int(one), int(two)):
        shape, place = bodies.shapes[k][0], placements.oMg[k]
        if isinstance(shape, coal.BVHModelBase):
            hull = hull_of(np.array([shape.vertex(n) for n in range(shape.num_vertices)]))
            assert hull is not None  # bodies without an inside are refused
            shape = convex_shape(*hull)
        given += [shape, coal.Transform3s(place.rotation, place.translation)]
    return max(0.0, -float(coal.distance(*given, coal.DistanceRequest(), coal.DistanceResult())))


def links_of_bodies(assembly: Assembly) -> dict[str, str]:
    """Return the link of each body: its name, without the number that tells bodies apart."""
    names = [str(item.name) for item in assembly.geometry.geometryObjects]
    frames = assembly.frames
    links = set() if frames is None else {*dict(frames.standing), *frames.moving}
    return {name: name if name in links else re.sub(r"_\d+$", "", name) for name in names}


def with_allowed_pairs(assembly: Assembly, task: MoveitTask) -> Assembly:
    """Return a robot with the pairs that may touch: the task's matrix decides."""
    allowed, disabled = task.allowed, set(assembly.disabled)
    for (one, link), (two, other) in combinations(links_of_bodies(assembly).items(), 2):
        may_touch = allowed.may_touch(link, other)
        if may_touch is not None and link != other:
            (disabled.add if may_touch else disabled.discard)(frozenset((one, two)))
    return assembly._replace(disabled=frozenset(disabled))


def arm_motion(assembly: Assembly, task: ArmMotion | MoveitTask) -> ArmMotion:
    """Return a task as a motion between configurations; refuse a goal that is a pose."""
    if isinstance(task, ArmMotion):
        return task
    q_goal = task.goal_configuration(assembly.joint_names)
    if q_goal is None:
        must = "a goal of joints for this planner (posture_es plans to poses)"
        raise SettingError("scenario.request", must, f"a pose of '{task.plan_request.link}'")
    world = task.world(assembly.frames, loaded_mesh)
    start, goal = (
        tuple(tuple(_typed(assembly, q)[a:b].tolist()) for a, b in assembly.arm_slices)
        for q in (task.start_configuration(assembly.joint_names), q_goal)
    )
    return as_motion(task, start, goal, world.obstacles)


def as_motion(
    task: Any, start: Sequence[Any], goal: Sequence[Any], obstacles: Sequence[Any]
) -> ArmMotion:
    """Return a motion between two configurations [deg], arm by arm, with the margin of a task."""
    return ArmMotion(
        q_start=tuple(start),
        q_goal=tuple(goal),
        security_margin=task.security_margin,
        length_unit=task.length_unit,
        obstacles=tuple(obstacles),
    )


def posture_task(assembly: Assembly, task: PostureTask | MoveitTask) -> PostureTask:
    """Return a task as one of reaching a pose; refuse one whose pairs with obstacles may touch."""
    if not isinstance(task, MoveitTask):
        return task
    world, names = task.world(assembly.frames, loaded_mesh), assembly.joint_names
    if pairs := touching(assembly, task):
        body = str(assembly.geometry.geometryObjects[pairs[0][0]].name)
        obstacle = world.objects[pairs[0][1]]
        must = "free of bodies that may touch objects, with this planner"
        raise SettingError("scenario.scene", must, f"'{body}' and '{obstacle}'")
    q_goal = task.goal_configuration(names)
    if q_goal is None:
        link = task.link_goal(world.frames)
    else:
        tool = assembly.tools[0]
        local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
        pose = frame_pose(assembly.table, tool.joint - 1, local, q_goal)
        place = Pose(pose[:9].reshape(3, 3), pose[9:])
        link = LinkGoal(place, task.position_tolerance, task.angle_tolerance)
    x, y, z = link.pose.position.tolist()
    goal: PoseGoal | PointGoal = PointGoal(kind="point", point=(x, y, z))
    if link.angle is not None:
        goal = PoseGoal(kind="pose", point=(x, y, z), rotation=link.pose.angles)
    # a goal that is a point only is rated without the term of the orientation
    terms = () if link.angle is not None else ("goal_distance", "limit_margin", "collision")
    return PostureTask(
        q_start=tuple(_typed(assembly, task.start_configuration(names)).tolist()),
        phases=(Phase(name="goal", goal=goal, terms=terms),),
        position_tolerance=link.distance,
        angle_tolerance=task.angle_tolerance if link.angle is None else link.angle,
        security_margin=task.security_margin,
        length_unit=task.length_unit,
        obstacles=world.obstacles,
    )


def touching(assembly: Assembly, task: MoveitTask) -> tuple[tuple[int, int], ...]:
    """Return the pairs (body, obstacle) that may touch, by their numbers."""
    allowed, objects = task.allowed, task.world(assembly.frames, loaded_mesh).objects
    return tuple(
        (body, obstacle)
        for body, link in enumerate(links_of_bodies(assembly).values())
        for obstacle, name in enumerate(objects)
        if allowed.may_touch(link, name)
    )


def hull_notes(names: Sequence[str]) -> tuple[str, ...]:
    """Note which obstacles a search takes to be larger than they are."""
    if not names:
        return ()
    note = "meshes, cones and hulls: the search tests boxes around them, the verdict"
    return (f"{note} judges their convex hulls: {', '.join(names)}",)


def _typed(assembly: Assembly, q: FloatArray) -> FloatArray:
    """Return q (nq,) [rad, m] as scenarios give it [deg, m]."""
    return np.where(assembly.table.slides, q, q / DEGREE)
