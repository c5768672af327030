"""The cost of a posture: terms that a configuration chooses and weighs.

Corsépius 2001, section 4.3. Every term is a field of the objective, and counts if it is given. The
cost is the sum of weight × term. Terms and their units:

- `goal_distance` [length unit]: of the controlled frame from the goal's point, or from the surface
  of an object (negative inside of it; its magnitude counts).
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
- `free_space` [-]: missing clearance up to `reach`, in units of `reach`; 0 beyond, 1 in contact.
"""

from typing import Literal, NamedTuple

import numpy as np

from evoexp.errors import SettingError, demand, nearest
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
IN_RADIANS = (ANGLE, AXIAL, HEADING, UPRIGHT, PARALLEL)
COLUMNS = tuple(f"{name}_rad" if k in IN_RADIANS else name for k, name in enumerate(TERMS))
"""Names of the terms in records, with their units; lengths are in the scene's."""

POINT, ROD, ROUND, EDGED = range(4)  # surfaces that a distance is measured to, see `Aim`
AT = 1e-9  # [length unit] closer to the object's axis than this, every heading is right


class LengthTerm(Settings):
    """A term that is a length."""

    weight: Positive  # per length unit
    unit: Literal["length"] = "length"  # of the term


class AngleTerm(Settings):
    """A term that is an angle."""

    weight: Positive  # per rad or per deg
    unit: Literal["rad", "deg"] = "rad"  # which of them


class LimitedAngle(AngleTerm):
    """An angle with a hard limit."""

    limit: Positive  # postures beyond it are infeasible [deg]


class RatioTerm(Settings):
    """A term without a unit."""

    weight: Positive
    unit: Literal["-"] = "-"


class FreeSpace(RatioTerm):
    """The preference of free regions."""

    reach: Positive  # least clearance that counts as free [length unit]


class PostureCost(Component):
    """Terms and weights; see the module's first lines."""

    goal_distance: LengthTerm | None = None
    goal_angle: AngleTerm | None = None
    axial_approach: AngleTerm | None = None
    heading: AngleTerm | None = None
    upright: LimitedAngle | None = None
    keep_parallel: LimitedAngle | None = None
    limit_margin: RatioTerm | None = None
    collision: RatioTerm | None = None
    free_space: FreeSpace | None = None
    # how `axial_approach` and `heading` count: their `sum`, or the `larger` one alone, each
    # times its weight
    grasp_angles: Literal["sum", "larger"] = "sum"

    def _check(self) -> None:
        must = "given: every goal is a place"
        self.demand("goal_distance", self.goal_distance is not None, must)
        if self.upright is not None and self.keep_parallel is not None:
            must = "left out with upright, which holds another axis of the same frame"
            raise SettingError("keep_parallel", must, self.keep_parallel.weight)
        if self.free_space is not None and self.collision is None:
            must = "given with collision, whose distances it rates"
            raise SettingError("free_space", must, self.free_space.weight)

    @property
    def chosen(self) -> tuple[str, ...]:
        """Names of the terms that are given."""
        return tuple(name for name in TERMS if getattr(self, name) is not None)

    def weights(self, terms: tuple[str, ...], field: str) -> FloatArray:
        """Return the weight of every term, (terms,); 0: the term does not count.

        Args:
            terms: Names of the terms that count; empty: all that are given.
            field: Their place in the configuration, for errors.

        Raises:
            SettingError: If a term is unknown, or has no weight in this objective.
        """
        for k, name in enumerate(terms):
            if name not in TERMS:
                must = f"a cost term ({', '.join(TERMS)})"
                raise SettingError(f"{field}[{k}]", must, name, nearest(name, TERMS))
            must = f"a term that the objective gives a weight ({', '.join(self.chosen)})"
            demand(name in self.chosen, f"{field}[{k}]", must, name)
        counting = terms or self.chosen
        given = [getattr(self, name) if name in counting else None for name in TERMS]
        weights = [term.weight if term else 0.0 for term in given]
        units = [DEGREE if term and term.unit == "deg" else 1.0 for term in given]
        return np.array(weights) / units  # of angles per rad

    @property
    def tilt_limits(self) -> tuple[float, float]:
        """Hard limits of `upright` and `keep_parallel` [rad]; infinite where there is none."""
        upright, parallel = self.upright, self.keep_parallel
        return (
            DEGREE * upright.limit if upright else np.inf,
            DEGREE * parallel.limit if parallel else np.inf,
        )


