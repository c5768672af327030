"""The problem of a posture search: robot, task and objective, checked against each other."""

import functools
from dataclasses import replace

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_models import BodyModel, CollisionModel
from evoexp.collision.covers.body_covers import Cover, inner_balls
from evoexp.collision.scene import obstacle_shapes
from evoexp.errors import SettingError, nearest
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import ANGLE, AXIAL, HEADING, TERMS, UPRIGHT, PostureCost
from evoexp.planners.moveit_tasks import posture_task, with_allowed_pairs
from evoexp.planners.posture_es.phases import Problem
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly, Robot
from evoexp.robots.poses import local_pose
from evoexp.scenarios.moveit import MoveitTask
from evoexp.scenarios.obstacles import CAPSULE, CYLINDER, ObstacleTable, obstacle_table
from evoexp.scenarios.posture_task import (
    Phase,
    PlaceGoal,
    PointGoal,
    PoseGoal,
    PostureTask,
    ShiftGoal,
    SurfaceGoal,
)


def prepare(
    robot: Robot,
    scenario: PostureTask | MoveitTask,
    scope: tuple[float, ...],
    objective: PostureCost,
    collision: CollisionModel,
) -> Problem:
    """Return the problem of a task.

    Raises:
        SettingError: If a joint has no limits, the start or the scope does not fit the robot, the
            start collides, a goal is out of reach, a contact names nothing, or a goal and the terms
            that rate it contradict each other.
    """
    assembly = _built(robot)
    if isinstance(scenario, MoveitTask):
        assembly = with_allowed_pairs(assembly, scenario)
    if assembly.num_arms != 1:
        raise SettingError("robot", "one arm", f"{assembly.num_arms} arms")
    task = posture_task(assembly, scenario)
    limits = _limits(assembly)
    start = _start(task, assembly, limits)
    if len(scope) not in (1, len(start)):
        must = f"one number, or one per joint ({len(start)})"
        raise SettingError("planner.scope", must, list(scope))
    obstacles = obstacle_table(task.objects).without_ellipses()
    bodies = _bodies(robot, collision, assembly.disabled)
    tool = assembly.tools[0]
    for k, name in enumerate(task.names):
        if name in bodies.names:
            raise SettingError(
                f"scenario.obstacles[{k}].name", "a name that no body of the robot has", name
            )
    problem = Problem(
        assembly,
        bodies,
        task,
        obstacles,
        _covers(task, obstacles, collision),
        (tool.joint - 1, local_pose(assembly.table, tool.joint, tool.rotation, tool.position)),
        task.all_phases,
        _weights(task, objective, obstacles),
        objective,
        start,
        limits,
        np.array(scope * len(start) if len(scope) == 1 else scope),
        None,
        task.security_margin,
        {},
    )
    _check_contacts(task, (*bodies.names, *task.all_names))
    if task.check_reach:
        _check_reach(problem, isinstance(scenario, MoveitTask))
    stage = problem.begin(0, start, problem.first_situation)
    problem = replace(problem, scene=problem.scene_of(stage))
    goal = None
    if isinstance(scenario, MoveitTask):
        goal = scenario.goal_configuration(assembly.joint_names)
    return _fitted(problem, goal)


def _fitted(problem: Problem, goal: FloatArray | None) -> Problem:
    """Return the problem with covers that its start, and a goal of joints, do not bring in contact.

    Where the bodies do not touch there; refuse a start that is infeasible all the same.
    """
    if goal is None and _is_feasible(problem):
        return problem
    ends = [problem.start] if goal is None else [problem.start, goal]
    free = [q for q in ends if _distances(problem, q).min(initial=np.inf) > 0.0]
    if free:
        table, ignored, _ = problem.surroundings(problem.phases[0], problem.first_situation)
        bodies = problem.bodies.fitted(table, ignored, np.column_stack(free))
        problem = replace(problem, bodies=bodies, memory={})
    if not _is_feasible(problem):
        raise _infeasible(problem, problem.start)
    return problem


def _is_feasible(problem: Problem) -> bool:
    stage = problem.begin(0, problem.start, problem.first_situation)
    return bool(stage.judge(problem.start[:, None]).feasible[0])


def _distances(problem: Problem, q: FloatArray) -> FloatArray:
    """Return the distances of the exact bodies, pair by pair, at posture q (nq,)."""
    scene = problem.scene
    assert scene is not None
    placements = scene.geometry.createData()
    pin.computeDistances(scene.model, scene.model.createData(), scene.geometry, placements, q)
    return np.array([result.min_distance for result in placements.distanceResults])


