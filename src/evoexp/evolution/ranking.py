"""Selection of parents by tournaments and by ranks."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


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
