"""Robots out of a URDF: their identity, their files, their frames, their spheres, refusals."""

import json
import shutil
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.attachments import PREFIX, keep
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log
from evoexp.collision.covers.body_covers import given_cover
from evoexp.condition import Condition
from evoexp.errors import EvoexpError
from evoexp.store.log_reader import read_log
from robots.robot_samples import TWO, UR5_LIKE, placements, task, tool_pose

SRDF = f"robot.srdf={UR5_LIKE / 'ur5_like.srdf'}"


def changed(tmp_path: Path, before: str, after: str) -> Path:
    """Copy the robot's files, and replace a part of the URDF, which occurs once or more."""
    file = shutil.copytree(UR5_LIKE, tmp_path / "ur5_like") / "ur5_like.urdf"
    assert before in file.read_text()
    file.write_text(file.read_text().replace(before, after))
    return file


def test_identity_is_the_content_wherever_it_lies(tmp_path: Path) -> None:
    moved = shutil.copytree(UR5_LIKE, tmp_path / "ur5_like") / "renamed.urdf"
    (moved.parent / "ur5_like.urdf").rename(moved)
    same = task(path=moved)
    assert same.id == task().id == Condition.from_json(same.to_json()).id
    config = json.loads(same.to_json())["robot"]
    assert set(config) == {"_target_", "revision", "urdf", "meshes", "pairs"}, "hashes only"
    assert config["meshes"][0]["name"] == "package://ur5_like/hand.obj"
    mesh = moved.parent / "hand.obj"
    mesh.write_text(mesh.read_text().replace("0.04", "0.05"))
    other = task(path=moved)
    assert other.id != same.id
    assert str(tmp_path) not in other.to_json().decode()


def test_files_travel_with_the_log(tmp_path: Path) -> None:
    condition = task(SRDF)
    content = run_replicate(condition, 0).content
    attachments = read_log(content).attachments
    contents = {data for name, data in attachments.items() if name.startswith(PREFIX)}
    files = {path.read_bytes() for path in UR5_LIKE.iterdir()}
    assert contents == {condition.robot.pairs.content, *files}
    log = tmp_path / "0000.mcap"
    log.write_bytes(content)
    assert reproduce_log(log).matches
    assert read_log(content).summary.solved


def test_two_of_them_through_strings_of_via_points() -> None:
    condition = task("ga.num_generations=60", base=TWO)
    summary = run_replicate(condition, 0).summary
    assert summary.solved
    assert summary.certified is not None
    assembly = condition.robot.build()
    assert assembly.num_arms == 2
    names = [item.name for item in assembly.geometry.geometryObjects]
    assert names[0] == "arm_1_base_link" and names[7] == "arm_2_base_link"


def test_base_and_tool_frames_are_chosen_by_name() -> None:
    tool, place = "robot.tool_frame=wrist_3_link", "robot.base_position=[1,0,0]"
    moved = task(place, "robot.base_rotation=[0,0,90]", tool).robot.build()
    plain = task(tool).robot.build()
    x, y, z = tool_pose(plain, np.full(6, 0.3))[9:]
    assert tool_pose(moved, np.full(6, 0.3))[9:] == pytest.approx([1.0 - y, x, z])


def test_the_base_frame_stands_at_the_base_pose(tmp_path: Path) -> None:
    """The file's root is turned and moved away from the base: the arm stands where it stood."""
    root = (
        '<link name="root"/><joint name="mount" type="fixed"><parent link="root"/>'
        '<child link="base_link"/><origin xyz="0.3 -0.2 0.5" rpy="0.4 -0.7 1.1"/></joint></robot>'
    )
    placed = ("robot.base_position=[1,2,3]", "robot.base_rotation=[10,20,30]")
    mounted = changed(tmp_path, "</robot>", root)
    one = task(*placed, "robot.base_frame=base_link", path=mounted).robot.build()
    two, q = task(*placed).robot.build(), np.full(6, 0.3)
    assert tool_pose(one, q) == pytest.approx(tool_pose(two, q), abs=1e-12)
    for place, expected in zip(placements(one, q)[1], placements(two, q)[1], strict=True):
        assert place.isApprox(expected, 1e-12)


NO_MESH = "robot.path: must be a file whose meshes exist, was \"a missing mesh 'package://ur5_l"
KIND = "fixed, floating or planar, was \"joint 'elbow_joint' of type spherical\""
LIMIT = "robot.joint_limits: must be given for every joint: postures are drawn between them, and"
RULE = "robot.path: must be a URDF whose joints follow joints that exist, was \"'"


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("hand.obj", "hnad.obj", NO_MESH),
        ('"elbow_joint" type="revolute"', '"elbow_joint" type="spherical"', KIND),
        ('<limit lower="-2.8" upper="2.8"', '<limit lower="1" upper="1"', LIMIT),
        ('<limit lower="-2.8"', '<mimic joint="elbow"/><limit lower="-2.8"', RULE),
    ],
)
def test_changed_files_are_refused(tmp_path: Path, before: str, after: str, message: str) -> None:
    with pytest.raises(EvoexpError) as refusal:
        task(path=changed(tmp_path, before, after)).prepare()
    assert message in str(refusal.value) and "\n" not in str(refusal.value)