@functools.lru_cache(maxsize=16)
def _built(robot: Robot) -> Assembly:
    return robot.build()


@functools.lru_cache(maxsize=16)
def _bodies(
    robot: Robot, collision: CollisionModel, disabled: frozenset[frozenset[str]]
) -> BodyModel:
    """Return a robot's bodies; kept, since finding pairs that never touch takes longest."""
    return collision.bind(_built(robot)._replace(disabled=disabled))


def _limits(assembly: Assembly) -> FloatArray:
    model = assembly.model
    limits = np.column_stack([model.lowerPositionLimit, model.upperPositionLimit])
    for joint in range(1, model.njoints):
        low, high = limits[model.idx_qs[joint]]
        if not (abs(low) < 1e6 and abs(high) < 1e6 and low < high):
            raise SettingError(
                "robot.joint_limits",
                "given for every joint: postures are drawn between them, and margins rated",
                f"none for joint '{model.names[joint]}'",
            )
    return limits


def _start(task: PostureTask, assembly: Assembly, limits: FloatArray) -> FloatArray:
    if len(task.q_start) != assembly.model.nq:
        raise SettingError(
            "scenario.q_start", f"one value per joint ({assembly.model.nq})", len(task.q_start)
        )
    # model units per unit of the scenario: degrees, lengths of sliding joints
    units = np.full(assembly.model.nq, DEGREE)
    units[assembly.table.slides] = 1.0
    start = np.array(task.q_start) * units
    for k, (value, (least, greatest)) in enumerate(zip(start, limits, strict=True)):
        if not least <= value <= greatest:
            raise SettingError(
                f"scenario.q_start[{k}]",
                f"within the joint's limits, {least / units[k]:g} to {greatest / units[k]:g}",
                task.q_start[k],
            )
    return start


def _weights(task: PostureTask, objective: PostureCost, obstacles: ObstacleTable) -> FloatArray:
    """Return the weights of every phase, (phases, terms)."""
    rows = []
    for k, phase in enumerate(task.all_phases):
        subgoal = k < len(task.subgoals)
        field = f"scenario.phases[{k - len(task.subgoals)}].terms"
        on_the_way = tuple(
            name
            for name in objective.chosen
            if name in ("goal_distance", "limit_margin", "collision")
        )
        weights = objective.weights(on_the_way if subgoal else phase.terms, field)
        if not subgoal:
            _check_terms(phase, weights, task, obstacles, field)
        rows.append(weights)
    return np.array(rows)


def _check_terms(
    phase: Phase, weights: FloatArray, task: PostureTask, obstacles: ObstacleTable, field: str
) -> None:
    """Refuse terms without a meaning for the goal of a phase, or that contradict it."""
    goal, where = phase.goal, field.removesuffix("terms") + "goal"
    if weights[0] == 0.0:
        raise SettingError(
            field, "terms with goal_distance: every goal is a place", list(phase.terms)
        )
    if weights[ANGLE] > 0.0 and not isinstance(goal, PoseGoal | ShiftGoal):
        raise SettingError(
            where,
            f"a pose, since goal_angle rates its orientation (or {field} without it)",
            goal.kind,
        )
    if isinstance(goal, PoseGoal) and weights[ANGLE] == 0.0:
        raise SettingError(where, "a point, since no goal_angle rates its orientation", "pose")
    if phase.upright_tolerance is not None and weights[UPRIGHT] == 0.0:
        raise SettingError(
            field.removesuffix("terms") + "upright_tolerance",
            "left out in a phase whose terms do not count upright",
            phase.upright_tolerance,
        )
    for term in (AXIAL, HEADING):
        if weights[term] > 0.0 and not isinstance(goal, SurfaceGoal):
            raise SettingError(
                where,
                f"the surface of an object, since {TERMS[term]} rates the way to it (or {field} "
                "without it)",
                goal.kind,
            )
    if isinstance(goal, SurfaceGoal):
        kind = obstacles.kind[task.names.index(goal.object)]
        shape = task.objects[task.names.index(goal.object)].shape
        if shape in ("half_space", "hull"):
            must = "a sphere, box, capsule or cylinder"
            raise SettingError(f"{where}.object", must, shape)
        if weights[AXIAL] > 0.0 and kind not in (CYLINDER, CAPSULE):
            raise SettingError(
                f"{where}.object",
                "a cylinder or capsule, since axial_approach rates its axis",
                shape,
            )


