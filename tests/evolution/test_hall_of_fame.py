"""Teams and the hall of fame, beside the same by enumeration."""

import itertools
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.evolution.best_team import best_team
from evoexp.evolution.hall_of_fame import (
    Hall,
    HallRules,
    gather_teams,
    renew_hall,
)
from matrix import num_cases

Key = tuple[int, float]


class World(NamedTuple):
    """Collisions, own costs and fronts of one generation."""

    collisions: np.ndarray
    own: np.ndarray
    front: np.ndarray

    @property
    def pairs(self) -> list[tuple[int, int]]:
        return list(itertools.combinations(range(len(self.own)), 2))

    def hits(self, r: int, i: int, s: int, j: int) -> int:
        if r > s:
            r, i, s, j = s, j, r, i
        return int(self.collisions[self.pairs.index((r, s)), i, j])

    def key(self, team: tuple[int, ...]) -> Key:
        hits = sum(self.hits(r, team[r], s, team[s]) for r, s in self.pairs)
        return hits, float(sum(self.own[p, i] for p, i in enumerate(team)))


def world(seed: int, num: int, size: int, free: float = 0.4, ties: bool = False) -> World:
    """Draw a generation; `ties` makes many costs and sums of costs equal."""
    rng = np.random.default_rng(seed)
    num_pairs = num * (num - 1) // 2
    collisions = rng.integers(1, 5, size=(num_pairs, size, size)) * (
        rng.random((num_pairs, size, size)) > free
    )
    own = (
        rng.integers(1, 5, size=(num, size)).astype(float)
        if ties
        else rng.uniform(1.0, 5.0, size=(num, size))
    )
    return World(collisions.astype(np.int16), own, rng.random((num, size)) < 0.4)


def rules(
    num: int, memory: int | None = None, frozen: bool = False, shared: tuple[int, ...] = ()
) -> HallRules:
    """Rules of a hall of `num` populations; those in `shared` may be in all teams."""
    return HallRules(memory or 0, frozen, np.array([p not in shared for p in range(num)]))


def form_teams(collisions: np.ndarray, own: np.ndarray, front: np.ndarray) -> Hall:
    formed = Hall.room(int(front.sum()), len(own))
    gather_teams(collisions, own, front, formed)
    return formed


def with_room(hall: Hall, depth: int) -> Hall:
    copy = Hall.room(depth, hall.teams.shape[1])
    num_teams = len(hall.teams)
    copy.teams[:num_teams], copy.ages[:num_teams] = hall.teams, hall.ages
    return copy


def update_hall(
    collisions: np.ndarray,
    own: np.ndarray,
    front: np.ndarray,
    hall: Hall,
    depth: int,
    taken: HallRules | None = None,
    best: np.ndarray | None = None,
) -> Hall:
    num = len(own)
    best, renewed = np.full(num, -1) if best is None else best, with_room(hall, depth)
    taken = taken or rules(num)
    held = renew_hall(collisions, own, front, renewed, len(hall.teams), best, taken)
    return Hall(*(array[:held] for array in renewed))


def teams_by_definition(w: World) -> list[tuple[int, ...]]:
    num, size = w.own.shape
    teams = []
    for p, i in itertools.product(range(num), range(size)):
        if w.front[p, i]:
            members = {p: i}
            for s in range(num):
                if s != p:
                    ranked = [
                        (sum(w.hits(q, m, s, j) for q, m in members.items()), w.own[s, j], j)
                        for j in range(size)
                    ]
                    members[s] = min(ranked)[2]
            teams.append(tuple(members[q] for q in range(num)))
    return teams


def hall_by_definition(
    w: World,
    hall: Hall,
    depth: int,
    memory: int | None,
    frozen: bool,
    shared: tuple[int, ...] = (),
    best: tuple[int, ...] | None = None,
) -> list[tuple[int, ...]]:
    old = [tuple(map(int, team)) for team in hall.teams]
    ranked = []
    for k, team in enumerate(old):
        expired = memory is not None and hall.ages[k] + 1 > memory
        ranked.append(((-1, 0, 0.0, k) if frozen else (int(expired), *w.key(team), k), team))
    offered = teams_by_definition(w) + ([] if best is None else [best])
    new = [team for team in offered if team not in old]
    ranked += [((0, *w.key(team), len(old) + k), team) for k, team in enumerate(new)]
    chosen: list[tuple[int, ...]] = []
    for _, team in sorted(ranked):
        met = [
            p not in shared and a == b
            for other in chosen
            for p, (a, b) in enumerate(zip(team, other, strict=True))
        ]
        if len(chosen) < depth and not any(met):
            chosen.append(team)
    return chosen


