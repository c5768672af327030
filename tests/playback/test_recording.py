import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.scene import Part, Scene, geometry_scene
from evoexp.paths.motion import Motion, clamped_cubic
from evoexp.planners.answers import judge_motion
from evoexp.playback.contacts import clearance, remainder
from evoexp.playback.recording import MAX_TICKS, Recording, outline, points, ticks
from evoexp.playback.trajectory import SpeedLimits, seconds_per_instant, velocities
from playback_samples import SAMPLES, condition, half_extent, matrix, recording, refuted

NAMES = sorted(SAMPLES)
Q = np.array([[0.0, 0.0], [2.0, 0.5], [1.0, 1.0], [0.0, 3.0]])
MOTIONS = pytest.mark.parametrize("motion", [Motion(Q), clamped_cubic(Q)], ids=["lines", "cubics"])


@pytest.fixture(params=NAMES)
def shown(request: pytest.FixtureRequest) -> Recording:
    return recording(request.param)


def least_distance(scene: Scene, q: np.ndarray) -> float:
    """Return the least distance of all pairs of a scene by Pinocchio and coal."""
    data, placements = scene.model.createData(), scene.geometry.createData()
    pin.computeDistances(scene.model, data, scene.geometry, placements, q)
    return min((result.min_distance for result in placements.distanceResults), default=np.inf)


def test_composed_transforms_are_those_of_pinocchio(shown: Recording) -> None:
    model = condition(shown.heading.title).robot.build().model
    data = model.createData()
    for k in range(0, len(shown.times), 17):
        pin.forwardKinematics(model, data, shown.motion.at(float(shown.times[k])))
        composed: list[np.ndarray] = []
        for frame, local in zip(shown.frames, shown.poses.local[k], strict=True):
            parent = composed[frame.parent] if frame.parent >= 0 else np.eye(4)
            composed.append(parent @ matrix(local))
        for joint in range(1, model.njoints):
            truth = data.oMi[joint].homogeneous
            for found in (composed[joint - 1], matrix(shown.poses.world[k, joint - 1])):
                assert np.abs(found - truth).max() < 1e-9


def test_every_coal_shape_is_drawn_once_and_of_the_same_size(shown: Recording) -> None:
    planner, problem = condition(shown.heading.title).prepare()
    scene = planner.parts(problem, shown.motion)[0].scene
    assert [shape.name for shape in shown.shapes] == list(scene.names)
    assert len(set(scene.names)) == len(scene.names) == scene.geometry.ngeoms
    for shape, item in zip(shown.shapes, scene.geometry.geometryObjects, strict=True):
        if shape.outline.kind == "half_space":
            continue
        item.geometry.computeLocalAABB()
        box = item.geometry.aabb_local
        half = 0.5 * (box.max_ - box.min_)
        assert np.allclose(half, half_extent(shape.outline), atol=1e-12), shape.name
        carried = shape.role == "object"
        assert carried or shape.frame == item.parentJoint - 1
        truth = np.eye(4) if carried else item.placement.homogeneous
        assert np.abs(matrix(shape.pose) - truth).max() < 1e-12


