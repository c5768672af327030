"""The problem of a posture search: robot, task and objective, checked against each other."""

import functools
from dataclasses import replace

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_models import BodyModel, CollisionModel
from evoexp.collision.covers.body_covers import Cover, inner_balls
from evoexp.collision.scene import obstacle_shapes
from evoexp.errors import SettingError, demand, nearest
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import (
    ANGLE,
    AXIAL,
    COLLISION,
    HEADING,
    TERMS,
    UPRIGHT,
    PostureCost,
)
from evoexp.planners.arm_tasks import posture_task, with_allowed_pairs
from evoexp.planners.posture_es.phases import Problem
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly, Robot
from evoexp.robots.kinematics import local_pose
from evoexp.scenarios.motion_tasks import (
    Phase,
    PlaceGoal,
    PointGoal,
    PoseGoal,
    PostureTask,
    ShiftGoal,
    SurfaceGoal,
)
from evoexp.scenarios.moveit import MoveitTask
from evoexp.scenarios.obstacles import CAPSULE, CYLINDER, ObstacleTable, obstacle_table


def prepare(
    robot: Robot,
    scenario: PostureTask | MoveitTask,
    scope: tuple[float, ...],
    objective: PostureCost,
    collision: CollisionModel,
) -> Problem:
    """Return the problem of a task; a SettingError names what contradicts robot, goals or terms."""
    assembly = robot.build()
    if isinstance(scenario, MoveitTask):
        assembly = with_allowed_pairs(assembly, scenario)
    demand(assembly.num_arms == 1, "robot", "one arm", f"{assembly.num_arms} arms")
    task = posture_task(assembly, scenario)
    limits = _limits(assembly)
    start = _start(task, assembly, limits)
    must = f"one number, or one per joint ({len(start)})"
    demand(len(scope) in (1, len(start)), "planner.scope", must, list(scope))
    obstacles = obstacle_table(task.objects).without_ellipses()
    bodies = _bodies(robot, collision, assembly.disabled)
    tool = assembly.tools[0]
    for k, name in enumerate(task.names):
        must = "a name that no body of the robot has"
        demand(name not in bodies.names, f"scenario.obstacles[{k}].name", must, name)
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
        task.security_margin,
        {},
    )
    names = *bodies.names, *task.all_names
    for k, phase in enumerate(task.phases):
        for c, pair in enumerate(phase.contacts):
            for name in (name for name in pair if name not in names):
                field = f"scenario.phases[{k}].contacts[{c}]"
                must = f"names of bodies or obstacles ({', '.join(names)})"
                raise SettingError(field, must, name, nearest(name, names))
    goal = None
    if isinstance(scenario, MoveitTask):
        goal = scenario.goal_configuration(assembly.joint_names)
    if task.check_reach:
        _check_reach(problem, isinstance(scenario, MoveitTask))
    return _fitted(problem, goal)


def _fitted(problem: Problem, goal: FloatArray | None) -> Problem:
    """Return the problem with covers that its start, and a goal of joints, do not bring in contact.

    Where the bodies do not touch there; refuse a start that is infeasible all the same.
    """
    start = problem.start[:, None]
    if goal is None and problem.first_stage.judge(start).feasible[0]:
        return problem
    ends = [problem.start] if goal is None else [problem.start, goal]
    free = [q for q in ends if problem.scene.distances(q).min(initial=np.inf) > 0.0]
    if free:
        table, ignored, _ = problem.surroundings(problem.phases[0], problem.first_situation)
        bodies = problem.bodies.fitted(table, ignored, np.column_stack(free))
        problem = replace(problem, bodies=bodies, memory={})
    judged = problem.first_stage.judge(start)
    if not judged.feasible[0]:
        must = "within the hard limits of upright and keep_parallel"
        if judged.rows[COLLISION, 0] != 0.0:
            distances = problem.scene.distances(problem.start)
            one, two = problem.scene.pair_names(int(np.argmin(distances)))
            depth = f"{max(-float(distances.min()), 0.0):.3g} {problem.task.length_unit}"
            must = f"free of collision ({one} and {two} overlap by {depth})"
        raise SettingError("scenario.q_start", must, list(problem.task.q_start))
    return problem


@functools.lru_cache(maxsize=16)
def _bodies(
    robot: Robot, collision: CollisionModel, disabled: frozenset[frozenset[str]]
) -> BodyModel:
    """Return a robot's bodies; kept, since finding pairs that never touch takes longest."""
    return collision.bind(robot.build()._replace(disabled=disabled))


def _limits(assembly: Assembly) -> FloatArray:
    model = assembly.model
    limits = np.column_stack([model.lowerPositionLimit, model.upperPositionLimit])
    for joint in range(1, model.njoints):
        low, high = limits[model.idx_qs[joint]]
        must = "given for every joint: postures are drawn between them, and margins rated"
        is_given = abs(low) < 1e6 and abs(high) < 1e6 and low < high
        demand(is_given, "robot.joint_limits", must, f"none for joint '{model.names[joint]}'")
    return limits


