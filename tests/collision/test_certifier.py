"""The certifier where the answer is known.

Contact times, clearances, margins, and what must not slip through.
"""

from concurrent.futures import ThreadPoolExecutor

import coal
import numpy as np
import pinocchio as pin
import pytest

from collision.certifier_scenes import mesh
from evoexp.collision.certifier.coal_distances import CoalDistance
from evoexp.collision.certifier.verdict import Limits, certify
from evoexp.collision.scene import Scene, geometry_scene, scene
from evoexp.paths.motion import Motion, cubic_motion
from evoexp.robots.arms import Arms
from evoexp.robots.assembly import ArmParts, Chain, Link
from evoexp.robots.planar_chain import PlanarChain
from evoexp.scenarios.obstacles import BoxObstacle, CapsuleObstacle, SphereObstacle


class Slider(Chain):
    """A straight finger that a prismatic joint moves along x."""

    component = "slider"
    base: tuple[float, float, float]
    radius: float

    def append_to(self, model: pin.Model, arm: int) -> ArmParts:
        joint = model.addJoint(
            0, pin.JointModelPX(), pin.SE3(np.eye(3), np.array(self.base)), f"{arm}_x"
        )
        return ArmParts([Link(arm, joint, np.zeros(3), np.array([1.0, 0.0, 0.0]), self.radius)])


def link(
    length: float, base: tuple[float, float], radius: float = 0.0, angle: float = 0.0
) -> PlanarChain:
    return PlanarChain(
        link_lengths=(length,), base_position=base, base_angle=angle, link_radius=radius
    )


def wall(x: float, thickness: float) -> BoxObstacle:
    return BoxObstacle(
        shape="box", center=(x + 0.5 * thickness, 0.0, 0.0), size=(thickness, 2.0, 2.0)
    )


def contact_of(built: Scene, *q: list[float]) -> float:
    verdict = certify(built, Motion(np.array(q)))
    assert verdict.status == "refuted" and verdict.margin_status == "refuted"
    assert verdict.clearance == 0.0 and verdict.clearance_at == verdict.refuted_at
    assert verdict.clearance_pair == verdict.refuted_pair is not None
    return verdict.refuted_at


def test_a_turning_link_meets_a_sphere() -> None:
    """A line from the origin touches a ball of radius r at distance c at the angle asin(r / c)."""
    ball = SphereObstacle(shape="sphere", center=(2.0, 0.0), radius=0.5)
    touching = np.arcsin(0.5 / 2.0)
    built = scene(link(3.0, (0.0, 0.0)).build(), (ball,))
    assert contact_of(built, [-1.5], [1.5]) == pytest.approx((1.5 - touching) / 3.0, abs=1e-9)
    # thick, and on a later segment
    built = scene(link(3.0, (0.0, 0.0), radius=0.2).build(), (ball,))
    touching = np.arcsin(0.7 / 2.0)
    assert contact_of(built, [1.5], [1.4], [0.4], [-0.6]) == pytest.approx(
        1.0 + (1.4 - touching), abs=1e-9
    )


def test_a_tip_meets_a_sphere_from_outside() -> None:
    """The tip of a line at distance 2 from the base meets a ball whose centre stands at 2.2."""
    ball = SphereObstacle(shape="sphere", center=(2.2, 0.0), radius=0.5)
    touching = np.arccos((2.0**2 + 2.2**2 - 0.5**2) / (2.0 * 2.0 * 2.2))
    built = scene(link(2.0, (0.0, 0.0)).build(), (ball,))
    assert contact_of(built, [1.0], [-1.0]) == pytest.approx((1.0 - touching) / 2.0, abs=1e-9)


def test_a_sliding_finger_meets_a_wall() -> None:
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    assert contact_of(built, [-1.0], [4.0]) == pytest.approx((3.0 - 1.1 + 1.0) / 5.0, abs=1e-9)
    verdict = certify(built, Motion(np.array([[-1.0], [1.8]])))
    assert verdict.status == "certified"
    assert verdict.clearance == pytest.approx(0.1, abs=1e-9)
    assert verdict.clearance_at == pytest.approx(1.0, abs=1e-9)
    assert verdict.clearance_pair == ("arm_1_link_1", "obstacle_1")
    assert 0.099 < verdict.proven <= verdict.clearance


