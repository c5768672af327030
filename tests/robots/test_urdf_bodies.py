"""Bodies of URDFs against a slow reader of their XML, and of capsules through every use."""

import json
import math
import re
import xml.etree.ElementTree as ET
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.attachments import File, keep, located
from evoexp.batch.replicate import run_replicate
from evoexp.cli import main
from evoexp.errors import SettingError
from evoexp.mesh_files import mesh_content
from evoexp.records import FloatArray
from evoexp.robots.robot_data import ROBOT_DATA
from evoexp.robots.urdf import Urdf
from evoexp.robots.urdf_model import urdf_model
from evoexp.testing import conditions

DATA = Path(__file__).parent / "data"
SHIPPED = [located(f"evoexp:motionbenchmaker/{name}/{name}.urdf") for name in ("panda", "ur5")]
# robots of example-robot-data that are no robots here, and why
REFUSED = {
    "ur3.urdf": "no link",
    "icub.urdf": "parts whose triangles coal joins",
    "icub_reduced.urdf": "parts whose triangles coal joins",
    "alex_psyonic_hands.urdf": "follows 'index_q1'",
    "double_pendulum.urdf": "'joint1': 0 to 0",
    "double_pendulum_simple.urdf": "'joint1': 0 to 0",
    "tiago_dual.urdf": "of at most 100 joints",
}
NO_ROBOT = ("must be a URDF with collision bodies", "must be a URDF with a joint that moves")


def robot_files() -> list[Path]:
    """List the URDFs of the tests, those that evoexp ships, and example-robot-data's if there."""
    found = [*sorted(DATA.rglob("*.urdf")), *map(Path, SHIPPED)]
    try:
        package = distribution(ROBOT_DATA)
    except PackageNotFoundError:
        return found
    folder = Path(str(package.locate_file(f"cmeel.prefix/share/{ROBOT_DATA}/robots")))
    return [*found, *sorted(folder.rglob("*.urdf"))]


def pose(element: ET.Element | None) -> FloatArray:
    """Read an <origin> as a matrix (4, 4)."""
    x = np.eye(4)
    if element is None:
        return x
    x[:3, 3] = [float(word) for word in element.get("xyz", "0 0 0").split()]
    r, p, y = (float(word) for word in element.get("rpy", "0 0 0").split())
    about = [turn(axis, angle) for axis, angle in (((0, 0, 1), y), ((0, 1, 0), p), ((1, 0, 0), r))]
    x[:3, :3] = about[0] @ about[1] @ about[2]
    return x


def turn(axis: Any, angle: float) -> FloatArray:
    """Turn about an axis: Rodrigues' formula."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * (k @ k)


class SlowRobot:
    """A URDF by its elements."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.root = ET.fromstring(path.read_bytes())
        self.joints = {str(joint.get("name")): joint for joint in self.root.iterfind("joint")}
        self.above = {self.end(joint, "child"): joint for joint in self.joints.values()}

    @staticmethod
    def end(joint: ET.Element, name: str) -> str:
        return next(str(end.get("link")) for end in joint.iterfind(name))

    def value(self, joint: ET.Element, q: dict[str, float]) -> float:
        mimic = joint.find("mimic")
        if mimic is None:
            return q.get(str(joint.get("name")), 0.0)
        source = self.value(self.joints[str(mimic.get("joint"))], q)
        return float(mimic.get("multiplier", 1)) * source + float(mimic.get("offset", 0))

    def link_pose(self, link: str, q: dict[str, float]) -> FloatArray:
        joint = self.above.get(link)
        if joint is None:
            return np.eye(4)
        x, kind, axis = pose(joint.find("origin")), joint.get("type"), joint.find("axis")
        moved = np.eye(4)
        if kind in ("revolute", "continuous", "prismatic"):
            along = [1.0, 0.0, 0.0]
            if axis is not None:
                along = [float(word) for word in str(axis.get("xyz")).split()]
            if kind == "prismatic":
                moved[:3, 3] = self.value(joint, q) * np.array(along) / np.linalg.norm(along)
            else:
                moved[:3, :3] = turn(along, self.value(joint, q))
        return np.asarray(self.link_pose(self.end(joint, "parent"), q) @ x @ moved)

    def bodies(self) -> dict[str, list[tuple[ET.Element, FloatArray]]]:
        """List shape and pose of the bodies of each link that has some."""
        found = {}
        for link in self.root.iterfind("link"):
            parts = link.findall("collision")
            rows = [(part.find("geometry"), pose(part.find("origin"))) for part in parts]
            if rows:
                found[str(link.get("name"))] = [(g[0], x) for g, x in rows if g is not None]
        return found