class Aim(NamedTuple):
    """The goal of a phase, as `rate_poses` takes it."""

    # (9,) wanted rotation of the controlled frame, row by row; or that of an object
    rotation: FloatArray
    # (3,) wanted place; of the surface of an object the object's middle [length unit]
    point: FloatArray
    axis: FloatArray  # (3,) axis of the object
    # the distance is measured to POINT, to a ROD (also a sphere), to a ROUND (a cylinder) or to an
    # EDGED body (a box)
    surface: int
    half_length: float  # half the length of the object's axis [length unit]
    radius: float  # of rods and cylinders [length unit]
    half_edges: FloatArray  # (3,) of a box [length unit]
    up: FloatArray  # (3,) direction up
    local_up: FloatArray  # (3,) the up axis of the controlled frame


@kernel
def rate_poses(count: int, pose: FloatArray, aim: Aim, rows: FloatArray) -> None:
    """Write the terms of a controlled frame: distance, angle, axial, heading, upright, parallel.

    Args:
        count: Configurations.
        pose: (12, configurations) rotation of the controlled frame, row by row, and its origin.
        rows: (≥ 6, configurations) written.
    """
    turn, axis, up, local_up, edges = aim.rotation, aim.axis, aim.up, aim.local_up, aim.half_edges
    for n in range(count):
        xx, xy, xz = pose[0, n], pose[1, n], pose[2, n]
        yx, yy, yz = pose[3, n], pose[4, n], pose[5, n]
        zx, zy, zz = pose[6, n], pose[7, n], pose[8, n]
        # the frame's place seen from the goal's, distance from its point
        mx, my, mz = (
            pose[9, n] - aim.point[0],
            pose[10, n] - aim.point[1],
            pose[11, n] - aim.point[2],
        )
        distance = np.sqrt(mx * mx + my * my + mz * mz)
        # angle between both orientations
        trace = turn[0] * xx + turn[1] * xy + turn[2] * xz + turn[3] * yx + turn[4] * yy
        trace = trace + turn[5] * yz + (turn[6] * zx + turn[7] * zy + turn[8] * zz)
        rows[ANGLE, n] = acos(min(max(0.5 * (trace - 1.0), -1.0), 1.0))
        # the shortest way to the object's axis, signed distance from its surface
        along = mx * axis[0] + my * axis[1] + mz * axis[2]
        inner = min(max(along, -aim.half_length), aim.half_length)
        wx, wy, wz = inner * axis[0] - mx, inner * axis[1] - my, inner * axis[2] - mz
        way = np.sqrt(wx * wx + wy * wy + wz * wz)
        if aim.surface == ROD:
            distance = way - aim.radius
        elif aim.surface == ROUND:
            beside = np.sqrt(max(mx * mx + my * my + mz * mz - along * along, 0.0)) - aim.radius
            distance = _signed_distance(beside, abs(along) - aim.half_length, -np.inf)
        elif aim.surface == EDGED:
            u = abs(turn[0] * mx + turn[3] * my + turn[6] * mz) - edges[0]
            v = abs(turn[1] * mx + turn[4] * my + turn[7] * mz) - edges[1]
            w = abs(turn[2] * mx + turn[5] * my + turn[8] * mz) - edges[2]
            distance = _signed_distance(u, v, w)
        rows[DISTANCE, n] = distance
        # grasping: across the axis, toward the axis
        across = abs(xy * axis[0] + yy * axis[1] + zy * axis[2])
        rows[AXIAL, n] = acos(min(across, 1.0))
        toward = (xz * wx + yz * wy + zz * wz) / max(way, AT)
        rows[HEADING, n] = acos(min(max(toward, -1.0), 1.0)) if way > AT else 0.0
        # tilts of the up axis and of the grasping direction
        ux = xx * local_up[0] + xy * local_up[1] + xz * local_up[2]
        uy = yx * local_up[0] + yy * local_up[1] + yz * local_up[2]
        uz = zx * local_up[0] + zy * local_up[1] + zz * local_up[2]
        rows[UPRIGHT, n] = acos(min(max(ux * up[0] + uy * up[1] + uz * up[2], -1.0), 1.0))
        rise = xz * up[0] + yz * up[1] + zz * up[2]
        rows[PARALLEL, n] = abs(asin(min(max(rise, -1.0), 1.0)))


@kernel
def _signed_distance(u: float, v: float, w: float) -> float:
    """Return the distance from a body of three pairs of faces, negative inside.

    u, v, w are how far the point is beyond the nearer face of each; negative between them.
    """
    a, b, c = max(u, 0.0), max(v, 0.0), max(w, 0.0)
    distance: float = np.sqrt(a * a + b * b + c * c) + min(max(u, max(v, w)), 0.0)
    return distance


@kernel
def rate_limits(count: int, q: FloatArray, limits: FloatArray, row: FloatArray) -> None:
    """Write 1 − the smallest normalised margin (configurations,) of the joints q (nq, …)."""
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
