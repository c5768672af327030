"""What a posture costs: terms that a configuration chooses and weighs.

Corsépius 2001, section 4.3.

Every term is a field of the objective: what is given counts, what is not given does not. The cost
is the sum of weight × term. Terms and their units:

- `goal_distance` [length unit]: of the controlled frame from the goal's point, or from the surface
  of an object (inside of it the signed distance is negative; what counts is its magnitude).
- `goal_angle` [rad]: between the controlled frame and the goal's orientation; with the distance a
  full pose.
- `axial_approach` [rad]: between the direction across the grasping direction (y of the tool) and
  the object's axis.
- `heading` [rad]: between the grasping direction (z of the tool) and the way to the object's axis.
- `upright` [rad]: between the up axis (y of the tool, z of an object held) and the direction up.
- `keep_parallel` [rad]: between the grasping direction and the ground plane.
- `limit_margin` [-]: 1 − the smallest distance of a joint from its limits, in units of half its
  range.
- `collision` [-]: 1 if anything touches, else 0.
- `free_space` [-]: how far the clearance falls short of `reach`, in units of it; 0 beyond, 1 in
  contact.
"""

from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from evoexp.errors import SettingError, nearest
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE, acos, asin
from evoexp.records import FloatArray
from evoexp.validation import Component, Positive, Settings

TERMS = (
    "goal_distance",
    "goal_angle",
    "axial_approach",
    "heading",
    "upright",
    "keep_parallel",
    "limit_margin",
    "collision",
    "free_space",
)
DISTANCE, ANGLE, AXIAL, HEADING, UPRIGHT, PARALLEL, MARGIN, COLLISION, FREE_SPACE = range(
    len(TERMS)
)
COLUMNS = (
    "goal_distance",
    "goal_angle_rad",
    "axial_approach_rad",
    "heading_rad",
    "upright_rad",
    "keep_parallel_rad",
    "limit_margin",
    "collision",
    "free_space",
)
"""Names of the terms in records, with their units; lengths are in the scene's."""

HALF_PI = 90.0 * DEGREE
AT = 1e-9  # [length unit] closer to the object's axis than this, every heading is right


class LengthTerm(Settings):
    """A term that is a length.

    Attributes:
        weight: Per length unit.
        unit: Of the term.
    """

    weight: Positive
    unit: Literal["length"] = "length"


class AngleTerm(Settings):
    """A term that is an angle.

    Attributes:
        weight: Per rad or per deg.
        unit: Which of them.
    """

    weight: Positive
    unit: Literal["rad", "deg"] = "rad"

    @property
    def per_radian(self) -> float:
        """The weight per rad."""
        return self.weight / DEGREE if self.unit == "deg" else self.weight


class LimitedAngle(AngleTerm):
    """An angle with a hard limit.

    Attributes:
        limit: Postures beyond it are infeasible [deg].
    """

    limit: Positive


class RatioTerm(Settings):
    """A term without a unit."""

    weight: Positive
    unit: Literal["-"] = "-"


class FreeSpace(RatioTerm):
    """The preference of free regions.

    Attributes:
        reach: Clearance from which on nothing is gained any more [length unit].
    """

    reach: Positive


class PostureCost(Component):
    """Terms and weights; see the module's first lines."""

    component: ClassVar[str] = "posture_cost"

    goal_distance: LengthTerm | None = None
    goal_angle: AngleTerm | None = None
    axial_approach: AngleTerm | None = None
    heading: AngleTerm | None = None
    upright: LimitedAngle | None = None
    keep_parallel: LimitedAngle | None = None
    limit_margin: RatioTerm | None = None
    collision: RatioTerm | None = None
    free_space: FreeSpace | None = None

    @model_validator(mode="after")
    def _terms_agree(self) -> Self:
        if self.goal_distance is None:
            raise SettingError("goal_distance", "given: every goal is a place", None)
        if self.upright is not None and self.keep_parallel is not None:
            must = "left out with upright, which holds another axis of the same frame"
            raise SettingError("keep_parallel", must, self.keep_parallel.weight)
        if self.free_space is not None and self.collision is None:
            raise SettingError(
                "free_space",
                "given with collision, whose distances it rates",
                self.free_space.weight,
            )
        return self

    @property
    def chosen(self) -> tuple[str, ...]:
        """Names of the terms that are given."""
        return tuple(name for name in TERMS if getattr(self, name) is not None)

    def weights(self, terms: tuple[str, ...], field: str) -> FloatArray:
        """Return the weight of every term, (terms,), 0 for those that do not count.

        Args:
            terms: Names of those that count; empty: all that are given.
            field: Where they stand in the configuration, for errors.

        Raises:
            SettingError: If one is unknown, or has no weight in this objective.
        """
        for k, name in enumerate(terms):
            if name not in TERMS:
                raise SettingError(
                    f"{field}[{k}]", f"a cost term ({', '.join(TERMS)})", name, nearest(name, TERMS)
                )
            if name not in self.chosen:
                must = f"a term that the objective gives a weight ({', '.join(self.chosen)})"
                raise SettingError(f"{field}[{k}]", must, name)
        counting = terms or self.chosen
        given = [getattr(self, name) if name in counting else None for name in TERMS]
        rates = [
            term.per_radian if isinstance(term, AngleTerm) else term.weight if term else 0.0
            for term in given
        ]
        return np.array(rates)

    @property
    def tilt_limits(self) -> tuple[float, float]:
        """Hard limits of `upright` and `keep_parallel` [rad]; infinite where there is none."""
        upright, parallel = self.upright, self.keep_parallel
        return (
            DEGREE * upright.limit if upright else np.inf,
            DEGREE * parallel.limit if parallel else np.inf,
        )


