"""The phases of a task: goals, held objects, permitted contacts, and the bodies of each phase.

An object's place at the begin of a phase depends on the postures before; the rest is made once. A
phase ends at the first posture that meets its goal, so a list of postures alone says which phase
each of them belongs to.
"""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.models.body_covers import Cover
from evoexp.collision.models.body_models import BodyModel, Carried
from evoexp.collision.scene import Part, Scene, geometry_scene, obstacle_shapes
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import (
    DISTANCE,
    EDGED,
    POINT,
    ROD,
    ROUND,
    TERMS,
    Aim,
    PostureCost,
)
from evoexp.paths.motion import Motion
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import COST, ROWS, Judging
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.poses import IDENTITY, compose, frame_pose, invert, pose_of
from evoexp.scenarios.obstacles import BOX, CYLINDER, ObstacleTable, rotation_matrix
from evoexp.scenarios.posture_task import (
    Phase,
    PointGoal,
    PoseGoal,
    PostureTask,
    ShiftGoal,
    SurfaceGoal,
)

KEPT = 64  # stages and scenes that a problem keeps

TOOL_UP, OBJECT_UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


class Situation(NamedTuple):
    """The places of all objects.

    Attributes:
        poses: (obstacles, 12) in the world; a held object stands where it was taken.
        held: Index of the held object; −1: none.
        grasp: (12,) of the held object, in the table's frame of the joint that moves the tool.
    """

    poses: FloatArray
    held: int
    grasp: FloatArray


class Problem(NamedTuple):
    """Robot and scenario, prepared for the search.

    Attributes:
        assembly: The robot, built.
        bodies: Its bodies, covered.
        task: The scenario.
        phases: Its phases, subgoals included.
        weights: (phases, terms) of the cost.
        objective: The cost.
        obstacles: The obstacles at the start.
        covers: Covers of the objects that are grasped, by index, in their own frames.
        start: (nq,) [rad].
        limits: (nq, 2) [rad].
        scope: (nq,) of a step [rad].
        tool: Index into the kinematic table of the joint that moves the tool; its local pose (12,).
        scene: The bodies themselves in the first phase.
        security_margin: Clearance that the task requires [length unit].
        memory: Stages that begin with nothing moved, made once.
    """

    assembly: Assembly
    bodies: BodyModel
    task: PostureTask
    phases: tuple[Phase, ...]
    weights: FloatArray
    objective: PostureCost
    obstacles: ObstacleTable
    covers: dict[int, Cover]
    start: FloatArray
    limits: FloatArray
    scope: FloatArray
    tool: tuple[int, FloatArray]
    scene: Scene | None
    security_margin: float
    memory: dict[Any, Any]

    @property
    def first_situation(self) -> Situation:
        """All objects where the scenario puts them."""
        table = self.obstacles
        poses = np.hstack([table.rotation, table.center])
        return Situation(poses, -1, IDENTITY)

    def parts(self, motion: Motion) -> list[Part]:
        """Return the motion phase by phase, each with its own bodies."""
        return [
            Part(scene_of(self, span.stage), span.first, span.last)
            for span in spans(self, motion.q)
        ]

    def spans(self, postures: FloatArray) -> "list[Span]":
        """Return the phases that a list of postures (postures, nq) [rad] reaches."""
        return spans(self, postures)

    @property
    def last_stage(self) -> "Stage":
        """The last phase, begun at the start with nothing moved."""
        return begin(self, len(self.phases) - 1, self.start, self.first_situation)

    def judge(self, stage: "Stage", q: FloatArray) -> "Judged":
        """Judge postures q (nq, postures) [rad] by a phase."""
        return judge(stage, q)

    def obstacles_in(self, stage: "Stage") -> ObstacleTable:
        """Return the obstacles in a phase; a held object stands where it was taken."""
        return placed_obstacles(self, stage.situation)