def test_shapes_that_no_scenario_has_are_drawn_too() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    vertices, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    vertices.extend(corners)
    for face in ((0, 1, 2), (0, 1, 3), (0, 3, 2), (1, 2, 3)):  # the first the wrong way round
        faces.append(coal.Triangle(*face))
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(4, 4)
    mesh.addVertices(corners)
    for face in ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)):  # all the wrong way round
        mesh.addTriangles(np.array([face]))
    mesh.endModel()
    for shape, triangles in (
        (coal.Convex(vertices, faces), [[2, 1, 0], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
        (mesh, [[2, 1, 0], [1, 3, 0], [3, 2, 0], [2, 3, 1]]),
    ):
        drawn, _ = outline(shape)
        assert drawn.kind == "mesh" and drawn.triangles.tolist() == triangles
        assert np.array_equal(drawn.points, corners)
    assert outline(coal.Cone(0.5, 2.0))[0].size == (0.5, 2.0)
    wall, place = outline(coal.Halfspace(np.array([1.0, 0.0, 0.0]), 2.0))
    assert wall.kind == "half_space"
    assert np.allclose(place.translation, [2.0, 0.0, 0.0])
    assert np.allclose(place.rotation[:, 2], [1.0, 0.0, 0.0])


def test_its_verdict_is_that_of_logs_and_contacts_and_curve_agree_with_it(
    shown: Recording,
) -> None:
    verdict, (least, pairs, found) = shown.verdict, shown.clearance
    planner, problem = condition(shown.heading.title).prepare()
    assert repr(judge_motion(planner, problem, shown.motion)) == repr(verdict)
    assert len(least) == len(shown.times) == len(shown.q) == len(pairs)
    if verdict.certified:
        assert found == ()
        if verdict.clearance_at is not None:
            assert least.min() >= verdict.clearance * (1.0 - 1e-3)
    elif verdict.refuted_at is not None:
        assert found[0].begin == pytest.approx(verdict.refuted_at, abs=1e-9)
        assert found[0].pair == verdict.refuted_pair


def test_distances_are_those_of_pinocchio(shown: Recording) -> None:
    planner, problem = condition(shown.heading.title).prepare()
    parts = planner.parts(problem, shown.motion)
    for k in range(0, len(shown.times), 40):
        t = float(shown.times[k])
        scene = next((part for part in parts if t < part.last), parts[-1]).scene
        truth = max(least_distance(scene, shown.motion.at(t)), 0.0)
        assert shown.clearance.least[k] == pytest.approx(truth, abs=1e-5)


@pytest.mark.parametrize("name", ["two arms in space", "co-evolution"])
def test_bodies_are_of_the_arm_whose_joints_carry_them(name: str) -> None:
    shown = recording(name)
    moving = [shape for shape in shown.shapes if shape.role == "arm" and shape.frame >= 0]
    half = len(shown.joints) // 2  # two arms of as many joints
    assert {shape.arm for shape in moving} == {0, 1}
    assert all(shape.arm == (shape.frame >= half) for shape in moving)


@pytest.mark.parametrize("name", ["mission", "placement"])
def test_the_tool_ends_at_the_marked_target(name: str) -> None:
    (target,), (way,) = recording(name).targets, recording(name).traces
    np.testing.assert_allclose(way[-1], target.point, atol=1e-9)


def test_all_contacts_are_found_and_match_a_brute_force() -> None:
    shown = refuted()
    found = shown.clearance.contacts
    assert len(found) >= 2
    assert found[0].begin == pytest.approx(shown.verdict.refuted_at, abs=1e-9)
    scene = condition("two arms").prepare().problem.scene
    for t in np.linspace(0.0, shown.motion.num_segments, 2001):
        near = any(min(abs(t - c.begin), abs(t - c.end)) < 1e-5 for c in found)
        inside = any(c.begin <= t <= c.end for c in found)
        assert near or inside == (least_distance(scene, shown.motion.at(t)) <= 1e-9), t


def test_bodies_that_touch_all_the_time_are_one_contact() -> None:
    model, geometry = pin.Model(), pin.GeometryModel()
    model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    for joint in (1, 0):
        ball = (f"ball_{joint}", joint, 0, pin.SE3.Identity(), coal.Sphere(1.0))
        geometry.addGeometryObject(pin.GeometryObject(*ball))
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    motion = Motion(np.array([[0.0], [1.0], [0.5]]))
    part = Part(geometry_scene(model, geometry), 0, 2)
    found = clearance([part], motion, np.linspace(0.0, 2.0, 9))
    assert [(contact.begin, contact.end) for contact in found.contacts] == [(0.0, 2.0)]
    assert not found.least.any()


@MOTIONS
@pytest.mark.parametrize("t", [0.0, 0.25, 1.0, 2.9])
def test_a_remainder_goes_on_where_the_motion_is(t: float, motion: Motion) -> None:
    rest = remainder(motion, t, 3)
    for s in np.linspace(0.0, rest.num_segments, 13):
        instant = t + s * (int(t) + 1 - t) if s < 1.0 else int(t) + s
        assert np.allclose(rest.at(s), motion.at(instant), atol=1e-12)


def test_a_carried_object_goes_with_the_tool_while_it_is_held_and_stands_otherwise() -> None:
    shown = recording("pick and place")
    (bottle,) = (shape for shape in shown.shapes if shape.role == "object")
    assert shown.frames[bottle.frame].name == "object bottle"
    hand = next(shape for shape in shown.shapes if shape.name == "hand").frame
    planner, problem = condition("pick and place").prepare()
    held = []
    for part in planner.parts(problem, shown.motion):
        held.append(part.scene.shapes[part.scene.names.index("bottle")][1] > 0)
        inside = (shown.times >= part.first) & (shown.times < part.last)
        poses = [matrix(row[bottle.frame]) for row in shown.poses.world[inside]]
        if held[-1]:
            hands = (matrix(row[hand]) for row in shown.poses.world[inside])
            poses = [np.linalg.inv(h) @ pose for h, pose in zip(hands, poses, strict=True)]
        assert np.ptp(poses, axis=0).max(initial=0.0) < 1e-9
    assert set(held) == {True, False}


def test_planar_scenes_are_told_from_others() -> None:
    solid = {name for name in NAMES if not recording(name).view.planar}
    assert solid == {"two arms in space", "mission", "postures", "pick and place"}


def test_ticks_hold_every_instant_and_are_not_too_many() -> None:
    turning = np.array([False])
    times = ticks(Motion(np.array([[0.0], [100.0], [100.0], [0.0]])), turning, 1.0)
    assert set(range(4)) <= set(times) and len(times) <= MAX_TICKS + 3
    assert (np.diff(times) > 0.0).all()
    many = ticks(Motion(np.zeros((5000, 1))), turning, 1.0)
    assert len(many) <= MAX_TICKS and (many[0], many[-1]) == (0.0, 4999.0)
    assert ticks(Motion(np.zeros((1, 1))), turning, 1.0).tolist() == [0.0]


@MOTIONS
def test_no_joint_is_faster_than_its_limit_and_one_reaches_it(motion: Motion) -> None:
    limits = SpeedLimits(turn=0.5, slide=0.1).of(np.array([False, True]), 1.0)
    assert limits.tolist() == [0.5, 0.1]
    seconds, times = seconds_per_instant(motion, limits), np.linspace(0.0, 3.0, 30001)
    speeds = np.abs(velocities(motion, times, seconds))
    assert (speeds / limits).max() == pytest.approx(1.0, abs=1e-6)
    positions = np.array([motion.at(t) for t in times[::100]])
    numeric = np.diff(positions, axis=0) / (seconds * np.diff(times[::100])[:, None])
    assert np.abs(numeric).max(axis=0) == pytest.approx(speeds.max(axis=0), rel=0.02)


def test_a_motion_that_stands_still_takes_its_time() -> None:
    assert seconds_per_instant(Motion(np.ones((2, 1))), np.array([1.0])) == 1.0
    assert SpeedLimits().of(np.array([True]), 8.0).tolist() == [2.0]


def test_points_of_frames_are_where_their_matrices_put_them(shown: Recording) -> None:
    several = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.1], [-1.0, 2.0, 0.5]])
    for frame in range(-1, len(shown.frames)):
        found = points(shown.poses.world, frame, several)
        assert found.shape == (3, len(shown.times), 3)
        turns = [np.eye(4) if frame < 0 else matrix(row[frame]) for row in shown.poses.world]
        for point, way in zip(several, found, strict=True):
            assert np.array_equal(points(shown.poses.world, frame, point), way)
            truth = np.array(turns)[:, :3] @ [*point, 1.0]
            assert np.allclose(way, truth, rtol=0.0, atol=1e-12 * max(1.0, np.abs(truth).max()))
