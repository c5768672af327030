"""Generations of the placement search, compiled (Chen & Zalzala 1995, section 3.2).

An individual is two strings of bits, see `evolution.bit_coding`.
"""

from typing import NamedTuple

from evoexp.evolution.bit_coding import cross_strings, decode_strings, flip_strings
from evoexp.evolution.scaled_selection import SelectionMemory, choose_parents
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.random_stream import Block, draw_many, used_up
from evoexp.objectives.placement_kernels import COST, CRITERIA, Model, measure_postures
from evoexp.records import FloatArray, IntArray

GENES = 2  # θ1, θ2
ROWS = GENES + CRITERIA + 1  # angles [deg], criteria, branch of θ3


class Coding(NamedTuple):
    """The meaning of strings, and settings of the operators."""

    bits: int  # bits per gene
    gray: bool  # whether they are Gray codes
    limits: FloatArray  # (2, 2) of the angles [deg]
    multiple: float  # copies that the best one expects, in units of the mean
    crossover_rate: float  # probability per pair
    mutation_rate: float  # probability per bit


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places."""

    strings: IntArray  # (2, individuals)
    rows: FloatArray  # (ROWS, individuals)


@kernel
def advance(
    draws: Block,  # uniform numbers
    coding: Coding,  # the meaning of strings, and settings of the operators
    model: Model,  # task, weights and limits of the criteria
    population: Population,
    following: Population,  # written
    chosen: SelectionMemory,  # parents and elites, written
) -> bool:
    """Write the population that follows another: its offspring, then the elites, best first.

    Returns whether the draws sufficed; if not, what is written is not complete.
    """
    draws, coding, model, population, following, chosen = borrowed(
        (draws, coding, model, population, following, chosen)
    )
    strings, rows, children = population.strings, population.rows, following.strings
    parents, elites, bits, count = chosen.parents, chosen.elites, coding.bits, len(chosen.parents)
    if not choose_parents(draws, rows[GENES + COST], coding.multiple, chosen):
        return False
    crossing = draw_many(draws, 2 * (count // 2))
    if used_up(draws):
        return False
    # crossover, mutation, criteria
    cross_strings(crossing, strings, bits, parents, coding.crossover_rate, children)
    flip_strings(draws, children, bits, count, coding.mutation_rate)
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