class Stage(NamedTuple):
    """One phase, begun.

    Attributes:
        number: Of the phase, from 0.
        phase: The phase.
        situation: The places of all objects in it.
        controlled: Index into the kinematic table, and local pose (12,), of the frame that is
            controlled.
        judging: Terms and limits for `kernels.judge`.
    """

    number: int
    phase: Phase
    situation: Situation
    controlled: tuple[int, FloatArray]
    judging: Judging

    @property
    def target_position(self) -> FloatArray:
        """The goal's point, or the middle of the object that is approached, (3,) [length unit]."""
        return self.judging.aim.point

    def weight(self, term: str) -> float:
        """Return the weight of a term of the cost, one of `posture_cost.TERMS`; 0: not counted."""
        return float(self.judging.weights[TERMS.index(term)])


class Judged(NamedTuple):
    """Judged postures.

    Attributes:
        rows: (ROWS, postures) terms, cost.
        feasible: (postures,).
        met: (postures,) whether they meet the goal.
    """

    rows: FloatArray
    feasible: BoolArray
    met: BoolArray

    @property
    def cost(self) -> FloatArray:
        """The cost, (postures,)."""
        return np.asarray(self.rows[COST])

    @property
    def distance(self) -> FloatArray:
        """Distance from the goal, also inside of a body, (postures,) [length unit]."""
        return np.asarray(np.abs(self.rows[DISTANCE]))


class Span(NamedTuple):
    """A phase in a list of postures.

    Attributes:
        stage: The phase, begun.
        first: Index of its first posture.
        last: Index of its last posture, where the next phase begins.
        judged: Its postures, judged by it.
        reached: Whether the last one meets its goal.
    """

    stage: Stage
    first: int
    last: int
    judged: Judged
    reached: bool


def judge(stage: Stage, q: FloatArray) -> Judged:
    """Judge postures q (nq, postures) [rad]."""
    q = np.ascontiguousarray(q)
    count = q.shape[1]
    flags = np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.bool_)
    found = Judged(np.empty((ROWS, count)), *flags)
    kernels.judge(q, stage.judging, *found)
    return found


def begin(problem: Problem, index: int, q: FloatArray, situation: Situation) -> Stage:
    """Begin a phase at posture q (nq,); stages are kept, verdict and terms need them again."""
    moved = not _unmoved(problem, situation) or situation.held >= 0
    key = (index, situation.poses.tobytes(), situation.grasp.tobytes()) if moved else (index,)
    if isinstance(problem.phases[index].goal, ShiftGoal):
        key = (*key, q.tobytes())
    if key not in problem.memory:
        if len(problem.memory) > KEPT:
            problem.memory.clear()
        problem.memory[key] = _begun(problem, index, q, situation)
    stage: Stage = problem.memory[key]
    return stage


def _begun(problem: Problem, index: int, q: FloatArray, situation: Situation) -> Stage:
    phase, (joint, local) = problem.phases[index], problem.tool
    controlled = (joint, situation.grasp if situation.held >= 0 else local)
    collision = problem.bodies.collision(*_surroundings(problem, phase, situation))
    objective, task = problem.objective, problem.task
    judging = Judging(
        problem.assembly.table.chain,
        joint,
        controlled[1],
        _aim(problem, phase, q, situation, controlled),
        problem.weights[index],
        np.array(objective.tilt_limits),
        problem.limits,
        collision.tables,
        objective.free_space.reach if objective.free_space else 0.0,
        np.array([task.position_tolerance, DEGREE * task.angle_tolerance]),
    )
    return Stage(index, phase, situation, controlled, judging)


def finish(problem: Problem, stage: Stage, q: FloatArray) -> Situation:
    """Return the places of all objects after a phase that ended at posture q (nq,)."""
    situation, phase = stage.situation, stage.phase
    if phase.then == "attach":
        held = problem.task.names.index(phase.object)
        joint, _ = problem.tool
        frame = frame_pose(problem.assembly.table, joint, IDENTITY, q)
        return situation._replace(held=held, grasp=compose(invert(frame), situation.poses[held]))
    if phase.then == "detach":
        poses = situation.poses.copy()
        poses[situation.held] = frame_pose(problem.assembly.table, *stage.controlled, q)
        return Situation(poses, -1, IDENTITY)
    return situation


