"""Which pairs of a robot's bodies a search tests, by covers, and which the certifier alone judges.

A robot whose pairs were derived when its files were read (`derived_pairs`) brings them along. Of
other robots, pairs that never touch are proven to, and so nobody judges them.
"""

import itertools
from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.collision.bodies.packing import Shapes
from evoexp.collision.derived_pairs import (
    DerivedPairs,
    Pair,
    are_neighbours,
    derive_pairs,
    joint_limits,
    sampled_configurations,
)
from evoexp.collision.distance_maps import approach_speeds, coal_distances
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly

SAMPLES = 1000  # random postures by which pairs that always touch are found
GRID, COARSE_GRID = 128, 48  # values per joint by which pairs that never touch are proven


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
    # pairs whose covers always touch, tested by maps of their distances
    mapped: tuple[Pair, ...] = ()
    # pairs whose covers touch at the start or the goal although the bodies do not: only the
    # certifier judges them
    fitted: tuple[Pair, ...] = ()

    @property
    def judged(self) -> tuple[Pair, ...]:
        """Pairs that the certifier judges."""
        return (*self.tested, *self.unseen, *self.overlapping, *self.mapped, *self.fitted)


def body_pairs(assembly: Assembly, shapes: Shapes) -> BodyPairs:
    """Sort the pairs of a robot's bodies.

    Args:
        shapes: The covers of its bodies.
    """
    q, is_given = sampled_configurations(assembly, SAMPLES), assembly.pairs is not None
    derived = (
        derive_pairs(assembly, SAMPLES)
        if assembly.pairs is None
        else DerivedPairs.from_json(assembly.pairs)
    )
    groups = dict[str, tuple[Pair, ...]](tested=(), adjacent=())
    items = enumerate(assembly.geometry.geometryObjects)
    for (a, one), (b, two) in itertools.combinations(items, 2):
        pair, names = (a, b), frozenset((one.name, two.name))
        if names in assembly.disabled or are_neighbours(assembly, a, b):
            group = "adjacent"
        elif q is None:
            group = "tested"
        elif names in derived.always:
            group = "always"
        elif names in derived.never and is_given:
            group = "unseen"
        elif names in derived.never and _never_touch(assembly, shapes, pair):
            group = "never"
        elif BodyCollision.of_pair(assembly.table, shapes, pair).collides(q).all():
            group = "overlapping"
        else:
            group = "tested"
        groups[group] = (*groups.get(group, ()), pair)
    return BodyPairs(**groups)


def _never_touch(assembly: Assembly, shapes: Shapes, pair: Pair) -> bool:
    """Return whether two bodies are proven to stay apart.

    The proof takes a grid over the joints between them and a bound of their motion within a step.
    The distances are those of the covers or, where these are too close, coal's on a coarser grid.
    Pairs with more than two joints between them are never proven, and so always tested.
    """
    way = approach_speeds(assembly, pair)
    moving = np.flatnonzero(way > 0.0)
    if len(moving) > 2:
        return False
    q, slack = _grid(assembly, moving, way, GRID)
    if float(BodyCollision.of_pair(assembly.table, shapes, pair).clearance(q).least.min()) > slack:
        return True
    q, slack = _grid(assembly, moving, way, COARSE_GRID)
    return bool(coal_distances(assembly, pair, q).min() > slack)


def _grid(
    assembly: Assembly, moving: np.ndarray, way: FloatArray, size: int
) -> tuple[FloatArray, float]:
    """Return configurations (nq, n) on a grid over some coordinates, `size` values of each.

    Also a bound of a distance's change within half a step, from that of |d distance / dq|, (nq,).
    """
    low, high = joint_limits(assembly)
    step = (high[moving] - low[moving]) / size
    values = [low[c] + s * (np.arange(size) + 0.5) for c, s in zip(moving, step, strict=True)]
    grid = np.meshgrid(*values, indexing="ij") if len(moving) else []
    q = np.repeat(0.5 * (low + high)[:, None], grid[0].size if grid else 1, axis=1)
    for column, value in zip(moving, grid, strict=True):
        q[column] = value.ravel()
    return q, float(np.sum(way[moving] * 0.5 * step))
