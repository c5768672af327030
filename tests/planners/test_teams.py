"""Teams and copies: the compiled answers beside obvious ones."""

import itertools

import numpy as np
import pytest

from evoexp.planners.coevolution.kernels import drop_copies
from evoexp.planners.coevolution.teams import count_partnered


@pytest.mark.parametrize("robots", [2, 3])
def test_partnered_individuals(robots: int) -> None:
    rng = np.random.default_rng(robots)
    for _ in range(50):
        pairs = list(itertools.combinations(range(robots), 2))
        collisions = rng.integers(0, 2, (len(pairs), 6, 6))
        blocked = (rng.random((robots, 6)) < 0.3).astype(np.int64)
        expected = 0
        for i in range(6):
            free = [
                any(
                    collisions[pairs.index((0, r)), i, j] == 0 and blocked[r, j] == 0
                    for j in range(6)
                )
                for r in range(1, robots)
            ]
            expected += blocked[0, i] == 0 and all(free)
        assert count_partnered(collisions, blocked) == expected


def test_of_equal_genomes_one_stays_and_none_that_the_hall_has() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        populations = rng.integers(0, 2, (2, 3, 9)).astype(np.float64)
        teams = rng.integers(0, 9, (2, 2))
        fronts = rng.random((2, 9)) < 0.7
        expected = fronts.copy()
        for robot in range(2):
            known = {populations[robot, :, member].tobytes() for member in teams[:, robot]}
            for member in np.flatnonzero(fronts[robot]):
                expected[robot, member] = populations[robot, :, member].tobytes() not in known
                known.add(populations[robot, :, member].tobytes())
        drop_copies(populations, teams, fronts)
        assert np.array_equal(fronts, expected)
