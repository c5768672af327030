"""Operators on real genes and on bits: what each formula says, and what rates of 0 leave alone."""

import numpy as np
import pytest
import scipy.stats
from pydantic import ValidationError

from evoexp import testing as drawn
from evoexp.evolution.bit_coding import decode_bits
from evoexp.evolution.operators.crossover import ArithmeticCrossover, BlxAlpha, UniformCrossover
from evoexp.evolution.operators.mutation import (
    BitFlips,
    GaussianMutation,
    NonUniformMutation,
    UniformReset,
)
from evoexp.evolution.operators.operator import Crossover, Genome, Mutation, Selection
from evoexp.evolution.operators.selection import LinearRanking, Tournament
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic
from evoexp.records import FloatArray

LIMITS = np.array([[-1.0, 2.0], [0.0, 4.0], [-5.0, -3.0]])
GENOME = Genome.of(LIMITS)
COUNT = 4000
CROSSOVERS = (UniformCrossover(), ArithmeticCrossover(), BlxAlpha())
each_crossover = pytest.mark.parametrize("operator", CROSSOVERS, ids=lambda each: each.component)


def genomes(count: int = COUNT, seed: int = 0) -> FloatArray:
    low, high = LIMITS.T
    return low[:, None] + (high - low)[:, None] * np.random.default_rng(seed).random((3, count))


def crossed(operator: Crossover, rate: float) -> tuple[FloatArray, FloatArray]:
    parents, rng = genomes(), np.random.default_rng(1)
    return parents, drawn.crossed(operator, rng, parents, np.arange(COUNT), rate, GENOME)


def mutated(operator: Mutation, rate: float, progress: float) -> tuple[FloatArray, FloatArray]:
    before, rng = genomes(), np.random.default_rng(1)
    return before, drawn.mutated(operator, rng, before, rate, GENOME, progress)


@each_crossover
def test_crossover_has_its_rate(operator: Crossover) -> None:
    parents, out = crossed(operator, 0.3)
    changed = (parents != out).any(axis=0).reshape(-1, 2).any(axis=1)
    # three genes, none exchanged in one of eight pairs
    rate = 0.3 * (0.875 if isinstance(operator, UniformCrossover) else 1.0)
    assert changed.mean() == pytest.approx(
        rate, abs=4.0 * np.sqrt(0.3 * 0.7 / len(changed))
    )  # four standard errors


def test_uniform_crossover_exchanges_half_of_the_genes() -> None:
    parents, out = crossed(UniformCrossover(), 1.0)
    swapped = parents[:, ::2] == out[:, 1::2]
    assert np.array_equal(swapped, parents[:, 1::2] == out[:, ::2])
    assert np.array_equal(~swapped, parents[:, ::2] == out[:, ::2])
    assert swapped.mean() == pytest.approx(0.5, abs=0.03)  # 6000 genes: four standard errors


def test_arithmetic_children_lie_between_their_parents_at_one_share() -> None:
    parents, out = crossed(ArithmeticCrossover(), 1.0)
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
    parents, out = crossed(BlxAlpha(blend_alpha=alpha), 1.0)
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


@pytest.mark.parametrize("kind", [NonUniformMutation, GaussianMutation, UniformReset])
@pytest.mark.parametrize("one_gene", [False, True])
def test_mutation_has_its_rate_and_keeps_the_limits(kind: type[Mutation], one_gene: bool) -> None:
    operator = kind(one_gene=one_gene)
    before, same = mutated(operator, 0.0, 0.1)
    assert np.array_equal(before, same)
    before, after = mutated(operator, 0.2, 0.1)
    changed = before != after
    counted = changed.any(axis=0) if one_gene else changed
    assert counted.mean() == pytest.approx(
        0.2, abs=4.0 * np.sqrt(0.16 / counted.size)
    )  # four standard errors
    if one_gene:
        assert changed.sum(axis=0).max() == 1
    assert (LIMITS[:, 0] <= after.T).all()
    assert (LIMITS[:, 1] >= after.T).all()


