"""The certifier where the answer is known: times of contact, clearances, margins, refusals."""

import functools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from coal_shapes import geometry_of
from evoexp.collision.certifier import verdict as verdicts
from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.collision.certifier.verdict import certify
from evoexp.collision.scene import Scene, geometry_scene, scene
from evoexp.paths.motion import Motion, cubic_motion
from evoexp.robots.arms import Arms, PlanarChain
from evoexp.robots.assembly import ArmParts, Chain, Link
from obstacle_samples import box, sphere

RIGHT_ANGLE = 0.5 * np.pi


class Slider(Chain):
    """A straight finger of length 1 and radius 0.1 that a prismatic joint moves along x."""

    component = "slider"
    y: float = 0.0

    def append_to(self, model: pin.Model, arm: int) -> ArmParts:
        base = pin.SE3(np.eye(3), np.array([0.0, self.y, 0.0]))
        joint = model.addJoint(0, pin.JointModelPX(), base, f"{arm}_x")
        return ArmParts([Link(arm, joint, np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.1)])


def link(
    length: float, base: tuple[float, float] = (0.0, 0.0), radius: float = 0.0, angle: float = 0.0
) -> PlanarChain:
    return PlanarChain(
        link_lengths=(length,), base_position=base, base_angle=angle, link_radius=radius
    )


def wall(x: float = 3.0, y: float = 0.0) -> Any:
    return box((x + 0.25, y, 0.0), (0.5, 2.0, 2.0))


@functools.cache
def finger() -> Scene:
    """A finger that slides towards a wall: they touch at q = 1.9."""
    return scene(Slider().build(), (wall(),))


def beside_ball(x: float, radius: float = 0.5, length: float = 3.0, thick: float = 0.0) -> Scene:
    return scene(link(length, radius=thick).build(), (sphere((x, 0.0), radius),))


def two_links(length: float, base: tuple[float, float], angle: float) -> Scene:
    return scene(Arms(arms=(link(length), link(length, base, angle=angle))).build())


def folding() -> Scene:
    """An arm whose third link's tip comes down on its first link."""
    robot = PlanarChain(link_lengths=(2.0, 1.0, 1.2), base_position=(0.0, 0.0))
    return scene(robot.build(), self_pairs=True)


def bulging(height: float) -> Motion:
    """A turn and back, q = 4 h u (1 − u), whose ends and chord are free."""
    return cubic_motion(np.array([[[0.0], [4.0 * height], [-4.0 * height], [0.0]]]))


def under_ball() -> Scene:
    return scene(link(3.0).build(), (sphere((0.0, 2.0), 0.5),))


TOUCHING = RIGHT_ANGLE - np.arcsin(0.25)
BULGE = 0.5 - 0.5 * np.sqrt(1.0 - TOUCHING / (TOUCHING + 1e-3))
TIP = np.arccos((2.0**2 + 2.2**2 - 0.5**2) / (2.0 * 2.0 * 2.2))
TIPS = (1.5 - np.arccos(1.0 / 1.5)) / 1.5
FOLD = (0.5 * np.pi + np.arcsin(1.0 / 1.2)) / 3.0
CONTACTS: dict[str, tuple[Callable[[], Scene], Any, float]] = {
    "a line, at asin(r / c)": (
        lambda: beside_ball(2.0), [[-1.5], [1.5]], (1.5 - np.arcsin(0.25)) / 3.0),
    "a thick link, on a later segment": (
        lambda: beside_ball(2.0, thick=0.2), [[1.5], [1.4], [0.4], [-0.6]], 2.4 - np.arcsin(0.35)),
    "a tip from outside": (lambda: beside_ball(2.2, length=2.0), [[1.0], [-1.0]], (1.0 - TIP) / 2),
    "a finger and a wall": (finger, [[-1.0], [4.0]], 2.9 / 5.0),
    "tips of two links": (
        lambda: two_links(1.5, (2.0, 0.0), 180.0), [[1.5, -1.5], [0.0, 0.0]], TIPS),
    # the tip of the standing line is at 45°
    "lines that sweep over one another, apart at both ends": (
        lambda: two_links(2.0, (1.0, -1.0), 90.0), [[1.2, 0.0], [-1.2, 0.0]],
        (1.2 - np.pi / 4.0) / 2.4),
    "the start": (lambda: beside_ball(2.0), [[0.0], [1.5]], 0.0),
    "no movement": (lambda: beside_ball(2.0), [[0.1]], 0.0),
    "the very end": (finger, [[-1.0], [0.0], [1.9]], 2.0),
    "an arm with itself": (folding, [[0.0, RIGHT_ANGLE, 0.0], [0.0, RIGHT_ANGLE, 3.0]], FOLD),
    "a cubic that bulges": (under_ball, bulging(TOUCHING + 1e-3), BULGE),
    "itself while it turns": (folding, [[0.0, RIGHT_ANGLE, 0.0], [1.0, RIGHT_ANGLE, 3.0]], FOLD),
}  # fmt: skip


