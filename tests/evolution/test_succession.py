"""The next population, written beside the present one."""

import numpy as np
import pytest

from evoexp.evolution.succession import follow_rows


@pytest.mark.parametrize(("size", "elites"), [(6, []), (6, [4, 0]), (2, [1, 0])])
def test_offspring_come_first_then_the_elites(size: int, elites: list[int]) -> None:
    rng, chosen = np.random.default_rng(0), np.array(elites, dtype=np.int64)
    count = size - len(elites)
    population, offspring = rng.random((3, size)), rng.random((3, count + 2))
    before, following = population.copy(), np.full((3, size), np.nan)
    follow_rows(population, offspring, count, chosen, following)
    assert np.array_equal(population, before)
    assert np.array_equal(following[:, :count], offspring[:, :count])
    assert np.array_equal(following[:, count:], before[:, chosen])
