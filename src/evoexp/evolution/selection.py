"""Selection: the members of a population that become parents, and those that stay.

Parents are drawn by roulette, by tournaments or by ranks.
"""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


@kernel
def spin_roulette(weights: FloatArray, uniforms: FloatArray, chosen: IntArray) -> None:
    """Draw parents with probabilities proportional to their weights (Goldberg 1989).

    Args:
        weights: (individuals,) ≥ 0; if all are 0, every individual is equally likely.
        uniforms: (parents,) in [0, 1).
        chosen: (parents,) written: indices in the order drawn; neighbours are a random pairing.
    """
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
    """Write the indices of the lowest costs, best first; among equals the lower index wins.

    By insertion: a later equal cost stays behind.
    """
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
    """Draw distinct indices in random order: the head of a Fisher–Yates shuffle.

    Args:
        uniforms: (draws,) in [0, 1), at most as many as there are indices.
        slots: (indices,) 0, 1, 2, … at first, changed: its head is the draw.
    """
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


@kernel
def choose_by_tournament(
    uniforms: FloatArray, costs: FloatArray, size: int, parents: IntArray
) -> None:
    """Draw parents as winners of tournaments (Goldberg & Deb 1991).

    The lowest cost among `size` contestants, drawn with replacement, wins; among equal costs,
    infinite ones included, the contestant drawn first. So a population without one feasible member
    is sampled uniformly.

    Args:
        uniforms: (parents × size) in [0, 1).
        costs: (individuals,).
        size: Contestants per tournament, ≥ 1; 1 is no selection at all.
        parents: (parents,) written: indices of individuals.
    """
    num = len(costs)
    for k in range(len(parents)):
        winner = min(int(uniforms[k * size] * num), num - 1)
        for t in range(1, size):
            other = min(int(uniforms[k * size + t] * num), num - 1)
            winner = other if costs[other] < costs[winner] else winner
        parents[k] = winner


@kernel
def rank_weights(costs: FloatArray, pressure: float, out: FloatArray) -> None:
    """Weigh individuals linearly by their rank for the roulette wheel (Baker 1985).

    With r = 0 for the highest of P costs and P − 1 for the lowest, the weight 2 − s + 2 (s − 1) r /
    (P − 1) is how often an individual is expected among P parents. Equal costs, infinite ones
    included, share the mean of their ranks.

    Args:
        costs: (individuals,).
        pressure: s in [1, 2]; 1 is no selection at all, 2 leaves the worst without offspring.
        out: (individuals,), written.
    """
    num = len(costs)
    # from the highest cost to the lowest; equal costs share a rank
    order = np.argsort(-costs, kind="mergesort")  # stable: the same on every machine
    first = 0
    while first < num:
        stop = first + 1
        while stop < num and costs[order[stop]] == costs[order[first]]:
            stop += 1
        rank = 0.5 * (first + stop - 1)
        weight = 2.0 - pressure + 2.0 * (pressure - 1.0) * rank / max(num - 1, 1)
        for k in range(first, stop):
            out[order[k]] = weight
        first = stop
