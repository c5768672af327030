"""Generations of the placement search, compiled (Chen & Zalzala 1995, section 3.2).

An individual is two strings of bits, see `evolution.bit_coding`.
"""

from typing import NamedTuple

from evoexp.evolution.bit_coding import cross_strings, decode_strings, flip_strings
from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.evolution.scaled_selection import SelectionMemory, choose_parents
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.random_stream import Block, draw_many, used_up
from evoexp.objectives.placement_kernels import COST, CRITERIA, Model, measure_postures
from evoexp.records import FloatArray, IntArray

GENES = 2  # θ1, θ2
ROWS = GENES + CRITERIA + 1  # angles [deg], criteria, branch of θ3


class Breeding(NamedTuple):
    """Settings of the operators."""

    multiple: float  # copies that the best one expects, in units of the mean
    crossover_rate: float  # probability per pair
    mutation_rate: float  # probability per bit


class Coding(NamedTuple):
    """The meaning of strings."""

    bits: int  # bits per gene
    gray: bool  # whether they are Gray codes
    limits: FloatArray  # (2, 2) of the angles [deg]


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places."""

    strings: IntArray  # (2, individuals)
    rows: FloatArray  # (ROWS, individuals)


@kernel
def evolve(
    draws: Block,  # uniform numbers
    first: int,  # the present generation
    last: int,  # the generation to reach
    breeding: Breeding,  # settings of the operators
    coding: Coding,  # the meaning of strings
    model: Model,  # task, weights and limits of the criteria
    table: Population,  # some generations; number g is at place g modulo the number of places
    chosen: SelectionMemory,  # parents and elites, written
    summaries: FloatArray,  # (places, 4) written, see `summarise_rows`
) -> int:
    """Go on from one generation to another.

    Returns:
        The generation reached: an earlier one if the draws did not suffice. Then it is to go on
        there with more.
    """
    draws, coding, model, table, chosen, summaries = borrowed(
        (draws, coding, model, table, chosen, summaries)
    )
    strings, rows = table.strings, table.rows
    for generation in range(first, last):
        before, own = draws.taken[0], generation % len(strings)
        other = (generation + 1) % len(strings)
        population = Population(strings[own], rows[own])
        following = Population(strings[other], rows[other])
        if not advance(draws, breeding, coding, model, population, following, chosen):
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
    chosen: SelectionMemory,
) -> bool:
    """Write the population that follows another: its offspring, then the elites, best first.

    Returns whether the draws sufficed; if not, what is written is not complete.
    """
    strings, rows, children = population.strings, population.rows, following.strings
    parents, elites, bits, count = chosen.parents, chosen.elites, coding.bits, len(chosen.parents)
    if not choose_parents(draws, rows[GENES + COST], breeding.multiple, chosen):
        return False
    crossing = draw_many(draws, 2 * (count // 2))
    if used_up(draws):
        return False
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
    out[0], out[1], out[2] = cost_statistics(rows[GENES + COST])
    feasible = 0
    for k in range(rows.shape[1]):
        feasible += rows[ROWS - 1, k] >= 0.0
    out[3] = feasible
