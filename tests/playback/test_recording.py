import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.scene import Part, geometry_scene
from evoexp.configuration.compose import expand
from evoexp.paths.motion import Motion, clamped_cubic
from evoexp.planners.proofs import judge_motion
from evoexp.playback import contacts
from evoexp.playback.body_poses import MAX_TICKS, points, ticks
from evoexp.playback.contacts import clearance, remainder
from evoexp.playback.recording import Recording
from evoexp.playback.shapes import outline
from evoexp.playback.timing import SpeedLimits, seconds_per_instant, velocities
from evoexp.records import generations
from playback_samples import SAMPLES, condition, half_extent, matrix, recording, refuted

NAMES = sorted(SAMPLES)


@pytest.fixture(params=NAMES)
def shown(request: pytest.FixtureRequest) -> Recording:
    return recording(request.param)


@pytest.mark.parametrize("name", NAMES)
def test_composed_transforms_are_those_of_pinocchio(name: str) -> None:
    shown = recording(name)
    model = condition(name).robot.build().model
    data = model.createData()
    for k in range(0, len(shown.times), 17):
        pin.forwardKinematics(model, data, shown.motion.at(float(shown.times[k])))
        composed: list[np.ndarray] = []
        for frame, local in zip(shown.frames, shown.poses.local[k], strict=True):
            composed.append(
                (composed[frame.parent] if frame.parent >= 0 else np.eye(4)) @ matrix(local)
            )
        for joint in range(1, model.njoints):
            truth = data.oMi[joint].homogeneous
            assert np.abs(composed[joint - 1] - truth).max() < 1e-9
            assert np.abs(matrix(shown.poses.world[k, joint - 1]) - truth).max() < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_every_coal_shape_is_drawn_once_and_of_the_same_size(name: str) -> None:
    shown, (planner, problem) = recording(name), condition(name).prepare()
    scene = planner.parts(problem, shown.motion)[0].scene
    assert [shape.name for shape in shown.shapes] == list(scene.names)
    assert len(set(scene.names)) == len(scene.names) == scene.geometry.ngeoms
    for shape, item in zip(shown.shapes, scene.geometry.geometryObjects, strict=True):
        geometry = item.geometry
        if shape.outline.kind == "half_space":
            continue
        geometry.computeLocalAABB()
        half = 0.5 * (geometry.aabb_local.max_ - geometry.aabb_local.min_)
        assert np.allclose(half, half_extent(shape.outline), atol=1e-12), shape.name
        where = matrix(shape.pose)
        if shape.role != "object":
            assert shape.frame == item.parentJoint - 1
            assert np.abs(where - item.placement.homogeneous).max() < 1e-12
        else:
            assert np.abs(where - np.eye(4)).max() < 1e-12


def test_shapes_that_no_scenario_has_are_drawn_too() -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    faces = coal.StdVec_Triangle()
    for a, b, c in (
        (0, 1, 2),
        (0, 1, 3),
        (0, 3, 2),
        (1, 2, 3),
    ):  # the first one the wrong way round
        faces.append(coal.Triangle(a, b, c))
    vertices = coal.StdVec_Vec3s()
    vertices.extend(points)
    drawn, _ = outline(coal.Convex(vertices, faces))
    assert drawn.kind == "mesh"
    assert drawn.points is not None and np.array_equal(drawn.points, points)
    assert drawn.triangles is not None
    assert drawn.triangles.tolist() == [[2, 1, 0], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(4, 4)
    mesh.addVertices(points)
    for face in ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)):  # all the wrong way round
        mesh.addTriangles(np.array([face]))
    mesh.endModel()
    turned, _ = outline(mesh)
    assert turned.points is not None
    assert np.array_equal(turned.points, points)
    assert turned.triangles is not None
    assert turned.triangles.tolist() == [[2, 1, 0], [1, 3, 0], [3, 2, 0], [2, 3, 1]]
    assert outline(coal.Cone(0.5, 2.0))[0].size == (0.5, 2.0)
    wall, place = outline(coal.Halfspace(np.array([1.0, 0.0, 0.0]), 2.0))
    assert wall.kind == "half_space"
    assert np.allclose(place * np.array([0.0, 0.0, 0.0]), [2.0, 0.0, 0.0])
    assert np.allclose(place.rotation[:, 2], [1.0, 0.0, 0.0])


def test_a_certified_motion_has_no_contact_and_its_curve_stays_above_the_verdict(
    shown: Recording,
) -> None:
    verdict, least = shown.verdict, shown.clearance.least
    assert len(least) == len(shown.times) == len(shown.q) == len(shown.clearance.pairs)
    if verdict.certified:
        assert shown.clearance.contacts == ()
        if verdict.clearance_at is not None:
            assert least.min() >= verdict.clearance * (1.0 - 1e-3)
    elif verdict.refuted_at is not None:
        assert shown.clearance.contacts[0].begin == pytest.approx(verdict.refuted_at, abs=1e-9)
        assert shown.clearance.contacts[0].pair == verdict.refuted_pair