def test_two_links_turn_against_each_other() -> None:
    """Bases 2 apart, both lines of length 1.5, mirrored: their tips meet in the middle."""
    built = scene(Arms(arms=(link(1.5, (0.0, 0.0)), link(1.5, (2.0, 0.0), angle=180.0))).build())
    touching = np.arccos(1.0 / 1.5)
    assert contact_of(built, [1.5, -1.5], [0.0, 0.0]) == pytest.approx(
        (1.5 - touching) / 1.5, abs=1e-9
    )
    assert contact_of(built, [-1.5, 1.5], [0.0, 0.0]) == pytest.approx(
        (1.5 - touching) / 1.5, abs=1e-9
    )


def test_lines_that_cross_touch() -> None:
    """Links without thickness, apart at both ends of a fast motion: a line sweeps over another."""
    built = scene(Arms(arms=(link(2.0, (0.0, 0.0)), link(2.0, (1.0, -1.0), angle=90.0))).build())
    verdict = certify(built, Motion(np.array([[1.2, 0.0], [-1.2, 0.0]])))
    assert verdict.status == "refuted"
    # the tip of the standing line is at (1, 1): at 45°
    assert verdict.refuted_at == pytest.approx((1.2 - np.pi / 4.0) / 2.4, abs=1e-9)


@pytest.mark.parametrize("samples", [10, 40])
def test_a_thin_plate_between_the_samples_is_seen(samples: int) -> None:
    """Checks at equal steps pass a plate of 1e-4; the certifier does not."""
    model, geometry = Slider(base=(0.0, 0.0, 0.0), radius=0.1).build().model, pin.GeometryModel()
    geometry.addGeometryObject(
        pin.GeometryObject("ball", 1, 0, pin.SE3.Identity(), coal.Sphere(1e-3))
    )
    placement = pin.SE3(np.eye(3), np.array([0.5107, 0.0, 0.0]))
    geometry.addGeometryObject(
        pin.GeometryObject("plate", 0, 0, placement, coal.Box(1e-4, 2.0, 2.0))
    )
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    built = geometry_scene(model, geometry)
    motion = Motion(np.array([[0.0], [1.0]]))
    for t in np.linspace(0.0, 1.0, samples + 1):
        assert certify(built, Motion(motion.at(float(t))[None])).status == "certified"
    verdict = certify(built, motion)
    assert verdict.status == "refuted"
    assert verdict.refuted_at == pytest.approx(0.5107 - 0.5e-4 - 1e-3, abs=1e-9)
    assert verdict.refuted_pair == ("ball", "plate")


def test_a_start_in_contact() -> None:
    ball = SphereObstacle(shape="sphere", center=(2.0, 0.0), radius=0.5)
    built = scene(link(3.0, (0.0, 0.0)).build(), (ball,))
    assert contact_of(built, [0.0], [1.5]) == 0.0
    assert contact_of(built, [0.1]) == 0.0


def test_contact_at_the_very_end() -> None:
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    assert contact_of(built, [-1.0], [0.0], [1.9]) == pytest.approx(2.0, abs=1e-9)


def test_no_movement() -> None:
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    for q in ([[1.0]], [[1.0], [1.0]], [[1.0], [1.0], [1.0]]):
        verdict = certify(built, Motion(np.array(q)))
        assert verdict.status == "certified"
        assert verdict.clearance == pytest.approx(0.9, abs=1e-9)
        assert 0.0 <= verdict.clearance_at <= len(q) - 1


def test_a_scene_without_pairs() -> None:
    verdict = certify(
        scene(link(3.0, (0.0, 0.0)).build()), Motion(np.zeros((3, 1))), security_margin=1.0
    )
    assert (verdict.status, verdict.margin_status) == ("certified", "certified")
    assert verdict.clearance == verdict.proven == np.inf
    assert (
        verdict.clearance_pair is None and np.isnan(verdict.clearance_at) and verdict.queries == 0
    )