def best_by_definition(w: World) -> tuple[tuple[int, ...], float]:
    num, size = w.own.shape
    free = [
        (w.key(team)[1], team)
        for team in itertools.product(range(size), repeat=num)
        if w.key(team)[0] == 0
    ]
    cost, team = min(free, default=(np.inf, (-1,) * num))
    return (team, cost) if cost < np.inf else ((-1,) * num, np.inf)


def some_hall(seed: int, num: int, size: int, count: int) -> Hall:
    """A hall of disjoint teams that nobody formed."""
    rng = np.random.default_rng(seed)
    teams = np.stack([rng.permutation(size)[:count] for _ in range(num)], axis=1)
    return Hall.room(0, num)._replace(teams=teams, ages=rng.integers(0, 6, size=count))


cases = given(st.integers(0, 10_000), st.sampled_from([2, 3, 4]), st.integers(1, 7), st.booleans())


@cases
@settings(deadline=None)
def test_teams_are_formed_as_defined(seed: int, num: int, size: int, ties: bool) -> None:
    w = world(seed, num, size, ties=ties)
    formed = form_teams(*w)
    expected = teams_by_definition(w)
    assert [tuple(team) for team in formed.teams] == expected
    assert list(zip(formed.collisions, formed.costs, strict=True)) == [
        w.key(team) for team in expected
    ]


@cases
@settings(deadline=None)
def test_best_team_is_the_best_of_all(seed: int, num: int, size: int, ties: bool) -> None:
    w = world(seed, num, min(size, 5), free=(0.0, 0.1, 0.5, 1.0)[seed % 4], ties=ties)
    found, (team, cost) = best_team(w.collisions, w.own), best_by_definition(w)
    assert (tuple(found.individuals), found.cost) == (team, cost)
    assert found.found == (cost < np.inf)


@pytest.mark.parametrize("size", [1, 4, 5, 37, 100])
@pytest.mark.parametrize("free", [0.0, 0.002, 0.05, 0.6])
@pytest.mark.parametrize("ties", [False, True])
def test_best_pair_of_large_populations(size: int, free: float, ties: bool) -> None:
    w = world(size, 2, size, free=free, ties=ties)
    sums = np.where(w.collisions[0] == 0, w.own[0][:, None] + w.own[1], np.inf)
    i, j = np.unravel_index(np.argmin(sums), sums.shape)  # the first in lexicographic order
    expected = (int(i), int(j)) if np.isfinite(sums[i, j]) else (-1, -1)
    found = best_team(w.collisions, w.own)
    assert (tuple(found.individuals), found.cost) == (expected, sums[i, j])


def test_sums_that_only_rounding_makes_equal_keep_their_order() -> None:
    small = 2.0**-53  # 1 + small == 1
    own = np.array([[small, 0.0, 1.0], [1.0, 3.0, 3.0]])
    assert best_team(np.zeros((1, 3, 3), dtype=np.int16), own).individuals.tolist() == [0, 0]
    own = np.array([[small, 0.0], [0.0, small], [1.0, 1.0]])
    assert best_team(np.zeros((3, 2, 2), dtype=np.int16), own).individuals.tolist() == [0, 0, 0]