def _covers(
    task: PostureTask, obstacles: ObstacleTable, collision: CollisionModel
) -> dict[int, tuple[Cover, Cover]]:
    """Return covers of the objects that are grasped, and shapes inside, in their own frames."""
    taken = {task.names.index(phase.object) for phase in task.phases if phase.then == "attach"}
    shapes = obstacle_shapes(obstacles)
    found = {}
    for k in taken:
        item = pin.GeometryObject(task.names[k], 0, 0, pin.SE3.Identity(), shapes[k][0])
        inner = inner_balls(item, task.allowed_penetration or 0.0)
        assert inner is not None  # the task lets nothing else be grasped
        found[k] = collision.cover(item), inner
    return found


def _check_contacts(task: PostureTask, names: tuple[str, ...]) -> None:
    for k, phase in enumerate(task.phases):
        for c, pair in enumerate(phase.contacts):
            for name in pair:
                if name not in names:
                    raise SettingError(
                        f"scenario.phases[{k}].contacts[{c}]",
                        f"names of bodies or obstacles ({', '.join(names)})",
                        name,
                        nearest(name, names),
                    )


def reach(assembly: Assembly, limits: FloatArray) -> tuple[FloatArray, float]:
    """Return a fixed point (3,) and the greatest distance of the tool from it, links stretched out.

    The point lies on the axis of the first joint: at the second joint, if that is on this axis.
    """
    table, tool = assembly.table, assembly.tools[0]
    joint, far = tool.joint - 1, float(np.sqrt(np.sum(tool.position * tool.position)))
    while table.parent[joint] >= 0:
        before = int(table.parent[joint])
        (x, y, z), slide = table.translation[joint], _stroke(assembly, limits, joint)
        if table.parent[before] < 0 and not table.prismatic[before] and x == 0.0 and y == 0.0:
            return table.translation[before] + z * table.rotation[before][[2, 5, 8]], far + slide
        far += float(np.sqrt(x * x + y * y + z * z)) + slide
        joint = before
    return table.translation[joint], far + _stroke(assembly, limits, joint)


def _stroke(assembly: Assembly, limits: FloatArray, joint: int) -> float:
    """Return the greatest slide of a joint of the table; 0 if it turns."""
    table = assembly.table
    multiplier, offset = table.rule[joint]
    stroke = abs(multiplier) * float(np.abs(limits[table.index_q[joint]]).max()) + abs(offset)
    return float(stroke) if table.prismatic[joint] else 0.0


def _check_reach(problem: Problem, is_moveits: bool) -> None:
    """Refuse goals out of the stretched arm's reach, in the first scene, with nothing held."""
    task = problem.task
    center, far = reach(problem.assembly, problem.limits)
    held, ways = False, len(task.subgoals)
    for k, phase in enumerate(problem.phases):
        goal, point, size = phase.goal, None, 0.0
        field = f"scenario.subgoals[{k}]" if k < ways else f"scenario.phases[{k - ways}].goal.point"
        if isinstance(goal, PointGoal | PoseGoal | PlaceGoal) and not held:
            point = np.array(goal.point)
            size = 0.0 if isinstance(goal, PoseGoal) else goal.radius
        elif isinstance(goal, SurfaceGoal):
            index = task.names.index(goal.object)
            point, field = problem.obstacles.center[index], field.replace("point", "object")
            # no point of it is farther from its middle
            size = float(np.sum(problem.obstacles.size[index]))
        if point is not None:
            away = float(np.sqrt(np.sum((point - center) ** 2))) - size
            if away - task.position_tolerance > far:
                where = ", ".join(f"{value:g}" for value in center)
                must = f"within reach, {far:.4g} {task.length_unit} from ({where})"
                if is_moveits:  # such a task has no check_reach
                    raise SettingError("scenario.request", must, f"a goal {away:.4g} away")
                must = f"{must} (check_reach=false searches it anyway)"
                raise SettingError(field, must, f"{away:.4g} away")
        held = {"attach": True, "detach": False}.get(phase.then, held)


def _infeasible(problem: Problem, start: FloatArray) -> SettingError:
    """Return the reason for which a start is refused."""
    scene, given = problem.scene, list(problem.task.q_start)
    assert scene is not None
    distances = _distances(problem, start)
    stage = problem.begin(0, start, problem.first_situation)
    if stage.judge(start[:, None]).rows[TERMS.index("collision"), 0] == 0.0:
        return SettingError(
            "scenario.q_start", "within the hard limits of upright and keep_parallel", given
        )
    one, two = scene.pair_names(int(np.argmin(distances)))
    depth = f"{max(-float(distances.min()), 0.0):.3g} {problem.task.length_unit}"
    must = f"free of collision ({one} and {two} overlap by {depth})"
    return SettingError("scenario.q_start", must, given)
