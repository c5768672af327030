"""Least distances of bodies: at many configurations, and local minima of pairs along a motion."""

import numpy as np

from evoexp.collision.certifier.convex_distance import CONVERGED
from evoexp.collision.certifier.task import (
    Task,
    Workspace,
    move_to,
    pair_distance,
    work_space,
)
from evoexp.collision.motion_bounds import joint_frames
from evoexp.collision.scene import Scene
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.records import FloatArray, IntArray

FIRST_STEP = 0.02  # [segments] towards a local minimum
FINEST = 1e-10  # [segments] the last step is not less
SHRINK = 0.0625  # [-] of the step where neither side is closer
MAX_MOVES = 1000  # on the way to a local minimum
MAX_POLISHED = 8  # pairs whose local minimum is sought, those with the least distances


class LeastDistance:
    """The least distance of a scene's pairs, configuration by configuration.

    It agrees with coal up to rounding, and for ellipsoids up to coal's own error.
    """

    def __init__(self, scene: Scene) -> None:
        """Take a scene whose bodies are `known`, and its pairs."""
        num_pairs, num_joints = len(scene.pairs), len(scene.table.chain.parent)
        self._task = Task(
            chain=scene.table.chain,
            bodies=scene.bodies,
            pairs=scene.pairs,
            exact=np.ones(num_pairs, dtype=np.bool_),
            coefficients=np.zeros((1, 4, scene.model.nq)),
            straight=True,
            last=0.0,
            weights=np.zeros((num_pairs, num_joints)),
            by_one=np.zeros(num_pairs, dtype=np.bool_),
        )
        self._work = work_space(self._task)

    def __call__(self, q: FloatArray) -> FloatArray:
        """Return the least distance at each configuration, 0 where bodies overlap.

        Args:
            q: (nq, configurations) [rad].

        Returns:
            (configurations,) [length unit]; inf without pairs.
        """
        least = np.empty(q.shape[1])
        _least_distances(self._task, self._work, np.ascontiguousarray(q.T), least)
        return least


def known(scene: Scene) -> bool:
    """Return whether the kernels know every body of a scene's pairs by its very shape."""
    return bool(scene.bodies.exact[scene.pairs].all())


@kernel
def _least_distances(task: Task, work: Workspace, q: FloatArray, least: FloatArray) -> None:
    """Write the least distance (configurations,) of any pair at each q (configurations, nq)."""
    task, work, q, least = borrowed((task, work, q, least))
    for k in range(len(q)):
        work.stamps[-1] += 1
        joint_frames(task.chain, q[k], work.frames)
        best = np.inf
        for pair in range(len(task.pairs)):
            # a pair that is seen to be farther than the best need not be measured
            _, high = pair_distance(task, work, pair, best, -np.inf, CONVERGED)
            best = min(best, high)
        least[k] = max(best, 0.0)


@kernel
def polish(
    task: Task, work: Workspace, pairs: IntArray, t: FloatArray, distances: FloatArray
) -> None:
    """Walk from given instants to local minima of pairs' distances.

    The walk goes on in equal steps while a neighbour is closer. Where neither is, the vertex of the
    parabola through the three is tried, and the step shrinks: a smooth minimum takes some 25
    distances; a minimum at an instant, where the motion bends, takes no more.

    Args:
        work: From `work_space`.
        pairs: (walks,) the pair of each walk.
        t: (walks,) where it begins; written: where it ended.
        distances: (walks,), written.
    """
    task, work, pairs, t, distances = borrowed((task, work, pairs, t, distances))
    for walk in range(len(pairs)):
        here, best, step = t[walk], np.inf, FIRST_STEP
        for move in range(MAX_MOVES):
            after = before = np.inf
            closer = False
            # the place itself (once), a step ahead, a step back, the parabola's vertex
            for k in range(1 if move > 0 else 0, 4):
                ahead = 0.0
                if k == 1:
                    ahead = step
                elif k == 2:
                    ahead = -step
                elif k == 3:
                    bend = (after - best) + (before - best)
                    ahead = 0.5 * step * (before - after) / bend if 0.0 < bend < np.inf else 0.0
                tried = min(max(here + ahead, 0.0), task.last)
                if tried == here and k > 0:
                    continue
                segment = min(int(tried), len(task.coefficients) - 1)
                move_to(task, work, segment, tried - segment)
                _, distance = pair_distance(task, work, pairs[walk], np.inf, -np.inf, CONVERGED)
                after = distance if k == 1 else after
                before = distance if k == 2 else before
                if distance < best:
                    here, best, closer = tried, distance, k in (1, 2)
                    if closer:
                        break
            step *= 1.0 if closer else SHRINK
            if step < FINEST:
                break
        t[walk], distances[walk] = here, best
