"""Motions as reports draw them: against trigonometry, plain distances and volumes of bodies."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from evoexp.condition import Prepared
from evoexp.playback.recording import Outline
from evoexp.records import FloatArray
from evoexp.report.figures import motion_scenes
from evoexp.report.figures.style import drawn
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import Results
from evoexp.scenarios import obstacles
from matrix import matrices_are_asked_for
from playback_samples import SAMPLES, condition, matrix, recording
from references.link_crossings_numpy import crossing, squared_distance
from report_samples import expand


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    return expand("rana_planar").conditions[0].condition.prepare()


@pytest.fixture(scope="module")
def q() -> FloatArray:
    return np.random.default_rng(4).uniform(0.0, 360.0, (4, 400))


def by_hand(q: FloatArray, base: tuple[float, float]) -> FloatArray:
    """Return base, elbow and tip of a planar arm with links of length 4, (3, configurations, 2)."""
    angles = np.radians([q[0], q[0] + q[1]])
    links = 4.0 * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    return np.array(base) + np.cumsum([np.zeros_like(links[0]), *links], axis=0)


def test_joints_are_where_trigonometry_puts_them(prepared: Prepared, q: FloatArray) -> None:
    arms = (by_hand(q[:2], (0.0, 0.0)), by_hand(q[2:], (0.0, 8.0)))
    found = list(motion_geometry.joint_positions(prepared.problem.assembly, q))
    assert [(arm, link) for arm, link, _, _ in found] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for arm, link, start, end in found:
        np.testing.assert_allclose(start[:, :2], arms[arm][link], atol=1e-12)
        np.testing.assert_allclose(end[:, :2], arms[arm][link + 1], atol=1e-12)
        assert np.abs(start[:, 2]).max() < 1e-12


def test_link_distances_are_those_of_segments(prepared: Prepared, q: FloatArray) -> None:
    one, other = by_hand(q[:2], (0.0, 0.0)), by_hand(q[2:], (0.0, 8.0))
    distances = []
    for i, j in product(range(2), range(2)):
        a, b, c, d = (p.T for p in (one[i], one[i + 1], other[j], other[j + 1]))
        ends = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
        apart = np.sqrt(np.min([squared_distance(*each) for each in ends], axis=0))
        distances.append(np.where(crossing(a, b, c, d), 0.0, apart))
    expected = np.min(distances, axis=0)
    assert (expected == 0.0).any()
    links = motion_geometry.BodyDistance(prepared.problem.scene)
    np.testing.assert_allclose(links(np.radians(q)), expected, atol=1e-9)
    least, (a, b) = links.nearest(np.radians(q[:, 0]))
    assert (least, np.linalg.norm(a - b)) == pytest.approx([expected[0]] * 2, abs=1e-9)
    # the robot's own geometry stays as it is
    assert len(prepared.problem.assembly.geometry.collisionPairs) == 0


def test_centre_distances_are_those_of_the_centres_and_as_recorded(
    prepared: Prepared, q: FloatArray, results: Results
) -> None:
    found = prepared.problem.centre_distances(q[:, :20])
    for k in range(20):
        one, other = prepared.problem.sphere_centres(q[:, k])
        assert one.shape == other.shape == (9, 3)
        least = np.linalg.norm(one[:, None] - other, axis=2).min()
        assert found[k] == pytest.approx(least, abs=1e-9)
    own = results.conditions[0]
    for replicate, solution in own.solutions.items():
        via = motion_geometry.configurations(own.prepared, solution)
        recorded = own.summaries.loc[replicate, "term_arm_distance_at_via_points"]
        assert prepared.problem.centre_distances(via).min() == pytest.approx(recorded, abs=1e-9)


def test_a_dense_motion_passes_its_via_points(q: FloatArray) -> None:
    times, between = motion_geometry.dense(q[:, :6], 8)
    assert (times.shape, between.shape) == ((41,), (4, 41))
    np.testing.assert_array_equal(between[:, ::8], q[:, :6])
    np.testing.assert_allclose(between[:, 4], 0.5 * (q[:, 0] + q[:, 1]), rtol=1e-15)
    np.testing.assert_allclose(between[:, 33], q[:, 4] + (q[:, 5] - q[:, 4]) / 8, rtol=1e-12)


def test_outlines_lie_on_the_surfaces_of_obstacles() -> None:
    ends = {"start": (2.0, 3.0), "end": (4.0, 3.0)}
    upright = {"start": (2.0, 3.0, -1.0), "end": (2.0, 3.0, 1.0)}
    turned = {"size": (0.8, 0.8), "rotation": (0.0, 0.0, 30.0)}
    bodies = (
        obstacles.SphereObstacle(shape="sphere", center=(5.2, 4.0), radius=0.4),
        obstacles.BoxObstacle(shape="box", center=(-5.5, 4.0), **turned),
        obstacles.RodObstacle(shape="capsule", **ends, radius=0.2),
        obstacles.RodObstacle(shape="cylinder", **upright, radius=0.3),
        obstacles.RodObstacle(shape="cylinder", **ends, radius=0.3),
        obstacles.HalfSpaceObstacle(shape="half_space", point=(0.0, -2.0), normal=(0.0, 1.0)),
        obstacles.EllipseObstacle(
            shape="ellipse", center=(1.0, 2.0), semi_axes=(3.0, 0.5), angle=60.0
        ),
    )
    outlines = [*motion_geometry.obstacle_outlines(obstacles.obstacle_table(bodies), 8.0)]
    ball, box, capsule, tin, lying, wall, egg = outlines
    for outline in outlines:
        np.testing.assert_allclose(outline[0], outline[-1], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(ball - [5.2, 4.0], axis=1), 0.4)
    np.testing.assert_allclose(np.linalg.norm(box - [-5.5, 4.0], axis=1), 0.4 * np.sqrt(2.0))
    assert np.degrees(np.arctan2(*(box[1] - box[0])[::-1])) == pytest.approx(30.0)
    on_axis = np.column_stack([np.clip(capsule[:, 0], 2.0, 4.0), np.full(len(capsule), 3.0)])
    np.testing.assert_allclose(np.linalg.norm(capsule - on_axis, axis=1), 0.2, atol=1e-12)
    edges = np.linalg.norm(np.diff(capsule, axis=0), axis=1)
    assert (edges > 1.0).sum() == 2  # two long sides, walked once each
    np.testing.assert_allclose(np.linalg.norm(tin - [2.0, 3.0], axis=1), 0.3)
    for outline, low, high in (
        (lying, [2.0, 2.7], [4.0, 3.3]),
        (wall, [-8.0, -2.8], [8.0, -2.0]),
    ):
        np.testing.assert_allclose([outline.min(axis=0), outline.max(axis=0)], [low, high])
    cosine, sine = 0.5, np.sqrt(0.75)
    along = (egg - [1.0, 2.0]) @ [[cosine, -sine], [sine, cosine]]
    np.testing.assert_allclose(np.linalg.norm(along / [3.0, 0.5], axis=1), 1.0)


@pytest.mark.parametrize("count", [1, 7, 503])
def test_extremes_of_many_motions_are_those_of_all_values(count: int) -> None:
    every = np.random.default_rng(3).normal(size=(count, 2, 5))
    found = motion_geometry.extremes(range(count), every.__getitem__, lambda q: q.sum(axis=0))
    table = every.sum(axis=1)
    for q, values in zip(found, (table.min(axis=0), table.max(axis=0)), strict=True):
        np.testing.assert_array_equal(q.sum(axis=0), values)


def volume(triangles: np.ndarray) -> float:
    a, b, c = triangles.transpose(1, 0, 2)
    return float((np.cross(a, b) * c).sum() / 6.0)  # positive: each is seen from outside


@pytest.mark.parametrize(
    ("kind", "size", "share"),  # of π
    [
        ("box", (1.0, 2.0, 3.0), 6.0 / np.pi),
        ("sphere", (0.5, 0.0, 0.0), 1.0 / 6.0),
        ("ellipsoid", (1.0, 2.0, 0.5), 4.0 / 3.0),
        ("capsule", (0.5, 2.0, 0.0), 0.5 + 1.0 / 6.0),
        ("cylinder", (0.5, 2.0, 0.0), 0.5),
        ("cone", (0.5, 2.0, 0.0), 0.5 / 3.0),
    ],
)
def test_surfaces_have_the_volume_of_their_bodies(
    kind: str, size: tuple[float, ...], share: float
) -> None:
    found, truth = volume(motion_scenes.triangles_of(kind, np.array(size), None)), share * np.pi
    assert found == pytest.approx(truth, rel=0.09)  # 14 pieces around: 3 % less at most each
    assert found <= truth * (1.0 + 1e-12)


def test_a_large_mesh_is_drawn_by_corners_of_its_hull() -> None:
    points = np.random.Generator(np.random.PCG64(1)).normal(size=(5000, 3))
    found = motion_scenes.corners_of(Outline("mesh", (), points, np.zeros((0, 3), np.int64)))
    assert found is not None and len(found) <= motion_scenes.MOST_CORNERS
    triangles, hull = (
        motion_scenes.triangles_of("mesh", np.zeros(3), found),
        ConvexHull(points).volume,
    )
    assert 0.9 * hull < volume(triangles) <= hull + 1e-9


DRAWN = ("grid", "three arms", "postures")  # in a plane, in a row, in space; others with --all


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_every_motion_has_its_pictures(name: str) -> None:
    shown, (planner, problem) = recording(name), condition(name).prepare()
    scenes, joints = motion_scenes.scenes_table([(name, shown)]), motion_scenes.joints_table(shown)
    counts, roles = scenes["element"].value_counts(), [shape.role for shape in shown.shapes]
    assert counts["start"] == roles.count("arm")
    assert counts.get("obstacle", 0) == roles.count("obstacle")
    way = scenes[(scenes["element"] == "way") & (scenes["arm"] == 0)][["x", "y", "z"]]
    assert np.allclose(way.to_numpy(), shown.traces[0], atol=1e-6)
    first = joints[joints["joint"] == shown.joints[0].name]["value"].to_numpy()
    scale = 1.0 if shown.joints[0].prismatic else 180.0 / np.pi
    assert np.allclose(first, scale * shown.q[:, 0], atol=1e-6)
    pictures = [
        lambda: motion_scenes.draw_scenes(scenes),
        lambda: motion_scenes.draw_joints(joints),
    ]
    if covers := planner.covers(problem):
        table = motion_scenes.covers_table([(name, shown, covers)])
        assert (table["element"] == "cover").sum() == len(covers)
        pictures.append(lambda: motion_scenes.draw_covers(table))
    for axes in pictures[0]().axes:  # the whole way is within the picture
        for axis, (low, high) in (("x", axes.get_xlim()), ("y", axes.get_ylim())):
            assert low < way[axis].min() <= way[axis].max() < high
    for picture in pictures if name in DRAWN or matrices_are_asked_for() else ():
        assert len(drawn(picture, ("png",), 40)["png"]) > 2000


@pytest.mark.parametrize("name", ["postures", "two arms in space", "two arms"])
def test_covers_hold_the_bodies_that_they_stand_for(name: str) -> None:
    """Each link's middle lies in a cover, unless it stands still or has no body of its own."""
    shown, (planner, problem) = recording(name), condition(name).prepare()
    table = motion_scenes.covers_table([(name, shown, planner.covers(problem))])
    covers, bodies = (table[table["element"] == element] for element in ("cover", "body"))
    assert set(covers["kind"]) <= {"sphere", "capsule"}
    moving = [shape.name for shape in shown.shapes if shape.role == "arm" and shape.frame >= 0]
    poses = covers[["x", "y", "z", "qx", "qy", "qz", "qw"]].to_numpy(float)
    axes = np.array([matrix(pose)[:3, 2] for pose in poses])
    half = np.where(covers["kind"] == "capsule", 0.5 * covers["size_2"], 0.0)
    for _, body in bodies[bodies["name"].isin(moving)].iterrows():
        to = body[["x", "y", "z"]].to_numpy(float) - poses[:, :3]
        along = np.clip((to * axes).sum(axis=1), -half, half)
        apart = np.linalg.norm(to - along[:, None] * axes, axis=1)
        assert (apart <= 1.5 * covers["size_1"]).any(), body["name"]