def is_as_given(shape: ET.Element, body: Any, slow: SlowRobot, special: set[str]) -> None:
    """Compare kind and size of a body with its element."""
    numbers = [float(w) for n in ("radius", "length") for w in str(shape.get(n, "")).split()]
    match shape.tag:
        case "box":
            assert isinstance(body, coal.Box)
            size = [float(word) for word in str(shape.get("size")).split()]
            assert (2 * body.halfSide).tolist() == size
        case "sphere":
            assert isinstance(body, coal.Sphere) and [body.radius] == numbers
        case "cylinder" | "capsule":
            is_capsule = shape.tag == "capsule" or "capsule" in special
            assert isinstance(body, coal.Capsule if is_capsule else coal.Cylinder)
            assert [body.radius, 2 * body.halfLength] == numbers
        case "mesh" if isinstance(body, coal.ConvexBase):
            assert "convex" in special
        case "mesh":
            name = str(shape.get("filename"))
            scale = np.array([float(word) for word in shape.get("scale", "1 1 1").split()])
            points = np.asarray(body.vertices())
            assert np.isfinite(points).all() and body.num_tris > 0
            content = mesh_content(name, slow.path, {}, "")
            if name.lower().endswith(".stl") and len(content) == 84 + 50 * body.num_tris:
                rows = np.frombuffer(content, np.dtype([("x", "<f4", 12), ("a", "<u2")]), -1, 84)
                corners = rows["x"][:, 3:].reshape(-1, 3) * scale
                assert np.allclose(points.min(axis=0), corners.min(axis=0), atol=1e-9)
                assert np.allclose(points.max(axis=0), corners.max(axis=0), atol=1e-9)
        case _:
            raise AssertionError(shape.tag)


@pytest.mark.parametrize("path", robot_files(), ids=lambda path: path.name)
def test_every_body_of_every_link_is_built_where_the_file_has_it(path: Path) -> None:
    try:
        settings = Urdf.read_files({"path": str(path)}, "robot")
        assembly = Urdf.model_validate(settings, strict=False).build()
    except SettingError as refusal:
        reasons = [*NO_ROBOT, *([REFUSED[path.name]] if path.name in REFUSED else [])]
        assert any(reason in str(refusal) for reason in reasons), str(refusal)
        return
    slow, model = SlowRobot(path), assembly.model
    built = {item.name: (k, item) for k, item in enumerate(assembly.geometry.geometryObjects)}
    expected = slow.bodies()
    count = sum(map(len, expected.values()))
    assert len(built) == count == assembly.geometry.ngeoms
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    for seed in range(3):
        q = low + (high - low) * np.random.default_rng(seed).random(model.nq)
        free = [k for k in range(1, model.njoints) if model.nqs[k]]
        values = {str(model.names[k]): float(q[model.idx_qs[k]]) for k in free}
        data, placed = model.createData(), assembly.geometry.createData()
        pin.updateGeometryPlacements(model, data, assembly.geometry, placed, q)
        for link, rows in expected.items():
            frame = slow.link_pose(link, values)
            checks = slow.root.findall(f"link[@name='{link}']/collision_checking/*")
            for k, (shape, local) in enumerate(rows):
                index, item = built[link if len(rows) == 1 else f"{link}_{k}"]
                is_as_given(shape, item.geometry, slow, {check.tag for check in checks})
                assert np.abs(placed.oMg[index].homogeneous - frame @ local).max() < 1e-9


