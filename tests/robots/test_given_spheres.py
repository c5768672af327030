"""Sphere models that somebody else made: taken as covers, measured against the bodies."""

from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.attachments import PREFIX, keep
from evoexp.collision.covers.body_covers import given_cover
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import EvoexpError

DATA = Path(__file__).parent / "data" / "ur5_like"
REACH = (
    "robot=urdf", "scenario=urdf_reach", "planner=posture_es", "ga=corsepius",
    "objective=corsepius_reach", "collision=corsepius_spheres",
)  # fmt: skip
BALL = '<collision><origin xyz="{} {} {}"/><geometry><sphere radius="{}"/></geometry></collision>'


def condition(*overrides: str) -> Condition:
    words = [*REACH, f"robot.path={DATA / 'ur5_like.urdf'}", *overrides]
    return compose.expand(words)[0].conditions[0].condition


def written(tmp_path: Path, **links: list[tuple[float, float, float, float]]) -> Path:
    text = "".join(
        f'<link name="{name}">{"".join(BALL.format(*ball) for ball in balls)}</link>'
        for name, balls in links.items()
    )
    file = tmp_path / "spheres.urdf"
    file.write_text(f'<robot name="spheres">{text}</robot>')
    return file


def test_they_stand_where_the_file_has_them(tmp_path: Path) -> None:
    balls = [(0.01, 0.02, 0.03, 0.05), (-0.01, 0.0, 0.1, 0.04)]
    file = written(tmp_path, forearm_link=balls, wrist_3_link=[(0.0, 0.0, 0.0, 0.03)])
    found = condition(f"robot.spheres={file}")
    assert found.files()[PREFIX + keep(file.read_bytes())] == file.read_bytes()
    assembly = found.robot.build()  # type: ignore[attr-defined]
    names = [item.name for item in assembly.geometry.geometryObjects]
    own = pin.buildModelFromUrdf(str(DATA / "ur5_like.urdf"))
    data, again = own.createData(), assembly.model.createData()
    _, problem = found.prepare()
    cover = problem.bodies.covers[names.index("forearm_link")]
    assert np.array_equal(np.sort(cover.radius), [0.04, 0.05])
    q = np.random.default_rng(1).uniform(-2.0, 2.0, 6)
    pin.framesForwardKinematics(own, data, q)
    pin.forwardKinematics(assembly.model, again, q)
    link = data.oMf[own.getFrameId("forearm_link")]
    joint = assembly.geometry.geometryObjects[names.index("forearm_link")].parentJoint
    expected = sorted(link.act(np.array(ball[:3])).tolist() for ball in balls)
    assert sorted(again.oMi[joint].act(c).tolist() for c in cover.start) == [
        pytest.approx(each) for each in expected
    ]
    # other links are covered as asked
    assert problem.bodies.covers[names.index("upper_arm_link")].uncovered == 0.0
    assert cover.uncovered > 0.0
    notes = " | ".join(found.planner.notes(problem))
    assert "given spheres do not contain all bodies; standing out [m]: " in notes
    assert "forearm_link 0." in notes


def test_how_far_a_body_stands_out() -> None:
    box = pin.GeometryObject("box", 0, 0, pin.SE3.Identity(), coal.Box(0.2, 0.2, 0.2))
    cover = given_cover(box, np.array([[0.0, 0.0, 0.0, 0.1]]))
    assert cover.uncovered == pytest.approx(0.1 * np.sqrt(3.0) - 0.1)  # a corner
    assert cover.inflation == pytest.approx(0.0, abs=1e-12)
    wide = given_cover(box, np.array([[0.0, 0.0, 0.0, 0.18], [0.15, 0.0, 0.0, 0.01]]))
    assert wide.uncovered == 0.0
    assert wide.inflation == pytest.approx(0.08)
    capsule = pin.GeometryObject("capsule", 0, 0, pin.SE3.Identity(), coal.Capsule(0.05, 0.2))
    one = given_cover(capsule, np.array([[0.0, 0.02, 0.3, 0.05]]))
    assert one.inflation == pytest.approx(np.sqrt(0.02**2 + 0.2**2))
    assert one.uncovered == pytest.approx(np.sqrt(0.02**2 + 0.4**2))


@pytest.mark.parametrize(
    ("links", "message"),
    [
        (
            {"forearm": [(0, 0, 0, 0.1)]},
            "robot.spheres: .* belong to links .* 'forearm'.*forearm_link",
        ),
        ({"forearm_link": []}, "robot.spheres: must be a URDF of spheres, was 'one without'"),
    ],
)
def test_refusals(tmp_path: Path, links: dict, message: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(EvoexpError, match=message):
        condition(f"robot.spheres={written(tmp_path, **links)}").prepare()


def test_one_of_several_arms_has_none(tmp_path: Path) -> None:
    file = written(tmp_path, forearm_link=[(0.0, 0.0, 0.0, 0.1)])
    words = [
        "robot=two_urdf", "scenario=urdf_two_arms", "planner=rana_puma", "ga=rana_puma",
        "objective=rana_puma", "collision=urdf_two_arms", f"robot.path={DATA / 'ur5_like.urdf'}",
        f"+robot.arms.0.spheres={file}",
    ]  # fmt: skip
    with pytest.raises(EvoexpError, match=r"spheres"):
        compose.expand(words)[0].conditions[0].condition.prepare()
