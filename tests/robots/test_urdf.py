"""Robots out of a URDF: against Pinocchio's own reading, through two planners.

And what is refused.
"""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.attachments import PREFIX
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import EvoexpError
from evoexp.robots.poses import frame_pose, local_pose
from evoexp.store.log_reader import read_log

DATA = Path(__file__).parent / "data" / "ur5_like"
URDF = DATA / "ur5_like.urdf"
REACH = (
    "robot=urdf", "scenario=urdf_reach", "planner=posture_es", "ga=corsepius",
    "objective=corsepius_reach",
    "collision=corsepius_spheres",
)  # fmt: skip
TWO = (
    "robot=two_urdf", "scenario=urdf_two_arms", "planner=rana_puma", "ga=rana_puma",
    "objective=rana_puma",
    "collision=urdf_two_arms",
)  # fmt: skip


def condition(*overrides: str, base: tuple[str, ...] = REACH, path: Path = URDF) -> Condition:
    found: Condition = (
        compose.expand([*base, f"robot.path={path}", *overrides])[0].conditions[0].condition
    )
    return found


def test_tool_and_bodies_are_where_pinocchio_has_them() -> None:
    assembly = condition().robot.build()  # type: ignore[attr-defined]
    own = pin.buildModelFromUrdf(str(URDF))
    geometry = pin.buildGeomFromUrdf(
        own, str(URDF), pin.GeometryType.COLLISION, package_dirs=[str(DATA.parent)]
    )
    data, placed = own.createData(), geometry.createData()
    again, moved = assembly.model.createData(), assembly.geometry.createData()
    tool = assembly.tools[0]
    local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
    for seed in range(20):
        q = np.random.default_rng(seed).uniform(-2.5, 2.5, 6)
        pin.framesForwardKinematics(own, data, q)
        expected = data.oMf[own.getFrameId("tool0")]
        pose = frame_pose(assembly.table, tool.joint - 1, local, q)
        assert pose[9:] == pytest.approx(expected.translation, abs=1e-12)
        assert pose[:9] == pytest.approx(expected.rotation.ravel(), abs=1e-12)
        pin.updateGeometryPlacements(own, data, geometry, placed, q)
        pin.updateGeometryPlacements(assembly.model, again, assembly.geometry, moved, q)
        for one, two in zip(placed.oMg, moved.oMg, strict=True):
            assert one.isApprox(two, 1e-12)
    assert [item.name for item in assembly.geometry.geometryObjects][-1] == "wrist_3_link"
    assert assembly.geometry.geometryObjects[6].geometry.num_vertices == 8


def test_identity_is_the_content_wherever_it_lies(tmp_path: Path) -> None:
    shutil.copytree(DATA, tmp_path / "ur5_like")
    moved = tmp_path / "ur5_like" / "renamed.urdf"
    (tmp_path / "ur5_like" / "ur5_like.urdf").rename(moved)
    assert condition(path=moved).id == condition().id
    (tmp_path / "ur5_like" / "hand.obj").write_text(
        (DATA / "hand.obj").read_text().replace("0.04", "0.05")
    )
    assert condition(path=moved).id != condition().id
    assert str(tmp_path) not in condition(path=moved).to_json().decode()


def test_files_travel_with_the_log(tmp_path: Path) -> None:
    found = condition(f"robot.srdf={DATA / 'ur5_like.srdf'}")
    content = run_replicate(found, 0).content
    attachments = read_log(content).attachments
    contents = {data for name, data in attachments.items() if name.startswith(PREFIX)}
    pairs = found.robot.pairs.content  # type: ignore[attr-defined]
    assert contents == {pairs, *(path.read_bytes() for path in DATA.iterdir())}
    log = tmp_path / "0000.mcap"
    log.write_bytes(content)
    assert reproduce_log(log).matches
    assert read_log(content).summary.solved


def test_pairs_that_an_srdf_names_are_not_judged() -> None:
    assembly = condition(f"robot.srdf={DATA / 'ur5_like.srdf'}").robot.build()  # type: ignore[attr-defined]
    assert frozenset(("shoulder_link", "forearm_link")) in assembly.disabled
    _, problem = condition(f"robot.srdf={DATA / 'ur5_like.srdf'}").prepare()
    names = problem.bodies.names
    tested = {frozenset((names[a], names[b])) for a, b in problem.bodies.pairs}
    assert not tested & assembly.disabled


def test_two_of_them_through_strings_of_via_points() -> None:
    found = condition("ga.num_generations=60", base=TWO)
    summary = run_replicate(found, 0).summary
    assert summary.solved
    assert summary.certified is not None
    assembly = found.robot.build()  # type: ignore[attr-defined]
    assert assembly.num_arms == 2
    names = [item.name for item in assembly.geometry.geometryObjects]
    assert names[0] == "arm_1_base_link" and names[7] == "arm_2_base_link"