@pytest.mark.parametrize("path", [*map(Path, SHIPPED)], ids=lambda path: path.name)
def test_joints_and_frames_stand_as_by_pinocchios_reader_bit_by_bit(path: Path) -> None:
    model = urdf_model(Urdf(urdf=File(sha256=keep(path.read_bytes()))))
    other = pin.buildModelFromUrdf(str(path))
    assert list(model.names) == list(other.names)
    for placement, expected in zip(model.jointPlacements, other.jointPlacements, strict=True):
        assert np.array_equal(placement.homogeneous, expected.homogeneous)
    found = {(str(frame.name), frame.type): frame for frame in model.frames}
    for frame in other.frames:
        if frame.type != pin.FrameType.SENSOR:
            own = found[str(frame.name), frame.type]
            assert own.parentJoint == frame.parentJoint
            assert np.array_equal(own.placement.homogeneous, frame.placement.homogeneous)


# the ball lies on the circle on which the body's middle moves
CAPSULE = (
    '<robot name="r"><link name="a"><collision><geometry><box size=".1 .1 .1"/></geometry>'
    '</collision></link><link name="b"><collision><origin xyz="0.5 0 0"/><geometry>{shape}'
    '</geometry></collision></link><joint name="j" type="revolute"><parent link="a"/>'
    '<child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1"/></joint></robot>'
)
MOTION = (
    *("robot=urdf", "scenario=urdf_two_arms", "planner=via_points", "ga=via_points"),
    *("objective=via_points", "collision=covered_bodies", "scenario.q_start=[[-50.0]]"),
    *("scenario.q_goal=[[50.0]]", "scenario.security_margin=0"),
)
PLAIN, DRAKE = (f'<{name} radius="0.05" length="0.3"/>' for name in ("capsule", "drake:capsule"))


def capsule_words(folder: Path, shape: str, ball: list[float]) -> list[str]:
    path = folder / "r.urdf"
    path.write_text(CAPSULE.format(shape=shape))
    obstacle = f"{{shape: sphere, name: ball, center: {ball}, radius: 0.02}}"
    return [*MOTION, f"robot.path={path}", f"scenario.obstacles=[{obstacle}]"]


@pytest.mark.parametrize("shape", [PLAIN, DRAKE])
@pytest.mark.parametrize(
    ("ball", "certified"),
    [
        ([0.5, 0.0, 0.0], False),
        ([0.5, 0.0, 0.21], False),  # in the cap: beyond the cylinder's end
        ([0.5, 0.0, 0.225], True),  # beyond the cap
    ],
)
def test_a_capsule_hits_a_ball_where_it_is(
    tmp_path: Path, shape: str, ball: list[float], certified: bool
) -> None:
    """Every motion of the one joint passes the middle; the capsule reaches to 0.2 m."""
    words = [*capsule_words(tmp_path, shape, ball), "collision.covers.inflation=0.001"]
    (condition,) = conditions(*words).values()
    summary = run_replicate(condition, 0).summary
    assert summary.certified is certified and summary.solved is certified
    if certified:
        assert summary.clearance == pytest.approx(0.225 - 0.2 - 0.02, abs=1e-6)
    else:
        assert summary.refuted_pair == "b – ball"


def test_a_capsule_is_drawn_and_exported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "out"))
    monkeypatch.chdir(tmp_path)
    words = capsule_words(tmp_path, PLAIN, [0.5, 0.0, 0.4])
    assert main(["run", *words, "budget=smoke", "runner.num_workers=1"]) == 0
    (log, *_) = sorted(tmp_path.rglob("0000.mcap"))
    page = tmp_path / "motion.html"
    assert main(["view", str(log), "-o", str(page)]) == 0
    assert main(["export", str(log), "-o", str(tmp_path / "motion.json")]) == 0
    capsys.readouterr()
    drawn = re.search(r'"kind": ?"capsule"[^{}]*', page.read_text())
    assert drawn is not None and "0.05" in drawn[0] and "0.3" in drawn[0]
    assert json.loads((tmp_path / "motion.json").read_text())
