"""Criteria of a mobile arm's posture against Pinocchio, and at their edges."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.objectives.placement_criteria import Model, PlacementCriteria, Task
from evoexp.robots.arms import MobileArm

LENGTHS = (1.0, 1.0, 0.5)
ANYTHING = np.array([[-np.inf, np.inf]] * 6)
PLAIN: dict[str, Any] = {
    "torque_norm_weight": 1.0,
    "torque_max_weight": 0.0,
    "manipulability_weight": 0.0,
    "torque_weights": (1.0, 1.0, 1.0),
    "greatest": 250.0,
}
ANGLES, FORCES = st.floats(-180.0, 180.0), st.floats(-5.0, 5.0)


def model(
    force: tuple[float, float] = (0.0, -5.0),
    avoided: Any = (),
    limits: np.ndarray = ANYTHING,
    height: float = 1.4,
    **weights: Any,
) -> Model:
    objective = PlacementCriteria(**(PLAIN | weights))
    table = np.array(avoided, dtype=np.float64).reshape(-1, 5)
    return Model(Task(*LENGTHS, 5.0, height, *force), objective.weights, table, limits)


def pinocchio_posture(
    q: np.ndarray, force: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return end-effector (2,), Jacobian (2, 3), torques (3,) at q = (X_p, Θ1, θ2, θ3) [rad]."""
    model = MobileArm(link_lengths=LENGTHS, platform_size=(0.6, 0.2)).build().model
    tip = pin.SE3(np.eye(3), np.array([LENGTHS[2], 0.0, 0.0]))
    frame = model.addFrame(pin.Frame("tip", model.njoints - 1, 0, tip, pin.FrameType.OP_FRAME))
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    whole = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    jacobian = whole[:2, 1:]
    return data.oMf[frame].translation[:2], jacobian, jacobian.T @ force


@settings(max_examples=80, deadline=None)
@given(ANGLES, ANGLES, FORCES, FORCES, st.integers(0, 3), st.sampled_from([0.0, 0.25, 0.5, 1.0]))
def test_both_branches_agree_with_pinocchio(
    one: float, two: float, fx: float, fy: float, link: int, place: float
) -> None:
    weights = {"torque_max_weight": 0.5, "manipulability_weight": 2.0}
    branch, *both = model((fx, fy), [[3.0, link, place, 5.2, 1.0]], **weights).posture(one, two)
    assert (branch >= 0) == np.isfinite(both[0][8])
    for numbers in both if branch >= 0 else ():
        q = np.array([numbers[9], *np.radians([one, two, numbers[8]])])
        tip, jacobian, torques = pinocchio_posture(q, np.array([fx, fy]))
        np.testing.assert_allclose(tip, [5.0, 1.4], atol=1e-9)
        np.testing.assert_allclose(numbers[5:8], torques, atol=1e-9)
        determinant = float(np.linalg.det(jacobian @ jacobian.T))
        if determinant > 0.01:
            np.testing.assert_allclose(numbers[4], 1.0 / determinant, rtol=1e-6)
        assert numbers[1] == pytest.approx(min(float(torques @ torques), 250.0), abs=1e-9)
        assert numbers[2] == pytest.approx(np.abs(torques).max(), abs=1e-9)
        ways = np.cumsum(q[1:])
        reached = np.array(LENGTHS) * np.clip(link - np.arange(1, 4) + place, 0.0, 1.0)
        point = q[0] + reached @ np.cos(ways), reached @ np.sin(ways)
        gap = np.square(np.subtract(point, (5.2, 1.0))).sum()
        avoided = min(3.0 * min(1.0 / max(gap, 1e-9), 250.0), 250.0)
        assert numbers[3] == pytest.approx(avoided, rel=1e-6)
        total = numbers[1] + 0.5 * numbers[2] + 2.0 * numbers[4] + numbers[3]
        assert numbers[0] == pytest.approx(min(total, 250.0), rel=1e-9)
        assert -180.0 <= numbers[8] < 180.0


def test_singular_and_infeasible_postures_are_capped_and_never_nan() -> None:
    out = model(manipulability_weight=1.0).measure(
        np.random.default_rng(0).uniform(-180.0, 180.0, (2, 20000))
    )
    assert np.isfinite(out).all()
    assert out[:5].max() == 250.0
    assert (out[0][out[5] < 0] == 250.0).all()
    stretched = model(height=2.5, manipulability_weight=1.0)  # upwards: det(J Jᵀ) is 0
    branch, own, _ = stretched.posture(90.0, 0.0)
    assert branch >= 0
    assert (own[4], own[0]) == (250.0, 250.0)
    assert own[1] == pytest.approx(0.0, abs=1e-20)


@pytest.mark.parametrize("count", [1, 7, 50, 400])
@pytest.mark.parametrize(
    "avoided", [[], [[1.0, 2, 0.5, 5.2, 1.0]], [[2.0, 0, 0.3, 4.0, 0.1], [1.5, 3, 0.9, 5.1, 1.3]]]
)
def test_a_population_is_measured_as_its_postures_are(count: int, avoided: object) -> None:
    narrow = np.array(
        [[-100.0, 150.0], [-170.0, 90.0], [-120.0, 179.0], [-5.0, 7.0], [-4.0, 6.0], [-3.0, 2.0]]
    )
    weights = {"torque_max_weight": 0.5, "manipulability_weight": 2.0, "greatest": 40.0}
    angles = np.random.default_rng(count).uniform(-180.0, 180.0, (2, count))
    angles = np.round(angles, 0 if count == 400 else 9)  # round ones: singular ones
    for limits in (ANYTHING, narrow):
        own = model((1.0, -5.0), avoided, limits, torque_weights=(1.0, 2.0, 3.0), **weights)
        expected = [[*posture[:5], branch] for branch, posture, _ in map(own.posture, *angles)]
        assert own.measure(angles).T.tolist() == expected


def test_an_obstacle_at_the_very_point_is_capped() -> None:
    _, own, _ = model().posture(70.0, 40.0)
    _, free, hit = model(avoided=[[1.0, 0, 0.5, own[9], 0.0]]).posture(70.0, 40.0)
    assert (hit[3], hit[0], hit[9]) == (250.0, 250.0, own[9])
    assert free[0] < 250.0, "the other θ3 is kept"


@pytest.mark.parametrize("row", range(6))
def test_limits_make_a_branch_infeasible(row: int) -> None:
    _, own, other = model().posture(70.0, 40.0)
    value = np.array([70.0, 40.0, own[8], *own[5:8]])[row]
    limits = ANYTHING.copy()
    limits[row] = value + 1e-6, np.inf
    branch, now, _ = model(limits=limits).posture(70.0, 40.0)
    if row < 2:
        assert (branch, now[0]) == (-1, 250.0)
    elif branch >= 0:
        assert now[0] == pytest.approx(other[0])
    limits[row] = value - 1e-6, np.inf
    assert model(limits=limits).posture(70.0, 40.0)[1][0] == own[0]