@pytest.mark.parametrize("name", CONTACTS)
def test_the_first_contact(name: str) -> None:
    build, q, expected = CONTACTS[name]
    verdict = certify(build(), q if isinstance(q, Motion) else Motion(np.array(q)))
    assert verdict.status == verdict.margin_status == "refuted"
    assert verdict.refuted_at == verdict.clearance_at == pytest.approx(expected, abs=2e-9)
    assert verdict.clearance == 0.0
    assert verdict.clearance_pair == verdict.refuted_pair is not None


@pytest.mark.parametrize(
    ("build", "q", "expected"),
    [
        (finger, [[1.0]], 0.9),
        (finger, [[1.0], [1.0]], 0.9),
        (folding, [[0.0, RIGHT_ANGLE, 0.0], [5.0, RIGHT_ANGLE, 0.0]], 1.0),
        (under_ball, bulging(TOUCHING + 1e-3).q, 2.0 - 0.5),
        (under_ball, bulging(TOUCHING - 1e-3), 2.0 * np.sin(np.arcsin(0.25) + 1e-3) - 0.5),
    ],
)
def test_clearances(build: Any, q: Any, expected: float) -> None:
    motion = q if isinstance(q, Motion) else Motion(np.array(q))
    verdict = certify(build(), motion)
    assert verdict.status == "certified"
    assert verdict.clearance == pytest.approx(expected, abs=1e-9)
    assert 0.0 <= verdict.clearance_at <= motion.num_segments


@pytest.mark.parametrize("samples", [10, 40])
def test_a_thin_plate_between_the_samples_is_seen(samples: int) -> None:
    """Checks at equal steps pass a plate of 1e-4; the certifier does not."""
    plate = coal.Box(1e-4, 2.0, 2.0)
    geometry = geometry_of(
        ("ball", 1, None, coal.Sphere(1e-3)),
        ("plate", 0, [0.5107, 0.0, 0.0], plate),
        pairs=[(0, 1)],
    )
    built = geometry_scene(Slider().build().model, geometry)
    motion = Motion(np.array([[0.0], [1.0]]))
    for t in np.linspace(0.0, 1.0, samples + 1):
        assert certify(built, Motion(motion.at(float(t))[None])).status == "certified"
    verdict = certify(built, motion)
    assert verdict.refuted_at == pytest.approx(0.5107 - 0.5e-4 - 1e-3, abs=1e-9)
    assert verdict.refuted_pair == ("ball", "plate")


def test_a_scene_without_pairs() -> None:
    verdict = certify(scene(link(3.0).build()), Motion(np.zeros((3, 1))), security_margin=1.0)
    assert verdict.status == verdict.margin_status == "certified"
    assert verdict.clearance == verdict.proven == np.inf
    assert verdict.clearance_pair is None and np.isnan(verdict.clearance_at)
    assert verdict.queries == 0


@pytest.mark.parametrize(
    ("build", "q", "clearance", "at"),
    [
        (finger, [[-1.0], [1.8]], 0.1, 1.0),
        (finger, [[-1.0], [1.8], [-1.0]], 0.1, 1.0),
        # a tip that turns past a ball: the least distance lies between the resolutions
        (lambda: beside_ball(2.5, 0.2, length=2.0), [[-1.0], [1.1]], 0.3, 1.0 / 2.1),
    ],
    ids=["at the end", "in the middle", "smooth"],
)
def test_the_security_margin(build: Any, q: Any, clearance: float, at: float) -> None:
    for factor, expected in ((0.5, "certified"), (1 - 1e-8, "certified"), (1 + 1e-6, "refuted")):
        verdict = certify(build(), Motion(np.array(q)), security_margin=factor * clearance)
        assert (verdict.status, verdict.margin_status) == ("certified", expected)
        assert verdict.clearance == pytest.approx(clearance, abs=1e-9)
        assert verdict.clearance_at == pytest.approx(at, abs=1e-4)
        assert verdict.clearance_pair == ("arm_1_link_1", "obstacle_1")
        assert 0.99 * clearance < verdict.proven <= verdict.clearance


