"""Maps of two bodies' distance over the joints between them, for pairs whose covers always touch.

The distance of bodies with one or two joints between them depends on one or two coordinates. A map
holds, for every cell of a grid over these, a bound of the exact distance from below: coal's in the
middle of the cell, less what the bodies can approach each other within it. Where the bound is
positive the bodies are proven apart.
"""

from itertools import product
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.body_table import body_table, geometry_key
from evoexp.collision.box_support import coal, distance
from evoexp.collision.derived_pairs import Pair, joint_limits
from evoexp.collision.motion_bounds import pair_reaches, reaches
from evoexp.numeric.cache_folder import cache_root, kept
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray, IntArray
from evoexp.robots.assembly import Assembly

COARSE, FINE = 128, 256  # cells along each coordinate
BEYOND = 1e-6  # [rad] or [length unit]: a map reaches so far beyond the joints' limits
TURN = 2.0 * np.pi


class DistanceMap(NamedTuple):
    """Bounds of the distance of two bodies from below, over two coordinates."""

    pair: Pair  # indices of both bodies
    coordinates: IntArray  # (2,) of q; the same twice where there is one, with one cell along it
    low: FloatArray  # (2,) where the grid begins [rad] or [length unit]
    step: FloatArray  # (2,) of a cell; the grid of a joint that turns once or more has a period
    bounds: FloatArray  # (cells, cells) [length unit]

    @property
    def around(self) -> FloatArray:
        """Least bounds of every cell and its neighbours, by which a search tests configurations.

        A line whose tested configurations stand at most a cell apart passes no other cell.
        """
        rows = np.minimum.reduce([np.roll(self.bounds, k, axis=0) for k in (-1, 0, 1)])
        return np.asarray(np.minimum.reduce([np.roll(rows, k, axis=1) for k in (-1, 0, 1)]))

    def at(self, q: FloatArray) -> FloatArray:
        """Return the bounds `around` configurations (nq, configurations) [rad]."""
        cells = np.floor((q[self.coordinates] - self.low[:, None]) / self.step[:, None])
        first, second = cells.astype(np.int64) % np.array(self.bounds.shape)[:, None]
        return np.asarray(self.around[first, second])

    def least(self, motion: Motion) -> float:
        """Return a bound of the distance over a whole motion from below; −inf if it is curved."""
        if motion.coefficients is not None:
            return -np.inf
        cells = (motion.q[:, self.coordinates] - self.low) / self.step  # (instants, 2)
        # pieces no longer than a cell: each lies within two cells along either coordinate
        ways = np.diff(cells, axis=0)
        counts = np.maximum(np.ceil(np.abs(ways).max(axis=1)), 1.0).astype(np.int64)
        nth = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        first, piece = (np.repeat(x, counts, axis=0) for x in (cells[:-1], ways / counts[:, None]))
        starts = np.concatenate([first + nth[:, None] * piece, cells[-1:]])
        ends = np.concatenate([first + (nth[:, None] + 1) * piece, cells[-1:]])
        low = np.floor(np.minimum(starts, ends)).astype(np.int64).T
        high = np.floor(np.maximum(starts, ends)).astype(np.int64).T
        rows, columns = self.bounds.shape
        corners = product((low[0] % rows, high[0] % rows), (low[1] % columns, high[1] % columns))
        return min(float(self.bounds[corner].min()) for corner in corners)


def distance_map(assembly: Assembly, pair: Pair) -> DistanceMap | None:
    """Return the map of two bodies, from where it is kept if it was made before.

    Args:
        assembly: A robot whose joints all have limits.
        pair: Indices of the bodies; with more than two joints between them they have no map.
    """
    way = approach_speeds(assembly, pair)
    moving = np.flatnonzero(way > 0.0)
    if not 1 <= len(moving) <= 2:
        return None
    coordinates = np.array([moving[0], moving[-1]])
    low, high = joint_limits(assembly)[:, coordinates] + np.array([[-BEYOND], [BEYOND]])
    turns = ~np.isin(coordinates, assembly.table.chain.index_q[assembly.table.chain.prismatic])
    span = np.where(turns, np.minimum(high - low, TURN), high - low)
    shape = np.array([FINE, FINE if len(moving) == 2 else 1])
    items = [assembly.geometry.geometryObjects[body] for body in pair]
    path = cache_root() / "distances" / geometry_key(items, *assembly.table.chain, low, span)
    asked = assembly, pair, coordinates, low, span, way[moving]
    bounds = np.frombuffer(kept(path, lambda: _bounds(*asked).tobytes())).reshape(shape)
    proves_nothing = not (bounds > 0.0).any()
    return None if proves_nothing else DistanceMap(pair, coordinates, low, span / shape, bounds)


def _bounds(
    assembly: Assembly,
    pair: Pair,
    coordinates: IntArray,
    low: FloatArray,
    span: FloatArray,
    speeds: FloatArray,  # bounds of |d distance / dq| by each coordinate that counts
) -> FloatArray:
    """Return the bounds of a map, with fine cells where coarse ones do not suffice."""
    bounds, num = np.full((1, 1), -np.inf), len(speeds)
    for cells in (COARSE, FINE):
        shape = (cells, cells if num == 2 else 1)
        for axis in range(2):
            bounds = np.repeat(bounds, shape[axis] // bounds.shape[axis], axis=axis)
        step = span / shape
        slack = float(np.sum(0.5 * step[:num] * speeds))
        near = np.nonzero(bounds < slack)
        q = np.repeat(pin.neutral(assembly.model)[:, None], len(near[0]), axis=1)
        for k in range(num):
            q[coordinates[k]] = low[k] + step[k] * (near[k] + 0.5)
        bounds[near] = np.maximum(bounds[near], coal_distances(assembly, pair, q) - slack)
    return bounds


def approach_speeds(assembly: Assembly, pair: Pair) -> FloatArray:
    """Return bounds of |d distance / dq| of two bodies, (nq,); 0 of joints not between them."""
    items, table = list(assembly.geometry.geometryObjects), assembly.table
    bodies, chain = body_table(table, [items[body] for body in pair]), table.chain
    strokes = np.abs(joint_limits(assembly)).max(axis=0)
    reach = reaches(chain, bodies.joint, bodies.from_origin, bodies.from_axis, strokes)
    way = pair_reaches(np.array([[0, 1]], dtype=np.int64), reach)[0]  # (joints,)
    # joints that follow others share their coordinates
    way = np.bincount(chain.index_q, way * np.abs(chain.rule[:, 0]), table.num_coordinates)
    return np.asarray(way, dtype=np.float64)


def coal_distances(assembly: Assembly, pair: Pair, q: FloatArray) -> FloatArray:
    """Return coal's distances (configurations,) of two bodies at q (nq, configurations)."""
    model, data, distances = assembly.model, assembly.model.createData(), np.empty(q.shape[1])
    one, two = (assembly.geometry.geometryObjects[body] for body in pair)
    for n in range(q.shape[1]):
        pin.forwardKinematics(model, data, np.ascontiguousarray(q[:, n]))
        places = (data.oMi[item.parentJoint] * item.placement for item in (one, two))
        first, second = (coal.Transform3s(place.rotation, place.translation) for place in places)
        distances[n] = distance(one.geometry, first, two.geometry, second)
    return distances