def test_distances_are_those_of_pinocchio(shown: Recording) -> None:
    planner, problem = condition(shown.heading.title).prepare()
    parts = planner.parts(problem, shown.motion)
    for k in range(0, len(shown.times), 40):
        t = float(shown.times[k])
        scene = next((part for part in parts if t < part.last), parts[-1]).scene
        if not len(scene.pairs):
            assert shown.clearance.least[k] == np.inf
            continue
        data, placements = scene.model.createData(), scene.geometry.createData()
        pin.computeDistances(scene.model, data, scene.geometry, placements, shown.motion.at(t))
        truth = min(result.min_distance for result in placements.distanceResults)
        assert shown.clearance.least[k] == pytest.approx(max(truth, 0.0), abs=1e-5)


@pytest.mark.parametrize("name", ["two arms in space", "co-evolution"])
def test_bodies_are_of_the_arm_whose_joints_carry_them(name: str) -> None:
    shown = recording(name)
    moving = [shape for shape in shown.shapes if shape.role == "arm" and shape.frame >= 0]
    half = len(shown.joints) // 2  # two arms of as many joints
    assert {shape.arm for shape in moving} == {0, 1}
    assert all(shape.arm == (shape.frame >= half) for shape in moving)


@pytest.mark.parametrize("name", ["mission", "placement"])
def test_the_tool_ends_at_the_marked_target(name: str) -> None:
    shown = recording(name)
    (target,), (way,) = shown.targets, shown.traces
    np.testing.assert_allclose(way[-1], target.point, atol=1e-9)


def test_all_contacts_are_found_and_match_a_brute_force() -> None:
    shown = refuted()
    contacts = shown.clearance.contacts
    assert len(contacts) >= 2
    assert contacts[0].begin == pytest.approx(shown.verdict.refuted_at, abs=1e-9)
    _, problem = condition("two arms").prepare()
    scene = problem.scene
    data, placements = scene.model.createData(), scene.geometry.createData()
    for t in np.linspace(0.0, shown.motion.num_segments, 2001):
        pin.computeDistances(scene.model, data, scene.geometry, placements, shown.motion.at(t))
        touching = min(result.min_distance for result in placements.distanceResults) <= 1e-9
        near = any(min(abs(t - c.begin), abs(t - c.end)) < 1e-5 for c in contacts)
        inside = any(c.begin <= t <= c.end for c in contacts)
        assert near or touching == inside, t


def test_bodies_that_touch_all_the_time_are_one_contact() -> None:
    model, geometry = pin.Model(), pin.GeometryModel()
    model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    for joint in (1, 0):
        geometry.addGeometryObject(
            pin.GeometryObject(f"ball_{joint}", joint, 0, pin.SE3.Identity(), coal.Sphere(1.0))
        )
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    motion = Motion(np.array([[0.0], [1.0], [0.5]]))
    found = clearance(
        [Part(geometry_scene(model, geometry), 0, 2)], motion, np.linspace(0.0, 2.0, 9)
    )
    assert [(contact.begin, contact.end) for contact in found.contacts] == [(0.0, 2.0)]
    assert not found.least.any()


@pytest.mark.parametrize("cubic", [False, True])
@pytest.mark.parametrize("t", [0.0, 0.25, 1.0, 2.9])
def test_a_remainder_goes_on_where_the_motion_is(t: float, cubic: bool) -> None:
    q = np.array([[0.0, 1.0], [2.0, 0.5], [1.0, 1.0], [0.0, 3.0]])
    motion = clamped_cubic(q) if cubic else Motion(q)
    rest = remainder(motion, t, 3)
    for s in np.linspace(0.0, rest.num_segments, 13):
        instant = t + s * (int(t) + 1 - t) if s < 1.0 else int(t) + s
        assert np.allclose(rest.at(s), motion.at(instant), atol=1e-12)


