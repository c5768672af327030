"""Selection of parents: by roulette, by tournaments or by ranks."""

from typing import Annotated

import numpy as np
from pydantic import Field

from evoexp.evolution.operators.operator import Context, Selection
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray
from evoexp.validation import Count, NonNegative


@kernel
def spin_roulette(weights: FloatArray, uniforms: FloatArray, chosen: IntArray) -> None:
    """Draw parents with probabilities proportional to their weights (Goldberg 1989).

    If all weights (individuals,) are 0, every individual is equally likely. Neighbours among
    the chosen (parents,) form random pairs.
    """
    # the wheel: sums of weights up to each individual
    num = len(weights)
    wheel = np.empty(num)
    total = 0.0
    for k in range(num):
        total += weights[k]
        wheel[k] = total
    for i in range(len(chosen)):
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


class InverseRoulette(Selection):
    """Roulette by 1/cost (Curkovic et al. 2013, methods I–VIII).

    A cost of inf or NaN weighs 0. If any cost is 0, only costs of 0 are drawn, each equally likely.
    A cost below 1e-300 counts as 0, because a sum of inverses would overflow.
    """

    @staticmethod
    @kernel
    def select(costs: FloatArray, context: Context, parents: IntArray) -> None:
        """Draw parents; see `Selection`."""
        weights, any_zero = np.empty(len(costs)), False
        for k in range(len(costs)):
            any_zero |= costs[k] < 1e-300
        for k in range(len(costs)):
            inverse = 1.0 / costs[k] if costs[k] < np.inf else 0.0
            free = 1.0 if costs[k] < 1e-300 else 0.0
            weights[k] = free if any_zero else inverse
        spin_roulette(weights, context.uniforms, parents)


class DifferenceRoulette(Selection):
    """Roulette by how far an individual's cost is below the highest finite one.

    A cost that is not finite weighs 0. If all finite costs are equal, each of them is equally
    likely, and an infeasible individual is still not drawn.
    """

    @staticmethod
    @kernel
    def select(costs: FloatArray, context: Context, parents: IntArray) -> None:
        """Draw parents; see `Selection`."""
        weights, highest, lowest = np.empty(len(costs)), -np.inf, np.inf
        for k in range(len(costs)):
            if np.isfinite(costs[k]):
                highest = max(highest, costs[k])
                lowest = min(lowest, costs[k])
        for k in range(len(costs)):
            weight = highest - costs[k] if highest > lowest else 1.0
            weights[k] = weight if np.isfinite(costs[k]) else 0.0
        spin_roulette(weights, context.uniforms, parents)


class FitnessRoulette(Selection):
    """Roulette by the fitness max(C_max − cost, 0) (Rana & Zalzala 1995, Eq. 7)."""

    fitness_offset: NonNegative  # C_max

    @staticmethod
    @kernel
    def select(costs: FloatArray, context: Context, parents: IntArray) -> None:
        """Draw parents; see `Selection`."""
        weights, fitness_offset = np.empty(len(costs)), context.settings[0]
        for k in range(len(costs)):
            fitness = fitness_offset - costs[k]
            weights[k] = fitness if fitness > 0.0 else 0.0
        spin_roulette(weights, context.uniforms, parents)


class LinearRanking(Selection):
    """Roulette by linear ranks (Baker 1985).

    With r = 0 for the highest of P costs and P − 1 for the lowest, the weight 2 − s + 2 (s − 1) r /
    (P − 1) is the expected number of copies of an individual among P parents. Equal costs, infinite
    ones included, share the mean of their ranks.
    """

    # s: offspring expected of the best one; 1 is no selection at all, 2 leaves the worst without
    rank_pressure: Annotated[float, Field(ge=1.0, le=2.0)] = 2.0

    @staticmethod
    @kernel
    def select(costs: FloatArray, context: Context, parents: IntArray) -> None:
        """Draw parents; see `Selection`."""
        num, pressure = len(costs), context.settings[0]
        weights = np.empty(num)
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
                weights[order[k]] = weight
            first = stop
        spin_roulette(weights, context.uniforms, parents)


class Tournament(Selection):
    """Winners of tournaments (Goldberg & Deb 1991).

    The lowest cost among the contestants, drawn with replacement, wins; among equal costs, infinite
    ones included, the contestant drawn first. So a population without one feasible member is
    sampled uniformly.
    """

    tournament_size: Count = 2  # contestants; 1 is no selection at all

    def num_uniforms(self, size: int, count: int) -> int:
        """Return one for every contestant of `count` tournaments."""
        return count * self.tournament_size

    @staticmethod
    @kernel
    def select(costs: FloatArray, context: Context, parents: IntArray) -> None:
        """Draw parents; see `Selection`."""
        num, size, uniforms = len(costs), int(context.settings[0]), context.uniforms
        for k in range(len(parents)):
            winner = min(int(uniforms[k * size] * num), num - 1)
            for t in range(1, size):
                other = min(int(uniforms[k * size + t] * num), num - 1)
                winner = other if costs[other] < costs[winner] else winner
            parents[k] = winner
