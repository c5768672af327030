"""Teams beside the slow co-evolution's, and dominance beside its definition."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.evolution.succession import pareto_front
from evoexp.evolution.teams import best_team, gather_teams, rate_team
from references.curkovic_numpy import Judged, formed

NOTHING: Any = None


def world(seed: int, num: int, size: int, free: float, ties: bool) -> Judged:
    """Draw a generation; `ties` makes many costs and sums of costs equal."""
    rng = np.random.default_rng(seed)
    hits = {
        pair: rng.integers(1, 5, (size, size)) * (rng.random((size, size)) > free)
        for pair in itertools.combinations(range(num), 2)
    }
    own = rng.integers(1, 5, (num, size)).astype(float) if ties else rng.uniform(1, 5, (num, size))
    return Judged(NOTHING, NOTHING, own, hits, NOTHING)


def collisions_of(judged: Judged) -> np.ndarray:
    return np.array(list(judged.hits.values())).astype(np.int16)


@given(st.integers(0, 10_000), st.sampled_from([2, 3, 4]), st.integers(1, 7), st.booleans())
@settings(deadline=None)
def test_teams_are_formed_as_defined(seed: int, num: int, size: int, ties: bool) -> None:
    judged = world(seed, num, size, 0.4, ties)
    front = np.random.default_rng(seed).random((num, size)) < 0.4
    teams = np.empty((int(front.sum()), num), dtype=np.int64)
    assert gather_teams(collisions_of(judged), judged.own, front, teams) == len(teams)
    expected = [formed(judged, r, i) for r, i in np.argwhere(front).tolist()]
    assert [tuple(team) for team in teams] == expected
    for team in teams:
        assert rate_team(collisions_of(judged), judged.own, team) == judged.key(tuple(team))


@given(st.integers(0, 10_000), st.sampled_from([2, 3, 4]), st.integers(1, 5), st.booleans())
@settings(deadline=None)
def test_best_team_is_the_best_of_all(seed: int, num: int, size: int, ties: bool) -> None:
    judged = world(seed, num, size, (0.0, 0.1, 0.5, 1.0)[seed % 4], ties)
    keys = {team: judged.key(team) for team in itertools.product(range(size), repeat=num)}
    costs = [(cost, team) for team, (hits, cost) in keys.items() if hits == 0]
    cost, team = min(costs, default=(np.inf, (-1,) * num))
    found = best_team(collisions_of(judged), judged.own)
    assert (tuple(found.individuals), found.cost) == (team, cost)
    assert found.found == (cost < np.inf)


SMALL = 2.0**-53  # 1 + SMALL == 1


@pytest.mark.parametrize(
    ("own", "team"),
    [
        ([[SMALL, 0.0, 1.0], [1.0, 3.0, 3.0]], [0, 0]),  # sums that only rounding makes equal
        ([[SMALL, 0.0], [0.0, SMALL], [1.0, 1.0]], [0, 0, 0]),
        ([[np.inf, 2.0], [1.0, np.inf]], [1, 0]),
        ([[np.inf, np.inf], [1.0, 2.0], [1.0, 2.0]], [-1, -1, -1]),
    ],
)
def test_edges_of_costs(own: list[list[float]], team: list[int]) -> None:
    costs = np.array(own)
    num, size = costs.shape
    free = np.zeros((num * (num - 1) // 2, size, size), dtype=np.int16)
    assert best_team(free, costs).individuals.tolist() == team


VALUES = st.sampled_from([0.0, -0.0, 1.0, 2.0, 3.0, np.inf, -np.inf, np.nan])
TABLES = st.integers(1, 6).flatmap(
    lambda rows: st.lists(st.lists(VALUES, min_size=rows, max_size=rows), min_size=1, max_size=30)
)


def front_by_definition(criteria: np.ndarray) -> list[bool]:
    def dominates(a: np.ndarray, b: np.ndarray) -> bool:
        return bool(np.all(a <= b) and np.any(a < b))

    columns = criteria.T
    return [
        not np.isnan(own).any() and not any(dominates(other, own) for other in columns)
        for own in columns
    ]


@pytest.mark.parametrize("num_criteria", [1, 2, 3, 4, 5, 8, 9])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 64, 101])
def test_front_is_what_the_definition_says(num_criteria: int, count: int) -> None:
    criteria = np.random.default_rng(10 * count + num_criteria).random((num_criteria, count))
    assert pareto_front(criteria).tolist() == front_by_definition(criteria)


@given(TABLES)
def test_ties_infinities_and_nan(individuals: list[list[float]]) -> None:
    criteria = np.ascontiguousarray(np.array(individuals).T)
    assert pareto_front(criteria).tolist() == front_by_definition(criteria)
