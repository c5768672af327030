"""Linear scaling: how many copies of every individual are expected among the parents."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray


def scale_linearly(costs: FloatArray, count: int, multiple: float = 2.0) -> FloatArray:
    """Return the expected numbers of copies by linear scaling (Chen & Zalzala 1995, Eqs. 5, 16).

    The paper, after Goldberg (1989), scales a fitness f = C_m − C to f' = a f + b, whose mean is
    that of f and whose maximum is `multiple` times the mean; negative values are set to 0. An
    individual then expects f' / mean(f') copies:

        f' / mean(f) = 1 + (multiple − 1) (mean(C) − C) / (mean(C) − min(C)),

    which does not depend on C_m (nor on the unit of the costs), so C_m is no setting. Setting
    negative values to 0 raises the mean, and all values are divided by it: the best then expects
    fewer than `multiple`.

    Args:
        costs: (individuals,) lower is better; an individual whose cost is not finite expects no
            copy and is left out of the mean.
        count: Number of parents.
        multiple: Copies that the best one expects if there is a parent per individual, > 1 [-].

    Returns:
        (individuals,) ≥ 0; their sum is `count` but for rounding. Individuals of equal finite cost
        expect equally many copies; without any finite cost all individuals do.

    Raises:
        ValueError: If an argument is out of range.
    """
    if costs.ndim != 1 or len(costs) == 0:
        raise ValueError(f"costs must have shape (individuals,), at least one, was {costs.shape}")
    if count < 0 or not multiple > 1.0:
        raise ValueError(f"count must be ≥ 0 and multiple > 1, were {count} and {multiple}")
    expected = np.empty(len(costs))
    scale_costs(costs, count, multiple, expected)
    return expected


@kernel
def scale_costs(costs: FloatArray, count: int, multiple: float, expected: FloatArray) -> None:
    """The kernel of `scale_linearly`, for other kernels; `expected` (individuals,) is written."""
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
