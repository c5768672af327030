"""Goals of posture searches, scenes without obstacles, and what is refused in one line."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.errors import EvoexpError
from evoexp.objectives.posture_cost import AXIAL, COLLISION, DISTANCE, HEADING
from evoexp.planners.posture_es.kernels import COST
from evoexp.planners.posture_es.problem import reach
from evoexp.records import FloatArray
from planners.runs import ran

BALL, BOTTLE, WALL = "corsepius_ball", "corsepius_bottle", "corsepius_wall"
PICK, WIDE = "corsepius_pick_and_place", "corsepius_gate_wide"
POINT = "kind: point, point: [0.4,0.2,0.7]"
FAR = "kind: point, point: [2,0,0.6]"


def phases(goal: str, rest: str = "") -> str:
    """Return a task of one phase."""
    return f"scenario.phases=[{{name: a, goal: {{{goal}}}{rest}}}]"


def prepared(name: str, *overrides: str) -> Any:
    return composed(f"experiment={name}", *overrides).prepare().problem


def random_postures(problem: Any, count: int) -> FloatArray:
    """Return postures within the limits, (nq, count)."""
    low, high = problem.limits.T
    return np.random.default_rng(0).uniform(low, high, (count, len(low))).T.copy()


def judged(problem: Any, q: FloatArray) -> FloatArray:
    """Return the terms of postures in the first phase."""
    rows: FloatArray = problem.begin(0, problem.start, problem.first_situation).judge(q).rows
    return rows


def tools(problem: Any, q: FloatArray) -> FloatArray:
    """Return the tool's places by Pinocchio, (postures, 3)."""
    model, tool = problem.assembly.model, problem.assembly.tools[0]
    data, places = model.createData(), []
    for one in q.T:
        pin.forwardKinematics(model, data, one.copy())
        places.append(data.oMi[tool.joint].act(np.asarray(tool.position)))
    return np.array(places)


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_a_ball_around_a_point_is_met_at_its_surface(radius: float) -> None:
    problem = prepared(WIDE, f"scenario.phases.0.goal.radius={radius}")
    q = random_postures(problem, 300)
    away = np.linalg.norm(tools(problem, q) - [1.35, 0.15, 0.8], axis=1)
    assert judged(problem, q)[DISTANCE] == pytest.approx(away - radius, abs=1e-12)


def test_a_place_is_a_disc() -> None:
    problem = prepared(BALL, phases("kind: place, point: [0.4, 0.2, 0.7], radius: 0.06"))
    q = random_postures(problem, 300)
    away = tools(problem, q) - [0.4, 0.2, 0.7]
    beside = np.maximum(np.hypot(away[:, 0], away[:, 1]) - 0.06, 0.0)
    expected = np.hypot(beside, away[:, 2])
    assert np.abs(judged(problem, q)[DISTANCE]) == pytest.approx(expected, abs=1e-9)


def test_of_two_grasping_angles_the_larger_one_alone_may_count() -> None:
    both, larger = prepared(BOTTLE), prepared(BOTTLE, "objective.grasp_angles=larger")
    q = random_postures(both, 200)
    one, two = judged(both, q), judged(larger, q)
    free = one[COLLISION] == 0.0
    assert one[:COST] == pytest.approx(two[:COST])
    less = 0.15 * np.minimum(one[AXIAL], one[HEADING])
    assert (one[COST] - two[COST])[free] == pytest.approx(less[free])


@pytest.mark.parametrize(
    ("name", "objects"),
    [(BOTTLE, ("bottle",)), (WIDE, ()), (WALL, ()), (PICK, ("bottle",)), (BALL, ("ball",))],
)
def test_an_empty_scene_keeps_only_objects_that_a_goal_or_a_grasp_names(
    name: str, objects: tuple[str, ...]
) -> None:
    full, empty = prepared(name), prepared(name, "scenario.empty_scene=true")
    assert empty.task.names == objects
    assert len(empty.obstacles.kind) == len(objects)
    one, two = (p.begin(0, p.start, p.first_situation) for p in (full, empty))
    assert set(empty.scene_of(two).names) == {*empty.bodies.names, *objects}
    assert all(map(np.array_equal, one.judging.aim, two.judging.aim))


def test_an_empty_scene_is_another_condition_with_the_same_random_numbers() -> None:
    first, second = (
        composed(f"experiment={BOTTLE}", *more) for more in ((), ("scenario.empty_scene=true",))
    )
    assert first.rng(3).random() == second.rng(3).random()
    assert first.id != second.id


def test_goals_out_of_reach_are_searched_on_request() -> None:
    words = phases(FAR), "scenario.check_reach=false", "ga.num_generations=30"
    last = ran(composed(f"experiment={BALL}", *words)).last
    assert not last.solved
    assert last.terms["goal_distance"] > 1.0


@pytest.mark.parametrize("name", [BALL, "corsepius_shelf", WIDE])
def test_nothing_is_farther_than_the_reach(name: str) -> None:
    problem = prepared(name)
    center, far = reach(problem.assembly, problem.limits)
    away = np.linalg.norm(tools(problem, random_postures(problem, 5000)) - center, axis=1)
    assert 0.5 * far < away.max() <= far + 1e-12


