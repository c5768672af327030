"""Postures of the mobile arm by Pinocchio, and over the directions of links 2 and 3."""

import numpy as np
import pinocchio as pin

from evoexp.robots.mobile_robots import MobileArm

LENGTHS = (1.0, 1.0, 0.5)


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


def dense_least(cost: object, height: float, num: int) -> float:
    """Return the least cost of (3, n) over a grid of φ2, φ3 with both values of φ1 there are."""
    grid = np.linspace(-np.pi, np.pi, num, endpoint=False)
    two, three = (values.ravel() for values in np.meshgrid(grid, grid))
    sine = (height - LENGTHS[1] * np.sin(two) - LENGTHS[2] * np.sin(three)) / LENGTHS[0]
    kept = np.abs(sine) <= 1.0
    first = np.arcsin(sine[kept])
    both = (np.stack([one, two[kept], three[kept]]) for one in (first, np.pi - first))
    return min(float(np.min(cost(x))) for x in both)  # type: ignore[operator]