def test_amounts_of_mutation() -> None:
    before, after = mutated(NonUniformMutation(mutation_power=1), 1.0, 0.7)
    room = np.where(after > before, LIMITS[:, 1:] - before, before - LIMITS[:, :1])
    share = np.abs(after - before) / room
    assert share.max() <= 0.3 + 1e-12
    assert share.mean() == pytest.approx(0.15, abs=0.005)  # r is uniform
    assert (after > before).mean() == pytest.approx(0.5, abs=0.02)
    before, after = mutated(UniformReset(), 0.5, 0.3)
    place = ((after - LIMITS[:, :1]) / (LIMITS[:, 1:] - LIMITS[:, :1]))[after != before]
    assert place.mean() == pytest.approx(0.5, abs=0.02)
    assert place.std() == pytest.approx(np.sqrt(1.0 / 12.0), abs=0.01)
    before, after = mutated(GaussianMutation(mutation_std=0.01), 1.0, 0.3)
    inside = (LIMITS[:, 0] < after.T) & (LIMITS[:, 1] > after.T)
    steps = ((after - before) / (LIMITS[:, 1:] - LIMITS[:, :1])).T[inside]
    assert steps.std() == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize(
    ("progress", "power", "spread"), [(0.0, 2, 1.0), (0.5, 2, 0.25), (1.0, 2, 0.0), (0.3, 0, 1.0)]
)
def test_the_spread_falls_to_nothing(progress: float, power: int, spread: float) -> None:
    before, after = mutated(NonUniformMutation(mutation_power=power), 1.0, progress)
    room = np.where(after > before, LIMITS[:, 1:] - before, before - LIMITS[:, :1])
    assert (np.abs(after - before) / room).max() == pytest.approx(spread, rel=1e-3)


def shares(operator: Selection, costs: FloatArray) -> FloatArray:
    """Return how often each individual is among 30,000 parents, as a share."""
    parents = drawn.selected(operator, np.random.default_rng(0), costs, 30_000)
    return np.bincount(parents, minlength=len(costs)) / len(parents)


def test_a_tournament_prefers_the_better_and_takes_anyone_where_nobody_is_feasible() -> None:
    costs = np.array([3.0, np.inf, 1.0, 2.0])
    # Of 16 ordered draws the best wins 7, the next 5, 3, 1.
    expected = np.array([3, 1, 7, 5]) / 16.0
    np.testing.assert_allclose(shares(Tournament(), costs), expected, atol=0.012)
    np.testing.assert_allclose(shares(Tournament(), np.full(4, np.inf)), 0.25, atol=0.012)
    np.testing.assert_allclose(shares(Tournament(tournament_size=1), costs), 0.25, atol=0.012)


@pytest.mark.parametrize("pressure", [1.0, 1.5, 2.0])
@pytest.mark.parametrize(
    "costs", [[5.0, 1.0, np.inf, np.inf], [7.0], [2.0, 2.0, 2.0], [4.0, 3.0, 1.0, 3.0, 0.5, np.inf]]
)
def test_parents_by_rank_are_as_many_as_their_formula_says(
    costs: list[float], pressure: float
) -> None:
    """Ranks as scipy counts them: equal costs share the mean of theirs."""
    ranks = scipy.stats.rankdata(-np.array(costs)) - 1.0
    weights = 2.0 - pressure + 2.0 * (pressure - 1.0) * ranks / max(len(costs) - 1, 1)
    weights = weights / weights.sum() if weights.any() else np.ones(len(costs))
    operator = LinearRanking(rank_pressure=pressure)
    np.testing.assert_allclose(shares(operator, np.array(costs)), weights, atol=0.012)


def test_bits() -> None:
    bits = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    angles = np.empty((2, 3))
    decode_bits(bits, 3, np.array([[-1.0, 2.0], [0.0, 3.0]]), angles)
    assert angles == pytest.approx(np.array([[-1.0, 2.0, 0.0], [0.0, 3.0, 1.0]]))
    genome, zeros = Genome.of(np.tile([0.0, 1.0], (20, 1))), np.zeros((20, 500))
    flipped = drawn.mutated(BitFlips(), np.random.default_rng(0), zeros, 0.1, genome)
    assert set(np.unique(flipped)) == {0.0, 1.0}
    assert flipped.mean() == pytest.approx(0.1, abs=0.012)  # four standard errors
    again = drawn.mutated(BitFlips(), np.random.default_rng(0), flipped, 0.0, genome)
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
