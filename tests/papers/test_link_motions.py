"""Executed motions, their bodies and the defects that reports count.

Against independent ways to get them.
"""

import numpy as np
import pytest

from evoexp.condition import Prepared
from evoexp.papers.curkovic import link_motions
from evoexp.records import FloatArray
from evoexp.report.results import motion_geometry
from report_samples import expand


def prepared(interpolation: str) -> Prepared:
    words = ("ga.population_size=20", f"planner.interpolation={interpolation}")
    return expand("curkovic_methods_b", *words).conditions[0].condition.prepare()


@pytest.fixture(scope="module", params=["linear", "cubic"])
def one(request: pytest.FixtureRequest) -> Prepared:
    return prepared(request.param)


@pytest.fixture(scope="module")
def solution(one: Prepared) -> FloatArray:
    genes = np.random.default_rng(3).uniform(0.0, 180.0, (2, 6, 2))
    genes[:, 0], genes[:, -1] = np.degrees(one.problem.start), np.degrees(one.problem.goal)
    return genes.ravel()


@pytest.mark.examples(1)
def test_an_executed_motion_passes_its_configurations(one: Prepared, solution: FloatArray) -> None:
    found = link_motions.sampled(link_motions.executed(one, solution), 10)
    assert found.links.shape == found.speeds.shape == (51, 2, 2)
    np.testing.assert_allclose(
        found.links[::10].transpose(1, 0, 2), solution.reshape(2, 6, 2), atol=1e-9
    )
    motion = one.planner.motion(one.problem, solution)
    np.testing.assert_allclose(found.q[:, 13], np.degrees(motion.at(1.3)), atol=1e-9)


@pytest.mark.examples(1)
def test_speeds_are_differences_of_angles(one: Prepared, solution: FloatArray) -> None:
    found = link_motions.sampled(link_motions.executed(one, solution), 2000)
    between = np.diff(found.links, axis=0) * 2000
    off = np.abs(between - found.speeds[:-1]).max()
    assert (
        off < 0.002 * np.abs(found.speeds).max()
    )  # a step of 1/2000 against accelerations of some speeds per instant
    limits = link_motions.speed_limits(one)
    expected = (np.abs(found.speeds).max(axis=0) / limits).max()
    assert link_motions.times_over_limit(one, solution) == pytest.approx(expected, rel=1e-4)


def test_limits_are_those_of_equation_2() -> None:
    one = prepared("linear")
    np.testing.assert_allclose(link_motions.speed_limits(one), np.degrees([[0.1, 0.2]] * 2))
    steps = np.abs(np.degrees(one.problem.goal - one.problem.start)) / 5.0
    expected = (steps / np.degrees([0.1, 0.2])).max()
    assert link_motions.times_over_limit(one, link_motions.straight(one)) == pytest.approx(expected)


@pytest.mark.matrix
def test_a_control_has_the_limits_of_the_planner_beside_it() -> None:
    control = (
        expand("curkovic_methods_b", "control=random_search").conditions[0].condition.prepare()
    )
    np.testing.assert_array_equal(
        link_motions.speed_limits(control), link_motions.speed_limits(prepared("linear"))
    )


def test_distances_of_bodies_are_those_of_links(one: Prepared, solution: FloatArray) -> None:
    q = link_motions.sampled(link_motions.executed(one, solution), 20).q
    q = np.radians(q)
    expected = motion_geometry.link_distance(one.problem.assembly)(q)
    scene = one.problem.scene
    found = motion_geometry.BodyDistance(scene.model, scene.geometry)(q)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_arms_are_those_of_the_collision_model(one: Prepared) -> None:
    for found, own in zip(link_motions.arms(one), one.problem.collision.arms, strict=True):
        assert found.base == pytest.approx(own.base, abs=1e-12)
        assert found.lengths == pytest.approx(own.lengths, rel=1e-12)


def test_a_contact_lies_on_both_bodies() -> None:
    from evoexp.planners.proofs import judge_motion

    one = prepared("linear")
    line = link_motions.straight(one)
    found = judge_motion(one.planner, one.problem, one.planner.motion(one.problem, line))
    assert found.certified is False
    assert found.refuted_at is not None
    x, y = motion_geometry.contact(one, line, found.refuted_at, found.refuted_pair)
    q = np.degrees(one.planner.motion(one.problem, line).at(found.refuted_at))[:, None]
    names = {f"arm_{arm + 1}_link_{link + 1}": (a[0], b[0]) for arm, link, a, b in joints(one, q)}
    for name in found.refuted_pair.split(" – "):
        a, b = names[name]
        along, to = b - a, np.array([x, y, 0.0]) - a
        off = np.linalg.norm(to - np.clip(to @ along / (along @ along), 0.0, 1.0) * along)
        assert off < 1e-6


def joints(one: Prepared, q: FloatArray) -> list[tuple[int, int, FloatArray, FloatArray]]:
    return list(motion_geometry.joint_positions(one.problem.assembly, q))


def test_the_distance_of_a_point_from_segments_is_that_of_a_dense_one() -> None:
    rng = np.random.default_rng(1)
    points, start, end = rng.normal(size=(3, 30, 2))
    share = np.linspace(0.0, 1.0, 4001)[:, None, None]
    dense = np.linalg.norm(points - (start + share * (end - start)), axis=2).min()
    assert link_motions.to_segment(points, start, end) == pytest.approx(dense, abs=1e-5)
