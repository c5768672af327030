"""Generations of the placement search, compiled (Chen & Zalzala 1995, section 3.2).

A population is strings of bits (2, individuals), see `evolution.bit_coding`, and what they are
worth in rows, individuals innermost: θ1 and θ2 [deg], the criteria, the branch of θ3.
"""

from evoexp.evolution.bit_coding import cross_strings, decode_strings, flip_strings
from evoexp.evolution.cost_statistics import summarise
from evoexp.evolution.remainder import choose_by_remainders, num_remainder_uniforms
from evoexp.evolution.scaling import scale_costs
from evoexp.evolution.selection import choose_elites
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.random_stream import draw_many, used_up
from evoexp.objectives.placement_kernels import COST, CRITERIA, measure_postures

GENES = 2  # θ1, θ2
ROWS = GENES + CRITERIA + 1  # angles, criteria, branch


@kernel
def evolve(draws, generations, breeding, coding, model, tables, memory, records):  # type: ignore[no-untyped-def]
    """Go on from one generation to another; what each is worth is noted beside it.

    Args:
        draws: See `evoexp.numeric.random_stream`.
        generations: The present one, and the one to reach.
        breeding: Scaling multiple, crossover rate, mutation rate.
        coding: Bits per gene, whether they are Gray codes, (2, 2) limits of the angles [deg].
        model: See `objectives.placement_kernels.measure_posture`: task, weights, avoided, limits.
        tables: Strings (places, 2, individuals) and rows (places, ROWS, individuals) of some
            generations; number g has place g modulo the number of places.
        memory: (individuals,) expected numbers of copies, (individuals,) order of the scan,
            (offspring,) parents, (elites,).
        records: (places, 4) see `record`.

    Returns:
        The generation reached: an earlier one if the draws did not suffice. Then it is to go on
        there with more.
    """
    draws, coding, model, tables, memory, records = borrowed(
        (draws, coding, model, tables, memory, records)
    )
    strings, rows = tables
    first, last = generations
    for generation in range(first, last):
        before, own, other = draws[1][0], generation % len(strings), (generation + 1) % len(strings)
        population, following = (strings[own], rows[own]), (strings[other], rows[other])
        if not advance(draws, breeding, coding, model, population, following, memory):
            draws[1][0] = before
            return generation
        record(rows[other], records[other])
    return last


@kernel
def advance(draws, breeding, coding, model, population, following, memory):  # type: ignore[no-untyped-def]
    """Write the population that follows another: its offspring, then the elites, best first.

    Returns:
        Whether the draws sufficed; if not, what is written is not complete.
    """
    multiple, crossover_rate, mutation_rate = breeding
    (strings, rows), (children, values) = population, following
    expected, order, parents, elites = memory
    bits, num, count = coding[0], strings.shape[1], len(parents)
    costs = rows[GENES + COST]
    choose_elites(costs, elites)
    scale_costs(costs, count, multiple, expected)
    choosing = draw_many(draws, num_remainder_uniforms(num, count))
    crossing = draw_many(draws, 2 * (count // 2))
    if used_up(draws):
        return False
    choose_by_remainders(choosing, expected, order, parents)
    cross_strings(crossing, strings, bits, parents, crossover_rate, children)
    flip_strings(draws, children, bits, count, mutation_rate)
    if used_up(draws):
        return False
    judge(children, coding, model, count, values)
    for e in range(len(elites)):
        for gene in range(GENES):
            children[gene, count + e] = strings[gene, elites[e]]
        for row in range(ROWS):
            values[row, count + e] = rows[row, elites[e]]
    return True


@kernel
def judge(strings, coding, model, count, rows):  # type: ignore[no-untyped-def]
    """Decode and measure the first individuals: fill their rows."""
    bits, gray, limits = coding
    task, weights, avoided, joint_limits = model
    decode_strings(strings[:, :count], bits, gray, limits, rows[:GENES])
    measure_postures(rows[:GENES], count, task, weights, avoided, joint_limits, rows[GENES:])


@kernel
def record(rows, out):  # type: ignore[no-untyped-def]
    """Note in `out` (4,) index of the best, mean and deviation of the costs.

    And how many postures are feasible.
    """
    out[0], out[1], out[2] = summarise(rows[GENES + COST])
    feasible = 0
    for k in range(rows.shape[1]):
        feasible += rows[ROWS - 1, k] >= 0.0
    out[3] = feasible