def spans(problem: Problem, postures: FloatArray) -> list[Span]:
    """Return the phases that a list of postures (postures, nq) reaches."""
    found: list[Span] = []
    first, situation, last = 0, problem.first_situation, len(postures) - 1
    for index in range(len(problem.phases)):
        stage = begin(problem, index, postures[first], situation)
        judged = judge(stage, postures[first:].T)
        where = np.flatnonzero(judged.met)
        stop = first + int(where[0]) if len(where) else last
        kept = slice(0, stop - first + 1)
        own = Judged(judged.rows[:, kept], judged.feasible[kept], judged.met[kept])
        found.append(Span(stage, first, stop, own, bool(len(where))))
        if not len(where):
            break
        situation, first = finish(problem, stage, postures[stop]), stop
    return found


def scene_of(problem: Problem, stage: Stage) -> Scene:
    """Return the bodies of a phase, for the exact verdict."""
    situation = stage.situation
    key = (
        "scene",
        stage.phase.contacts,
        situation.held,
        situation.grasp.tobytes(),
        situation.poses.tobytes(),
    )
    if key not in problem.memory:
        problem.memory[key] = _scene(problem, stage)
    bodies: Scene = problem.memory[key]
    return bodies


def _scene(problem: Problem, stage: Stage) -> Scene:
    assembly, situation = problem.assembly, stage.situation
    items = list(assembly.geometry.geometryObjects)
    geometry = pin.GeometryModel()
    for item in items:
        geometry.addGeometryObject(
            pin.GeometryObject(item.name, item.parentJoint, 0, item.placement, item.geometry)
        )
    for k, (shape, placement) in enumerate(obstacle_shapes(placed_obstacles(problem, situation))):
        joint, where = 0, placement
        if k == situation.held:
            joint = problem.tool[0] + 1
            alignment = pose_of(assembly.table.alignment[joint - 1], np.zeros(3))
            pose = compose(alignment, situation.grasp)
            where = pin.SE3(pose[:9].reshape(3, 3), pose[9:])
        geometry.addGeometryObject(
            pin.GeometryObject(problem.task.names[k], joint, 0, where, shape)
        )
    allowed = _allowed(problem, stage.phase)
    pairs = list(problem.bodies.pairs)
    for k in range(len(problem.task.names)):
        if k == situation.held:
            others = [len(items) + j for j in range(len(problem.task.names)) if j != k]
            watched = [*_apart_from_tool(problem), *others]
            pairs += [(body, len(items) + k) for body in watched]
        else:
            pairs += [
                (body, len(items) + k) for body, item in enumerate(items) if item.parentJoint > 0
            ]
    names = [item.name for item in geometry.geometryObjects]
    for a, b in pairs:
        if frozenset((names[a], names[b])) not in allowed:
            geometry.addCollisionPair(pin.CollisionPair(a, b))
    return geometry_scene(assembly.model, geometry, assembly.table)


def placed_obstacles(problem: Problem, situation: Situation) -> ObstacleTable:
    """Return the obstacles in a situation; a held object stands where it was taken."""
    poses = situation.poses
    return problem.obstacles._replace(rotation=poses[:, :9].copy(), center=poses[:, 9:].copy())


def _unmoved(problem: Problem, situation: Situation) -> bool:
    return bool(np.array_equal(situation.poses, problem.first_situation.poses))


def _allowed(problem: Problem, phase: Phase) -> set[frozenset[str]]:
    return {frozenset(pair) for pair in phase.contacts}


def _apart_from_tool(problem: Problem) -> list[int]:
    """Return the bodies that a held object must not touch: all that are not beside the tool."""
    joint, parents = problem.tool[0] + 1, problem.assembly.model.parents
    items = problem.assembly.geometry.geometryObjects
    return [k for k, item in enumerate(items) if item.parentJoint not in (joint, parents[joint])]


