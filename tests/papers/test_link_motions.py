"""Executed motions, their bodies and the defects that reports count, got in independent ways."""

import numpy as np
import pytest

from evoexp.condition import Prepared
from evoexp.papers.curkovic import measures
from evoexp.planners.proofs import judge_motion
from evoexp.records import FloatArray
from evoexp.report.results import motion_geometry
from references.link_crossings_numpy import squared_distance
from report_samples import expand


def prepared(*words: str) -> Prepared:
    experiment = expand("curkovic_methods_b", "ga.population_size=20", *words)
    return experiment.conditions[0].condition.prepare()


@pytest.fixture(scope="module", params=["linear", "cubic"])
def one(request: pytest.FixtureRequest) -> Prepared:
    return prepared(f"planner.interpolation={request.param}")


@pytest.fixture(scope="module")
def linear() -> Prepared:
    return prepared("planner.interpolation=linear")


@pytest.fixture(scope="module")
def solution(one: Prepared) -> FloatArray:
    genes = np.random.default_rng(3).uniform(0.0, 180.0, (2, 6, 2))
    genes[:, 0], genes[:, -1] = np.degrees(one.problem.start), np.degrees(one.problem.goal)
    return genes.ravel()


@pytest.mark.examples(1)
def test_an_executed_motion_passes_its_configurations(one: Prepared, solution: FloatArray) -> None:
    found = measures.sampled(one, solution, 10)
    assert found.links.shape == found.speeds.shape == (51, 2, 2)
    configurations = solution.reshape(2, 6, 2)
    np.testing.assert_allclose(found.links[::10].transpose(1, 0, 2), configurations, atol=1e-9)
    motion = one.planner.motion(one.problem, solution)
    np.testing.assert_allclose(found.q[:, 13], np.degrees(motion.at(1.3)), atol=1e-9)


@pytest.mark.examples(1)
def test_speeds_are_differences_of_angles(one: Prepared, solution: FloatArray) -> None:
    found = measures.sampled(one, solution, 2000)
    off = np.abs(np.diff(found.links, axis=0) * 2000 - found.speeds[:-1]).max()
    # a step of 1/2000 against accelerations of some speeds per instant
    assert off < 0.002 * np.abs(found.speeds).max()
    expected = (np.abs(found.speeds).max(axis=0) / measures.speed_limits(one)).max()
    assert measures.over_limit(one, solution) == pytest.approx(expected, rel=1e-4)


def test_limits_are_those_of_equation_2(linear: Prepared) -> None:
    limits = np.degrees([[0.1, 0.2]] * 2)
    np.testing.assert_allclose(measures.speed_limits(linear), limits)
    steps = np.abs(np.degrees(linear.problem.goal - linear.problem.start)) / 5.0
    line = measures.straight(linear)
    assert measures.over_limit(linear, line) == pytest.approx((steps / limits).max())


@pytest.mark.matrix
def test_a_control_has_the_limits_of_the_planner_beside_it(linear: Prepared) -> None:
    control = measures.speed_limits(prepared("control=random_search"))
    np.testing.assert_array_equal(control, measures.speed_limits(linear))


def test_a_contact_lies_on_both_bodies(linear: Prepared) -> None:
    planner, problem = linear
    line = measures.straight(linear)
    motion = planner.motion(problem, line)
    found = judge_motion(planner, problem, motion)
    assert found.certified is False and found.refuted_at is not None
    point = motion_geometry.contact(linear, line, found.refuted_at, found.refuted_pair)
    q = np.degrees(motion.at(found.refuted_at))[:, None]
    for arm, link, starts, ends in motion_geometry.joint_positions(problem.assembly, q):
        if f"arm_{arm + 1}_link_{link + 1}" in found.refuted_pair.split(" – "):
            assert squared_distance(starts[0, :2], ends[0, :2], np.array(point)) < 1e-12
