"""Tasks that MoveIt wrote, with planners: by configuration alone, and checked at the door."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.condition import Condition
from evoexp.configuration.compose import expand
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.planners.answers import judge_motion
from evoexp.planners.via_point_ga.strings import Strings
from evoexp.records import generations
from moveit_samples import (
    COVERED,
    GOAL,
    JOINTS,
    START,
    body,
    request,
    scene,
    write_problem,
    write_robot,
)

SMALL = ["ga.num_generations=40", "ga.population_size=40", "planner.num_new_trajectories=10"]
POST = body("cylinder", [1.0, 0.03], [0.35, 0.35, 0.5], name="post")  # in the straight way


def condition(folder: Path, *changes: str, world: Any = None, asked: Any = None) -> Condition:
    words = [*write_robot(folder), *write_problem(folder, world or scene(POST), asked)]
    keys = {change.partition("=")[0] for change in changes}
    kept = [word for word in (*words, *COVERED) if word.partition("=")[0] not in keys]
    (experiment,) = expand([*kept, *changes])
    return experiment.conditions[0].condition


def test_the_request_chooses_group_and_values_of_joints_at_rest(tmp_path: Path) -> None:
    found = condition(tmp_path)
    assert found.robot.group == "arm"  # type: ignore[attr-defined]
    assert found.robot.fixed == (("finger", 0.05),)  # type: ignore[attr-defined]
    prepared = found.prepare()
    problem = prepared.problem
    assert [str(name) for name in problem.assembly.model.names[1:]] == list(JOINTS)
    assert np.allclose(DEGREE * problem.start, START, atol=1e-15)
    assert np.allclose(DEGREE * problem.goal, GOAL, atol=1e-15)
    # the start state has the last word
    again = condition(tmp_path, "robot.fixed={finger: 0.01}")
    assert again.id == found.id
    # a log is all that it takes
    assert Condition.from_json(found.to_json()).id == found.id


def test_contradictions_of_robot_and_request_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"robot\.group: must be 'arm'.*was 'hand'"):
        condition(tmp_path, "robot.group=hand")
    asked = request(group_name="")
    asked["start_state"]["joint_state"] = {"name": list(JOINTS), "position": list(START)}
    silent = condition(tmp_path, asked=asked)
    with pytest.raises(SettingError, match="a start or goal for joint 'finger'"):
        silent.prepare()


def test_ends_in_contact_or_beyond_limits_are_named(tmp_path: Path) -> None:
    tall = body("box", [0.2, 0.2, 2.0], [0.0, 0.4, 0.5], name="tower")  # at the goal
    with pytest.raises(SettingError, match=r"q_goal: .*tower overlap by [\d.e-]+ m"):
        condition(tmp_path, world=scene(tall)).prepare()
    asked = request()
    asked["start_state"]["joint_state"]["position"][1] = 2.6
    with pytest.raises(SettingError, match=r"q_start: .*limits of 'lean', -143\.239 to 143\.239"):
        condition(tmp_path, asked=asked).prepare()


def test_pairs_that_may_touch_are_not_judged(tmp_path: Path) -> None:
    names = ["tower", "upper", "lower", "tip", "column"]
    values = [[bool((a == 0) != (b == 0)) for b in range(5)] for a in range(5)]
    matrix = {"entry_names": names, "entry_values": values}
    tall = body("box", [0.2, 0.2, 2.0], [0.0, 0.4, 0.5], name="tower")
    problem = (
        condition(tmp_path, world=scene(tall, allowed_collision_matrix=matrix)).prepare().problem
    )
    judged = {frozenset(problem.scene.pair_names(k)) for k in range(len(problem.scene.pairs))}
    assert not any("tower" in pair and "base" not in pair for pair in judged)
    assert not problem.collision.collides(problem.goal[:, None])[0]
    # the matrix forbids what the SRDF allows: these two are judged again
    assert frozenset(("column", "lower")) in judged


def test_covered_paths_agree_with_exact_bodies_and_keep_limits(tmp_path: Path) -> None:
    found = condition(tmp_path, "budget=paper", *SMALL)
    planner, problem = found.prepare()
    low, high = Strings(planner, problem).settings.limits.T
    assert low.max() < high.min()
    *_, last = generations(planner.evolve(problem, found.rng(0)))
    assert last.solved
    motion = planner.motion(problem, last.best)
    assert judge_motion(planner, problem, motion).certified
    assert not planner.departures(problem, last.best)
    # free by covers is free by coal
    rng, model = np.random.default_rng(0), problem.assembly.model
    q = rng.uniform(-2.5, 2.5, (3, 300))
    free = ~problem.collision.collides(q / DEGREE)
    data, placed = model.createData(), problem.scene.geometry.createData()
    exact = [
        not pin.computeCollisions(model, data, problem.scene.geometry, placed, q[:, k], True)
        for k in range(300)
    ]
    assert 0 < np.count_nonzero(free) < 300
    assert not np.any(free & ~np.array(exact))


def test_strings_stay_within_limits_whatever_is_drawn(tmp_path: Path) -> None:
    asked = request()
    asked["start_state"]["joint_state"]["position"][1] = 2.499  # the whole way near a limit
    asked["goal_constraints"][0]["joint_constraints"][1]["position"] = 2.499
    found = condition(tmp_path, asked=asked, world=scene())
    planner, problem = found.prepare()
    drawn = planner.sample(problem, np.random.default_rng(1), 50)
    assert np.all(np.abs(DEGREE * drawn) <= 2.5 + 1e-12)
    assert np.any(np.isclose(np.abs(DEGREE * drawn), 2.5))  # some would have left them


def test_a_folder_is_a_condition_per_problem(tmp_path: Path) -> None:
    folder = tmp_path / "posts"
    folder.mkdir()
    for number in ("0001", "0002"):
        world = scene(body("sphere", [0.1], [float(number), 0, 0]))
        write_problem(folder, world, number=number)
    words = [*write_robot(tmp_path), "scenario=moveit", f"scenario.folder={folder}", *COVERED]
    (experiment,) = expand(words)
    assert [label for label, _ in experiment.conditions] == ["posts 0001", "posts 0002"]
    assert len({each.condition.id for each in experiment.conditions}) == 2
    (above,) = expand([w.replace(str(folder), str(tmp_path)) for w in words])
    assert [c.condition.id for c in above.conditions] == [
        c.condition.id for c in experiment.conditions
    ]
    with pytest.raises(SettingError, match=r"scenario\.scene: must be left out"):
        expand([*words, "scenario.scene=x.yaml"])
    (folder / "request0002.yaml").unlink()
    with pytest.raises(SettingError, match=r"request0002\.yaml beside every scene"):
        expand(words)
    with pytest.raises(SettingError, match=r"scenario\.folder: must be a folder of problems"):
        expand([*words[: -len(COVERED) - 1], "scenario.folder=/nowhere", *COVERED])


def test_a_request_with_a_slide_counts_metres(tmp_path: Path) -> None:
    asked = request(group_name="")
    asked["goal_constraints"][0]["joint_constraints"].append(
        {"joint_name": "finger", "position": 0.08}
    )
    found = condition(tmp_path, "robot.joints=[turn,lean,bend,finger]", asked=asked)
    planner, problem = found.prepare()
    motion = planner.motion(
        problem, planner.solution(problem, planner.sample(problem, found.rng(0), 1), 0)
    )
    assert np.allclose(motion.q[[0, -1], 3], [0.05, 0.08], atol=1e-15)


REACHING = ["planner=posture_es", "ga=corsepius", "objective=corsepius_pose"]
SPHERES = [*REACHING, "collision=corsepius_spheres", "budget=paper"]


def test_posture_es_reaches_the_pose_of_a_goal_of_joints(tmp_path: Path) -> None:
    found = condition(tmp_path, *SPHERES, world=scene())
    planner, problem = found.prepare()
    (phase,) = problem.task.phases
    model, data = problem.assembly.model, problem.assembly.model.createData()
    tool = problem.assembly.tools[0]
    pin.forwardKinematics(model, data, np.array(GOAL))
    pose = data.oMi[tool.joint] * pin.SE3(tool.rotation, tool.position)
    assert np.allclose(phase.goal.point, pose.translation, atol=1e-12)
    angles = DEGREE * np.array(phase.goal.rotation)
    assert np.allclose(pin.rpy.rpyToMatrix(angles), pose.rotation, atol=1e-9)
    *_, last = generations(planner.evolve(problem, found.rng(0)))
    assert last.solved
    assert judge_motion(planner, problem, planner.motion(problem, last.best)).certified


def test_posture_es_takes_goals_of_links_and_via_points_say_that_they_do_not(
    tmp_path: Path,
) -> None:
    region = {"primitives": [{"type": "sphere", "dimensions": [0.02]}]}
    region["primitive_poses"] = [{"position": [0.3, 0.4, 0.6]}]  # type: ignore[dict-item]
    goal = {"position_constraints": [{"link_name": "tip", "constraint_region": region}]}
    asked = request(goal_constraints=[goal])
    found = condition(tmp_path, *SPHERES, world=scene(), asked=asked)
    assert found.robot.tool_frame == "tip"  # type: ignore[attr-defined]
    planner, problem = found.prepare()
    *_, last = generations(planner.evolve(problem, found.rng(0)))
    assert last.solved
    with pytest.raises(SettingError, match=r"robot\.tool_frame: must be 'tip'"):
        condition(tmp_path, *SPHERES, "robot.tool_frame=lower", world=scene(), asked=asked)
    with pytest.raises(SettingError, match="a goal of joints for this planner .*pose of 'tip'"):
        condition(tmp_path, world=scene(), asked=asked).prepare()