def test_without_a_free_team_there_is_none() -> None:
    for num in (2, 3):
        none = best_team(np.ones((num * (num - 1) // 2, 4, 4), dtype=np.int16), np.ones((num, 4)))
        assert none.individuals.tolist() == [-1] * num
        assert none.cost == np.inf
        assert not none.found
        assert not best_team(
            np.zeros((num * (num - 1) // 2, 4, 4), dtype=np.int16), np.full((num, 4), np.inf)
        ).found
    own = np.array([[np.inf, 2.0], [1.0, np.inf]])
    assert best_team(np.zeros((1, 2, 2), dtype=np.int16), own).individuals.tolist() == [1, 0]


@given(
    st.integers(0, 10_000),
    st.sampled_from([2, 3]),
    st.integers(1, 8),
    st.integers(0, 5),
    st.sampled_from([None, 1, 3]),
    st.booleans(),
    st.booleans(),
    st.sampled_from([(), (0,), (1,)]),
    st.booleans(),
)
@settings(max_examples=num_cases(30, 100), deadline=None)
def test_hall_is_chosen_as_defined(
    seed: int,
    num: int,
    size: int,
    depth: int,
    memory: int | None,
    frozen: bool,
    ties: bool,
    shared: tuple[int, ...],
    offers_best: bool,
) -> None:
    w = world(seed, num, size, ties=ties)
    hall = some_hall(seed, num, size, seed % (min(depth, size) + 1))
    team, cost = best_by_definition(w)
    best = team if offers_best and cost < np.inf else None
    given = np.array(team) if offers_best else None
    chosen = update_hall(*w, hall, depth, rules(num, memory, frozen, shared), given)
    expected = hall_by_definition(w, hall, depth, memory, frozen, shared, best)
    assert [tuple(team) for team in chosen.teams] == expected
    assert list(zip(chosen.collisions, chosen.costs, strict=True)) == [
        w.key(team) for team in expected
    ]
    ages = {tuple(team): age + 1 for team, age in zip(hall.teams, hall.ages, strict=True)}
    assert chosen.ages.tolist() == [ages.get(team, 0) for team in expected]


def test_memory_counts_generations_and_needs_somebody_new() -> None:
    own = np.array([[1.0, 2.0], [1.0, 2.0]])
    collisions = np.array([[[0, 1], [1, 0]]], dtype=np.int16)
    front = np.array(
        [[False, True], [False, False]]
    )  # forms (1, 1) of key (0, 4); in the hall is (0, 0) of (0, 2)
    hall = Hall.room(0, 2)._replace(
        teams=np.zeros((1, 2), dtype=np.int64), ages=np.zeros(1, dtype=np.int64)
    )
    firsts = []
    for _ in range(4):
        hall = update_hall(collisions, own, front, hall, 1, rules(2, memory=2))
        firsts.append(hall.teams[0].tolist())
    assert firsts == [[0, 0], [0, 0], [1, 1], [1, 1]]
    old = hall._replace(teams=np.zeros((1, 2), dtype=np.int64), ages=np.array([9]))
    again = np.array(
        [[True, False], [True, False]]
    )  # forms the very team that must give way: nobody new
    for nobody in (again, np.zeros((2, 2), dtype=bool)):
        stayed = update_hall(collisions, own, nobody, old, 1, rules(2, memory=2))
        assert stayed.teams.tolist() == [[0, 0]]
        assert stayed.ages.tolist() == [10]


def test_equal_keys_keep_the_old_then_the_first_formed() -> None:
    own, collisions = np.ones((2, 4)), np.zeros((1, 4, 4), dtype=np.int16)
    everybody = np.ones((2, 4), dtype=bool)
    old = Hall.room(0, 2)._replace(teams=np.array([[3, 2]]), ages=np.array([7]))
    chosen = update_hall(collisions, own, everybody, old, 3)
    assert chosen.teams.tolist() == [
        [3, 2],
        [0, 0],
    ]  # all new pairs have member 0 of one population
    assert chosen.ages.tolist() == [8, 0]


def test_nothing_is_random_and_inputs_are_left_alone() -> None:
    w, hall = world(6, 2, 30), some_hall(2, 2, 30, 4)
    copies = [array.copy() for array in (*w, *hall)]
    first, second = (update_hall(*w, hall, 5, rules(2, memory=2)) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    assert all(np.array_equal(a, b) for a, b in zip((*w, *hall), copies, strict=True))


def test_arrays_that_do_not_match_are_errors() -> None:
    w = world(0, 2, 5)
    with pytest.raises(ValueError, match="do not match"):
        best_team(w.collisions[:, :4], w.own)
    with pytest.raises(ValueError, match="do not match"):
        best_team(w.collisions, np.ones((3, 5)))
    with pytest.raises(ValueError, match="do not match"):
        best_team(np.zeros((0, 5, 5), dtype=np.int16), np.ones((1, 5)))