def test_a_carried_object_goes_with_the_tool_while_it_is_held_and_stands_otherwise() -> None:
    shown = recording("pick and place")
    (bottle,) = (shape for shape in shown.shapes if shape.role == "object")
    assert shown.frames[bottle.frame].name == "object bottle"
    planner, problem = condition("pick and place").prepare()
    parts = planner.parts(problem, shown.motion)
    held = [part for part in parts if part.scene.shapes[part.scene.names.index("bottle")][1] > 0]
    free = [part for part in parts if part not in held]
    assert held and free
    hand = next(shape for shape in shown.shapes if shape.name == "hand").frame
    for part in held:
        inside = (shown.times >= part.first) & (shown.times < part.last)
        relative = [
            np.linalg.inv(matrix(row[hand])) @ matrix(row[bottle.frame])
            for row in shown.poses.world[inside]
        ]
        assert np.ptp(relative, axis=0).max() < 1e-9
    for part in free:
        inside = (shown.times >= part.first) & (shown.times < part.last)
        assert np.ptp(shown.poses.world[inside][:, bottle.frame], axis=0).max(initial=0.0) < 1e-12


def test_planar_scenes_are_told_from_others() -> None:
    flat = {name: recording(name).view.planar for name in NAMES}
    solid = {"two arms in space", "mission", "postures", "pick and place"}
    assert flat == {name: name not in solid for name in NAMES}


def test_ticks_hold_every_instant_and_are_not_too_many() -> None:
    q = np.zeros((4, 1))
    q[:, 0] = [0.0, 100.0, 100.0, 0.0]
    times = ticks(Motion(q), np.array([False]), 1.0)
    assert set(range(4)) <= set(times)
    assert len(times) <= MAX_TICKS + 3
    assert (np.diff(times) > 0.0).all()
    many = ticks(Motion(np.zeros((5000, 1))), np.array([False]), 1.0)
    assert len(many) <= MAX_TICKS
    assert (many[0], many[-1]) == (0.0, 4999.0)
    assert ticks(Motion(np.zeros((1, 1))), np.array([False]), 1.0).tolist() == [0.0]


@pytest.mark.parametrize("cubic", [False, True])
def test_no_joint_is_faster_than_its_limit_and_one_reaches_it(cubic: bool) -> None:
    q = np.array([[0.0, 0.0], [2.0, 0.5], [1.0, 1.0], [0.0, 3.0]])
    motion = clamped_cubic(q) if cubic else Motion(q)
    limits = SpeedLimits(turn=0.5, slide=0.1).of(np.array([False, True]), 1.0)
    assert limits.tolist() == [0.5, 0.1]
    seconds = seconds_per_instant(motion, limits)
    times = np.linspace(0.0, 3.0, 30001)
    speeds = np.abs(velocities(motion, times, seconds))
    assert (speeds <= limits * (1.0 + 1e-9)).all()
    assert (speeds / limits).max() == pytest.approx(1.0, abs=1e-6)
    positions = np.array([motion.at(t) for t in times[::100]])
    numeric = np.diff(positions, axis=0) / (seconds * np.diff(times[::100])[:, None])
    assert np.abs(numeric).max(axis=0) == pytest.approx(speeds.max(axis=0), rel=0.02)


def test_a_motion_that_stands_still_takes_its_time() -> None:
    assert seconds_per_instant(Motion(np.ones((2, 1))), np.array([1.0])) == 1.0
    assert SpeedLimits().of(np.array([True]), 8.0).tolist() == [2.0]


def test_its_verdict_is_the_one_that_logs_have(shown: Recording) -> None:
    planner, problem = condition(shown.heading.title).prepare()
    assert repr(judge_motion(planner, problem, shown.motion)) == repr(shown.verdict)


def test_distances_are_those_of_all_pairs_though_few_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    words = ("experiment=motionbenchmaker", "budget=smoke")
    (panda,) = expand(words, only=("box_panda",))[0].conditions
    planner, problem = panda.condition.prepare()
    motion = planner.motion(
        problem, next(generations(planner.evolve(problem, panda.condition.rng(0)))).best
    )
    parts = list(planner.parts(problem, motion))
    times = np.linspace(0.0, motion.num_segments, 7)
    few = clearance(parts, motion, times)
    monkeypatch.setattr(contacts, "SLACK", 1e6)
    every = clearance(parts, motion, times)
    assert np.array_equal(few.least, every.least)
    assert few[1:] == every[1:]


def test_points_of_frames_are_where_their_matrices_put_them(shown: Recording) -> None:
    several = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.1], [-1.0, 2.0, 0.5]])
    for frame in range(-1, len(shown.frames)):
        found = points(shown.poses.world, frame, several)
        assert found.shape == (3, len(shown.times), 3)
        for point, way in zip(several, found, strict=True):
            assert np.array_equal(points(shown.poses.world, frame, point), way)
            turns = [np.eye(4) if frame < 0 else matrix(row[frame]) for row in shown.poses.world]
            truth = [(turn @ [*point, 1.0])[:3] for turn in turns]
            assert np.allclose(way, truth, rtol=0.0, atol=1e-12 * max(1.0, np.abs(truth).max()))
