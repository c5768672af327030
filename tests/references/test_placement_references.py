"""Truths of postures by another parametrisation, by complex steps and by the planner's kernels."""

import functools
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.references.placement_programme import (
    MARGINS,
    TORQUE_BOUNDS,
    Directions,
    Programme,
    directions_of,
)
from evoexp.references.placement_references import lowest, slide
from evoexp.references.reference import Truth
from references import placement_complex as slow

LABELS = {
    "torque_norm": "A torque norm",
    "minimax": "A minimax",
    "obstacle_link": "B link",
    "obstacle_platform": "B platform",
    "manipulability": "C manipulability",
}


def problem(case: str) -> Any:
    return composed("experiment=chen_placement", label=LABELS[case]).prepare()[1]


@functools.cache
def found(case: str, kind: str) -> tuple[Truth, Any, Any]:
    """Return the truth, reference and problem of an optimum, a conventional one or a landscape."""
    experiment = "chen_landscapes" if kind == "landscape" else "chen_placement"
    label = f"{LABELS[case]}, {kind}"
    planner, prepared = composed(f"experiment={experiment}", label=label).prepare()
    return planner.truth(prepared), planner, prepared


def dense_least(cost: object, height: float, num: int) -> float:
    """Return the least cost of (3, n) over a grid of φ2, φ3 with both values of φ1 there are."""
    grid = np.linspace(-np.pi, np.pi, num, endpoint=False)
    two, three = (values.ravel() for values in np.meshgrid(grid, grid))
    sine = height - np.sin(two) - 0.5 * np.sin(three)  # links of 1, 1 and 0.5
    kept = np.abs(sine) <= 1.0
    first = np.arcsin(sine[kept])
    both = (np.stack([one, two[kept], three[kept]]) for one in (first, np.pi - first))
    return min(float(np.min(cost(x))) for x in both)  # type: ignore[operator]


CASES = {  # E of the optimum as first found; see the test with another parametrisation
    "torque_norm": 1.7276170655,
    "minimax": 0.8975274679,
    "obstacle_link": 5.4524761377,
    "obstacle_platform": 6.5064348784,
    "manipulability": 6.4073405334,
}


def turned(*middle: float, half: float, num: int) -> np.ndarray:
    """Return a grid of θ1, θ2 [deg] around a place, (2, num²)."""
    axes = (place + np.linspace(-half, half, num) for place in middle)
    return np.stack(np.meshgrid(*axes)).reshape(2, -1)


@pytest.mark.examples(2)
@pytest.mark.parametrize("case", CASES)
def test_the_optimum_is_that_of_another_parametrisation(case: str) -> None:
    truth, _, problem = found(case, "optimum")
    assert truth.cost == pytest.approx(CASES[case], abs=1e-9)
    model = directions_of(problem.model, problem.angle_limits)
    # every 0.3°: the cost near a smooth minimum changes by 1e-4 or so
    least = dense_least(functools.partial(slow.cost, model), 1.4, 1200)
    assert truth.cost <= least * (1.0 + 1e-12)
    assert least == pytest.approx(truth.cost, rel=1e-2)
    minima = truth.arrays["minima"]
    assert (np.diff(minima[:, 2]) >= -1e-8).all()
    assert len(minima) == truth.terms["num_minima"]
    around = problem.model.measure(turned(*truth.best, half=1, num=201))[0]
    assert around.min() >= truth.cost - 1e-12
    if case == "minimax":
        torques = np.abs(problem.model.posture(*truth.best)[1][5:8])
        np.testing.assert_allclose(torques, truth.cost, atol=1e-10)


@pytest.mark.examples(1)
@pytest.mark.parametrize(
    ("limit", "k"),
    [([[-180, 60], [-180, 180], [-180, 180]], 0), ([[-180, 180], [60, 90], [-180, 180]], 1)],
)
def test_optima_within_joint_limits_lie_on_them(limit: list[list[int]], k: int) -> None:
    own = composed("experiment=chen_placement", label="A torque norm, optimum")
    limits = tuple((float(low), float(high)) for low, high in limit)
    robot = own.robot.model_copy(update={"joint_limits": limits})
    problem = own.planner.prepare(robot, own.scenario)
    truth = own.planner.truth(problem)
    assert truth.solved
    assert truth.cost > CASES["torque_norm"] + 1e-3
    least = problem.model.measure(turned(0, 0, half=180, num=1801))[0].min()
    assert truth.cost <= least * (1 + 1e-9)
    assert truth.cost == pytest.approx(least, rel=0.05)
    assert min(abs(truth.best[k] - edge) for edge in limit[k]) < 1e-6