def test_base_and_tool_frames_are_chosen_by_name() -> None:
    moved = condition(
        "robot.base_position=[1,0,0]",
        "robot.base_rotation=[0,0,90]",
        "robot.tool_frame=wrist_3_link",
    )
    assembly = moved.robot.build()  # type: ignore[attr-defined]
    plain = condition("robot.tool_frame=wrist_3_link").robot.build()  # type: ignore[attr-defined]
    poses = []
    for one in (assembly, plain):
        tool = one.tools[0]
        local = local_pose(one.table, tool.joint, tool.rotation, tool.position)
        poses.append(frame_pose(one.table, tool.joint - 1, local, np.full(6, 0.3)))
    x, y, z = poses[1][9:]
    assert poses[0][9:] == pytest.approx([1.0 - y, x, z])


def written(tmp_path: Path, change: Any) -> Path:
    shutil.copytree(DATA, tmp_path / "ur5_like")
    file = tmp_path / "ur5_like" / "ur5_like.urdf"
    file.write_text(change(file.read_text()))
    return file


def test_the_base_frame_stands_at_the_base_pose(tmp_path: Path) -> None:
    """The file's root is turned and moved away from the base: the arm stands where it stood."""
    root = (
        '<link name="root"/><joint name="mount" type="fixed"><parent link="root"/>'
        '<child link="base_link"/><origin xyz="0.3 -0.2 0.5" rpy="0.4 -0.7 1.1"/></joint></robot>'
    )
    mounted = written(tmp_path, lambda text: text.replace("</robot>", root))
    placed = ("robot.base_position=[1,2,3]", "robot.base_rotation=[10,20,30]")
    found = condition(*placed, "robot.base_frame=base_link", path=mounted).robot.build()  # type: ignore[attr-defined]
    plain = condition(*placed).robot.build()  # type: ignore[attr-defined]
    q, poses = np.full(6, 0.3), []
    for assembly in (found, plain):
        tool = assembly.tools[0]
        local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
        poses.append(frame_pose(assembly.table, tool.joint - 1, local, q))
        placements = assembly.geometry.createData()
        data = assembly.model.createData()
        pin.updateGeometryPlacements(assembly.model, data, assembly.geometry, placements, q)
        poses.append(np.array([placement.homogeneous for placement in placements.oMg]))
    assert poses[0] == pytest.approx(poses[2], abs=1e-12)
    assert poses[1] == pytest.approx(poses[3], abs=1e-12)


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda text: text[:300],
            "robot.path: must be XML with the root <robot>, was 'unclosed token: line 7",
        ),
        (lambda text: "<sdf></sdf>", "robot.path: must be XML with the root <robot>, was '<sdf>'"),
        (
            lambda text: text.replace("hand.obj", "hnad.obj"),
            'robot.path: must be a file whose meshes are there, was "a missing mesh '
            "'package://ur5_like/hnad.obj'\"",
        ),
        (
            lambda text: text.replace(
                '"elbow_joint" type="revolute"', '"elbow_joint" type="spherical"'
            ),
            "robot.path: must be a URDF whose joints are revolute, continuous, prismatic, fixed, "
            "floating or planar, was \"joint 'elbow_joint' of type spherical\"",
        ),
        (
            lambda text: text.replace(
                '<limit lower="-2.8" upper="2.8"', '<limit lower="1" upper="1"'
            ),
            "robot.joint_limits: must be given for every joint: postures are drawn between them, "
            "and margins rated",
        ),
        (
            lambda text: text.replace(
                '<limit lower="-2.8"', '<mimic joint="elbow"/><limit lower="-2.8"'
            ),
            "robot.path: must be a URDF whose joints follow joints that are there, was \"'",
        ),
        (
            lambda text: text.replace('<child link="tool0"/>', '<child link="nothing"/>'),
            "robot.path: must be a URDF that has the links of joint 'tool_joint', "
            "was \"without 'nothing'\"",
        ),
    ],
)
def test_refusals(tmp_path: Path, change: Any, message: str) -> None:
    with pytest.raises(EvoexpError) as found:
        condition(path=written(tmp_path, change)).prepare()
    assert message in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            ("robot.path=nowhere.urdf",),
            "robot.path: must be a file that can be read (no such file or directory)",
        ),
        (("robot.tool_frame=tool1",), "was 'tool1'; did you mean 'tool0'?"),
        (
            ("robot.tool_frame=base_link",),
            "robot.tool_frame: must be a frame that moves, was 'base_link'",
        ),
        (
            ("robot.base_frame=tool0",),
            "robot.base_frame: must be a frame that does not move, was 'tool0'",
        ),
        (("robot.srdf=no.srdf",), "robot.srdf: must be a file that can be read"),
    ],
)
def test_frames_and_files_that_are_not_there(overrides: tuple[str, ...], message: str) -> None:
    given = [
        *REACH,
        *(() if overrides[0].startswith("robot.path") else (f"robot.path={URDF}",)),
        *overrides,
    ]
    with pytest.raises(EvoexpError) as found:
        compose.expand(given)[0].conditions[0].condition.prepare()
    assert message in str(found.value)


def test_a_configuration_holds_hashes_only() -> None:
    config = json.loads(condition().to_json())["robot"]
    assert set(config) == {"_target_", "revision", "urdf", "meshes", "pairs"}
    assert config["meshes"][0]["name"] == "package://ur5_like/hand.obj"
    assert Condition.from_json(condition().to_json()).id == condition().id
