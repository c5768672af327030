"""Exact optima against another parametrisation, conventional methods and landscapes against the planner's kernels."""

import functools
from typing import Any

import numpy as np
import pytest

from evoexp import compose
from evoexp.condition import Condition
from evoexp.references.placement_model import directions_of, gradient
from evoexp.references.placement_subgradient import cost_of
from evoexp.references.truth import Truth
from references.placement_numpy import dense_least

CASES = {  # objective, scenario, E of the optimum as first found; see the test with another parametrisation
    "torque_norm": ("chen_docking", 1.7276170655),
    "minimax": ("chen_docking", 0.8975274679),
    "obstacle_link": ("chen_docking_link", 5.4524761377),
    "obstacle_platform": ("chen_docking_platform", 6.5064348784),
    "manipulability": ("chen_docking", 6.4073405334),
}


@functools.cache
def condition(case: str, reference: str, *more: str) -> Condition:
    words = ["experiment=chen_placement", f"objective=chen_{case}", f"scenario={CASES[case][0]}"]
    return compose.expand([*words, f"reference={reference}", *more], only=["A torque norm"])[0].conditions[0].condition


@functools.cache
def found(case: str, reference: str, *more: str) -> tuple[Truth, Any, Any]:
    planner, problem = condition(case, reference, *more).prepare()
    return planner.truth(problem), planner, problem


@pytest.mark.parametrize("case", CASES)
def test_the_optimum_is_that_of_another_parametrisation(case: str) -> None:
    truth, _, problem = found(case, "placement_optimum")
    assert truth.cost == pytest.approx(CASES[case][1], abs=1e-9)
    model = directions_of(problem.model, problem.angle_limits)
    least = dense_least(model.cost, 1.4, 1200)  # every 0.3°: the cost near a smooth minimum changes by 1e-4 or so
    assert truth.cost <= least * (1.0 + 1e-12)
    assert least == pytest.approx(truth.cost, rel=1e-2)
    minima = truth.arrays["minima"]
    assert (np.diff(minima[:, 2]) >= -1e-8).all()
    assert len(minima) == truth.terms["num_minima"]


@pytest.mark.parametrize("case", CASES)
def test_no_posture_of_a_fine_grid_is_below_the_optimum(case: str) -> None:
    truth, _, problem = found(case, "placement_optimum")
    one, two = truth.best
    grid = np.stack(np.meshgrid(one + np.linspace(-1, 1, 201), two + np.linspace(-1, 1, 201))).reshape(2, -1)
    assert problem.model.measure(grid)[0].min() >= truth.cost - 1e-12


def test_the_minimax_optimum_has_equal_torques() -> None:
    truth, _, problem = found("minimax", "placement_optimum")
    torques = np.abs(problem.model.posture(*truth.best)[1][5:8])
    np.testing.assert_allclose(torques, truth.cost, atol=1e-10)


@pytest.mark.parametrize("case", CASES)
def test_three_ways_to_compute_a_cost_agree(case: str) -> None:
    _, _, problem = found(case, "placement_optimum")
    model, rng = directions_of(problem.model, problem.angle_limits), np.random.default_rng(1)
    checked = 0
    for one, two in rng.uniform(-180.0, 180.0, (200, 2)):
        costs, theta_3 = problem.model.measure_branches(np.array([[one], [two]]))
        for cost, third in zip(costs[:, 0], theta_3[:, 0], strict=True):
            if cost < 250.0:
                x = model.directions(np.array([one, two]), float(third))
                assert abs(model.height(x)) < 1e-12
                assert model.cost(x) == pytest.approx(cost, rel=1e-9)
                parts = model.lengths, model.target, model.force, model.weights, model.avoided
                assert cost_of(x, *parts) == pytest.approx(cost, rel=1e-9)
                checked += 1
    assert checked > 30


def test_complex_steps_are_derivatives() -> None:
    _, _, problem = found("manipulability", "placement_optimum")
    model, x, h = directions_of(problem.model, problem.angle_limits), np.array([1.1, 1.9, 4.4]), 1e-6
    plain = [(model.smooth(x + h * e) - model.smooth(x - h * e)) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(gradient(model.smooth, x), plain, rtol=1e-7)


@pytest.mark.parametrize(
    ("limit", "k"), [([[-180, 60], [-180, 180], [-180, 180]], 0), ([[-180, 180], [60, 90], [-180, 180]], 1)]
)
def test_optima_within_joint_limits_lie_on_them(limit: list[list[int]], k: int) -> None:
    truth, _, problem = found("torque_norm", "placement_optimum", f"+robot.joint_limits={limit}".replace(" ", ""))
    assert truth.solved
    assert truth.cost > CASES["torque_norm"][1] + 1e-3
    fine = np.stack(np.meshgrid(np.linspace(-180, 180, 1801), np.linspace(-180, 180, 1801))).reshape(2, -1)
    least = problem.model.measure(fine)[0].min()
    assert truth.cost <= least * (1 + 1e-9)
    assert truth.cost == pytest.approx(least, rel=0.05)
    assert min(abs(truth.best[k] - edge) for edge in limit[k]) < 1e-6


def test_conventional_ends_are_never_below_the_optimum_and_some_are_stuck() -> None:
    for case in ("minimax", "manipulability"):
        truth, _, _ = found(case, "placement_conventional")
        least = CASES[case][1]
        names = ["bounded" if case == "minimax" else "newton", "subgradient"]
        for name in names:
            ends = truth.arrays[name][:, 2]
            assert ends.shape == (60,)
            assert ends.min() > least * (1.0 - 1e-4), "SLSQP may leave the target by 1e-6"
            near = np.count_nonzero(ends < least * 1.01)
            assert 5 < near < 55, (case, name, near)
        assert ("bounded" in truth.arrays) == (case == "minimax")


def test_starts_reach_the_target() -> None:
    truth, _, problem = found("minimax", "placement_conventional")
    for one, two, three in truth.arrays["starts"]:
        _, theta_3 = problem.model.measure_branches(np.array([[one], [two]]))
        assert np.abs(theta_3[:, 0] - three).min() < 1e-12
    assert len({tuple(row) for row in truth.arrays["starts"]}) == 60


def test_the_landscape_is_the_planners_cost() -> None:
    truth, _, problem = found("minimax", "placement_landscape")
    one, two, cost = (truth.arrays[name] for name in ("theta_1", "theta_2", "cost"))
    assert cost.shape == (361, 361)
    assert (one[0], one[-1], two[0], two[-1]) == (-180.0, 180.0, -180.0, 180.0)
    np.testing.assert_allclose(cost[0], cost[-1], rtol=1e-9)  # −180° and 180° are the same
    for i, j in ((249, 222), (200, 180), (290, 140)):
        branch, own, _ = problem.model.posture(one[i], two[j])
        assert np.isnan(cost[i, j]) if branch < 0 else cost[i, j] == own[0]
    assert truth.cost == np.nanmin(cost)
    assert truth.terms["share_feasible"] == pytest.approx(0.19, abs=0.01)