def test_conventional_ends_are_never_below_the_optimum_and_some_are_stuck() -> None:
    for case, names in (("minimax", ["bounded"]), ("manipulability", ["newton"])):
        truth, _, _ = found(case, "conventional")
        for name in [*names, "subgradient"]:
            ends = truth.arrays[name][:, 2]
            assert ends.shape == (60,)
            assert ends.min() > CASES[case] * (1.0 - 1e-4), "SLSQP may leave the target by 1e-6"
            near = np.count_nonzero(ends < CASES[case] * 1.01)
            assert 5 < near < 55, (case, name, near)
        assert ("bounded" in truth.arrays) == (case == "minimax")


def test_starts_reach_the_target() -> None:
    truth, _, problem = found("minimax", "conventional")
    for one, two, three in truth.arrays["starts"]:
        _, theta_3 = problem.model.measure_branches(np.array([[one], [two]]))
        assert np.abs(theta_3[:, 0] - three).min() < 1e-12
    assert len({tuple(row) for row in truth.arrays["starts"]}) == 60


def test_the_landscape_is_the_planners_cost() -> None:
    truth, _, problem = found("minimax", "landscape")
    one, two, cost = (truth.arrays[name] for name in ("theta_1", "theta_2", "cost"))
    assert cost.shape == (361, 361)
    assert (one[0], one[-1], two[0], two[-1]) == (-180.0, 180.0, -180.0, 180.0)
    np.testing.assert_allclose(cost[0], cost[-1], rtol=1e-9)  # −180° and 180° are the same
    for i, j in ((249, 222), (200, 180), (290, 140)):
        branch, own, _ = problem.model.posture(one[i], two[j])
        assert np.isnan(cost[i, j]) if branch < 0 else cost[i, j] == own[0]
    assert truth.cost == np.nanmin(cost)
    assert truth.terms["share_feasible"] == pytest.approx(0.19, abs=0.01)


AROUND = np.array([[-180.0, 180.0], [-180.0, 180.0]])
POINTS = np.array(
    [
        [2.0, 0, 0.5, 5.2, 1.0],
        [1.0, 1, 0.3, 4.0, 0.1],
        [3.0, 2, 0.5, 5.2, 1.0],
        [0.7, 3, 0.9, 5.0, 2.0],
    ]
)


def directions(case: str, **changes: Any) -> Directions:
    return directions_of(problem(case).model, problem(case).angle_limits)._replace(**changes)


def limited(case: str) -> Directions:
    joints = np.array([[-2.5, 3.0], [-np.inf, 2.5], [-2.0, np.inf]])
    limits = {"joint_limits": joints, "torque_limits": np.array([[-6.0, 8.0]] * 3)}
    return directions(case, avoided=POINTS, **limits)


@pytest.mark.examples(2)
@pytest.mark.parametrize("with_limits", [False, True])
@pytest.mark.parametrize("case", LABELS)
def test_the_programme_and_its_derivatives_are_those_of_complex_steps(
    case: str, with_limits: bool
) -> None:
    model = limited(case) if with_limits else directions(case)
    programme, rng = Programme(model), np.random.default_rng(2)
    function = functools.partial(slow.programme, model)
    for z in rng.uniform(-3.0, 3.0, (40, 3 + programme.minimax)):
        values, slopes = programme.measured(z)
        assert len(values) == MARGINS + TORQUE_BOUNDS * programme.minimax + len(model.bounds())
        np.testing.assert_allclose(values, function(z), rtol=1e-11, atol=1e-13)
        expected = slow.gradient(function, z)
        np.testing.assert_allclose(slopes, expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max())

    smooth, x, h = functools.partial(slow.smooth, model), np.array([1.1, 1.9, 4.4]), 1e-6
    plain = [(smooth(x + h * e) - smooth(x - h * e)) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(slow.gradient(smooth, x), plain, rtol=1e-6)


@pytest.mark.parametrize("case", ["torque_norm", "obstacle_link", "manipulability"])
def test_the_subgradient_method_is_the_slow_one(case: str) -> None:
    model = directions(case)
    rows = lowest(problem(case).model, AROUND, 60, 6)  # the lowest minima of a coarse search
    starts = [model.reaching(np.radians(row[:2]), row[2] == 1.0) for row in rows]
    steps = 0.3 / np.sqrt(np.arange(1.0, 41.0))
    ends, costs = slide(np.array(2 * starts).T, steps, model)
    for k, start in enumerate(starts):
        end, least = slow.slide(model, start, steps)
        # differences of 1e-6 rad: ten digits of the slope
        assert costs[k] == pytest.approx(least, rel=1e-5)
        np.testing.assert_allclose(ends[:, k], end, atol=1e-5)
        np.testing.assert_array_equal(ends[:, k], ends[:, k + len(starts)])
