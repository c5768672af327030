"""Crossover of individuals that are strings of via-points."""

import numpy as np

from evoexp.numerics import kernel
from evoexp.records import FloatArray


def num_uniforms(num_arms: int, num_pairs: int) -> int:
    """Return how many uniform numbers `site_crossover` takes: per pair one to decide, and a site per arm."""
    return num_pairs * (1 + num_arms)


def site_crossover(
    rng: np.random.Generator,
    population: FloatArray,
    parents: np.ndarray,
    arm_slices: np.ndarray,
    rate: float,
    max_distance: float,
    out: FloatArray,
) -> None:
    """Cross strings at one site per arm, where the parents are close (Rana & Zalzala 1995, section 3.4b).

    Parents 2k and 2k + 1 form a pair; an odd last one stays alone. A pair is crossed with probability `rate`, and only
    if at the sites chosen in both arms' portions the two parents' via-points are closer than `max_distance`. Each child
    takes the part before the site from one parent and the part from the site on from the other, arm by arm. What is not
    crossed is copied.

    Args:
        rng: Source of `num_uniforms` uniform numbers.
        population: (nq, N + 1, individuals) strings of via-points.
        parents: (offspring,) indices into the population.
        arm_slices: (arms, 2) rows of each arm.
        rate: Probability in [0, 1].
        max_distance: Euclidean, in the units of the via-points.
        out: (nq, N + 1, ≥ offspring), written: the offspring.
    """
    uniforms = rng.random(num_uniforms(len(arm_slices), len(parents) // 2))
    cross_at_sites(uniforms, population, parents, arm_slices, rate, max_distance, out)


@kernel
def cross_at_sites(uniforms, population, parents, arm_slices, rate, max_distance, out):  # type: ignore[no-untyped-def]
    """The kernel of `site_crossover`, for other kernels."""
    num_points, num_arms = population.shape[1], len(arm_slices)
    num_offspring = len(parents)
    mates = parents.copy()
    sites = np.full((num_arms, num_offspring), num_points)  # beyond the end: a copy
    for pair in range(num_offspring // 2):
        draw = uniforms[pair * (1 + num_arms) :]
        first, second = parents[2 * pair], parents[2 * pair + 1]
        if num_points < 3 or not draw[0] < rate:
            continue
        close = True
        for arm in range(num_arms):
            site = 1 + min(int(draw[1 + arm] * (num_points - 2)), num_points - 3)  # 1 … N − 1
            squared = 0.0
            for j in range(arm_slices[arm, 0], arm_slices[arm, 1]):
                step = population[j, site, first] - population[j, site, second]
                squared += step * step
            close = close and np.sqrt(squared) < max_distance
            sites[arm, 2 * pair] = site
            sites[arm, 2 * pair + 1] = site
        mates[2 * pair], mates[2 * pair + 1] = second, first
        if not close:
            sites[:, 2 * pair : 2 * pair + 2] = num_points
    for arm in range(num_arms):
        site = sites[arm]
        for j in range(arm_slices[arm, 0], arm_slices[arm, 1]):
            for i in range(num_points):
                source, target = population[j, i], out[j, i]
                for k in range(num_offspring):
                    own, other = source[parents[k]], source[mates[k]]
                    target[k] = own if i < site[k] else other
