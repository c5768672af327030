"""Pareto dominance: the individuals that no other one surpasses in every respect."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import BoolArray, FloatArray


@kernel
def pareto_front(criteria: FloatArray) -> BoolArray:
    """Mark the individuals (individuals,) that are not dominated (Curkovic et al. 2013, section 3).

    One dominates another if it is no worse in every criterion (criteria, individuals), all
    minimised, and better in at least one. Exact ties are all kept. An individual with a NaN neither
    dominates nor is on the front. ValueError: there is no criterion.

    Dominance is transitive, so only those not dominated so far are compared with all. Four criteria
    per pass stay in registers; where fewer are left, the last is repeated, which changes nothing.
    """
    if len(criteria) == 0:
        raise ValueError("criteria are (criteria, individuals), one at least")
    count = criteria.shape[1]
    last = len(criteria) - 1
    dominated = np.zeros(count, dtype=np.int64)
    # on i beside j: bit 0 better in some criterion, bit 1 worse in some
    verdicts = np.empty(count, dtype=np.int64)
    # a NaN keeps an individual off the front
    for m in range(last + 1):
        for i in range(count):
            dominated[i] |= 1 if criteria[m, i] != criteria[m, i] else 0
    for j in range(count):
        if dominated[j] != 0:
            continue
        verdicts[:] = 0
        for m in range(0, last + 1, 4):
            a, b = criteria[m], criteria[min(m + 1, last)]
            c, d = criteria[min(m + 2, last)], criteria[min(m + 3, last)]
            p, q, r, s = a[j], b[j], c[j], d[j]
            for i in range(count):
                better = (a[i] < p) | (b[i] < q) | (c[i] < r) | (d[i] < s)
                worse = (a[i] > p) | (b[i] > q) | (c[i] > r) | (d[i] > s)
                verdicts[i] |= (1 if better else 0) | (2 if worse else 0)
        for i in range(count):
            dominated[i] |= 1 if verdicts[i] == 2 else 0
    return np.asarray(dominated == 0)
