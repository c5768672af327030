"""A mobile arm's posture as a smooth programme over the directions of its links.

x = (φ1, φ2, φ3) [rad] are the directions of the three links; one equation ties them: the
end-effector's height. The minimax term of Chen & Zalzala (1995, Eq. 11) is a bound:
z = (φ1, φ2, φ3, t), t above every |α τ|. Nothing is shared with the planner's own kernels, which
use joint angles.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import sincos
from evoexp.objectives.placement_criteria import Model
from evoexp.records import FloatArray

INSIDE = 1e-11  # [rad], of torques [-]: on a limit, in spite of rounding, is within it
TURN = 360.0  # [deg]
SMALLEST = 1e-300  # keeps quotients finite
STEP = 1e-30  # of complex steps: its square vanishes beside anything
AnyArray = NDArray[Any]  # real, or complex for derivatives
# rows: the objective, the height (which must be 0), then margins (which must not be negative)
OBJECTIVE, HEIGHT, MARGINS = range(3)
TORQUE_BOUNDS = 6  # margins of the minimax term: t − α τ and t + α τ


class Directions(NamedTuple):
    """Task, weights and limits of the criteria over the links' directions."""

    lengths: FloatArray  # (3,) l1, l2, l3
    target: FloatArray  # (2,) X_e, Y_e
    force: FloatArray  # (2,)
    weights: FloatArray  # ε, λ, δ of Eq. 14, α1, α2, α3 of Eq. 11
    avoided: FloatArray  # (n, 5) γ, link, place, X_o, Y_o of Eq. 12
    joint_limits: FloatArray  # (3, 2) θ1, θ2, θ3 [rad]
    torque_limits: FloatArray  # (3, 2)

    def bounds(self) -> FloatArray:
        """Return the finite limits, (m, 3): limited quantity, 1.0 (from below) or −1.0, limit.

        Quantities: 0, 1, 2 are joint angles; 3, 4, 5 torques.
        """
        limits = np.concatenate([self.joint_limits, self.torque_limits])
        quantity, side = np.nonzero(np.isfinite(limits))
        return np.column_stack([quantity, 1.0 - 2.0 * side, limits[quantity, side]])

    def theta(self, x: FloatArray) -> FloatArray:
        """Return θ1, θ2 [deg] of x, both in [−180, 180)."""
        angles = np.degrees(np.array([x[0], x[1] - x[0]]))
        return np.asarray(angles - TURN * np.floor((angles + TURN / 2) / TURN))

    def directions(self, theta: FloatArray, theta_3: float) -> FloatArray:
        """Return x of joint angles θ1, θ2 and θ3 [deg]."""
        return np.asarray(np.radians(np.cumsum([theta[0], theta[1], theta_3])))

    def reaching(self, theta: FloatArray, to_the_left: bool) -> FloatArray:
        """Return x of θ1 and θ2 [rad] at which the end-effector has its height."""
        one, both = theta[0], theta[0] + theta[1]
        _, up = self.links(np.array([one, both, 0.0]))
        upward = np.arcsin((self.target[1] - up[0] - up[1]) / self.lengths[2])
        third = np.pi - upward if to_the_left else upward
        # θ3 in [−π, π)
        turns = np.floor((third - both + np.pi) / (2.0 * np.pi))
        return np.array([one, both, third - 2.0 * np.pi * turns])

    def links(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the extents of the links along x and along y, both (3, …), at directions x."""
        angles = np.ascontiguousarray(x)
        sines, cosines = np.empty(angles.shape), np.empty(angles.shape)
        _sincos(angles.ravel(), sines.ravel(), cosines.ravel())
        lengths = self.lengths.reshape((3,) + (1,) * (x.ndim - 1))
        return lengths * cosines, lengths * sines

    def torques(self, across: AnyArray, up: AnyArray) -> tuple[AnyArray, AnyArray, AnyArray]:
        """Return the Jacobian's columns, x and y, and torques (Eq. 8), (3, …), joint 3 first."""
        jx, jy = -np.cumsum(up[::-1], axis=0), np.cumsum(across[::-1], axis=0)
        return jx, jy, jx * self.force[0] + jy * self.force[1]

    def costs(self, across: AnyArray, up: AnyArray, greatest: AnyArray | None = None) -> AnyArray:
        """Return E of Eq. 14 by extents (3, …), uncapped; `greatest` replaces |α τ| (Eq. 11)."""
        epsilon, lam, delta, *alphas = self.weights
        jx, jy, torques = self.torques(across, up)
        if greatest is None:
            weighted = zip(alphas[::-1], torques, strict=True)
            greatest = np.maximum.reduce([abs(alpha * torque) for alpha, torque in weighted])
        determinant = dot(jx, jx) * dot(jy, jy) - dot(jx, jy) ** 2
        singular = delta / np.maximum(determinant, SMALLEST)  # Eq. 13
        costs = epsilon * dot(torques, torques) + lam * greatest + singular
        # obstacles (Eq. 12); of each link the share before the point that avoids
        platform = self.target[0] - across[::-1].sum(axis=0)
        for gamma, link, place, x_o, y_o in self.avoided:
            dx, dy = platform - x_o, -y_o
            for k in range(3):
                share = 1.0 if k + 1 < link else place * (k + 1 == link)
                dx, dy = dx + share * across[k], dy + share * up[k]
            costs = costs + gamma / np.maximum(dx * dx + dy * dy, SMALLEST)
        return np.asarray(costs)


def dot(one: AnyArray, two: AnyArray) -> AnyArray:
    """Return the scalar products of columns (3, …), added in the order of their rows."""
    return np.asarray(one[0] * two[0] + one[1] * two[1] + one[2] * two[2])


@kernel
def _sincos(x: FloatArray, sines: FloatArray, cosines: FloatArray) -> None:
    """Write sines and cosines (n,) of x [rad]."""
    for n in range(len(x)):
        sines[n], cosines[n] = sincos(x[n])


def directions_of(model: Model, angle_limits: FloatArray) -> Directions:
    """Return the criteria of a planner's model; `angle_limits` below a turn limit θ1 or θ2."""
    task, joints = np.array(model.task), model.limits[:3].copy()
    for k, (least, greatest) in enumerate(angle_limits):
        if greatest - least < TURN:
            joints[k] = max(least, joints[k, 0]), min(greatest, joints[k, 1])
    inside = INSIDE * np.array([1.0, -1.0])
    limits = np.radians(joints) + inside, model.limits[3:] + inside
    weights = np.array(model.weights[:6])
    return Directions(task[:3], task[3:5], task[5:7], weights, model.avoided, *limits)


class End(NamedTuple):
    """The end of an optimiser's way."""

    x: FloatArray  # (3,) directions of the links [rad]
    cost: float  # E there, without any cap
    evaluations: int  # evaluations of the cost


class Programme:
    """Minimise smooth(x) + λ t, t above all |α τ|, height 0, no margin negative; no t if λ is 0."""

    def __init__(self, model: Directions) -> None:
        self._model, self._bounds = model, model.bounds()
        self.minimax = bool(model.weights[1])
        self._where = b""

    def measured(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return objective, height, margins at z, (2 + margins,), and slopes by complex steps."""
        if z.tobytes() != self._where:
            found = self._rows(z[:, None] + 1j * STEP * np.eye(len(z)))
            self._values, self._slopes = found[:, 0].real.copy(), found.imag / STEP
            self._where = z.tobytes()
        return self._values, self._slopes

    def _rows(self, z: AnyArray) -> AnyArray:
        """Return objective, height and margins (2 + margins, n) at complex places z (len(z), n)."""
        model, x, t = self._model, z[:3], z[3] if self.minimax else 0.0 * z[0]
        across, up = (model.lengths[:, None] * turn for turn in (np.cos(x), np.sin(x)))
        torques = model.torques(across, up)[2][::-1]
        weighted = model.weights[3:, None] * torques
        quantities = [x[0], x[1] - x[0], x[2] - x[1], *torques]
        margins = [*(t - weighted), *(t + weighted)] if self.minimax else []
        margins += [sign * (quantities[int(k)] - limit) for k, sign, limit in self._bounds]
        return np.array([model.costs(across, up, t), up.sum(axis=0) - model.target[1], *margins])

    def start(self, x: FloatArray) -> FloatArray:
        """Return z at directions x."""
        if not self.minimax:
            return x
        values, _ = self.measured(np.append(x, 0.0))
        return np.append(x, -values[MARGINS : MARGINS + TORQUE_BOUNDS].min())

    def cost(self, x: FloatArray) -> float:
        """Return E of Eq. 14 at directions x, without any cap."""
        return float(self.measured(self.start(x))[0][OBJECTIVE])

    def is_legal(self, x: FloatArray, tolerance: float) -> bool:
        """Return whether directions reach the target within all limits."""
        values, _ = self.measured(self.start(x))
        return bool(abs(values[HEIGHT]) < tolerance and (values[MARGINS:] > -tolerance).all())

    def descend(self, x: FloatArray, most_steps: int = 200) -> End:
        """Minimise E from x by sequential quadratic programming (SLSQP)."""
        height, margins = slice(HEIGHT, MARGINS), slice(MARGINS, None)
        kinds = [("eq", height), ("ineq", margins)][: 1 + (self.minimax or len(self._bounds) > 0)]
        minimize: Any = optimize.minimize  # whose overloads no callable of ours fits
        found = minimize(
            lambda z: float(self.measured(z)[0][OBJECTIVE]),
            self.start(x),
            jac=lambda z: self.measured(z)[1][OBJECTIVE].copy(),  # scipy keeps it
            constraints=[
                {
                    "type": kind,
                    "fun": lambda z, rows=rows: self.measured(z)[0][rows],
                    "jac": lambda z, rows=rows: self.measured(z)[1][rows],
                }
                for kind, rows in kinds
            ],
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": most_steps},
        )
        return End(found.x[:3], self.cost(found.x[:3]), int(found.nfev))