@pytest.mark.parametrize(
    ("margin", "expected"),
    [
        (0.0, "certified"),
        (0.05, "certified"),
        (0.0999999, "certified"),
        (0.1, "certified"),
        (0.1000001, "refuted"),
    ],
)
def test_the_security_margin(margin: float, expected: str) -> None:
    """Past a wall at 0.1, at the end of the motion and in its middle."""
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    for q in ([[-1.0], [1.8]], [[-1.0], [1.8], [-1.0]]):
        verdict = certify(built, Motion(np.array(q)), security_margin=margin)
        assert (verdict.status, verdict.margin_status) == ("certified", expected)


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
    robot = Arms(
        arms=(Slider(base=(0.0, 0.0, 0.0), radius=0.1), Slider(base=(0.0, 9.0, 0.0), radius=0.1))
    )
    walls = (
        wall(3.0, 0.5),
        BoxObstacle(shape="box", center=(3.25, 9.0, 0.0), size=(0.5, 2.0, 2.0)),
    )
    whole = scene(robot.build(), walls)
    built = whole.of_pairs(np.array([abs(a - b) == 2 for a, b in whole.pairs]))
    names = [built.pair_names(k) for k in range(len(built.pairs))]
    assert names == [("arm_1_link_1", "obstacle_1"), ("arm_2_link_1", "obstacle_2")]
    motion = Motion(np.array([[-1.0, -1.0], [1.8, 1.5], [-1.0, -1.0]]))
    verdict = certify(built, motion, security_margin=np.array(margins))
    assert (verdict.status, verdict.margin_status) == ("certified", expected)
    assert verdict.clearance == pytest.approx(0.1)


def test_a_margin_around_a_smooth_minimum() -> None:
    """A tip that turns past a ball.

    Least distance in the middle of an interval, between the resolutions.
    """
    ball = SphereObstacle(shape="sphere", center=(2.5, 0.0), radius=0.2)
    built = scene(link(2.0, (0.0, 0.0)).build(), (ball,))
    motion = Motion(np.array([[-1.0], [1.1]]))
    for margin, expected in (
        (0.2999, "certified"),
        (0.3 - 1e-9, "certified"),
        (0.3 + 1e-9, "refuted"),
    ):
        verdict = certify(built, motion, security_margin=margin)
        assert verdict.margin_status == expected
        assert verdict.clearance == pytest.approx(0.3, abs=1e-9)
        assert verdict.clearance_at == pytest.approx(1.0 / 2.1, abs=1e-4)


def test_of_equal_clearances_the_first_is_named() -> None:
    """Past two balls at the same distance, the second in the list first; and back again."""
    balls = tuple(SphereObstacle(shape="sphere", center=(x, 2.0), radius=0.5) for x in (2.0, -2.0))
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), balls)
    verdict = certify(built, Motion(np.array([[-4.0], [3.0], [-4.0]])))
    assert verdict.clearance == pytest.approx(1.4, abs=1e-9)
    assert verdict.clearance_pair == ("arm_1_link_1", "obstacle_2")
    assert (
        1.0 / 7.0 - 1e-6 <= verdict.clearance_at <= 2.0 / 7.0 + 1e-6
    )  # a finger of length 1 passes
    assert verdict.queries == 1


def test_two_motions_of_one_scene_are_asked_in_turns() -> None:
    """Coal's placements are shared by all judgements of a thread."""
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    one, two = (CoalDistance(built, Motion(np.array([[0.0], [end]])), 100) for end in (1.0, -1.0))
    other = scene(link(3.0, (0.0, 0.0)).build(), (wall(5.0, 0.5),))
    for _ in range(2):
        assert one(0, 0.5) == pytest.approx(1.4)
        assert two(0, 0.5) == pytest.approx(2.4)
        assert CoalDistance(other, Motion(np.zeros((2, 1))), 100)(0, 0.5) == pytest.approx(2.0)


def test_a_cubic_that_bulges_into_an_obstacle() -> None:
    """Ends and chord are free: q = 4 h u (1 − u), h to the obstacle and beyond."""
    ball = SphereObstacle(shape="sphere", center=(0.0, 2.0), radius=0.5)
    built = scene(link(3.0, (0.0, 0.0)).build(), (ball,))
    touching = np.pi / 2.0 - np.arcsin(0.25)
    for height, status in ((touching - 1e-3, "certified"), (touching + 1e-3, "refuted")):
        motion = cubic_motion(np.array([[[0.0], [4.0 * height], [-4.0 * height], [0.0]]]))
        assert certify(built, Motion(motion.q)).status == "certified"
        verdict = certify(built, motion)
        assert verdict.status == status
        if status == "refuted":
            assert verdict.refuted_at == pytest.approx(
                0.5 - 0.5 * np.sqrt(1.0 - touching / height), abs=1e-8
            )
        else:
            assert verdict.clearance == pytest.approx(
                2.0 * np.sin(np.arcsin(0.25) + 1e-3) - 0.5, abs=1e-9
            )


