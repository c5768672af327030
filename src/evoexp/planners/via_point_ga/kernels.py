"""One generation of strings of via-points, compiled (Rana & Zalzala 1995, section 3.4).

Populations are arrays (nq, N + 1, individuals), padded to whole vectors.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.body_tables import FlatTables
from evoexp.collision.bodies.clearance_kernels import least_clearances
from evoexp.evolution.operators.breeding import Breeding, Cross, Mutate, Select, breed
from evoexp.evolution.succession import choose_elites, copy_members, summarise
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.string_fitness import StringTerms, count_collisions, weigh
from evoexp.paths.interpolation import interpolate
from evoexp.paths.redistribution import measure_paths, redistribute_arms, relax_points
from evoexp.records import FloatArray, IntArray


class Settings(NamedTuple):
    """Settings of the steps behind breeding, and scratch."""

    arm_slices: IntArray  # (arms, 2) rows of each arm
    redistribution: bool  # whether to redistribute (section 3.4 c)
    samples: int  # of its arc length between two via-points
    is_clamped: bool  # whether the slopes at the ends of its spline are zero
    relaxation_step: float  # delta of Eqs. 8, 9
    substeps: int  # configurations tested per segment
    weights: tuple[float, float, float]  # k1, k2, k3 of Eq. 7
    tables: FlatTables  # of the circles, spheres or covers of bodies
    limits: FloatArray  # (nq, 2) of the joints, infinite where bodies are not covered [deg]


class Population(NamedTuple):
    """One generation; or all of several, with a first axis of places."""

    strings: FloatArray  # (nq, N + 1, individuals, padded); offspring first, then the elites
    costs: FloatArray  # (individuals,)
    collisions: FloatArray  # (individuals,) colliding instants


class Scratch(NamedTuple):
    """Arrays that a generation writes on its way."""

    offspring: FloatArray  # strings
    terms: StringTerms  # of the offspring
    elites: IntArray  # places of the elites, best first
    parents: IntArray  # (offspring,) places of the parents


@kernel
def evolve(
    select: Select,
    cross: Cross,
    mutate: Mutate,
    # (generations, numbers) those of every generation, in the order in which they are used
    uniforms: FloatArray,
    normals: FloatArray,  # normal deviates, of one generation only; see `breed`
    first: int,  # the present generation
    rules: Breeding,
    settings: Settings,
    # see `Population`: some generations; number g is at place g modulo the number of places
    table: Population,
    scratch: Scratch,
    summaries: FloatArray,  # (places, 4) written, see `summarise`
) -> None:
    """Go on from one generation to others."""
    rules, settings, scratch = borrowed((rules, settings, scratch))
    table, summaries = borrowed((table, summaries))
    (strings, costs, collisions), offspring, count = table, scratch.offspring, len(scratch.parents)
    rate = rules.mutation_rate
    for index in range(first, first + len(uniforms)):
        own, other, draws = index % len(costs), (index + 1) % len(costs), uniforms[index - first]
        # elites: the lowest costs
        choose_elites(costs[own], scratch.elites)
        # (a) reproduction, (b) cross-over, and (d) mutation before (c): a new trajectory, too, is
        # redistributed and relaxed once
        before, parents = costs[own], scratch.parents
        genomes, out = by_gene(strings[own]), by_gene(offspring)
        breed(
            select, cross, mutate, draws, normals, index, rate, rules, before, genomes, parents, out
        )
        # (c) redistribution and relaxation
        smooth(offspring, count, settings)
        # Eqs. 2–7
        judge(offspring, settings, scratch.terms)
        follow(table, own, other, scratch)
        summarise(costs[other], collisions[other] == 0.0, summaries[other])


@kernel
def by_gene(strings: FloatArray) -> FloatArray:
    """Return strings (nq, N + 1, individuals) as genomes (nq · (N + 1), individuals): a view."""
    return strings.reshape((strings.shape[0] * strings.shape[1], strings.shape[2]))


@kernel
def follow(table: Population, own: int, other: int, scratch: Scratch) -> None:
    """Write the population at a place that follows another: elites are not evaluated again."""
    (strings, costs, collisions), (offspring, terms, elites, parents) = table, scratch
    count, new, following = len(parents), by_gene(offspring), by_gene(strings[other])
    for row in range(len(new)):
        for k in range(count):
            following[row, k] = new[row, k]
    copy_members(by_gene(strings[own]), elites, following, count)
    costs[other, :count], collisions[other, :count] = terms.cost[:count], terms.collisions[:count]
    costs[other, count:], collisions[other, count:] = costs[own][elites], collisions[own][elites]


@kernel
def smooth(strings: FloatArray, count: int, settings: Settings) -> None:
    """Redistribute and relax the first `count` of strings (nq, N + 1, ≥ count) (section 3.4 c).

    Points that leave the limits are put there.
    """
    lanes = -(-count // 8) * 8  # whole vectors
    if settings.redistribution and count > 0 and strings.shape[1] > 2:
        arms, samples = settings.arm_slices, settings.samples
        redistribute_arms(strings, arms, lanes, samples, settings.is_clamped)
    if settings.relaxation_step > 0.0 and count > 0:
        relax_points(strings, settings.relaxation_step, lanes)
    for joint in range(len(strings)):
        low, high = settings.limits[joint]
        for point in range(strings.shape[1]):
            row = strings[joint, point]
            for k in range(count):
                row[k] = low if row[k] < low else (high if row[k] > high else row[k])


@kernel
def judge(strings: FloatArray, settings: Settings, terms: StringTerms) -> None:
    """Write the terms of strings (nq, N + 1, individuals), Eqs. 2–7.

    The instants 1 … N are the configurations that may collide.
    """
    substeps, (nq, num_points, lanes) = settings.substeps, strings.shape
    # Eqs. 2–5: lengths, and how uneven the distances of via-points are
    measure_paths(strings, settings.arm_slices, terms.lengths, terms.unevenness)
    # Eq. 6: contacts at the instants, which follow the start, and at the substeps before them
    configurations, start = strings, lanes
    if substeps > 1:
        configurations, start = np.empty((nq, (num_points - 1) * substeps, lanes)), 0
        interpolate(strings, substeps, configurations)
    angles = configurations.reshape((nq, -1))[:, start:] * DEGREE
    clearances = np.empty((3, angles.shape[1]))
    least_clearances(settings.tables, 0.0, True, angles, clearances)
    hits = np.minimum(clearances[0], np.minimum(clearances[1], clearances[2]))
    count_collisions(hits.reshape((num_points - 1, substeps, lanes)), terms.collisions)
    # Eq. 7
    weigh(settings.weights, terms.lengths, terms.unevenness, terms.collisions, terms.cost)
