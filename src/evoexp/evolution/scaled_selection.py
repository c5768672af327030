"""Selection by scaled costs: expected numbers of copies, and stochastic remainder sampling.

Every individual first becomes a parent as often as the whole part of its expected number says. For
the places left, the remainders are added up once, in random order; an individual that brings the
sum past u, u + 1, u + 2, … gets a place, where u is one uniform number: at most one, with exactly
the probability of its remainder. Goldberg's scan, which tosses a coin per remainder until the
places are full, is biased against individuals that come late, and against small remainders.
"""

from typing import NamedTuple

import numpy as np

from evoexp.evolution.succession import choose_elites
from evoexp.numeric.compilation import kernel
from evoexp.numeric.random_stream import Block, draw_many, used_up
from evoexp.records import FloatArray, IntArray


class SelectionMemory(NamedTuple):
    """Arrays that the selection of a generation writes."""

    parents: IntArray  # (offspring,) indices of individuals
    elites: IntArray  # (elites,) likewise
    expected: FloatArray  # (individuals,) expected numbers of copies
    order: IntArray  # (individuals,) order in which remainders are scanned

    @classmethod
    def of(cls, num_offspring: int, num_elites: int, size: int) -> "SelectionMemory":
        """Return memory for a population of a size."""
        parents, elites = (np.empty(n, dtype=np.int64) for n in (num_offspring, num_elites))
        return cls(parents, elites, np.empty(size), np.empty(size, dtype=np.int64))


@kernel
def choose_parents(
    draws: Block,  # uniform numbers
    costs: FloatArray,  # (individuals,)
    multiple: float,  # copies that the best one expects, in units of the mean
    memory: SelectionMemory,  # written
) -> bool:
    """Choose the elites, and parents by linear scaling and stochastic remainders.

    Returns whether the draws sufficed; if not, no parents are chosen.
    """
    parents, elites, expected, order = memory
    choose_elites(costs, elites)
    scale_costs(costs, len(parents), multiple, expected)
    uniforms = draw_many(draws, len(costs) + 1 + len(parents))
    if used_up(draws):
        return False
    choose_by_remainders(uniforms, expected, order, parents)
    return True


@kernel
def scale_costs(costs: FloatArray, count: int, multiple: float, expected: FloatArray) -> None:
    """Write the expected numbers of copies by linear scaling (Chen & Zalzala 1995, Eqs. 5, 16).

    The paper, after Goldberg (1989), scales a fitness f = C_m − C to f' = a f + b, whose mean is
    that of f and whose maximum is `multiple` times the mean; negative values are set to 0. An
    individual then expects f' / mean(f') = 1 + (multiple − 1) (mean(C) − C) / (mean(C) − min(C))
    copies, whatever C_m is. Setting negative values to 0 raises the mean, and all values are
    divided by it.

    Individuals whose cost is not finite expect no copy and are left out of the mean; those of equal
    finite cost expect equally many; without any finite cost all do. The sum is `count`, but for
    rounding.
    """
    # mean and least of the finite costs
    num, finite, total, least = len(costs), 0, 0.0, np.inf
    for k in range(num):
        if np.isfinite(costs[k]):
            finite += 1
            total += costs[k]
            least = min(least, costs[k])
    mean = total / max(finite, 1)
    spread = mean - least
    # copies in units of the mean, none below 0
    total = 0.0
    for k in range(num):
        if finite == 0:
            copies = 1.0
        elif not np.isfinite(costs[k]):
            copies = 0.0
        elif spread > 0.0:
            copies = max(1.0 + (multiple - 1.0) * ((mean - costs[k]) / spread), 0.0)
        else:  # all are equal, but for rounding of the mean
            copies = 1.0
        expected[k] = copies
        total += copies
    # as many in all as parents are wanted
    for k in range(num):
        expected[k] = expected[k] * (count / total)


@kernel
def choose_by_remainders(
    uniforms: FloatArray,  # (individuals + 1 + parents,) in [0, 1)
    expected: FloatArray,  # (individuals,) ≥ 0, adding up to the number of parents but for rounding
    order: IntArray,  # (individuals,) scratch: the order of the scan; negative where placed
    # (parents,) written, in random order: neighbours are a random pairing; k occurs ⌊expected[k]⌋
    # times or once more
    parents: IntArray,
) -> None:
    """Choose parents without replacement (Chen & Zalzala 1995, sections 2.3 and 3.2)."""
    num, count, filled = len(expected), len(parents), 0
    # whole parts
    for k in range(num):
        order[k] = k
        # A number that should be whole may be rounded down; a thousandth of 1e-9 is no remainder.
        for _ in range(int(expected[k] + 1e-12)):
            if filled < count:
                parents[filled] = k
                filled += 1
    # a random order of the individuals (Fisher–Yates), and the sum of the remainders
    total = 0.0
    for k in range(num):
        other = k + min(int(uniforms[k] * (num - k)), num - k - 1)
        order[k], order[other] = order[other], order[k]
        total += _remainder(expected[order[k]])
    # the places left, by one scan
    scale = (count - filled) / total if total > 0.0 else 0.0  # 1 but for rounding
    pointer, scanned = uniforms[num], 0.0
    for k in range(num):
        chosen = order[k]
        scanned += scale * _remainder(expected[chosen])
        if scanned > pointer and filled < count:
            parents[filled] = chosen
            order[k] = -1
            filled += 1
            pointer += 1.0
    # places that rounding left
    for k in range(num):
        if (
            filled < count
            and order[k] >= 0
            and (_remainder(expected[order[k]]) > 0.0 or total == 0.0)
        ):
            parents[filled] = order[k]
            filled += 1
    # parents in random order
    for k in range(count):
        other = k + min(int(uniforms[num + 1 + k] * (count - k)), count - k - 1)
        parents[k], parents[other] = parents[other], parents[k]


@kernel
def _remainder(expected: float) -> float:
    """Return the part of a number that is not whole, 0 below 1e-12."""
    return max(expected - int(expected + 1e-12), 0.0)