def test_an_arm_that_folds_onto_itself() -> None:
    """The third link's tip comes down on the first link.

    While the first joint turns all three and changes nothing.
    """
    robot = PlanarChain(link_lengths=(2.0, 1.0, 1.2), base_position=(0.0, 0.0))
    touching = 0.5 * np.pi + np.arcsin(1.0 / 1.2)
    built = scene(robot.build(), self_pairs=True)
    for turn in (0.0, 1.0):
        at = contact_of(built, [0.0, 0.5 * np.pi, 0.0], [turn, 0.5 * np.pi, 3.0])
        assert at == pytest.approx(touching / 3.0, abs=1e-9)
    assert certify(
        built, Motion(np.array([[0.0, 0.5 * np.pi, 0.0], [5.0, 0.5 * np.pi, 0.0]]))
    ).clearance == pytest.approx(1.0)


def test_one_scene_serves_many_threads() -> None:
    rng = np.random.default_rng(6)
    robot = PlanarChain(link_lengths=(1.2, 1.2), base_position=(0.0, 0.0), link_radius=0.05)
    built = scene(
        robot.build(),
        (SphereObstacle(shape="sphere", center=(1.5, 1.8), radius=0.4), wall(2.6, 0.1)),
    )
    motions = [Motion(np.cumsum(rng.normal(size=(9, 2)) * 0.2, axis=0)) for _ in range(40)]
    alone = [certify(built, motion) for motion in motions]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda motion: certify(built, motion), motions))
    assert [repr(verdict) for verdict in together] == [repr(verdict) for verdict in alone]
    assert {verdict.status for verdict in alone} == {"certified", "refuted"}


def test_robots_in_another_order() -> None:
    rng = np.random.default_rng(3)
    one, two = (
        PlanarChain(link_lengths=(4.0, 4.0), base_position=(0.0, y), link_radius=0.1)
        for y in (0.0, 6.0)
    )
    ball = SphereObstacle(shape="sphere", center=(5.0, 3.0), radius=0.4)
    here, there = (
        scene(Arms(arms=(one, two)).build(), (ball,)),
        scene(Arms(arms=(two, one)).build(), (ball,)),
    )
    statuses = set()
    for _ in range(40):
        q = np.cumsum(rng.normal(size=(9, 4)) * 0.25, axis=0)
        first, second = certify(here, Motion(q)), certify(there, Motion(q[:, [2, 3, 0, 1]]))
        assert first.status == second.status
        assert first.clearance == pytest.approx(second.clearance, abs=1e-7)
        assert first.refuted_at == pytest.approx(second.refuted_at, abs=1e-8, nan_ok=True)
        statuses.add(first.status)
    assert statuses == {"certified", "refuted"}


def test_a_mirrored_scene() -> None:
    """Mirrored at the x axis: all angles change their signs."""
    rng = np.random.default_rng(4)

    def build(sign: float) -> Scene:
        robot = PlanarChain(
            link_lengths=(2.0, 2.0, 1.0), base_position=(0.0, sign * 0.5), base_angle=sign * 20.0
        )
        return scene(
            robot.build(),
            (
                CapsuleObstacle(
                    shape="capsule", start=(1.0, sign * 2.0), end=(3.0, sign * 3.0), radius=0.3
                ),
                BoxObstacle(
                    shape="box",
                    center=(-2.0, sign * -1.0),
                    size=(1.0, 0.5),
                    rotation=(0.0, 0.0, sign * 30.0),
                ),
            ),
        )

    above, below = build(1.0), build(-1.0)
    for _ in range(40):
        q = np.cumsum(rng.normal(size=(9, 3)) * 0.25, axis=0)
        first, second = certify(above, Motion(q)), certify(below, Motion(-q))
        assert first.status == second.status
        assert first.clearance == pytest.approx(second.clearance, abs=1e-7)
        assert first.refuted_at == pytest.approx(second.refuted_at, abs=1e-8, nan_ok=True)


