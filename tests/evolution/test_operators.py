"""Operators: what must hold whatever is drawn, and the statistics of what is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp import testing as drawn
from evoexp.errors import SettingError
from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.evolution.operators.operator import Genome
from evoexp.evolution.operators.selection import spin_roulette
from evoexp.evolution.succession import choose_elites
from evoexp.planners.via_point_ga.string_operators import StringCrossover

ARMS = np.array([[0, 2], [2, 5]])


def population(seed: int, individuals: int = 12, points: int = 9) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.0, 50.0, size=(5, points, individuals))


def crossed(
    seed: int,
    parents: np.ndarray,
    rate: float,
    distance: float,
    strings: np.ndarray,
    segment: bool = False,
) -> np.ndarray:
    operator = StringCrossover(crossover_distance=distance, exchanges_segment=segment)
    joints, points, individuals = strings.shape
    genomes = strings.reshape(joints * points, individuals)
    genome = Genome(np.zeros((joints * points, 2)), ARMS, points)
    rng = np.random.default_rng(seed)
    out = drawn.crossed(operator, rng, genomes, parents, rate, genome)
    return out.reshape(joints, points, -1)


def crossed_literally(
    seed: int, parents: np.ndarray, rate: float, distance: float, strings: np.ndarray
) -> np.ndarray:
    """The same pair by pair, arm by arm, as one reads it in the paper."""
    rng = np.random.default_rng(seed)
    children = strings[:, :, parents].copy()
    for pair in range(len(parents) // 2):
        decide, *draws = rng.random(1 + len(ARMS))
        sites = [1 + int(draw * (strings.shape[1] - 2)) for draw in draws]
        a, b = strings[:, :, parents[2 * pair]], strings[:, :, parents[2 * pair + 1]]
        gaps = [
            np.linalg.norm(a[f:s, i] - b[f:s, i]) for (f, s), i in zip(ARMS, sites, strict=True)
        ]
        if decide < rate and all(gap < distance for gap in gaps):
            for (f, s), i in zip(ARMS, sites, strict=True):
                children[f:s, i:, 2 * pair] = b[f:s, i:]
                children[f:s, i:, 2 * pair + 1] = a[f:s, i:]
    return children


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("count", [0, 1, 2, 11, 12])
def test_crossover_is_what_the_paper_says(seed: int, count: int) -> None:
    strings = population(seed)
    parents = np.random.default_rng(seed + 100).integers(0, strings.shape[2], size=count)
    fast = crossed(seed, parents, 0.9, 45.0, strings)
    assert np.array_equal(fast, crossed_literally(seed, parents, 0.9, 45.0, strings))


def crossed_as_one_string(
    seed: int, parents: np.ndarray, rate: float, distance: float, strings: np.ndarray
) -> np.ndarray:
    """Two-point cross-over of p : q, each parent one list of via-points, arm after arm."""
    rng, num = np.random.default_rng(seed), strings.shape[1]
    children = strings[:, :, parents].copy()
    for pair in range(len(parents) // 2):
        decide, *draws = rng.random(1 + len(ARMS))
        one, two = 1 + int(draws[0] * (num - 2)), num + 1 + int(draws[1] * (num - 2))
        a, b = (
            [strings[f:s, i, parents[2 * pair + k]] for f, s in ARMS for i in range(num)]
            for k in (0, 1)
        )
        near = all(np.linalg.norm(a[site] - b[site]) < distance for site in (one, two))
        if decide < rate and near:
            a[one:two], b[one:two] = b[one:two], a[one:two]
        for k, points in enumerate((a, b)):
            for arm, (f, s) in enumerate(ARMS):
                own = points[arm * num : (arm + 1) * num]
                children[f:s, :, 2 * pair + k] = np.array(own).T
    return children


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("count", [1, 2, 11, 12])
def test_crossover_exchanges_the_segment_between_its_sites(seed: int, count: int) -> None:
    strings = population(seed)
    parents = np.random.default_rng(seed + 100).integers(0, strings.shape[2], size=count)
    fast = crossed(seed, parents, 0.9, 45.0, strings, segment=True)
    assert np.array_equal(fast, crossed_as_one_string(seed, parents, 0.9, 45.0, strings))
    if count > 2:
        assert not np.array_equal(fast, crossed(seed, parents, 0.9, 45.0, strings))


def test_strings_without_inner_points_are_copied() -> None:
    strings = population(4, points=2)
    assert np.array_equal(crossed(0, np.array([1, 2]), 1.0, 1e9, strings), strings[:, :, [1, 2]])


def roulette(rng: np.random.Generator, weights: np.ndarray, count: int) -> np.ndarray:
    chosen = np.empty(count, dtype=np.int64)
    spin_roulette(weights, rng.random(count), chosen)
    return chosen


@given(
    st.lists(st.one_of(st.just(0.0), st.floats(1e-300, 1e300)), min_size=1, max_size=20),
    st.integers(0, 2**32 - 1),
)
def test_roulette_never_draws_a_weight_of_zero(weights: list[float], seed: int) -> None:
    weights_array = np.array(weights)
    chosen = roulette(np.random.default_rng(seed), weights_array, 50)
    assert chosen.min() >= 0
    assert chosen.max() < len(weights)
    if weights_array.any():
        assert np.all(weights_array[chosen] > 0.0)


def test_roulette_agrees_with_searchsorted() -> None:
    weights = np.random.default_rng(1).uniform(0.0, 3.0, size=37)
    pointers = np.random.default_rng(2).random(500) * np.cumsum(weights)[-1]
    assert np.array_equal(
        roulette(np.random.default_rng(2), weights, 500),
        np.searchsorted(np.cumsum(weights), pointers, side="right"),
    )


def test_elites_are_the_lowest_costs_and_ties_keep_their_order() -> None:
    elites = np.empty(3, dtype=np.int64)
    choose_elites(np.array([3.0, 1.0, np.inf, 1.0, 2.0]), elites)
    assert elites.tolist() == [1, 3, 4]
    choose_elites(np.array([1.0]), elites[:0])


@given(st.lists(st.floats(-1e6, 1e6) | st.just(np.inf), min_size=1, max_size=30))
def test_cost_statistics_agree_with_numpy(costs: list[float]) -> None:
    array = np.array(costs)
    finite = array[np.isfinite(array)]
    best, mean, std = cost_statistics(array)
    assert array[best] == array.min()
    if len(finite):
        assert mean == pytest.approx(finite.mean(), rel=1e-9, abs=1e-6)
        assert std == pytest.approx(finite.std(), rel=1e-6, abs=1e-6)
    else:
        assert np.isnan(mean)
        assert np.isnan(std)


def test_evaluations_of_the_paper() -> None:
    paper = GeneticSettings(
        population_size=50, num_generations=500, num_elites=2, crossover_rate=0.9, mutation_rate=1.0
    )
    assert paper.num_evaluations == 24_050


def test_more_elites_than_individuals_are_refused() -> None:
    with pytest.raises(
        SettingError, match=r"num_elites: must be at most population_size \(5\), was 6"
    ):
        GeneticSettings(
            population_size=5,
            num_generations=1,
            num_elites=6,
            crossover_rate=0.9,
            mutation_rate=1.0,
        )
