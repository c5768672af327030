import numpy as np
import pytest

from evoexp.condition import Prepared
from evoexp.records import FloatArray
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import Results
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    CapsuleObstacle,
    CylinderObstacle,
    EllipseObstacle,
    HalfSpaceObstacle,
    SphereObstacle,
    obstacle_table,
)
from report_samples import expand


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    return expand("rana_planar").conditions[0].condition.prepare()


@pytest.fixture(scope="module")
def q() -> FloatArray:
    return np.random.default_rng(4).uniform(0.0, 360.0, (4, 400))


def by_hand(q: FloatArray, base: tuple[float, float]) -> FloatArray:
    """Return base, elbow and tip of a planar arm with links of length 4, (3, 2, configurations)."""
    first, both = np.radians(q[0]), np.radians(q[0] + q[1])
    elbow = np.array(base)[:, None] + 4.0 * np.array([np.cos(first), np.sin(first)])
    start = np.repeat(np.array(base)[:, None], q.shape[1], axis=1)
    return np.array([start, elbow, elbow + 4.0 * np.array([np.cos(both), np.sin(both)])])


def segment_distance(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Return the distance of segments ab and cd in the plane, each (2, configurations)."""

    def cross(u: FloatArray, v: FloatArray) -> FloatArray:
        return np.asarray(u[0] * v[1] - u[1] * v[0])

    def point(p: FloatArray, s: FloatArray, e: FloatArray) -> FloatArray:
        share = np.clip(((p - s) * (e - s)).sum(axis=0) / ((e - s) ** 2).sum(axis=0), 0.0, 1.0)
        return np.asarray(np.linalg.norm(p - s - share * (e - s), axis=0))

    ends = np.min([point(a, c, d), point(b, c, d), point(c, a, b), point(d, a, b)], axis=0)
    crossing = (cross(b - a, c - a) * cross(b - a, d - a) < 0) & (
        cross(d - c, a - c) * cross(d - c, b - c) < 0
    )
    return np.where(crossing, 0.0, ends)


def test_joints_are_where_trigonometry_puts_them(prepared: Prepared, q: FloatArray) -> None:
    arms = (by_hand(q[:2], (0.0, 0.0)), by_hand(q[2:], (0.0, 8.0)))
    found = list(motion_geometry.joint_positions(prepared.problem.assembly, q))
    assert [(arm, link) for arm, link, _, _ in found] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for arm, link, start, end in found:
        np.testing.assert_allclose(start[:, :2].T, arms[arm][link], atol=1e-12)
        np.testing.assert_allclose(end[:, :2].T, arms[arm][link + 1], atol=1e-12)
        assert np.abs(start[:, 2]).max() < 1e-12


def test_link_distances_are_those_of_segments(prepared: Prepared, q: FloatArray) -> None:
    one, other = by_hand(q[:2], (0.0, 0.0)), by_hand(q[2:], (0.0, 8.0))
    pairs = [
        segment_distance(one[i], one[i + 1], other[j], other[j + 1])
        for i in range(2)
        for j in range(2)
    ]
    expected = np.min(pairs, axis=0)
    assert (expected == 0.0).any()
    links = motion_geometry.link_distance(prepared.problem.assembly)
    np.testing.assert_allclose(links(np.radians(q)), expected, atol=1e-9)
    nearest = links.nearest(np.radians(q[:, 0]))
    assert nearest.distance == pytest.approx(expected[0], abs=1e-9)
    assert np.linalg.norm(nearest.points[0] - nearest.points[1]) == pytest.approx(
        expected[0], abs=1e-9
    )
    assert (
        len(prepared.problem.assembly.geometry.collisionPairs) == 0
    )  # the robot's own geometry stays as it is


def test_centre_distances_are_those_of_the_centres(prepared: Prepared, q: FloatArray) -> None:
    found = prepared.problem.centre_distances(q)
    for k in range(20):
        one, other = prepared.problem.sphere_centres(q[:, k])
        assert one.shape == other.shape == (9, 3)
        least = np.linalg.norm(one[:, None] - other, axis=2).min()
        assert found[k] == pytest.approx(least, abs=1e-9)


def test_a_dense_motion_passes_its_via_points(q: FloatArray) -> None:
    times, between = motion_geometry.dense(q[:, :6], 8)
    assert times.shape == (41,)
    assert between.shape == (4, 41)
    np.testing.assert_array_equal(between[:, ::8], q[:, :6])
    np.testing.assert_allclose(between[:, 4], 0.5 * (q[:, 0] + q[:, 1]), rtol=1e-15)
    np.testing.assert_allclose(between[:, 33], q[:, 4] + (q[:, 5] - q[:, 4]) / 8, rtol=1e-12)


def test_the_straight_line_collides(prepared: Prepared) -> None:
    planner, problem = prepared
    line = motion_geometry.straight_line(planner.shape(problem), problem.start, problem.goal)
    q = motion_geometry.configurations(prepared, line)
    np.testing.assert_allclose(q[:, 10], 0.5 * (prepared.problem.start + prepared.problem.goal))
    terms = prepared.planner.evaluate(prepared.problem, line)
    assert terms["collisions"] > 0
    assert terms["path_length_ratio"] == pytest.approx(1.0)


def test_distances_agree_with_the_recorded_terms(results: Results) -> None:
    condition = results.conditions[0]
    for replicate, solution in condition.solutions.items():
        q = motion_geometry.configurations(condition.prepared, solution)
        at = condition.prepared.problem.centre_distances(q).min()
        term = condition.summaries.loc[replicate, "term_arm_distance_at_via_points"]
        assert at == pytest.approx(float(term), abs=1e-9)


def test_outlines_lie_on_the_surfaces_of_obstacles() -> None:
    table = obstacle_table(
        (
            SphereObstacle(shape="sphere", center=(5.2, 4.0), radius=0.4),
            BoxObstacle(
                shape="box", center=(-5.5, 4.0), size=(0.8, 0.8), rotation=(0.0, 0.0, 30.0)
            ),
            CapsuleObstacle(shape="capsule", start=(-1.0, -5.0), end=(1.0, -5.0), radius=0.2),
            CylinderObstacle(
                shape="cylinder", start=(2.0, 3.0, -1.0), end=(2.0, 3.0, 1.0), radius=0.3
            ),
            CylinderObstacle(shape="cylinder", start=(2.0, 3.0), end=(4.0, 3.0), radius=0.3),
            HalfSpaceObstacle(shape="half_space", point=(0.0, -2.0), normal=(0.0, 1.0)),
            EllipseObstacle(shape="ellipse", center=(1.0, 2.0), semi_axes=(3.0, 0.5), angle=60.0),
        )
    )
    ball, box, capsule, tin, lying, wall, egg = motion_geometry.obstacle_outlines(table, 8.0)
    np.testing.assert_allclose(np.linalg.norm(ball - [5.2, 4.0], axis=1), 0.4)
    np.testing.assert_allclose(np.linalg.norm(box - [-5.5, 4.0], axis=1), 0.4 * np.sqrt(2.0))
    first = np.degrees(np.arctan2(*(box[1] - box[0])[::-1]))
    assert first == pytest.approx(30.0)
    on_axis = np.column_stack([np.clip(capsule[:, 0], -1.0, 1.0), np.full(len(capsule), -5.0)])
    np.testing.assert_allclose(np.linalg.norm(capsule - on_axis, axis=1), 0.2, atol=1e-12)
    edges = np.linalg.norm(np.diff(capsule, axis=0), axis=1)
    assert (edges > 1.0).sum() == 2  # two long sides, walked once each
    np.testing.assert_allclose(np.linalg.norm(tin - [2.0, 3.0], axis=1), 0.3)
    assert (lying.min(axis=0).tolist(), lying.max(axis=0).tolist()) == ([2.0, 2.7], [4.0, 3.3])
    assert (wall.min(axis=0).round(9).tolist(), wall.max(axis=0).round(9).tolist()) == (
        [-8.0, -2.8],
        [8.0, -2.0],
    )
    turn = np.deg2rad(60.0)
    along = (egg - [1.0, 2.0]) @ [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    np.testing.assert_allclose(np.linalg.norm(along / [3.0, 0.5], axis=1), 1.0)
    for outline in (ball, box, capsule, tin, lying, wall, egg):
        np.testing.assert_allclose(outline[0], outline[-1], atol=1e-12)
