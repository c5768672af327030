"""Crossover of strings of via-points, beside the same pair by pair, as the paper describes it."""

import numpy as np
import pytest

from evoexp import testing as drawn
from evoexp.evolution.operators.operator import Genome
from evoexp.planners.via_point_ga.string_operators import StringCrossover

ARMS = np.array([[0, 2], [2, 5]])
RATE, DISTANCE = 0.9, 45.0


def crossed_literally(
    rng: np.random.Generator, strings: np.ndarray, parents: np.ndarray, segment: bool
) -> np.ndarray:
    """Exchange the tails of both arms, or the segment between the sites of p : q as one string."""
    num, children = strings.shape[1], strings[:, :, parents].copy()
    for pair in range(len(parents) // 2):
        decide, *draws = rng.random(1 + len(ARMS))
        sites = [1 + int(draw * (num - 2)) for draw in draws]
        a, b = strings[:, :, parents[2 * pair]], strings[:, :, parents[2 * pair + 1]]
        places = list(zip(ARMS, sites, strict=True))
        if decide < RATE and all(
            np.linalg.norm((a - b)[f:s, i]) < DISTANCE for (f, s), i in places
        ):
            for arm, ((f, s), i) in enumerate(places):
                exchanged = slice(i) if segment and arm == 1 else slice(i, num)
                children[f:s, exchanged, 2 * pair] = b[f:s, exchanged]
                children[f:s, exchanged, 2 * pair + 1] = a[f:s, exchanged]
    return children


@pytest.mark.parametrize("segment", [False, True])
@pytest.mark.parametrize("count", [0, 1, 2, 11, 12])
def test_crossover_is_what_the_paper_says(count: int, segment: bool) -> None:
    operator = StringCrossover(crossover_distance=DISTANCE, exchanges_segment=segment)
    for seed, points in ((0, 2), *((seed, 9) for seed in range(20))):
        strings = np.random.default_rng(seed).uniform(0.0, 50.0, size=(5, points, 12))
        parents = np.random.default_rng(seed + 100).integers(0, 12, size=count)
        genome = Genome(np.zeros((5 * points, 2)), ARMS, points)
        rng, slow_rng = np.random.default_rng(seed), np.random.default_rng(seed)
        found = drawn.crossed(operator, rng, strings.reshape(-1, 12), parents, RATE, genome)
        expected = (
            crossed_literally(slow_rng, strings, parents, segment)
            if points > 2  # else there is no inner point
            else strings[:, :, parents]
        )
        assert np.array_equal(found.reshape(5, points, -1), expected)
