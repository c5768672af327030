import math

import numpy as np
import pytest

from evoexp.report.statistics.inference import Interval, Proportion, fisher_exact, newcombe


def test_a_proportion_knows_share_and_interval() -> None:
    found = Proportion(935, 1000)
    assert found.share == 0.935
    assert np.isnan(Proportion(0, 0).share)


@pytest.mark.parametrize(
    ("one", "two", "low", "high"),
    [  # Newcombe 1998, Table II, method 10
        (Proportion(56, 70), Proportion(48, 80), 0.0524, 0.3339),
        (Proportion(9, 10), Proportion(3, 10), 0.1705, 0.8090),
        (Proportion(6, 7), Proportion(2, 7), 0.0582, 0.8062),
        (Proportion(5, 56), Proportion(0, 29), -0.0381, 0.1926),
        (Proportion(10, 10), Proportion(0, 10), 0.6075, 1.0),
    ],
)
def test_differences_are_newcombes(
    one: Proportion, two: Proportion, low: float, high: float
) -> None:
    found = newcombe(one, two, 0.95)
    assert found == pytest.approx((low, high), abs=5e-5)
    mirrored = newcombe(two, one, 0.95)
    assert mirrored == pytest.approx((-high, -low), abs=5e-5)


def test_without_runs_every_difference_is_possible() -> None:
    assert newcombe(Proportion(0, 0), Proportion(3, 4), 0.95) == Interval(-1.0, 1.0)
    assert newcombe(Proportion(3, 4), Proportion(0, 0), 0.95) == Interval(-1.0, 1.0)


def test_fishers_test_sums_all_tables_that_are_at_most_as_likely() -> None:
    rng = np.random.default_rng(4)
    for _ in range(60):
        n, m = (int(size) for size in rng.integers(1, 60, 2))
        one = Proportion(int(rng.integers(0, n + 1)), n)
        two = Proportion(int(rng.integers(0, m + 1)), m)
        count = one.having + two.having
        ways = [math.comb(n, k) * math.comb(m, count - k) for k in range(min(count, n) + 1)]
        as_likely = sum(way for way in ways if way <= ways[one.having])
        expected = as_likely / math.comb(n + m, count)
        assert fisher_exact(one, two) == pytest.approx(expected, rel=1e-9)
    assert fisher_exact(Proportion(0, 0), Proportion(1, 2)) == 1.0
