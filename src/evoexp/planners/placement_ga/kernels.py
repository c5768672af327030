"""Generations of the placement search, compiled (Chen & Zalzala 1995, section 3.2).

An individual is two strings of bits, see `evolution.bit_coding`.
"""

from typing import NamedTuple

from evoexp.evolution.bit_coding import cross_strings, decode_strings, flip_strings
from evoexp.evolution.cost_statistics import summarise
from evoexp.evolution.scaled_selection import (
    choose_by_remainders,
    num_remainder_uniforms,
    scale_costs,
)
from evoexp.evolution.selection import choose_elites
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.random_stream import Block, draw_many, used_up
from evoexp.objectives.placement_kernels import COST, CRITERIA, Model, measure_postures
from evoexp.records import FloatArray, IntArray

GENES = 2  # θ1, θ2
ROWS = GENES + CRITERIA + 1  # angles [deg], criteria, branch of θ3


class Breeding(NamedTuple):
    """Settings of the operators.

    Attributes:
        multiple: Copies that the best one expects, in units of the mean.
        crossover_rate: Probability per pair.
        mutation_rate: Probability per bit.
    """

    multiple: float
    crossover_rate: float
    mutation_rate: float


class Coding(NamedTuple):
    """The meaning of strings.

    Attributes:
        bits: Bits per gene.
        gray: Whether they are Gray codes.
        limits: (2, 2) of the angles [deg].
    """

    bits: int
    gray: bool
    limits: FloatArray


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places.

    Attributes:
        strings: (2, individuals).
        rows: (ROWS, individuals).
    """

    strings: IntArray
    rows: FloatArray


class Memory(NamedTuple):
    """Scratch.

    Attributes:
        parents: (offspring,) indices of individuals.
        elites: (elites,) likewise.
        expected: (individuals,) expected numbers of copies.
        order: (individuals,) order in which remainders are scanned.
    """

    parents: IntArray
    elites: IntArray
    expected: FloatArray
    order: IntArray


@kernel
def evolve(
    draws: Block,
    first: int,
    last: int,
    breeding: Breeding,
    coding: Coding,
    model: Model,
    table: Population,
    memory: Memory,
    summaries: FloatArray,
) -> int:
    """Go on from one generation to another.

    Args:
        draws: Uniform numbers.
        first: The present generation.
        last: The generation to reach.
        breeding: Settings of the operators.
        coding: The meaning of strings.
        model: Task, weights and limits of the criteria.
        table: Some generations; number g is at place g modulo the number of places.
        memory: Scratch.
        summaries: (places, 4) written, see `summarise_rows`.

    Returns:
        The generation reached: an earlier one if the draws did not suffice. Then it is to go on
        there with more.
    """
    draws, coding, model, table, memory, summaries = borrowed(
        (draws, coding, model, table, memory, summaries)
    )
    strings, rows = table.strings, table.rows
    for generation in range(first, last):
        before, own = draws.taken[0], generation % len(strings)
        other = (generation + 1) % len(strings)
        population = Population(strings[own], rows[own])
        following = Population(strings[other], rows[other])
        if not advance(draws, breeding, coding, model, population, following, memory):
            draws.taken[0] = before
            return generation
        summarise_rows(rows[other], summaries[other])
    return last


@kernel
def advance(
    draws: Block,
    breeding: Breeding,
    coding: Coding,
    model: Model,
    population: Population,
    following: Population,
    memory: Memory,
) -> bool:
    """Write the population that follows another: its offspring, then the elites, best first.

    Args:
        draws: Uniform numbers.
        breeding: Settings of the operators.
        coding: The meaning of strings.
        model: Task, weights and limits of the criteria.
        population: The present one.
        following: Written.
        memory: Scratch.

    Returns:
        Whether the draws sufficed; if not, what is written is not complete.
    """
    strings, rows, children = population.strings, population.rows, following.strings
    parents, elites, expected = memory.parents, memory.elites, memory.expected
    bits, num, count = coding.bits, strings.shape[1], len(parents)
    costs = rows[GENES + COST]
    # parents by linear scaling and stochastic remainders
    choose_elites(costs, elites)
    scale_costs(costs, count, breeding.multiple, expected)
    choosing = draw_many(draws, num_remainder_uniforms(num, count))
    crossing = draw_many(draws, 2 * (count // 2))
    if used_up(draws):
        return False
    choose_by_remainders(choosing, expected, memory.order, parents)
    # crossover, mutation, criteria
    cross_strings(crossing, strings, bits, parents, breeding.crossover_rate, children)
    flip_strings(draws, children, bits, count, breeding.mutation_rate)
    if used_up(draws):
        return False
    judge(children, coding, model, count, following.rows)
    # elites
    for e in range(len(elites)):
        for gene in range(GENES):
            children[gene, count + e] = strings[gene, elites[e]]
        for row in range(ROWS):
            following.rows[row, count + e] = rows[row, elites[e]]
    return True


@kernel
def judge(strings: IntArray, coding: Coding, model: Model, count: int, rows: FloatArray) -> None:
    """Decode and measure the first individuals: fill their rows."""
    decode_strings(strings[:, :count], coding.bits, coding.gray, coding.limits, rows[:GENES])
    measure_postures(rows[:GENES], count, model, rows[GENES:])


@kernel
def summarise_rows(rows: FloatArray, out: FloatArray) -> None:
    """Write index of the best, mean and deviation of the costs, number of feasible postures."""
    out[0], out[1], out[2] = summarise(rows[GENES + COST])
    feasible = 0
    for k in range(rows.shape[1]):
        feasible += rows[ROWS - 1, k] >= 0.0
    out[3] = feasible
