"""Operators on real genes and on bits: what each formula says, and what rates of 0 leave alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from evoexp.evolution.crossover import (
    ARITHMETIC,
    BLX_ALPHA,
    UNIFORM,
    cross_genes,
    num_gene_uniforms,
)
from evoexp.evolution.mutation import (
    GAUSSIAN,
    GENE,
    INDIVIDUAL,
    NON_UNIFORM,
    UNIFORM_RESET,
    decode_bits,
    flip_bits,
    mutate_genes,
    non_uniform_spread,
    num_mutation_uniforms,
)
from evoexp.evolution.selection import choose_by_tournament, rank_weights, spin_roulette
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic
from evoexp.records import FloatArray

LIMITS = np.array([[-1.0, 2.0], [0.0, 4.0], [-5.0, -3.0]])
COUNT = 4000


def genomes(count: int = COUNT, seed: int = 0) -> FloatArray:
    low, high = LIMITS.T
    return low[:, None] + (high - low)[:, None] * np.random.default_rng(seed).random((3, count))


def crossed(
    kind: int, rate: float, alpha: float = 0.5, seed: int = 1
) -> tuple[FloatArray, FloatArray]:
    parents, out = genomes(), np.empty((3, COUNT))
    uniforms = np.random.default_rng(seed).random(num_gene_uniforms(3, COUNT // 2))
    cross_genes(kind, uniforms, parents, np.arange(COUNT), rate, alpha, LIMITS, out)
    return parents, out


def mutated(
    kind: int, scope: int, rate: float, spread: float, seed: int = 1
) -> tuple[FloatArray, FloatArray]:
    rng, before = np.random.default_rng(seed), genomes()
    after = before.copy()
    uniforms = rng.random(num_mutation_uniforms(3, COUNT, scope))
    mutate_genes(
        kind, scope, uniforms, rng.standard_normal((3, COUNT)), after, COUNT, rate, spread, LIMITS
    )
    return before, after


@pytest.mark.parametrize("kind", [UNIFORM, ARITHMETIC, BLX_ALPHA])
def test_crossover_at_rate_0_copies(kind: int) -> None:
    parents, out = crossed(kind, 0.0)
    assert np.array_equal(parents, out)


@pytest.mark.parametrize("kind", [UNIFORM, ARITHMETIC, BLX_ALPHA])
def test_crossover_has_its_rate(kind: int) -> None:
    parents, out = crossed(kind, 0.3)
    changed = (parents != out).any(axis=0).reshape(-1, 2).any(axis=1)
    rate = 0.3 * (
        0.875 if kind == UNIFORM else 1.0
    )  # three genes, none exchanged in one of eight pairs
    assert changed.mean() == pytest.approx(
        rate, abs=4.0 * np.sqrt(0.3 * 0.7 / len(changed))
    )  # four standard errors


def test_uniform_crossover_exchanges_half_of_the_genes() -> None:
    parents, out = crossed(UNIFORM, 1.0)
    swapped = parents[:, ::2] == out[:, 1::2]
    assert np.array_equal(swapped, parents[:, 1::2] == out[:, ::2])
    assert np.array_equal(~swapped, parents[:, ::2] == out[:, ::2])
    assert swapped.mean() == pytest.approx(0.5, abs=0.03)  # 6000 genes: four standard errors


def test_arithmetic_children_lie_between_their_parents_at_one_share() -> None:
    parents, out = crossed(ARITHMETIC, 1.0)
    x, y, first, second = parents[:, ::2], parents[:, 1::2], out[:, ::2], out[:, 1::2]
    share = (first - y) / (x - y)
    assert np.abs(share - share[0]).max() < 1e-9
    assert (share[0] >= 0.0).all()
    assert (share[0] < 1.0).all()
    np.testing.assert_allclose(first + second, x + y, atol=1e-12)


@pytest.mark.parametrize("alpha", [0.0, 0.5, 3.0])
def test_blx_children_lie_at_most_alpha_beyond_their_parents_and_within_limits(
    alpha: float,
) -> None:
    parents, out = crossed(BLX_ALPHA, 1.0, alpha)
    x, y = parents[:, ::2], parents[:, 1::2]
    wide = alpha * np.abs(x - y) + 1e-12
    for child in (out[:, ::2], out[:, 1::2]):
        assert (child >= np.minimum(x, y) - wide).all()
        assert (child <= np.maximum(x, y) + wide).all()
        assert (LIMITS[:, 0] <= child.T).all()
        assert (LIMITS[:, 1] >= child.T).all()
    if alpha == 0.5:  # one child in two lies outside of its parents, but for the limits
        outside = (out[:, ::2] < np.minimum(x, y)) | (out[:, ::2] > np.maximum(x, y))
        assert 0.25 < outside.mean() < 0.5


@pytest.mark.parametrize("kind", [NON_UNIFORM, GAUSSIAN, UNIFORM_RESET])
@pytest.mark.parametrize("scope", [GENE, INDIVIDUAL])
def test_mutation_has_its_rate_and_keeps_the_limits(kind: int, scope: int) -> None:
    before, same = mutated(kind, scope, 0.0, 0.7)
    assert np.array_equal(before, same)
    before, after = mutated(kind, scope, 0.2, 0.7)
    changed = before != after
    counted = changed if scope == GENE else changed.any(axis=0)
    assert counted.mean() == pytest.approx(
        0.2, abs=4.0 * np.sqrt(0.16 / counted.size)
    )  # four standard errors
    if scope == INDIVIDUAL:
        assert changed.sum(axis=0).max() == 1
    assert (LIMITS[:, 0] <= after.T).all()
    assert (LIMITS[:, 1] >= after.T).all()


def test_amounts_of_mutation() -> None:
    before, after = mutated(NON_UNIFORM, GENE, 1.0, 0.3)
    room = np.where(after > before, LIMITS[:, 1:] - before, before - LIMITS[:, :1])
    share = np.abs(after - before) / room
    assert share.max() <= 0.3 + 1e-12
    assert share.mean() == pytest.approx(0.15, abs=0.005)  # r is uniform
    assert (after > before).mean() == pytest.approx(0.5, abs=0.02)
    before, after = mutated(UNIFORM_RESET, GENE, 0.5, 0.3)
    place = ((after - LIMITS[:, :1]) / (LIMITS[:, 1:] - LIMITS[:, :1]))[after != before]
    assert place.mean() == pytest.approx(0.5, abs=0.02)
    assert place.std() == pytest.approx(np.sqrt(1.0 / 12.0), abs=0.01)
    before, after = mutated(GAUSSIAN, GENE, 1.0, 0.01)
    inside = (LIMITS[:, 0] < after.T) & (LIMITS[:, 1] > after.T)
    steps = ((after - before) / (LIMITS[:, 1:] - LIMITS[:, :1])).T[inside]
    assert steps.std() == pytest.approx(0.01, rel=0.05)


def test_the_spread_falls_to_nothing() -> None:
    assert non_uniform_spread(0, 100, 2) == 1.0
    assert non_uniform_spread(50, 100, 2) == pytest.approx(0.25)
    assert non_uniform_spread(100, 100, 2) == 0.0
    assert non_uniform_spread(30, 100, 0) == 1.0


def test_a_tournament_prefers_the_better_and_takes_anyone_where_nobody_is_feasible() -> None:
    uniforms, parents = np.random.default_rng(0).random(60_000), np.empty(30_000, dtype=np.int64)
    costs = np.array([3.0, np.inf, 1.0, 2.0])
    choose_by_tournament(uniforms, costs, 2, parents)
    # Of 16 ordered draws the best wins 7, the next 5, 3, 1.
    expected = np.array([3, 1, 7, 5]) / 16.0
    np.testing.assert_allclose(
        np.bincount(parents, minlength=4) / len(parents), expected, atol=0.012
    )
    choose_by_tournament(uniforms, np.full(4, np.inf), 2, parents)
    np.testing.assert_allclose(np.bincount(parents, minlength=4) / len(parents), 0.25, atol=0.012)
    choose_by_tournament(uniforms[:30_000], costs, 1, parents)
    np.testing.assert_allclose(np.bincount(parents, minlength=4) / len(parents), 0.25, atol=0.012)


@given(
    st.lists(st.one_of(st.floats(0.0, 9.0), st.just(np.inf)), min_size=1, max_size=30),
    st.floats(1.0, 2.0),
)
def test_rank_weights_sum_to_the_population_and_fall_with_cost(
    costs: list[float], pressure: float
) -> None:
    values, weights = np.array(costs), np.empty(len(costs))
    rank_weights(values, pressure, weights)
    assert weights.sum() == pytest.approx(len(costs) if len(costs) > 1 else 2.0 - pressure)
    order = np.argsort(values, kind="stable")
    assert (np.diff(weights[order]) <= 1e-12).all()
    for cost in set(costs):
        assert np.ptp(weights[values == cost]) == 0.0


def test_ranks_of_four() -> None:
    weights = np.empty(4)
    rank_weights(np.array([5.0, 1.0, np.inf, np.inf]), 2.0, weights)
    assert weights == pytest.approx([4.0 / 3.0, 2.0, 1.0 / 3.0, 1.0 / 3.0])
    parents = np.empty(9, dtype=np.int64)
    rank_weights(np.array([7.0]), 2.0, weights[:1])
    spin_roulette(weights[:1], np.random.default_rng(0).random(9), parents)
    assert (parents == 0).all()


def test_bits() -> None:
    bits = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    angles = np.empty((2, 3))
    decode_bits(bits, 3, np.array([[-1.0, 2.0], [0.0, 3.0]]), angles)
    assert angles == pytest.approx(np.array([[-1.0, 2.0, 0.0], [0.0, 3.0, 1.0]]))
    flipped = np.zeros((20, 500))
    flip_bits(np.random.default_rng(0).random(10_000), flipped, 500, 0.1)
    assert set(np.unique(flipped)) == {0.0, 1.0}
    assert flipped.mean() == pytest.approx(0.1, abs=0.012)  # four standard errors
    again = flipped.copy()
    flip_bits(np.random.default_rng(0).random(10_000), again, 500, 0.0)
    assert np.array_equal(again, flipped)


SHARED = {
    "population_size": 10, "num_generations": 5, "num_elites": 1, "crossover_rate": 0.3,
    "mutation_rate": 0.2,
    "selection": "tournament", "tournament_size": 2, "rank_pressure": 1.5,
}  # fmt: skip
REAL = SHARED | {
    "crossover": "one_point", "blend_alpha": 0.5, "mutation": "non_uniform",
    "mutation_scope": "gene",
    "mutation_power": 2, "mutation_std": 0.1,
}  # fmt: skip


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("blend_alpha", -0.1),
        ("tournament_size", 0),
        ("rank_pressure", 0.9),
        ("rank_pressure", 2.1),
        ("mutation_power", -1),
        ("mutation_std", 0.0),
        ("selection", "lottery"),
        ("crossover", "two_point"),
        ("mutation", "none"),
        ("mutation_scope", "all"),
    ],
)
def test_settings_out_of_range_are_refused(field: str, value: object) -> None:
    assert RealGenetic(**REAL).num_offspring == 9
    with pytest.raises(ValidationError, match=field):
        RealGenetic(**(REAL | {field: value}))


@pytest.mark.parametrize("bits", [0, 53])
def test_bits_per_gene_out_of_range_are_refused(bits: int) -> None:
    assert BinaryGenetic(**SHARED, bits_per_gene=16).bits_per_gene == 16
    with pytest.raises(ValidationError, match="bits_per_gene"):
        BinaryGenetic(**SHARED, bits_per_gene=bits)
