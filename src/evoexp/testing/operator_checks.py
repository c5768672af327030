"""The obligations of an operator: `evolution.operators.operator` explains them."""

import numpy as np

from evoexp.evolution.operators.operator import (
    Context,
    Crossover,
    Genome,
    Mutation,
    Operator,
    Selection,
)
from evoexp.records import FloatArray, IntArray
from evoexp.testing.contract import ContractBroken

NUM_GENES, SIZE, SPARE = 6, 9, 4  # of a small population; SPARE columns pad the offspring
NOTHING = np.empty((0, 2))


def context_of(operator: Operator, uniforms: FloatArray, rate: float, genome: Genome) -> Context:
    """Return the context of an operator in the initial generation, without normal deviates."""
    return Context(uniforms, NOTHING, rate, 0.0, operator.settings, genome)


def selected(
    operator: Selection, rng: np.random.Generator, costs: FloatArray, count: int
) -> IntArray:
    """Return the indices of `count` parents, drawn by costs (individuals,)."""
    parents = np.full(count, -1)
    uniforms = rng.random(operator.num_uniforms(len(costs), count))
    operator.select(costs, context_of(operator, uniforms, 1.0, Genome.of(NOTHING)), parents)
    return parents


def crossed(
    operator: Crossover,
    rng: np.random.Generator,
    genomes: FloatArray,
    parents: IntArray,
    rate: float,
    genome: Genome,
) -> FloatArray:
    """Return the offspring (genes, parents) of a population (genes, individuals)."""
    out = np.full((len(genomes), len(parents) + SPARE), np.nan)
    uniforms = rng.random(operator.num_uniforms(genome, len(parents)))
    operator.cross(genomes, parents, context_of(operator, uniforms, rate, genome), out)
    _check(bool(np.isnan(out[:, len(parents) :]).all()), operator, "leaves the padding alone")
    return out[:, : len(parents)]


def mutated(
    operator: Mutation,
    rng: np.random.Generator,
    genomes: FloatArray,
    rate: float,
    genome: Genome,
    progress: float = 0.0,
) -> FloatArray:
    """Return the mutants (genes, individuals) of individuals, at t / T = `progress`."""
    num_genes, count = genomes.shape
    out = np.pad(genomes, [(0, 0), (0, SPARE)], constant_values=np.nan)
    uniforms = rng.random(operator.num_uniforms(genome, count))
    normals = rng.standard_normal((num_genes, count) if operator.takes_normals else (0, 0))
    context = context_of(operator, uniforms, rate, genome)
    operator.mutate(out, count, context._replace(normals=normals, progress=progress))
    _check(bool(np.isnan(out[:, count:]).all()), operator, "leaves the padding alone")
    return out[:, :count]


def check_operator(operator: Operator) -> None:
    """Check the obligations of an operator on small populations.

    Parents are individuals; at the rate 0 nobody is changed; every gene is written and within its
    limits; the same numbers give the same bits.

    Raises:
        ContractBroken: For the first obligation that it does not keep.
    """
    for seed in range(20):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(0, SIZE))
        if isinstance(operator, Selection):
            costs = np.where(rng.random(SIZE) < 0.3, np.inf, rng.random(SIZE))
            parents = selected(operator, rng, costs, count)
            _check(bool(((parents >= 0) & (parents < SIZE)).all()), operator, "draws individuals")
        elif isinstance(operator, Crossover | Mutation):
            _check_children(operator, rng, rng.integers(0, SIZE, count))


def _check_children(
    operator: Crossover | Mutation, rng: np.random.Generator, parents: IntArray
) -> None:
    genome = Genome.of(np.sort(rng.uniform(-5.0, 5.0, (NUM_GENES, 2))))
    low, high = genome.limits.T[:, :, None]
    genomes = rng.uniform(low, high, (NUM_GENES, SIZE))
    before = genomes[:, parents]

    def children(rate: float) -> FloatArray:
        numbers = np.random.default_rng(0)
        if isinstance(operator, Crossover):
            return crossed(operator, numbers, genomes, parents, rate, genome)
        return mutated(operator, numbers, before, rate, genome, 0.3)

    _check(np.array_equal(children(0.0), before), operator, "changes nobody at the rate 0")
    found = children(0.8)
    _check(bool(((low <= found) & (found <= high)).all()), operator, "keeps genes within limits")
    _check(np.array_equal(found, children(0.8)), operator, "gives the same bits again")


def _check(is_kept: bool, operator: Operator, obligation: str) -> None:
    if not is_kept:
        raise ContractBroken(f"operator {operator.component!r}: is one that {obligation}")
