"""Bodies of URDFs against a slow reader of their XML; every robot of the gallery plans a reach."""

import math
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.attachments import File, keep, located, mesh_content
from evoexp.errors import EvoexpError, SettingError
from evoexp.records import FloatArray
from evoexp.robots.urdf import ROBOT_DATA, Urdf, robot_file
from evoexp.robots.urdf_model import urdf_model
from robot_gallery import POSTURES, ROBOTS, GalleryRobot, planned_reach
from robots.robot_samples import placements, urdf

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


def gallery() -> Path | None:
    """Return the folder of the robots of example-robot-data, if they are installed."""
    try:
        package = distribution(ROBOT_DATA)
    except PackageNotFoundError:
        return None
    return Path(str(package.locate_file(f"cmeel.prefix/share/{ROBOT_DATA}/robots")))


GALLERY = gallery()
FILES = [*sorted(DATA.rglob("*.urdf")), *map(Path, SHIPPED)]
FILES += sorted(GALLERY.rglob("*.urdf")) if GALLERY else []


def pose(element: ET.Element | None) -> FloatArray:
    """Read an <origin> as a matrix (4, 4)."""
    x = np.eye(4)
    if element is None:
        return x
    x[:3, 3] = [float(word) for word in element.get("xyz", "0 0 0").split()]
    r, p, y = (float(word) for word in element.get("rpy", "0 0 0").split())
    x[:3, :3] = turn((0, 0, 1), y) @ turn((0, 1, 0), p) @ turn((1, 0, 0), r)
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
            content, corners = mesh_content(name, slow.path, {}, ""), points / scale
            if name.lower().endswith(".stl") and len(content) == 84 + 50 * body.num_tris:
                rows = np.frombuffer(content, np.dtype([("x", "<f4", 12), ("a", "<u2")]), -1, 84)
                corners = rows["x"][:, 3:].reshape(-1, 3)
            elif name == "package://ur5_like/hand.obj":
                corners = np.array([line.split()[1:] for line in content.decode().splitlines()
                                    if line.startswith("v ")], float)  # fmt: skip
            for end in (np.min, np.max):
                assert np.allclose(end(points, axis=0), end(corners * scale, axis=0), atol=1e-9)
        case _:
            raise AssertionError(shape.tag)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_body_of_every_link_is_built_where_the_file_has_it(path: Path) -> None:
    try:
        assembly = urdf(path).build()
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
        places = placements(assembly, q)[1]
        for link, rows in expected.items():
            frame = slow.link_pose(link, values)
            checks = slow.root.findall(f"link[@name='{link}']/collision_checking/*")
            for k, (shape, local) in enumerate(rows):
                index, item = built[link if len(rows) == 1 else f"{link}_{k}"]
                is_as_given(shape, item.geometry, slow, {check.tag for check in checks})
                assert np.abs(places[index].homogeneous - frame @ local).max() < 1e-9


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


needs_robots = pytest.mark.skipif(
    GALLERY is None, reason="needs the robots: pip install 'evoexp[robots]'"
)


@pytest.mark.matrix
@needs_robots
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_a_reach_is_planned_and_certified(robot: GalleryRobot) -> None:
    found = planned_reach(robot)
    _, problem = found.reach.postures.prepare()
    assert problem.bodies.num_shapes > 0
    assert found.postures is not None
    assert found.strings is not None


@pytest.mark.matrix
@needs_robots
def test_a_run_is_reproduced_when_its_robot_is_gone(tmp_path: Path) -> None:
    """By commands in processes of their own, which share nothing but what is stored."""
    urdf = Path(robot_file(f"{ROBOT_DATA}:ur_description/urdf/ur5_robot.urdf", "robot.path"))
    robots = tmp_path / ROBOT_DATA / "robots"  # as meshes are named in the file
    shutil.copytree(urdf.parents[1], robots / "ur_description")
    copy = robots / "ur_description" / "urdf" / urdf.name
    words = (f"robot.path={copy}", "robot=urdf", "budget=smoke", "num_replicates=1")
    _evoexp(tmp_path, "run", *words, *POSTURES, "runner=serial", "--no-report")
    (run,) = (tmp_path / "outputs" / "runs").iterdir()
    shutil.rmtree(robots)
    assert "MATCH" in _evoexp(tmp_path, "reproduce", run.name).splitlines()[-1]


def _evoexp(place: Path, *words: str) -> str:
    """Run a command; return what it says."""
    around = os.environ | {"EVOEXP_OUTPUTS": str(place / "outputs")}
    command = [sys.executable, "-m", "evoexp", *words]
    done = subprocess.run(command, env=around, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_name_of_the_package_is_refused_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("evoexp.robots.urdf.distribution", missing)
    with pytest.raises(EvoexpError, match=r"pip install 'evoexp\[robots\]'"):
        Urdf.read_files({"path": f"{ROBOT_DATA}:ur5.urdf"}, "robot")


@needs_robots
def test_a_name_that_the_package_does_not_have_is_refused() -> None:
    with pytest.raises(EvoexpError, match="did you mean 'z1_description/urdf/z1.urdf'?"):
        Urdf.read_files({"path": f"{ROBOT_DATA}:z1_description/urdf/z2.urdf"}, "robot")
    with pytest.raises(EvoexpError):
        Urdf.read_files({"path": f"{ROBOT_DATA}:../../../../x.urdf"}, "robot")