@kernel
def rate_poses(count, pose, aim, rows):  # type: ignore[no-untyped-def]
    """Write the terms of a controlled frame: distance, angle, axial, heading, upright, parallel.

    Args:
        count: Configurations.
        pose: (12, configurations) rotation of the controlled frame, row by row, and its origin.
        aim: (30,) of the goal: 0–8 its rotation, row by row; 9–11 its point; 12–14 the axis of the
            object; 15–17 its middle; 18 half the length of its axis; 19 its radius; 20–22 half the
            edges of a box; 23 what the distance is measured to (0: the point, 1: a rod, 2: a
            cylinder, 3: a box); 24–26 up; 27–29 the local up axis.
        rows: (≥ 6, configurations) written.
    """
    for n in range(count):
        xx, xy, xz = pose[0, n], pose[1, n], pose[2, n]
        yx, yy, yz = pose[3, n], pose[4, n], pose[5, n]
        zx, zy, zz = pose[6, n], pose[7, n], pose[8, n]
        px, py, pz = pose[9, n], pose[10, n], pose[11, n]
        dx, dy, dz = aim[9] - px, aim[10] - py, aim[11] - pz
        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
        trace = aim[0] * xx + aim[1] * xy + aim[2] * xz + aim[3] * yx + aim[4] * yy + aim[5] * yz
        trace += aim[6] * zx + aim[7] * zy + aim[8] * zz
        rows[ANGLE, n] = acos(min(max(0.5 * (trace - 1.0), -1.0), 1.0))
        mx, my, mz = px - aim[15], py - aim[16], pz - aim[17]
        along = mx * aim[12] + my * aim[13] + mz * aim[14]
        inner = min(max(along, -aim[18]), aim[18])
        wx, wy, wz = inner * aim[12] - mx, inner * aim[13] - my, inner * aim[14] - mz
        way = np.sqrt(wx * wx + wy * wy + wz * wz)
        if aim[23] == 1.0:
            distance = way - aim[19]
        elif aim[23] == 2.0:
            beside = np.sqrt(max(mx * mx + my * my + mz * mz - along * along, 0.0)) - aim[19]
            beyond = abs(along) - aim[18]
            distance = _outside(beside, beyond, -np.inf)
        elif aim[23] == 3.0:
            u = abs(aim[0] * mx + aim[3] * my + aim[6] * mz) - aim[20]
            v = abs(aim[1] * mx + aim[4] * my + aim[7] * mz) - aim[21]
            w = abs(aim[2] * mx + aim[5] * my + aim[8] * mz) - aim[22]
            distance = _outside(u, v, w)
        rows[DISTANCE, n] = distance
        across = abs(xy * aim[12] + yy * aim[13] + zy * aim[14])
        rows[AXIAL, n] = acos(min(across, 1.0))
        toward = (xz * wx + yz * wy + zz * wz) / max(way, AT)
        rows[HEADING, n] = acos(min(max(toward, -1.0), 1.0)) if way > AT else 0.0
        ux = xx * aim[27] + xy * aim[28] + xz * aim[29]
        uy = yx * aim[27] + yy * aim[28] + yz * aim[29]
        uz = zx * aim[27] + zy * aim[28] + zz * aim[29]
        tilt = ux * aim[24] + uy * aim[25] + uz * aim[26]
        rows[UPRIGHT, n] = acos(min(max(tilt, -1.0), 1.0))
        rise = xz * aim[24] + yz * aim[25] + zz * aim[26]
        rows[PARALLEL, n] = abs(asin(min(max(rise, -1.0), 1.0)))


@kernel
def _outside(u, v, w):  # type: ignore[no-untyped-def]
    """Signed distance from what a point is beyond the faces by."""
    a, b, c = max(u, 0.0), max(v, 0.0), max(w, 0.0)
    return np.sqrt(a * a + b * b + c * c) + min(max(u, max(v, w)), 0.0)


@kernel
def rate_limits(count, q, limits, row):  # type: ignore[no-untyped-def]
    """Write 1 − the smallest normalised margin of the joints.

    Args:
        count: Configurations.
        q: (nq, configurations).
        limits: (nq, 2).
        row: (configurations,) written.
    """
    for n in range(count):
        row[n] = 1.0
    for k in range(len(limits)):
        low, high = limits[k, 0], limits[k, 1]
        half = 0.5 * (high - low)
        for n in range(count):
            margin = min(q[k, n] - low, high - q[k, n]) / half
            row[n] = min(row[n], margin)
    for n in range(count):
        row[n] = 1.0 - row[n]
