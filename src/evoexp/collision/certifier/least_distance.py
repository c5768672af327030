"""Least distances of bodies at many configurations, by the certifier's kernels."""

import numpy as np

from evoexp.collision.certifier.convex_distance import CONVERGED
from evoexp.collision.certifier.task import Task, Workspace, pair_distance, work_space
from evoexp.collision.motion_bounds import joint_frames
from evoexp.collision.scene import Scene
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.records import FloatArray


class LeastDistance:
    """The least distance of a scene's pairs, configuration by configuration.

    It agrees with coal up to rounding, and for ellipsoids up to coal's own error.
    """

    def __init__(self, scene: Scene) -> None:
        """Take a scene and its pairs.

        Args:
            scene: Its bodies must be `known`.

        Raises:
            ValueError: If a body is known by its hull only.
        """
        if not known(scene):
            raise ValueError("scene: a body is known by its hull only")
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