def spheres(tmp_path: Path, **links: Any) -> Path:
    """Write balls (x, y, z, radius) of links as a URDF."""
    ball = (
        '<collision><origin xyz="{} {} {}"/><geometry><sphere radius="{}"/></geometry></collision>'
    )
    text = "".join(
        f'<link name="{name}">{"".join(ball.format(*each) for each in balls)}</link>'
        for name, balls in links.items()
    )
    file = tmp_path / "spheres.urdf"
    file.write_text(f'<robot name="spheres">{text}</robot>')
    return file


def test_spheres_of_others_stand_where_their_file_has_them(tmp_path: Path) -> None:
    balls = [(0.01, 0.02, 0.03, 0.05), (-0.01, 0.0, 0.1, 0.04)]
    file = spheres(tmp_path, forearm_link=balls, wrist_3_link=[(0.0, 0.0, 0.0, 0.03)])
    condition = task(f"robot.spheres={file}")
    assert condition.files()[PREFIX + keep(file.read_bytes())] == file.read_bytes()
    assembly, (_, problem) = condition.robot.build(), condition.prepare()
    items = {item.name: k for k, item in enumerate(assembly.geometry.geometryObjects)}
    cover, other = (
        problem.bodies.covers[items[name]] for name in ("forearm_link", "upper_arm_link")
    )
    assert np.array_equal(np.sort(cover.radius), [0.04, 0.05])
    own, q = pin.buildModelFromUrdf(str(UR5_LIKE / "ur5_like.urdf")), np.linspace(-2.0, 2.0, 6)
    data = own.createData()
    pin.framesForwardKinematics(own, data, q)
    link = data.oMf[own.getFrameId("forearm_link")]
    joint = assembly.geometry.geometryObjects[items["forearm_link"]].parentJoint
    frame = placements(assembly, q)[0][joint]
    expected = sorted(link.act(np.array(ball[:3])).tolist() for ball in balls)
    assert np.allclose(sorted(frame.act(center).tolist() for center in cover.start), expected)
    # other links are covered as asked
    assert other.uncovered == 0.0 < cover.uncovered
    notes = " | ".join(condition.planner.notes(problem))
    assert "given spheres do not contain all bodies; uncovered [m]: " in notes
    assert "forearm_link 0." in notes


BOX, CAPSULE = coal.Box(0.2, 0.2, 0.2), coal.Capsule(0.05, 0.2)


@pytest.mark.parametrize(
    ("shape", "balls", "uncovered", "inflation"),
    [
        (BOX, [(0.0, 0.0, 0.0, 0.1)], 0.1 * np.sqrt(3.0) - 0.1, 0.0),  # a corner
        (BOX, [(0.0, 0.0, 0.0, 0.18), (0.15, 0.0, 0.0, 0.01)], 0.0, 0.08),
        (CAPSULE, [(0.0, 0.02, 0.3, 0.05)], np.hypot(0.02, 0.4), np.hypot(0.02, 0.2)),
    ],
)
def test_how_far_a_body_stands_out(shape: Any, balls: Any, uncovered: Any, inflation: Any) -> None:
    item = pin.GeometryObject("body", 0, 0, pin.SE3.Identity(), shape)
    cover = given_cover(item, np.array(balls))
    assert cover.uncovered == pytest.approx(uncovered)
    assert cover.inflation == pytest.approx(inflation, abs=1e-12)


@pytest.mark.parametrize(
    ("links", "message"),
    [
        ({"forearm": [(0, 0, 0, 0.1)]}, "belong to links .* 'forearm'.*forearm_link"),
        ({"forearm_link": []}, "must be a URDF of spheres, was 'one without'"),
    ],
)
def test_spheres_that_do_not_fit_are_refused(tmp_path: Path, links: Any, message: str) -> None:
    with pytest.raises(EvoexpError, match=f"robot.spheres: .*{message}"):
        task(f"robot.spheres={spheres(tmp_path, **links)}").prepare()


def test_one_of_several_arms_has_no_spheres_of_others(tmp_path: Path) -> None:
    file = spheres(tmp_path, forearm_link=[(0.0, 0.0, 0.0, 0.1)])
    with pytest.raises(EvoexpError, match="spheres"):
        task(f"+robot.arms.0.spheres={file}", base=TWO).prepare()
