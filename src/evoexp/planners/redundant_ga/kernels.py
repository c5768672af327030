"""Generations of end postures of a sub-path, compiled (Lavoie & Boudreau 2001).

A population is a table of rows, individuals innermost: the genes; the joint angles, which are the
genes themselves in real coding and follow them in binary coding; then cost, position error and
joint displacement. Generations are computed several per call, one table for each of them.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.ellipse_kernels import PathChecks, prepare_checks
from evoexp.evolution.bit_coding import decode_bits
from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.evolution.operators.breeding import Breeding, Cross, Mutate, Select, breed
from evoexp.evolution.succession import choose_elites
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.planners.redundant_ga.sub_path_costs import (
    RESULTS,
    Judging,
    drop_collisions,
    list_inside,
    measure,
)
from evoexp.records import BoolArray, FloatArray, IntArray

SUMMARY = 4  # of a population: see `summarise_costs`


class Coding(NamedTuple):
    """The meaning of genes."""

    num_genes: int
    binary: bool  # whether they are bits
    limits: FloatArray  # (joints, 2) of the joint angles [rad]


class Generations(NamedTuple):
    """Some generations; number g is at place g modulo the number of places."""

    tables: FloatArray  # (places, rows, individuals, filled up to whole vectors)
    summaries: FloatArray  # (places, SUMMARY)


class Memory(NamedTuple):
    """Arrays that a generation writes on its way."""

    parents: IntArray  # (offspring,) indices of individuals
    elites: IntArray  # (elites,) likewise
    lanes: IntArray  # (individuals + LANES,) scratch
    hit: BoolArray  # (individuals,) scratch


@kernel
def evolve(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    uniforms: FloatArray,  # (generations, numbers) of those to be computed
    normals: FloatArray,  # normal deviates, of one generation only; see `breed`
    first: int,  # the present generation
    stop_cost: float,  # the first generation whose best costs less ends the search
    # whether generations are bred; if not, each is drawn as the initial one is, as many individuals
    # as would be bred
    evolving: bool,
    breeding: Breeding,
    coding: Coding,
    judging: Judging,
    starts: FloatArray,  # (joints, ≥ individuals) start of the sub-path, the same for all [rad]
    generations: Generations,
    memory: Memory,
) -> int:
    """Compute the generations behind one up to another, or up to the first that is good enough.

    Returns:
        The last generation that was computed.
    """
    uniforms, normals, starts, breeding, coding, judging, generations, memory = borrowed(
        (uniforms, normals, starts, breeding, coding, judging, generations, memory)
    )
    tables, summaries = generations
    count, last = len(memory.parents), first + len(uniforms)
    checks = prepare_checks(judging.ellipses, len(starts), tables.shape[2])
    for index in range(first, last):
        own, other = index % len(tables), (index + 1) % len(tables)
        population, following, numbers = tables[own], tables[other], uniforms[index - first]
        costs = following[len(following) - RESULTS, : len(memory.hit)]
        if evolving:
            # elites, and offspring of genomes
            before = population[len(population) - RESULTS, : len(memory.hit)]
            choose_elites(before, memory.elites)
            genomes, children = population[: coding.num_genes], following[: coding.num_genes]
            rate, parents = breeding.mutation_rate, memory.parents
            breed(
                select,
                cross,
                mutate,
                numbers,
                normals,
                index,
                rate,
                breeding,
                before,
                genomes,
                parents,
                children,
            )
            succeed(coding, judging, starts, population, following, memory, checks)
        else:
            draw(numbers, count, coding, judging, starts, following, memory, checks)
            costs = costs[:count]
        summarise_costs(costs, summaries[other])
        if costs[int(summaries[other, 0])] < stop_cost:
            return index + 1
    return last


@kernel
def begin(
    uniforms: FloatArray,  # (genes · individuals,)
    coding: Coding,
    judging: Judging,
    starts: FloatArray,
    generations: Generations,
    memory: Memory,
) -> None:
    """Draw and judge the initial population, at place 0; see `evolve`."""
    (tables, summaries), size = generations, len(memory.hit)
    checks = prepare_checks(judging.ellipses, len(starts), tables.shape[2])
    draw(uniforms, size, coding, judging, starts, tables[0], memory, checks)
    summarise_costs(tables[0, len(tables[0]) - RESULTS, :size], summaries[0])


@kernel
def draw(
    uniforms: FloatArray,  # (genes · count,)
    count: int,
    coding: Coding,
    judging: Judging,
    starts: FloatArray,
    table: FloatArray,
    memory: Memory,
    checks: PathChecks,
) -> None:
    """Draw and judge the first `count` individuals, uniform within the limits or bit by bit."""
    num_genes, limits = coding.num_genes, coding.limits
    for gene in range(num_genes):
        row, numbers = table[gene], uniforms[gene * count : (gene + 1) * count]
        if coding.binary:
            for k in range(count):
                row[k] = np.floor(2.0 * numbers[k])
        else:
            low, wide = limits[gene, 0], limits[gene, 1] - limits[gene, 0]
            for k in range(count):
                row[k] = low + wide * numbers[k]
    angles = _angles(table, count, coding, len(starts))
    measure(starts, angles, count, judging, table)
    lanes, left = memory.lanes, list_inside(table, count, memory.lanes)
    drop_collisions(starts, angles, lanes, left, judging, table, memory.hit, checks)


@kernel
def _angles(table: FloatArray, count: int, coding: Coding, num_joints: int) -> FloatArray:
    """Return the rows of the joint angles of a table; those of the first `count` are decoded."""
    first = coding.num_genes if coding.binary else 0
    angles = table[first : first + num_joints]
    if coding.binary:
        decode_bits(table[: coding.num_genes], count, coding.limits, angles)
    return angles


@kernel
def succeed(
    coding: Coding,
    judging: Judging,
    starts: FloatArray,
    population: FloatArray,
    following: FloatArray,
    memory: Memory,
    checks: PathChecks,
) -> None:
    """Judge the offspring in the population that follows another; put the elites behind them."""
    elites, count, num_genes = memory.elites, len(memory.parents), coding.num_genes
    angles = _angles(following, count, coding, len(starts))
    judge_children(starts, angles, num_genes, judging, population, following, memory, checks)
    for row in range(len(population)):
        for k in range(len(elites)):
            following[row, count + k] = population[row, elites[k]]


@kernel
def summarise_costs(costs: FloatArray, out: FloatArray) -> None:
    """Write index of the best, mean and deviation of the finite costs, and how many are finite."""
    out[0], out[1], out[2] = cost_statistics(costs)
    finite = 0
    for k in range(len(costs)):
        finite += np.isfinite(costs[k])
    out[3] = finite


@kernel
def judge_children(
    starts: FloatArray,
    angles: FloatArray,
    num_genes: int,
    judging: Judging,
    population: FloatArray,
    following: FloatArray,
    memory: Memory,
    checks: PathChecks,
) -> None:
    """Write Eq. 4 and its parts for all offspring.

    A child that ends outside the box, or is its own parent, is not tested for collisions.

    The first `num_genes` rows make a child its own parent if they are equal; it then costs as much.
    """
    row, count, parents, lanes = (
        len(population) - RESULTS,
        len(memory.parents),
        memory.parents,
        memory.lanes,
    )
    measure(starts, angles, count, judging, following)
    # children inside the box that differ from their parents
    left, cost = 0, following[row]
    for n in range(list_inside(following, count, lanes)):
        child = lanes[n]
        parent, gene = parents[child], 0
        while gene < num_genes and following[gene, child] == population[gene, parent]:
            gene += 1
        if gene == num_genes:
            cost[child] = population[row, parent]
        lanes[left] = child
        left += gene < num_genes
    drop_collisions(starts, angles, lanes, left, judging, following, memory.hit, checks)