@pytest.mark.parametrize(
    ("margins", "expected"),
    [
        ((0.1, 0.4), "certified"),
        ((0.1000001, 0.4), "refuted"),
        ((0.1, 0.4000001), "refuted"),  # of the pair that does not come closest
        ((0.05, 0.4000001), "refuted"),  # nor is its clearance the least that is proven
        ((0.0, 0.3), "certified"),
        ((0.4, 0.1), "refuted"),
    ],
)
def test_every_pair_has_its_own_margin(margins: tuple[float, float], expected: str) -> None:
    """A finger goes up to 0.1 before one wall, and a second finger to 0.4 before another."""
    whole = scene(Arms(arms=(Slider(), Slider(y=9.0))).build(), (wall(), wall(y=9.0)))
    built = whole.of_pairs(np.array([abs(a - b) == 2 for a, b in whole.pairs]))
    names = [built.pair_names(k) for k in range(len(built.pairs))]
    assert names == [("arm_1_link_1", "obstacle_1"), ("arm_2_link_1", "obstacle_2")]
    motion = Motion(np.array([[-1.0, -1.0], [1.8, 1.5], [-1.0, -1.0]]))
    verdict = certify(built, motion, security_margin=np.array(margins))
    assert (verdict.status, verdict.margin_status) == ("certified", expected)
    assert verdict.clearance == pytest.approx(0.1)


def test_of_equal_clearances_the_first_is_named() -> None:
    """Past two balls at the same distance, the second in the list first; and back again."""
    built = scene(Slider().build(), tuple(sphere((x, 2.0), 0.5) for x in (2.0, -2.0)))
    verdict = certify(built, Motion(np.array([[-4.0], [3.0], [-4.0]])))
    assert verdict.clearance == pytest.approx(1.4, abs=1e-9)
    assert verdict.clearance_pair == ("arm_1_link_1", "obstacle_2")
    # a finger of length 1 passes
    assert 1.0 / 7.0 - 1e-6 <= verdict.clearance_at <= 2.0 / 7.0 + 1e-6
    assert verdict.queries == 1


def test_two_motions_of_one_scene_are_asked_in_turns() -> None:
    """Coal's placements are shared by all judgements of a thread; each query counts."""
    one, two = (CoalDistance(finger(), Motion(np.array([[0.0], [q]])), 100) for q in (1.0, -1.0))
    other = scene(link(3.0).build(), (wall(5.0),))
    for count in (1, 2):
        assert one(0, 0.5) == pytest.approx(1.4)
        assert two(0, 0.5) == pytest.approx(2.4)
        assert CoalDistance(other, Motion(np.zeros((2, 1))), 100)(0, 0.5) == pytest.approx(2.0)
        assert one.queries == count


def test_one_scene_serves_many_threads() -> None:
    rng = np.random.default_rng(6)
    robot = PlanarChain(link_lengths=(1.2, 1.2), base_position=(0.0, 0.0), link_radius=0.05)
    built = scene(robot.build(), (sphere((1.5, 1.8), 0.4), box((2.65, 0.0, 0.0), (0.1, 2.0, 2.0))))
    motions = [Motion(np.cumsum(rng.normal(size=(9, 2)) * 0.2, axis=0)) for _ in range(40)]
    alone = [certify(built, motion) for motion in motions]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda motion: certify(built, motion), motions))
    assert [repr(verdict) for verdict in together] == [repr(verdict) for verdict in alone]
    assert {verdict.status for verdict in alone} == {"certified", "refuted"}


def test_a_limit_leaves_it_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    built, motion = beside_ball(2.5, 0.49, length=2.0), Motion(np.array([[-1.0], [1.1]]))
    assert certify(built, motion).status == "certified"
    monkeypatch.setattr(verdicts, "MOST_INTERVALS", 2)
    verdict = certify(built, motion)
    assert verdict.status == verdict.margin_status == "undecided"
    assert verdict.intervals == 2
    monkeypatch.undo()
    monkeypatch.setattr(verdicts, "MOST_QUERIES", 0)
    assert certify(built, motion).status == "undecided"


def test_the_tolerance_decides_what_touches() -> None:
    motion = Motion(np.array([[-1.0], [1.8999]]))
    assert certify(finger(), motion).status == "certified"
    near = finger()._replace(tolerances=np.array([1e-3]))
    assert certify(near, motion).status == "refuted"


@pytest.mark.parametrize(
    ("motion", "settings", "message"),
    [
        (Motion(np.zeros((2, 2))), {}, r"q must have shape \(instants, 1\), was \(2, 2\)"),
        (Motion(np.zeros((0, 1))), {}, r"q must have shape \(instants, 1\), was \(0, 1\)"),
        (Motion(np.zeros((2, 1)), np.zeros((2, 4, 1))), {}, r"must have shape \(1, 4, 1\)"),
        (Motion(np.array([[0.0], [np.nan]])), {}, "q must be finite"),
        (None, {"security_margin": -1.0}, "security_margin must be at least 0, was -1"),
        (None, {"security_margin": np.zeros(7)}, "security_margin must be one number, or one per"),
    ],
)
def test_what_cannot_be_judged_is_refused(motion: Any, settings: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        certify(finger(), motion or Motion(np.array([[0.0], [1.0]])), **settings)