GOAL, PHASE = "scenario.phases[0].goal", "scenario.phases[0]"
GRASP = "objective=corsepius_grasp"
HELD = ", then: attach, object: bottle}, {name: b, goal: {kind: surface, object: table}"
HELD = phases("kind: surface, object: bottle", f"{HELD}, then: attach, object: table")
REFUSALS = [
    (BALL, ["planner.scope=0"], "planner.scope: must be greater than 0.0, was 0"),
    (BALL, ["planner.scope=[0.1,0.1]"], "planner.scope: must be one number, or one per joint (6)"),
    (BALL, ["planner.scope=[0.1,0.1,0.1,0.1,0.1,0]"], "planner.scope"),
    (BALL, ["scenario.q_start=[0,0]"], "scenario.q_start: must be one value per joint (6), was 2"),
    (BALL, ["scenario.q_start=[0,90,0,0,0,0]"], "scenario.q_start[1]: must be within the joint's"),
    (
        BALL,
        ["scenario.obstacles.0.center=[0.3,0.1,0.88]"],
        "(finger_right and ball overlap by 0.019",
    ),
    (BALL, [phases(FAR)], f"{GOAL}.point: must be within reach, 0.8936 m from (0, 0, 0.6)"),
    (BALL, ["scenario.obstacles.0.center=[3,0,0]"], f"{GOAL}.object: must be within reach, 0.8936"),
    (BALL, ["scenario.subgoals=[[0,0,3]]"], "scenario.subgoals[0]: must be within reach"),
    (BALL, [phases("kind: surface, object: bal")], f"{GOAL}.object: must be the name of an"),
    (BALL, [phases("kind: surface, object: bal")], "(ball), was 'bal'; did you mean 'ball'?"),
    (
        BALL,
        [phases("kind: pose, point: [0.4,0.2,0.7], rotation: [0,0,0]")],
        "must be a point, since",
    ),
    (BALL, [phases("kind: places")], f"{GOAL}: must be one of 'point', 'pose', 'surf"),
    (BALL, ["objective=corsepius_pose"], f"{GOAL}: must be a pose, since goal_angle rates its"),
    (BALL, [GRASP], f"{GOAL}.object: must be a cylinder or capsule, since axial_approach rates"),
    (BALL, [GRASP, phases(POINT)], f"{GOAL}: must be the surface of an object, since"),
    (BALL, [phases(POINT, ", terms: [upright]")], f"{PHASE}.terms[0]: must be a term that the"),
    (BALL, [phases(POINT, ", terms: [uprigth]")], f"{PHASE}.terms[0]: must be a cost term"),
    (
        BALL,
        [phases(POINT, ", contacts: [[hand, bal]]"), "scenario.allowed_penetration=0.001"],
        f"{PHASE}.contacts[0]: must be names of bodies or obstacles (column, shoulder",
    ),
    (BALL, [phases(POINT, ", then: detach")], f"{PHASE}.then: must be attach in a phase before"),
    (BALL, [phases(POINT, ", then: attach")], f"{PHASE}.object: must be given with then: attach,"),
    (BALL, ["+scenario.up=[0,0,0]"], "scenario.up: must be a direction, not (0, 0, 0)"),
    (BALL, ["+objective.goal_anglee.weight=1"], "unknown setting; did you mean 'goal_angle'?"),
    (BALL, ["objective.goal_distance.weight=0"], "goal_distance.weight: must be greater than 0.0"),
    (BALL, ["+objective.goal_distance.unit=rad"], "unit: must be one of 'length', was 'rad'"),
    (BALL, ["~objective.goal_distance"], "objective.goal_distance: must be given: every goal is a"),
    (BALL, ["ga.num_parents=101"], "ga.num_parents: must be at most num_offspring (100) with"),
    (BALL, ["robot.joints.0.limits=[10,-10]"], "robot.joints[0].limits: must be [least, greatest]"),
    (BALL, ["robot=two_planar_2r"], "robot: must be one arm, was '2 arms'"),
    (BALL, ["scenario=lavoie_7dof"], "scenario: must be one that posture_es takes (PostureTask or"),
    (BALL, ["collision=rana_planar"], "collision"),
    (BOTTLE, ["scenario.obstacles.1.name=hand"], "must be a name that no body of the robot has,"),
    (BOTTLE, ["scenario.obstacles.1.name=ground"], "must be a name that no other obstacle has,"),
    (PICK, [HELD], "scenario.phases[1].then: must be detach before anything else is"),
    (PICK, ["~scenario.allowed_penetration"], "must be given: phases[1].contacts allows contacts"),
    (PICK, ["scenario.allowed_penetration=0"], "allowed_penetration: must be greater than 0.0,"),
    (
        PICK,
        ["scenario.phases.4.scope_share=2"],
        "phases[4].scope_share: must be at most 1.0, was 2",
    ),
    (WALL, ["+scenario.phases.0.upright_tolerance=1"], f"{PHASE}.upright_tolerance: must be left"),
]


@pytest.mark.examples(8)
@pytest.mark.parametrize(("name", "overrides", "message"), REFUSALS)
def test_what_cannot_be_is_refused_in_one_line(
    name: str, overrides: list[str], message: str
) -> None:
    with pytest.raises(EvoexpError) as refusal:
        prepared(name, *overrides)
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)
