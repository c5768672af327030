"""One generation of the placement search, compiled (Chen & Zalzala 1995, section 3.2).

A population is a table of rows, individuals innermost: the bits, θ1 and θ2 [deg], the criteria, the branch of θ3.
"""

from evoexp.evolution.bit_coding import gray_to_binary
from evoexp.evolution.crossover import cross_single_point
from evoexp.evolution.gene_mutation import decode_bits, flip_bits
from evoexp.evolution.remainder import choose_by_remainders
from evoexp.evolution.scaling import scale_costs
from evoexp.evolution.selection import choose_elites
from evoexp.evolution.statistics import summarise
from evoexp.evolution.succession import succeed_rows
from evoexp.numerics import kernel
from evoexp.objectives.placement_kernels import CRITERIA, measure_postures

GENES = 2  # θ1, θ2
RESULTS = CRITERIA + 1  # rows behind the angles: criteria and branch


@kernel
def advance(uniforms, breeding, model, memory):  # type: ignore[no-untyped-def]
    """Replace a population by the next one.

    Args:
        uniforms: For selection, crossover and mutation, one after the other.
        breeding: Where those of crossover and of mutation begin; scaling multiple, crossover rate, mutation rate;
            whether bits are Gray codes; (2, 2) limits of the angles [deg].
        model: See `objectives.placement_kernels.measure_posture`: task, weights, avoided, limits.
        memory: Tables of the population and of its offspring; (bits, offspring) plain bits, (individuals,) expected
            numbers of copies, (individuals,) order of the scan, (offspring,) parents, (elites,).

    Returns:
        See `summary`.
    """
    crossing, mutating, multiple, crossover_rate, mutation_rate, gray, limits = breeding
    population, offspring, plain, expected, order, parents, elites = memory
    num_bits, count = len(plain), len(parents)
    costs = population[num_bits + GENES]
    choose_elites(costs, elites)
    scale_costs(costs, count, multiple, expected)
    choose_by_remainders(uniforms[:crossing], expected, order, parents)
    bits = offspring[:num_bits]
    cross_single_point(uniforms[crossing:mutating], population[:num_bits], parents, crossover_rate, bits)
    flip_bits(uniforms[mutating:], bits, count, mutation_rate)
    judge(offspring, count, gray, limits, model, plain)
    succeed_rows(population, offspring, count, elites)
    return summary(costs, population[len(population) - 1])


@kernel
def judge(table, count, gray, limits, model, plain):  # type: ignore[no-untyped-def]
    """Decode and measure individuals: fill the rows of a table behind its bits; `plain` is scratch."""
    num_bits = len(plain)
    task, weights, avoided, joint_limits = model
    angles, results = table[num_bits : num_bits + GENES], table[num_bits + GENES :]
    if gray:
        gray_to_binary(table[:num_bits], count, GENES, plain)
        decode_bits(plain, count, limits, angles)
    else:
        decode_bits(table[:num_bits], count, limits, angles)
    measure_postures(angles, count, task, weights, avoided, joint_limits, results)


@kernel
def summary(costs, branches):  # type: ignore[no-untyped-def]
    """Return index of the best, mean and standard deviation of the costs, and how many postures are feasible."""
    best, mean, std = summarise(costs)
    feasible = 0
    for k in range(len(costs)):
        feasible += branches[k] >= 0.0
    return best, mean, std, feasible
