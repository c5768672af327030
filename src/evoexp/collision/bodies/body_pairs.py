"""Which pairs of a robot's bodies a search tests, by covers, and which the certifier alone judges.

A robot whose pairs were derived when its files were read (`derived_pairs`) brings them along. Of
other robots, pairs that never touch are proven to, and so nobody judges them.
"""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.collision.bodies.shapes import Shapes
from evoexp.collision.body_table import body_table
from evoexp.collision.box_support import coal
from evoexp.collision.derived_pairs import (
    DerivedPairs,
    Pair,
    are_neighbours,
    joint_limits,
    sampled_configurations,
)
from evoexp.collision.motion_bounds import pair_reaches, reaches
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import obstacle_table

SAMPLES = 1000  # random postures by which pairs that always touch are found
GRID, COARSE_GRID = 128, 48  # values per joint by which pairs that never touch are proven
NO_OBSTACLES = obstacle_table(())


class BodyPairs(NamedTuple):
    """All pairs of a robot's bodies, sorted."""

    tested: tuple[Pair, ...]  # pairs that a search tests and the certifier judges
    # pairs on one joint or on neighbouring ones, or disabled: nobody judges them
    adjacent: tuple[Pair, ...]
    always: tuple[Pair, ...] = ()  # pairs that touch in every posture sampled: nobody judges them
    never: tuple[Pair, ...] = ()  # pairs that are proven never to touch: nobody judges them
    # pairs that touch in no posture sampled: only the certifier judges them
    unseen: tuple[Pair, ...] = ()
    # pairs whose covers touch in every posture sampled although the bodies do not: only the
    # certifier judges them
    overlapping: tuple[Pair, ...] = ()
    # pairs whose covers touch at the start or the goal although the bodies do not: only the
    # certifier judges them
    fitted: tuple[Pair, ...] = ()

    @property
    def judged(self) -> tuple[Pair, ...]:
        """Pairs that the certifier judges."""
        return (*self.tested, *self.unseen, *self.overlapping, *self.fitted)


def body_pairs(assembly: Assembly, shapes: Shapes) -> BodyPairs:
    """Sort the pairs of a robot's bodies.

    Args:
        shapes: The covers of its bodies.
    """
    items = list(assembly.geometry.geometryObjects)
    adjacent: list[Pair] = []
    apart: list[Pair] = []
    for a, one in enumerate(items):
        for b, two in enumerate(items[a + 1 :], start=a + 1):
            named = frozenset((one.name, two.name)) in assembly.disabled
            (adjacent if named or are_neighbours(assembly, a, b) else apart).append((a, b))
    q = sampled_configurations(assembly, SAMPLES)
    if not apart or q is None:
        return BodyPairs(tuple(apart), tuple(adjacent))
    if assembly.pairs is not None:
        return _as_derived(assembly, shapes, adjacent, apart, q)
    touching = _coal_touches(assembly, apart, q)
    always = [pair for pair, hits in zip(apart, touching, strict=True) if hits.all()]
    rest = [pair for pair in apart if pair not in always]
    never, overlapping = [], []
    for pair in rest:
        if not touching[apart.index(pair)].any() and _never_touch(assembly, shapes, pair):
            never.append(pair)
        elif _alone(assembly, shapes, pair).collides(q).all():
            overlapping.append(pair)
    left = {*never, *overlapping}
    return BodyPairs(
        tuple(pair for pair in rest if pair not in left),
        tuple(adjacent),
        tuple(always),
        tuple(never),
        overlapping=tuple(overlapping),
    )


def _as_derived(
    assembly: Assembly, shapes: Shapes, adjacent: list[Pair], apart: list[Pair], q: FloatArray
) -> BodyPairs:
    """Sort the pairs that are not adjacent by the data that the robot brings along."""
    assert assembly.pairs is not None
    derived = DerivedPairs.from_json(assembly.pairs)
    names = [item.name for item in assembly.geometry.geometryObjects]
    always, never = set(derived.always), set(derived.never)
    sorted_pairs: dict[str, list[Pair]] = {"always": [], "unseen": [], "over": [], "tested": []}
    for pair in apart:
        named = frozenset(names[body] for body in pair)
        if named in always:
            sorted_pairs["always"].append(pair)
        elif named in never:
            sorted_pairs["unseen"].append(pair)
        else:
            hidden = bool(_alone(assembly, shapes, pair).collides(q).all())
            sorted_pairs["over" if hidden else "tested"].append(pair)
    return BodyPairs(
        tuple(sorted_pairs["tested"]),
        tuple(adjacent),
        tuple(sorted_pairs["always"]),
        unseen=tuple(sorted_pairs["unseen"]),
        overlapping=tuple(sorted_pairs["over"]),
    )


