"""Selection: the members of a population that become parents, and those that stay."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


def roulette(rng: np.random.Generator, weights: FloatArray, count: int) -> IntArray:
    """Draw parents with probabilities proportional to their weights (Goldberg 1989).

    Args:
        rng: Source of one uniform number per parent.
        weights: (individuals,) ≥ 0; if all are 0, every individual is equally likely.
        count: Number of parents.

    Returns:
        (count,) indices, in the order drawn: neighbours are a random pairing.
    """
    chosen = np.empty(count, dtype=np.int64)
    spin_roulette(weights, rng.random(count), chosen)
    return chosen


def elites(costs: FloatArray, count: int) -> IntArray:
    """Return the indices of the lowest costs, best first; among equals the lower index wins."""
    chosen = np.empty(count, dtype=np.int64)
    choose_elites(costs, chosen)
    return chosen


def distinct(rng: np.random.Generator, num: int, count: int) -> IntArray:
    """Draw `count` distinct indices out of 0 … num − 1, in random order.

    The head of a Fisher–Yates shuffle.

    Args:
        rng: Source of `count` uniform numbers.
        num: Number of indices.
        count: Number of draws, at most `num`.
    """
    slots = np.arange(num)
    shuffle_head(rng.random(count), slots)
    return slots[:count]


@kernel
def spin_roulette(weights: FloatArray, uniforms: FloatArray, chosen: IntArray) -> None:
    """The kernel of `roulette`, for other kernels; writes one index per uniform number."""
    # the wheel: sums of weights up to each individual
    num = len(weights)
    wheel = np.empty(num)
    total = 0.0
    for k in range(num):
        total += weights[k]
        wheel[k] = total
    for i in range(len(uniforms)):
        if total > 0.0:
            # the first k with wheel[k] > pointer, by bisection
            pointer = uniforms[i] * total
            low, high = 0, num - 1
            while low < high:
                middle = (low + high) // 2
                if wheel[middle] > pointer:
                    high = middle
                else:
                    low = middle + 1
            while weights[low] == 0.0 and low > 0:  # a pointer rounded up to the total
                low -= 1
            chosen[i] = low
        else:
            chosen[i] = min(int(uniforms[i] * num), num - 1)


@kernel
def choose_elites(costs: FloatArray, chosen: IntArray) -> None:
    """The kernel of `elites`, for other kernels: insertion; a later equal cost stays behind."""
    count, filled = len(chosen), 0
    for k in range(len(costs)):
        if filled == count and (count == 0 or not costs[k] < costs[chosen[count - 1]]):
            continue
        place = filled if filled < count else count - 1
        while place > 0 and costs[k] < costs[chosen[place - 1]]:
            chosen[place] = chosen[place - 1]
            place -= 1
        chosen[place] = k
        filled = min(filled + 1, count)


@kernel
def shuffle_head(uniforms: FloatArray, slots: IntArray) -> None:
    """The kernel of `distinct`, for other kernels: the head of `slots` is the draw."""
    num = len(slots)
    for k in range(len(uniforms)):
        other = k + min(int(uniforms[k] * (num - k)), num - k - 1)
        slots[k], slots[other] = slots[other], slots[k]


@kernel
def inverse_weights(costs: FloatArray, out: FloatArray) -> None:
    """Weigh individuals by 1/cost for the roulette wheel (Curkovic et al. 2013, methods I–VIII).

    A cost of inf or NaN weighs 0. If any cost is 0, only those of cost 0 can be drawn: they weigh
    1, all others 0.

    Args:
        costs: (individuals,) ≥ 0; below 1e-300 counts as 0: a sum of inverses would overflow.
        out: (individuals,), written.
    """
    any_zero = False
    for k in range(len(costs)):
        any_zero |= costs[k] < 1e-300
    for k in range(len(costs)):
        inverse = 1.0 / costs[k] if costs[k] < np.inf else 0.0
        free = 1.0 if costs[k] < 1e-300 else 0.0
        out[k] = free if any_zero else inverse


@kernel
def difference_weights(costs: FloatArray, out: FloatArray) -> None:
    """Weigh individuals by how far they are below the highest finite cost.

    A cost that is not finite weighs 0. If all finite costs are equal, each of them weighs 1: they
    are equally likely, and an infeasible individual is still not drawn.

    Args:
        costs: (individuals,).
        out: (individuals,), written.
    """
    highest, lowest = -np.inf, np.inf
    for k in range(len(costs)):
        if np.isfinite(costs[k]):
            highest = max(highest, costs[k])
            lowest = min(lowest, costs[k])
    for k in range(len(costs)):
        weight = highest - costs[k] if highest > lowest else 1.0
        out[k] = weight if np.isfinite(costs[k]) else 0.0
