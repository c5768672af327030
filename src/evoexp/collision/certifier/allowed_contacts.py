"""Exact depths of pairs that may touch, over a whole continuous motion.

A signed distance is negative where bodies overlap: minus the length of the shortest shift that
parts them. Both bodies are convex, so it is the greatest, over all directions, of the gap between
the two planes across a direction that support the bodies; none of these gaps changes faster than a
point of one body can move relative to the other. The bounds of speed by which distances are
searched therefore hold for depths, too.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.certifier.coal_distances import (
    CoalDistance,
    LeafGoals,
    QueryLimit,
    search_interval,
)
from evoexp.collision.certifier.task import approach_weights
from evoexp.collision.motion_bounds import approach_bounds
from evoexp.collision.scene import AllowedContact, Scene
from evoexp.paths.motion import Motion

MOST_QUERIES = 100_000
RESOLUTION = 0.02  # [-] of the allowed depth, up to which the greatest depth is found
EPA_ERROR = 1e-6  # [-] of the scene's size: of coal's depths, by its own tolerance


class Depth(NamedTuple):
    """The greatest depth of one pair that may touch."""

    contact: AllowedContact  # the pair
    greatest: float  # greatest depth found; 0 if the bodies never touch [length unit]
    at: float  # where [instant]
    # where the bodies first overlap deeper than they may [instant]; None: nowhere
    too_deep_at: float | None
    decided: bool  # whether the limit of queries was enough


class _DepthGoals(LeafGoals):
    """Asks for the greatest depth instead of the least clearance."""

    def target(self, upper: float) -> float:
        """Return the lower bound that is enough while `upper` is the least distance found."""
        return max(min(upper, 0.0) - self.resolution, self.level)


def contact_depths(scene: Scene, motion: Motion) -> tuple[tuple[Depth, ...], int]:
    """Find the greatest depths of a scene's allowed contacts, and count coal's queries.

    Args:
        scene: The bodies; only its `contacts` are looked at.
        motion: In the units of the model.
    """
    if not scene.contacts:
        return (), 0
    pairs = np.array([contact[:2] for contact in scene.contacts], dtype=np.int64)
    distance = CoalDistance(scene._replace(pairs=pairs), motion, MOST_QUERIES)
    chain = scene.table.chain
    weights = approach_weights(chain, scene.bodies, pairs, motion.greatest)
    found = []
    for k, contact in enumerate(scene.contacts):
        depth = Depth(contact, 0.0, 0.0, None, True)
        try:
            found.append(_searched(depth, k, distance, weights))
        except QueryLimit:
            found.append(depth._replace(decided=False))
    return tuple(found), distance.queries


def _searched(depth: Depth, pair: int, distance: CoalDistance, weights: np.ndarray) -> Depth:
    """Search a motion segment by segment, up to the first instant that is too deep."""
    scene, motion, allowed = distance.scene, distance.motion, depth.contact.depth
    chain, slack = scene.table.chain, EPA_ERROR * scene.size
    goals = _DepthGoals(0.0, -allowed - slack, slack, np.inf, RESOLUTION * allowed, 0.0)
    if motion.num_segments == 0:
        least = distance(pair, 0.0)
        too_deep = 0.0 if least <= goals.level else None
        return depth._replace(greatest=max(0.0, -least), too_deep_at=too_deep)
    polynomials = np.ascontiguousarray(motion.polynomials)
    speeds, scratch = np.empty((2, len(weights))), np.empty(len(chain.parent))
    for segment in range(motion.num_segments):
        approach_bounds(chain, polynomials[segment], 0.0, 1.0, weights, speeds, scratch)
        interval = float(segment), segment + 1.0
        leaf = search_interval(distance, pair, interval, float(speeds[0, pair]), goals)
        if -leaf.least > depth.greatest:
            depth = depth._replace(greatest=-leaf.least, at=leaf.at)
        if leaf.first < np.inf:
            return depth._replace(too_deep_at=leaf.first)
    return depth
