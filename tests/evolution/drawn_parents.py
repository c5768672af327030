"""Parents drawn with memory of their own."""

import numpy as np

from evoexp.evolution.selection import spin_roulette


def roulette(rng: np.random.Generator, weights: np.ndarray, count: int) -> np.ndarray:
    chosen = np.empty(count, dtype=np.int64)
    spin_roulette(weights, rng.random(count), chosen)
    return chosen
