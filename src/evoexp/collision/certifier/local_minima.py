"""Local minima of the distances of pairs of bodies along a motion."""

import numpy as np

from evoexp.collision.certifier.convex_distance import CONVERGED
from evoexp.collision.certifier.task import Task, Workspace, move_to, pair_distance
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.records import FloatArray, IntArray

FIRST_STEP = 0.02  # [segments] towards a local minimum

FINEST = 1e-10  # [segments] the last step is not less

SHRINK = 0.0625  # [-] of the step where neither side is closer

MAX_MOVES = 1000  # on the way to a local minimum

MAX_POLISHED = 8  # pairs whose local minimum is sought, those with the least distances

SAME = 1e-4  # [segments] a local minimum so close is the same one


@kernel
def polish(
    task: Task, work: Workspace, pairs: IntArray, t: FloatArray, distances: FloatArray
) -> None:
    """Walk from given instants to local minima of pairs' distances.

    The walk goes on in equal steps while a neighbour is closer. Where neither is, the vertex of the
    parabola through the three is tried, and the step shrinks: a smooth minimum takes some 25
    distances; a minimum at an instant, where the motion bends, takes no more.

    Args:
        task: The motion.
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


@kernel
def nearest_minimum(
    task: Task,
    work: Workspace,
    least: FloatArray,
    begins: FloatArray,
    worth: float,
    known: tuple[int, float],
    rounding: float,
) -> tuple[int, float]:
    """Return pair and instant of the least local minimum; of equal ones the first in time.

    Args:
        task: The motion.
        work: From `work_space`.
        least: (pairs,) the distance of each that was found.
        begins: (pairs,) its instant, at which the walk begins.
        worth: Pairs with a greater distance are left out, and those whose distances are not exact.
        known: Pair and instant of a local minimum that is known.
        rounding: Distances closer than that are equal [length unit].

    Returns:
        A pair of −1 if there is none but the known one.
    """
    # the pairs that came closest, at most MAX_POLISHED, the closest first
    order, count = np.empty(MAX_POLISHED + 1, dtype=np.int64), 0
    for pair in range(len(least)):
        if least[pair] <= worth and task.exact[pair]:
            k = count
            while k > 0 and least[order[k - 1]] > least[pair]:
                order[k] = order[k - 1]
                k -= 1
            order[k] = pair
            count = min(count + 1, MAX_POLISHED)
    # without the one that is known
    pairs, t, num_walks = np.empty_like(order), np.empty(len(order)), 0
    for k in range(count):
        # a motion of one instant is swept as a segment without movement
        begin = min(begins[order[k]], task.last)
        if order[k] != known[0] or not abs(begin - known[1]) < SAME:
            pairs[num_walks], t[num_walks] = order[k], begin
            num_walks += 1
    if num_walks == 0:
        return -1, np.nan
    # their local minima
    pairs, t, distances = pairs[:num_walks], t[:num_walks], np.empty(num_walks)
    polish(task, work, pairs, t, distances)
    tied = distances.min() + rounding
    earliest = np.inf
    for k in range(num_walks):
        if distances[k] <= tied:
            earliest = min(earliest, t[k])
    first, nearest = 0, np.inf
    for k in range(num_walks):
        if distances[k] <= tied and t[k] <= earliest + SAME and distances[k] < nearest:
            first, nearest = k, distances[k]
    return pairs[first], t[first]
