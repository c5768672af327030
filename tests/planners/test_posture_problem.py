"""What a posture search refuses, each in one line that names the field."""

import re

import numpy as np
import pytest
from posture_samples import condition, prepared, random_postures

from composed import composed
from evoexp.configuration import compose
from evoexp.errors import EvoexpError
from evoexp.planners.posture_es.problem import reach
from evoexp.records import generations
from evoexp.robots.poses import frame_poses

BALL, PICK = "experiment=corsepius_ball", "experiment=corsepius_pick_and_place"
POINT = "[{name: a, goal: {kind: point, point: [0.4, 0.2, 0.7]}}]"


def phases(text: str) -> str:
    return f"scenario.phases={text}"


@pytest.mark.examples(6)
@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["planner.scope=0"], "planner.scope: must be greater than 0.0, was 0"),
        (
            ["planner.scope=[0.1,0.1]"],
            "planner.scope: must be one number, or one per joint (6), was [0.1, 0.1]",
        ),
        (["planner.scope=[0.1,0.1,0.1,0.1,0.1,0]"], "planner.scope"),
        (["scenario.q_start=[0,0]"], "scenario.q_start: must be one value per joint (6), was 2"),
        (
            ["scenario.q_start=[0,90,0,0,0,0]"],
            "scenario.q_start[1]: must be within the joint's limits, -200 to 20, was 90.0",
        ),
        (
            ["scenario.obstacles.0.center=[0.3,0.1,0.88]"],
            "scenario.q_start: must be free of collision (finger_right and ball overlap by 0.019",
        ),
        (
            [phases("[{name: a, goal: {kind: point, point: [2, 0, 0.6]}}]")],
            "scenario.phases[0].goal.point: must be within reach, 0.8936 m from (0, 0, 0.6) "
            "(check_reach=false",
        ),
        (
            ["scenario.obstacles.0.center=[3,0,0]"],
            "scenario.phases[0].goal.object: must be within reach, 0.8936 m from",
        ),
        (["scenario.subgoals=[[0,0,3]]"], "scenario.subgoals[0]: must be within reach"),
        (
            [phases("[{name: a, goal: {kind: surface, object: bal}}]")],
            "scenario.phases[0].goal.object: must be the name of an obstacle (ball), was 'bal'; "
            "did you mean 'ball'?",
        ),
        (
            [phases("[{name: a, goal: {kind: pose, point: [0.4,0.2,0.7], rotation: [0,0,0]}}]")],
            "scenario.phases[0].goal: must be a point, since no goal_angle rates its "
            "orientation, was 'pose'",
        ),
        (
            [phases("[{name: a, goal: {kind: places}}]")],
            "scenario.phases[0].goal: must be one of 'point', 'pose', 'surf",
        ),
        (
            ["objective=corsepius_pose"],
            "scenario.phases[0].goal: must be a pose, since goal_angle rates its orientation",
        ),
        (
            ["objective=corsepius_grasp"],
            "scenario.phases[0].goal.object: must be a cylinder or capsule, since axial_approach "
            "rates its axis",
        ),
        (
            ["objective=corsepius_grasp", phases(POINT)],
            "scenario.phases[0].goal: must be the surface of an object, since axial_approach "
            "rates the way to it",
        ),
        (
            [phases("[{name: a, goal: {kind: point, point: [0.4,0.2,0.7]}, terms: [upright]}]")],
            "scenario.phases[0].terms[0]: must be a term that the objective gives a weight",
        ),
        (
            [phases("[{name: a, goal: {kind: point, point: [0.4,0.2,0.7]}, terms: [uprigth]}]")],
            "scenario.phases[0].terms[0]: must be a cost term",
        ),
        (
            [
                phases(
                    "[{name: a, goal: {kind: point, point: [0.4,0.2,0.7]}, contacts: [[hand, "
                    "bal]]}]"
                ),
                "scenario.allowed_penetration=0.001",
            ],
            "scenario.phases[0].contacts[0]: must be names of bodies or obstacles (column, "
            "shoulder",
        ),
        (
            [phases("[{name: a, goal: {kind: point, point: [0.4,0.2,0.7]}, then: detach}]")],
            "scenario.phases[0].then: must be attach in a phase before, was 'detach'",
        ),
        (
            [phases("[{name: a, goal: {kind: point, point: [0.4,0.2,0.7]}, then: attach}]")],
            "scenario.phases[0].object: must be given with then: attach, and only then, was None",
        ),
        (["+scenario.up=[0,0,0]"], "scenario.up: must be a direction, not (0, 0, 0)"),
        (
            ["+objective.goal_anglee.weight=1"],
            "objective.goal_anglee: unknown setting; did you mean 'goal_angle'?",
        ),
        (
            ["objective.goal_distance.weight=0"],
            "objective.goal_distance.weight: must be greater than 0.0, was 0",
        ),
        (
            ["+objective.goal_distance.unit=rad"],
            "objective.goal_distance.unit: must be one of 'length', was 'rad'",
        ),
        (
            ["~objective.goal_distance"],
            "objective.goal_distance: must be given: every goal is a place, was None",
        ),
        (
            ["ga.num_parents=101"],
            "ga.num_parents: must be at most num_offspring (100) with comma selection, was 101",
        ),
        (
            ["robot.joints.0.limits=[10,-10]"],
            "robot.joints[0].limits: must be [least, greatest] with least < greatest",
        ),
        (["robot=two_planar_2r"], "robot: must be one arm, was '2 arms'"),
        (
            ["scenario=lavoie_7dof"],
            "scenario: must be one that posture_es takes (PostureTask or MoveitTask), was "
            "'pick_and_place'",
        ),
        (["collision=rana_planar"], "collision"),
    ],
)
def test_refusals(overrides: list[str], message: str) -> None:
    with pytest.raises(EvoexpError, match=re.escape(message)) as found:
        composed(BALL, *overrides).prepare()
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "hand",
            "scenario.obstacles[1].name: must be a name that no body of the robot has, was 'hand'",
        ),
        ("ground", "obstacles[1].name: must be a name that no other obstacle has, was 'ground'"),
    ],
)
def test_names_are_told_apart(name: str, message: str) -> None:
    overrides = ["experiment=corsepius_bottle", f"scenario.obstacles.1.name={name}"]
    with pytest.raises(EvoexpError, match=re.escape(message)):
        composed(*overrides).prepare()


