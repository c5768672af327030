"""Generations of end postures of a sub-path, compiled (Lavoie & Boudreau 2001).

A population is a table of rows, individuals innermost: the genes; the joint angles, which are the
genes themselves in real coding and follow them in binary coding; then cost, position error and
joint displacement. Generations are computed several per call, one table for each of them.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.link_ellipses import (
    Ellipses,
    PathChecks,
    TestedPath,
    check_paths,
    prepare_checks,
)
from evoexp.evolution.operators.operator import Breeding, Cross, Mutate, Select, breed
from evoexp.evolution.succession import choose_elites, copy_members, summarise
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.vectors import LANES, load, root, select, spread, store
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import VECTOR, U
from evoexp.robots.planar_ends import PlanarArm, block_ends, load_lanes

RESULTS = 3  # last rows of a table of individuals: cost, position error, joint displacement


class Judging(NamedTuple):
    """The collision model and the objective of a sub-path."""

    arm: PlanarArm  # the arm
    ellipses: Ellipses  # the ellipses
    path: TestedPath  # the positions that are tested
    target: FloatArray  # (2,) desired place of the tip [length unit]
    box: FloatArray  # (4,) least and greatest x, least and greatest y of the tip [length unit]
    weights: tuple[float, float]  # w1, w2 of Eq. 4.


class SubPath(NamedTuple):
    """A sub-path that is searched, and arrays that a generation writes on its way."""

    num_genes: int
    binary: bool  # whether genes are bits
    limits: FloatArray  # (joints, 2) of the joint angles [rad]
    parents: IntArray  # (offspring,) indices of individuals, scratch
    elites: IntArray  # (elites,) likewise
    lanes: IntArray  # (individuals + LANES,) scratch
    hit: BoolArray  # (individuals,) scratch
    starts: FloatArray  # (joints, ≥ individuals) start of the sub-path, the same for all [rad]
    judging: Judging


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
    rules: Breeding,
    sub_path: SubPath,
    # (places, rows, individuals, filled up to whole vectors): generation g is at place g modulo the
    # number of places
    tables: FloatArray,
    summaries: FloatArray,  # (places, 4) see `summarise`
) -> int:
    """Compute generations up to another, or the first that is good enough; return the last one."""
    uniforms, normals, rules, sub_path = borrowed((uniforms, normals, rules, sub_path))
    tables, summaries = borrowed((tables, summaries))
    num_genes, parents, size = sub_path.num_genes, sub_path.parents, len(sub_path.hit)
    rate, last = rules.mutation_rate, first + len(uniforms)
    checks = prepare_checks(len(sub_path.starts), tables.shape[2])
    for t in range(first, last):
        population, following = tables[t % len(tables)], tables[(t + 1) % len(tables)]
        draws, summary, num_new = uniforms[t - first], summaries[(t + 1) % len(tables)], size
        if evolving:
            # elites, and offspring of genomes
            costs = population[len(population) - RESULTS, :size]
            choose_elites(costs, sub_path.elites)
            genes, out = population[:num_genes], following[:num_genes]
            breed(select, cross, mutate, draws, normals, t, rate, rules, costs, genes, parents, out)
            succeed(sub_path, population, following, checks)
        else:
            num_new = len(parents)
            draw(draws, num_new, sub_path, following, checks)
        new_costs = following[len(following) - RESULTS, :num_new]
        summarise(new_costs, np.isfinite(new_costs), summary)
        if new_costs[int(summary[0])] < stop_cost:
            return t + 1
    return last


@kernel
def begin(uniforms: FloatArray, sub_path: SubPath, tables: FloatArray) -> None:
    """Draw and judge the initial population by (genes · individuals,) numbers; see `evolve`."""
    size = len(sub_path.hit)
    checks = prepare_checks(len(sub_path.starts), tables.shape[2])
    draw(uniforms, size, sub_path, tables[0], checks)


@kernel
def draw(
    uniforms: FloatArray, count: int, sub_path: SubPath, table: FloatArray, checks: PathChecks
) -> None:
    """Write and judge individuals, uniform in the limits or bits, by (genes · count,) numbers."""
    num_genes, limits, lanes = sub_path.num_genes, sub_path.limits, sub_path.lanes
    for gene in range(num_genes):
        row, numbers = table[gene], uniforms[gene * count : (gene + 1) * count]
        if sub_path.binary:
            for k in range(count):
                row[k] = np.floor(2.0 * numbers[k])
        else:
            low, wide = limits[gene, 0], limits[gene, 1] - limits[gene, 0]
            for k in range(count):
                row[k] = low + wide * numbers[k]
    starts, judging, angles = sub_path.starts, sub_path.judging, _angles(table, count, sub_path)
    measure(starts, angles, count, judging, table)
    num_inside = list_inside(table, count, lanes)
    drop_collisions(starts, angles, lanes, num_inside, judging, table, sub_path.hit, checks)


@kernel
def _angles(table: FloatArray, count: int, sub_path: SubPath) -> FloatArray:
    """Return the rows of the joint angles of a table; those of the first `count` are decoded."""
    num_genes, num_joints = sub_path.num_genes, len(sub_path.limits)
    first = num_genes if sub_path.binary else 0
    angles = table[first : first + num_joints]
    if sub_path.binary:
        decode_bits(table[:num_genes], count, sub_path.limits, angles)
    return angles


@kernel
def decode_bits(bits: FloatArray, count: int, limits: FloatArray, out: FloatArray) -> None:
    """Decode plain binary numbers n of B bits, the highest first: l + (h − l) n / (2^B − 1).

    From bits (genes × B, ≥ count), 0.0 or 1.0, by limits (genes, 2), to out (genes, ≥ count).
    """
    num = len(bits) // len(out)
    greatest = 0.0
    for _ in range(num):
        greatest = 2.0 * greatest + 1.0
    for gene in range(len(out)):
        low, high = limits[gene, 0], limits[gene, 1]
        for k in range(count):
            number = 0.0
            for bit in range(num):
                number = 2.0 * number + bits[gene * num + bit, k]
            out[gene, k] = low + (high - low) * (number / greatest)


@kernel
def succeed(
    sub_path: SubPath, population: FloatArray, following: FloatArray, checks: PathChecks
) -> None:
    """Judge the offspring in the population that follows another; put the elites behind them.

    A child with all genes of a parent costs as much, and is not tested for collisions.
    """
    starts, judging, lanes = sub_path.starts, sub_path.judging, sub_path.lanes
    row, count, num_genes = len(population) - RESULTS, len(sub_path.parents), sub_path.num_genes
    angles = _angles(following, count, sub_path)
    measure(starts, angles, count, judging, following)
    # children inside the box that differ from their parents
    num_open, cost = 0, following[row]
    for n in range(list_inside(following, count, lanes)):
        child = lanes[n]
        parent, gene = sub_path.parents[child], 0
        while gene < num_genes and following[gene, child] == population[gene, parent]:
            gene += 1
        if gene == num_genes:
            cost[child] = population[row, parent]
        lanes[num_open] = child
        num_open += gene < num_genes
    drop_collisions(starts, angles, lanes, num_open, judging, following, sub_path.hit, checks)
    copy_members(population, sub_path.elites, following, count)


@kernel
def measure(
    starts: FloatArray, angles: FloatArray, count: int, judging: Judging, table: FloatArray
) -> None:
    """Write Eqs. 4, 1 and 2 without collisions for the first `count` individuals.

    The cost is inf if the tip ends outside the box; a tip on its edge is inside.
    """
    arm, target, box, (w1, w2) = judging.arm, judging.target, judging.box, judging.weights
    row, rows, lanes = len(table) - RESULTS, len(starts) * LANES, np.arange(count + LANES)
    cost, error, displacement = table[row], table[row + 1], table[row + 2]
    begin, end, outside = np.empty(rows), np.empty(rows), spread(np.inf)
    x, y, found = np.empty(rows + LANES), np.empty(rows + LANES), np.empty(3 * LANES)
    for first in range(0, count, LANES):
        # tips of a block
        load_lanes(starts, lanes, first, count, begin)
        load_lanes(angles, lanes, first, count, end)
        block_ends(begin, end, arm, 1, 1, x, y)
        # displacement (Eq. 2), position error (Eq. 1), cost (Eq. 4)
        squares = spread(0.0)
        for k in range(len(starts)):
            turn = load(begin, U(k) * VECTOR) - load(end, U(k) * VECTOR)
            squares = squares + turn * turn
        tip_x, tip_y = load(x, U(rows)), load(y, U(rows))
        off_x, off_y = tip_x - target[0], tip_y - target[1]
        off, turned = root(off_x * off_x + off_y * off_y), root(squares)
        worth = w1 * off + w2 * turned
        worth = select(tip_x < box[0], outside, worth)
        worth = select(box[1] < tip_x, outside, worth)
        worth = select(tip_y < box[2], outside, worth)
        worth = select(box[3] < tip_y, outside, worth)
        store(found, U(0), worth)
        store(found, VECTOR, off)
        store(found, U(2) * VECTOR, turned)
        for n in range(min(LANES, count - first)):
            cost[first + n], error[first + n] = found[n], found[LANES + n]
            displacement[first + n] = found[2 * LANES + n]


@kernel
def list_inside(table: FloatArray, count: int, lanes: IntArray) -> int:
    """List the individuals of finite cost in `lanes`; return how many there are."""
    cost, inside = table[len(table) - RESULTS], 0
    for k in range(count):
        lanes[inside] = k
        inside += cost[k] < np.inf
    return inside


@kernel
def drop_collisions(
    starts: FloatArray,
    angles: FloatArray,
    lanes: IntArray,
    count: int,
    judging: Judging,
    table: FloatArray,
    hit: BoolArray,
    checks: PathChecks,
) -> None:
    """Write inf as the cost of those among `lanes` that collide on their way."""
    cost = table[len(table) - RESULTS]
    arm, ellipses, path = judging.arm, judging.ellipses, judging.path
    check_paths(starts, angles, lanes, count, arm, ellipses, path, hit, checks)
    for k in range(count):
        individual = lanes[k]
        cost[individual] = np.inf if hit[individual] else cost[individual]


@kernel
def judge_paths(starts: FloatArray, ends: FloatArray, judging: Judging) -> FloatArray:
    """Return Eq. 4 and its parts, (3, individuals), of sub-paths by both ends (joints, …).

    An individual whose tip ends outside the box is not tested for collisions.
    """
    count = starts.shape[1]
    results, lanes = np.empty((RESULTS, count)), np.empty(count + LANES, dtype=np.int64)
    measure(starts, ends, count, judging, results)
    left, hit = list_inside(results, count, lanes), np.zeros(count, dtype=np.bool_)
    checks = prepare_checks(len(starts), count)
    drop_collisions(starts, ends, lanes, left, judging, results, hit, checks)
    return results
