"""A planar arm's tip is brought to a place as damped least squares, by numpy, bring it."""

import numpy as np

from evoexp.records import FloatArray
from evoexp.robots.planar_ends import CLOSE, DAMPING, MOST_STEPS, PlanarArm, bring_tip_to


def plain_steps(q: FloatArray, target: FloatArray, limits: FloatArray, arm: PlanarArm) -> bool:
    """Step by Jᵀ (J Jᵀ + λ)⁻¹ e, the Jacobian by turning the way from each joint to the tip."""
    reach = arm.lengths.sum()
    for _ in range(MOST_STEPS):
        links = arm.lengths * np.exp(1j * (arm.base_angle + np.cumsum(q)))
        to_tip = np.cumsum(links[::-1])[::-1]  # from each joint
        error = complex(*target) - complex(arm.base_x, arm.base_y) - links.sum()
        if abs(error) <= CLOSE * reach:
            return True
        jacobian = np.array([(1j * to_tip).real, (1j * to_tip).imag])  # (2, N)
        square = jacobian @ jacobian.T + DAMPING * reach**2 * np.eye(2)
        q += jacobian.T @ np.linalg.solve(square, [error.real, error.imag])
        q[:] = np.clip(q, *limits.T)
    return False


def test_postures_are_those_of_damped_least_squares() -> None:
    rng, found = np.random.default_rng(0), 0
    arm = PlanarArm(np.array([0.5, 0.4, 0.3]), 0.1, -0.2, 0.3)
    limits = np.array([[-2.5, 2.5]] * 3)
    for _ in range(40):
        q, target = rng.uniform(-2.5, 2.5, 3), rng.uniform(-0.7, 0.7, 2)
        plain = q.copy()
        there = bring_tip_to(q, target, limits, arm)
        assert there is plain_steps(plain, target, limits, arm)
        if there:
            found += 1
            np.testing.assert_allclose(q, plain, atol=1e-6)
    assert found > 20