def test_one_thing_is_held_at_a_time() -> None:
    text = (
        "[{name: a, goal: {kind: surface, object: bottle}, then: attach, object: bottle},"
        "{name: b, goal: {kind: surface, object: table}, then: attach, object: table}]"
    )
    with pytest.raises(
        EvoexpError,
        match=re.escape("scenario.phases[1].then: must be detach before anything else is"),
    ):
        compose.expand([PICK, phases(text)])


def test_goals_out_of_reach_are_searched_on_request() -> None:
    far = phases("[{name: a, goal: {kind: point, point: [2, 0, 0.6]}}]")
    planner, problem = prepared(
        "corsepius_ball", far, "scenario.check_reach=false", "ga.num_generations=30"
    )
    last = list(generations(planner.evolve(problem, condition("corsepius_ball").rng(0))))[-1]
    assert not last.solved
    assert last.terms["goal_distance"] > 1.0


@pytest.mark.examples(1)
@pytest.mark.parametrize("name", ["corsepius_ball", "corsepius_shelf", "corsepius_gate_wide"])
def test_nothing_is_farther_than_the_reach(name: str) -> None:
    _, problem = prepared(name)
    center, far = reach(problem.assembly, problem.limits)
    q = random_postures(problem, 20000)
    poses = np.empty((12, q.shape[1]))
    frame_poses(problem.assembly.table.chain, *problem.tool, q, poses)
    away = np.linalg.norm(poses[9:].T - center, axis=1)
    assert away.max() <= far + 1e-12
    assert away.max() > 0.5 * far