def _surroundings(problem: Problem, phase: Phase, situation: Situation) -> tuple[Any, ...]:
    """Return the arguments of `BodyModel.collision`.

    They are the obstacles, the pairs (body, obstacle) that may touch, and the carried object.
    """
    names, bodies = problem.task.names, problem.bodies.names
    allowed = _allowed(problem, phase)
    held = situation.held
    left = [k for k in range(len(names)) if k != held]
    table = placed_obstacles(problem, situation)
    table = ObstacleTable(*(np.ascontiguousarray(column[left]) for column in table))
    own = len(bodies)
    numbers = {name: k for k, name in enumerate(bodies)} | ({names[held]: own} if held >= 0 else {})
    moving = {
        k
        for k, item in enumerate(problem.assembly.geometry.geometryObjects)
        if item.parentJoint > 0
    } | {own}
    ignored = tuple(
        (number, place)
        for name, number in numbers.items()
        for place, k in enumerate(left)
        if number in moving and frozenset((name, names[k])) in allowed
    )
    if held < 0:
        return table, ignored, None
    cover, grasp = problem.covers[held], situation.grasp
    joint = problem.tool[0] + 1
    pose = compose(pose_of(problem.assembly.table.alignment[joint - 1], np.zeros(3)), grasp)
    start, end = (_moved(pose, points) for points in (cover.start, cover.end))
    watched = [
        k for k in _apart_from_tool(problem) if frozenset((bodies[k], names[held])) not in allowed
    ]
    return (
        table,
        ignored,
        Carried(joint, Cover(start, end, cover.radius, cover.inflation), tuple(watched)),
    )


def _moved(pose: FloatArray, points: FloatArray) -> FloatArray:
    x, y, z = points.T
    rows = [
        (pose[3 * e] * x + pose[3 * e + 1] * y + pose[3 * e + 2] * z) + pose[9 + e]
        for e in range(3)
    ]
    return np.column_stack(rows)


def _aim(
    problem: Problem,
    phase: Phase,
    q: FloatArray,
    situation: Situation,
    controlled: tuple[int, FloatArray],
) -> Aim:
    """Return the goal of a phase that begins at posture q, as the kernels take it."""
    goal, rotation = phase.goal, IDENTITY[:9].copy()
    point, axis = np.zeros(3), np.zeros(3)
    surface, half_length, radius, half_edges = POINT, 0.0, 0.0, np.zeros(3)
    if isinstance(goal, PointGoal | PoseGoal):
        point = np.array(goal.point, dtype=np.float64)
    if isinstance(goal, PoseGoal):
        rotation = np.array(rotation_matrix(goal.rotation), dtype=np.float64).ravel()
    if isinstance(goal, ShiftGoal):
        table = problem.assembly.table
        now = frame_pose(table, *controlled, q)
        way = np.array(goal.offset, dtype=np.float64)
        if goal.frame == "tool":
            tool = frame_pose(table, *problem.tool, q)
            way = compose(tool, np.concatenate([IDENTITY[:9], way]))[9:] - tool[9:]
        rotation, point = now[:9].copy(), now[9:] + way
    if isinstance(goal, SurfaceGoal):
        k = problem.task.names.index(goal.object)
        pose, kind, size = situation.poses[k], problem.obstacles.kind[k], problem.obstacles.size[k]
        rotation, point, axis = pose[:9].copy(), pose[9:].copy(), pose[[2, 5, 8]]
        if kind == BOX:
            surface, half_edges = EDGED, size.copy()
        else:
            surface, half_length, radius = ROUND if kind == CYLINDER else ROD, size[1], size[0]
    up = np.array(problem.task.up)
    return Aim(
        rotation,
        point,
        axis,
        surface,
        float(half_length),
        float(radius),
        half_edges,
        up / np.sqrt(np.sum(up * up)),
        OBJECT_UP if situation.held >= 0 else TOOL_UP,
    )