def test_a_motion_run_backwards_is_as_clear() -> None:
    rng = np.random.default_rng(5)
    robot = PlanarChain(link_lengths=(2.0, 2.0), base_position=(0.0, 0.0), link_radius=0.05)
    built = scene(robot.build(), (SphereObstacle(shape="sphere", center=(2.0, 2.5), radius=0.4),))
    for _ in range(40):
        q = np.cumsum(rng.normal(size=(9, 2)) * 0.2, axis=0)
        there, back = certify(built, Motion(q)), certify(built, Motion(q[::-1].copy()))
        assert there.status == back.status
        assert there.clearance == pytest.approx(back.clearance, abs=1e-7)


def test_a_mesh_is_judged_by_coal_itself() -> None:
    """An L of two faces: a finger passes where the hull would touch it.

    And touches where the mesh is.
    """
    model = pin.Model()
    model.addJoint(0, pin.JointModelPZ(), pin.SE3.Identity(), "z")
    geometry = pin.GeometryModel()
    geometry.addGeometryObject(
        pin.GeometryObject("finger", 1, 0, pin.SE3.Identity(), coal.Sphere(0.05))
    )
    place = pin.SE3(np.eye(3), np.array([0.3, -0.25, 0.0]))
    geometry.addGeometryObject(pin.GeometryObject("mesh", 0, 0, place, mesh(1.0)))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    built = geometry_scene(model, geometry)
    verdict = certify(built, Motion(np.array([[-2.0], [2.0]])))
    expected = min(_sphere_to_mesh(place, z) for z in np.linspace(-2.0, 2.0, 4001))
    assert verdict.status == ("certified" if expected > 0.0 else "refuted")
    if verdict.status == "certified":
        assert verdict.clearance == pytest.approx(expected, abs=1e-5)
    assert verdict.queries > 10


def _sphere_to_mesh(place: pin.SE3, z: float) -> float:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    here = coal.Transform3s(np.eye(3), np.array([0.0, 0.0, z]))
    there = coal.Transform3s(place.rotation, place.translation)
    return float(coal.distance(coal.Sphere(0.05), here, mesh(1.0), there, request, result))


def test_a_limit_leaves_it_undecided() -> None:
    ball = SphereObstacle(shape="sphere", center=(2.5, 0.0), radius=0.49)
    built, motion = scene(link(2.0, (0.0, 0.0)).build(), (ball,)), Motion(np.array([[-1.0], [1.1]]))
    verdict = certify(built, motion, limits=Limits(intervals=2))
    assert (verdict.status, verdict.margin_status, verdict.intervals) == (
        "undecided",
        "undecided",
        2,
    )
    assert certify(built, motion, limits=Limits(queries=0)).status == "undecided"
    assert certify(built, motion).status == "certified"


def test_the_tolerance_decides_what_touches() -> None:
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    motion = Motion(np.array([[-1.0], [1.8999]]))
    assert certify(built, motion).status == "certified"
    near = built._replace(tolerances=np.array([1e-3]))
    assert certify(near, motion).status == "refuted"


def test_a_distance_is_computed_once_and_counted_each_time() -> None:
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    distance = CoalDistance(built, Motion(np.array([[-1.0], [1.0]])), 10)
    assert distance(0, 0.5) == distance(0, 0.5)
    assert distance.queries == 2


def test_what_cannot_be_judged_is_refused() -> None:
    built = scene(Slider(base=(0.0, 0.0, 0.0), radius=0.1).build(), (wall(3.0, 0.5),))
    good = Motion(np.array([[0.0], [1.0]]))
    with pytest.raises(ValueError, match=r"q must have shape \(instants, 1\), was \(2, 2\)"):
        certify(built, Motion(np.zeros((2, 2))))
    with pytest.raises(ValueError, match=r"q must have shape \(instants, 1\), was \(0, 1\)"):
        certify(built, Motion(np.zeros((0, 1))))
    with pytest.raises(ValueError, match=r"coefficients must have shape \(1, 4, 1\)"):
        certify(built, Motion(good.q, np.zeros((2, 4, 1))))
    with pytest.raises(ValueError, match="q must be finite"):
        certify(built, Motion(np.array([[0.0], [np.nan]])))
    with pytest.raises(ValueError, match=r"security_margin must be at least 0, was -1"):
        certify(built, good, security_margin=-1.0)
    with pytest.raises(ValueError, match=r"security_margin must be one number, or one per pair"):
        certify(built, good, security_margin=np.zeros(7))
    with pytest.raises(ValueError, match=r"resolution must be above 0, was 0"):
        certify(built, good, resolution=0.0)