def _start(task: PostureTask, assembly: Assembly, limits: FloatArray) -> FloatArray:
    nq = assembly.model.nq
    must = f"one value per joint ({nq})"
    demand(len(task.q_start) == nq, "scenario.q_start", must, len(task.q_start))
    # model units per unit of the scenario: degrees, lengths of sliding joints
    units = np.where(assembly.table.slides, 1.0, DEGREE)
    start = np.array(task.q_start) * units
    for k, (value, (least, greatest)) in enumerate(zip(start, limits, strict=True)):
        must = f"within the joint's limits, {least / units[k]:g} to {greatest / units[k]:g}"
        fits = bool(least <= value <= greatest)
        demand(fits, f"scenario.q_start[{k}]", must, task.q_start[k])
    return start


def _weights(task: PostureTask, objective: PostureCost, obstacles: ObstacleTable) -> FloatArray:
    """Return the weights of every phase, (phases, terms)."""
    rows = []
    on_the_way = {"goal_distance", "limit_margin", "collision"}
    of_subgoal = tuple(name for name in objective.chosen if name in on_the_way)
    for k, phase in enumerate(task.all_phases):
        subgoal = k < len(task.subgoals)
        field = f"scenario.phases[{k - len(task.subgoals)}].terms"
        weights = objective.weights(of_subgoal if subgoal else phase.terms, field)
        if not subgoal:
            _check_terms(phase, weights, task, obstacles, field)
        rows.append(weights)
    return np.array(rows)


def _check_terms(
    phase: Phase, weights: FloatArray, task: PostureTask, obstacles: ObstacleTable, field: str
) -> None:
    """Refuse terms without a meaning for the goal of a phase, or that contradict it."""
    goal, where, counts = phase.goal, field.removesuffix("terms") + "goal", weights > 0.0
    must = "terms with goal_distance: every goal is a place"
    demand(counts[0], field, must, list(phase.terms))
    must = f"a pose, since goal_angle rates its orientation (or {field} without it)"
    demand(not counts[ANGLE] or isinstance(goal, PoseGoal | ShiftGoal), where, must, goal.kind)
    must = "a point, since no goal_angle rates its orientation"
    demand(counts[ANGLE] or not isinstance(goal, PoseGoal), where, must, "pose")
    tilt, must = phase.upright_tolerance, "left out in a phase whose terms do not count upright"
    tilt_field = field.removesuffix("terms") + "upright_tolerance"
    demand(tilt is None or counts[UPRIGHT], tilt_field, must, tilt)
    for term in (AXIAL, HEADING):
        must = f"the surface of an object, since {TERMS[term]} rates the way to it "
        must += f"(or {field} without it)"
        demand(not counts[term] or isinstance(goal, SurfaceGoal), where, must, goal.kind)
    if isinstance(goal, SurfaceGoal):
        kind = obstacles.kind[task.names.index(goal.object)]
        shape, of = task.objects[task.names.index(goal.object)].shape, f"{where}.object"
        has_surface = shape not in ("half_space", "hull")
        demand(has_surface, of, "a sphere, box, capsule or cylinder", shape)
        must = "a cylinder or capsule, since axial_approach rates its axis"
        demand(not counts[AXIAL] or kind in (CYLINDER, CAPSULE), of, must, shape)


def _covers(
    task: PostureTask, obstacles: ObstacleTable, collision: CollisionModel
) -> dict[int, tuple[Cover, Cover]]:
    """Return covers of the objects that are grasped, and shapes inside, in their own frames."""
    shapes, found = obstacle_shapes(obstacles), {}
    for k in {task.names.index(phase.object) for phase in task.phases if phase.then == "attach"}:
        item = pin.GeometryObject(task.names[k], 0, 0, pin.SE3.Identity(), shapes[k][0])
        inner = inner_balls(item, task.allowed_penetration or 0.0)
        assert inner is not None  # the task lets nothing else be grasped
        found[k] = collision.cover(item), inner
    return found


def reach(assembly: Assembly, limits: FloatArray) -> tuple[FloatArray, float]:
    """Return a fixed point (3,) and the greatest distance of the tool from it, links stretched out.

    The point lies on the axis of the first joint: at the second joint, if that is on this axis.
    """
    table, tool = assembly.table.chain, assembly.tools[0]
    joint, far = tool.joint - 1, float(np.sqrt(np.sum(tool.position * tool.position)))
    # the greatest slide of each joint; 0 if it turns
    multiplier, offset = table.rule.T
    slides = np.abs(multiplier) * np.abs(limits).max(axis=1)[table.index_q] + np.abs(offset)
    slides = np.where(table.prismatic, slides, 0.0)
    while table.parent[joint] >= 0:
        before = int(table.parent[joint])
        x, y, z = table.translation[joint]
        if table.parent[before] < 0 and not table.prismatic[before] and x == 0.0 and y == 0.0:
            axis = table.rotation[before][[2, 5, 8]]
            return table.translation[before] + z * axis, far + float(slides[joint])
        far += float(np.sqrt(x * x + y * y + z * z)) + float(slides[joint])
        joint = before
    return table.translation[joint], far + float(slides[joint])


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