def _coal_touches(assembly: Assembly, pairs: list[Pair], q: FloatArray) -> np.ndarray:
    """Return which pairs touch on coal's geometry, (pairs, configurations)."""
    model, geometry = assembly.model, assembly.geometry
    data, placements = model.createData(), geometry.createData()
    shapes = [item.geometry for item in geometry.geometryObjects]
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    out = np.zeros((len(pairs), q.shape[1]), dtype=np.bool_)
    for n in range(q.shape[1]):
        pin.updateGeometryPlacements(
            model, data, geometry, placements, np.ascontiguousarray(q[:, n])
        )
        places = [coal.Transform3s(place.rotation, place.translation) for place in placements.oMg]
        for k, (a, b) in enumerate(pairs):
            result.clear()
            out[k, n] = (
                coal.collide(shapes[a], places[a], shapes[b], places[b], request, result) > 0
            )
    return out


def _alone(assembly: Assembly, shapes: Shapes, pair: Pair) -> BodyCollision:
    """Return the model of two bodies alone."""
    kept = np.isin(shapes.labels, pair)
    own = Shapes(
        shapes.joint[kept],
        shapes.start[kept],
        shapes.end[kept],
        shapes.radius[kept],
        shapes.labels[kept],
    )
    return BodyCollision.build(assembly.model, own, NO_OBSTACLES, (pair,))


def _never_touch(assembly: Assembly, shapes: Shapes, pair: Pair) -> bool:
    """Return whether two bodies are proven to stay apart.

    The proof takes a grid over the joints between them and a bound of their motion within a step.
    The distances are those of the covers or, where these are too close, coal's on a coarser grid.
    Pairs with more than two joints between them are never proven, and so always tested.
    """
    items, table = list(assembly.geometry.geometryObjects), assembly.table
    bodies = body_table(table, [items[body] for body in pair])
    strokes = np.abs(joint_limits(assembly)).max(axis=0)
    reach = reaches(table.chain, bodies.joint, bodies.from_origin, bodies.from_axis, strokes)
    way = pair_reaches(np.array([[0, 1]], dtype=np.int64), reach)[0]  # (joints,)
    # joints that follow others share their coordinates
    way = np.asarray(
        np.bincount(table.index_q, way * np.abs(table.rule[:, 0]), table.num_coordinates),
        dtype=np.float64,
    )
    moving = np.flatnonzero(way > 0.0)
    if len(moving) > 2:
        return False
    q, slack = _grid(assembly, moving, way, GRID)
    if float(_alone(assembly, shapes, pair).clearance(q).least.min()) > slack:
        return True
    q, slack = _grid(assembly, moving, way, COARSE_GRID)
    return bool(_coal_distances(assembly, pair, q).min() > slack)


def _grid(
    assembly: Assembly, moving: np.ndarray, way: FloatArray, size: int
) -> tuple[FloatArray, float]:
    """Return configurations on a grid, and a bound of a distance's change within half a step.

    Args:
        moving: Indices of the coordinates that the grid spans.
        way: (nq,) bound of |d distance / dq| by coordinate.
        size: Values per coordinate.

    Returns:
        (nq, n) configurations, and the bound [length unit].
    """
    low, high = joint_limits(assembly)
    step = (high[moving] - low[moving]) / size
    values = [low[c] + s * (np.arange(size) + 0.5) for c, s in zip(moving, step, strict=True)]
    grid = np.meshgrid(*values, indexing="ij") if len(moving) else []
    q = np.repeat(0.5 * (low + high)[:, None], grid[0].size if grid else 1, axis=1)
    for column, value in zip(moving, grid, strict=True):
        q[column] = value.ravel()
    return q, float(np.sum(way[moving] * 0.5 * step))


def _coal_distances(assembly: Assembly, pair: Pair, q: FloatArray) -> FloatArray:
    """Return the distances of two bodies, (configurations,)."""
    model, data = assembly.model, assembly.model.createData()
    items = [assembly.geometry.geometryObjects[body] for body in pair]
    request, result, out = coal.DistanceRequest(), coal.DistanceResult(), np.empty(q.shape[1])
    for n in range(q.shape[1]):
        pin.forwardKinematics(model, data, np.ascontiguousarray(q[:, n]))
        places = [data.oMi[item.parentJoint] * item.placement for item in items]
        one, two = (coal.Transform3s(place.rotation, place.translation) for place in places)
        result.clear()
        out[n] = coal.distance(items[0].geometry, one, items[1].geometry, two, request, result)
    return out
