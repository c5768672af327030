"""The planner of Rana & Zalzala 1995 for planar arms of two links, in numpy over populations.

Written from the paper, without any kernel of evoexp: what a careful author would write without a
compiler. It takes its uniform numbers in the order in which `via_point_ga` takes them.
A population is an array (individuals, arms, N + 1, 2) [deg], joint angles relative to the link
before.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rana:
    """Scene and settings; those of `via_point_ga` and its parts have the same names."""

    start: Array  # (arms, 2) [deg]
    goal: Array  # (arms, 2) [deg]
    bases: Array  # (arms, 2) [length unit]
    link_lengths: Array  # (arms, 2) [length unit]
    num_via_points: int = 20
    walk_step: float = 2.5
    max_turn: float = 120.0
    num_new_trajectories: int = 5
    crossover_distance: float = 100.0
    crossover_reading: str = "tails"
    relaxation_step: float = 0.5
    redistribution: bool = True
    spline_end: str = "natural"
    chords_per_segment: int = 16  # of the polyline that measures the spline's arc length
    population_size: int = 50
    num_generations: int = 500
    num_elites: int = 2
    crossover_rate: float = 0.9
    mutation_rate: float = 1.0
    length_weight: float = 0.5
    unevenness_weight: float = 0.005
    collision_weight: float = 100.0
    fitness_offset: float = 500.0
    spheres_per_link: int = 5
    sphere_radius: float = 0.5
    collision_substeps: int = 1


class Judged(NamedTuple):
    """Cost and the terms of Eq. 7."""

    cost: Array  # (individuals,)
    lengths: Array  # (individuals, arms)
    unevenness: Array  # (individuals, arms)
    collisions: Array  # (individuals,)


class Population(NamedTuple):
    """One generation."""

    strings: Array  # (individuals, arms, N + 1, 2)
    costs: Array  # (individuals,)
    collisions: Array  # (individuals,)


def from_condition(condition: Any, **changes: Any) -> Rana:
    """Return the same scene and settings as a condition of `via_point_ga` has, with changes."""
    robot, scenario, planner = condition.robot, condition.scenario, condition.planner
    assert not scenario.obstacles, "the reference is for planar arms of two links alone"
    assert not any(len(arm.link_lengths) != 2 or arm.base_angle for arm in robot.arms)
    settings: dict[str, Any] = {}
    for part in (planner, planner.ga, planner.objective, planner.collision):
        settings |= {f.name: getattr(part, f.name) for f in fields(Rana) if hasattr(part, f.name)}
    return Rana(
        start=np.array(scenario.q_start),
        goal=np.array(scenario.q_goal),
        bases=np.array([arm.base_position for arm in robot.arms]),
        link_lengths=np.array([arm.link_lengths for arm in robot.arms]),
        **(settings | changes),
    )


def evolve(rana: Rana, rng: np.random.Generator) -> Iterator[Population]:
    """Yield the initial population, then one generation after the other."""
    strings = smooth(rana, walks(rana, rng, rana.population_size))
    judged = judge(rana, strings)
    population = Population(strings, judged.cost, judged.collisions)
    yield population
    for _ in range(rana.num_generations):
        population = advance(rana, rng, population)
        yield population


def advance(rana: Rana, rng: np.random.Generator, population: Population) -> Population:
    """Return the next generation: the offspring, then the elites, best first."""
    num_offspring = rana.population_size - rana.num_elites
    kept = np.argsort(population.costs, kind="stable")[: rana.num_elites]
    parents = roulette(rng, np.maximum(rana.fitness_offset - population.costs, 0.0), num_offspring)
    offspring = crossover(rana, rng, population.strings[parents])
    slots = distinct(rng, num_offspring, rana.num_new_trajectories)
    mutated = rng.random(len(slots)) < rana.mutation_rate
    offspring[slots[mutated]] = walks(rana, rng, len(slots))[mutated]
    offspring = smooth(rana, offspring)
    judged = judge(rana, offspring)
    return Population(
        np.concatenate([offspring, population.strings[kept]]),
        np.concatenate([judged.cost, population.costs[kept]]),
        np.concatenate([judged.collisions, population.collisions[kept]]),
    )


def walks(rana: Rana, rng: np.random.Generator, count: int) -> Array:
    """Return random walks from start to goal (section 3.3)."""
    num, arms = rana.num_via_points, len(rana.start)
    turns = (2.0 * rng.random((count, arms, num - 1)) - 1.0) * np.deg2rad(rana.max_turn)
    length = rana.walk_step * np.linalg.norm(rana.goal - rana.start, axis=1) / num
    path = np.empty((count, arms, num + 1, 2))
    path[:, :, 0], path[:, :, num] = rana.start, rana.goal
    for i in range(1, num):
        ahead = rana.goal - path[:, :, i - 1]
        angle = np.arctan2(ahead[..., 1], ahead[..., 0]) + turns[:, :, i - 1]
        step = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        path[:, :, i] = path[:, :, i - 1] + length[:, None] * step
    return path


def smooth(rana: Rana, strings: Array) -> Array:
    """Redistribute along splines at equal arc length, then relax once (Eqs. 8, 9)."""
    paths = strings.reshape(-1, rana.num_via_points + 1, 2).copy()
    if rana.redistribution:
        paths = redistributed(paths, rana.chords_per_segment, rana.spline_end)
    for i in range(1, rana.num_via_points):
        middle = (paths[:, i - 1] + paths[:, i + 1]) / 2.0
        paths[:, i] += rana.relaxation_step * (middle - paths[:, i])
    return paths.reshape(strings.shape)


def redistributed(paths: Array, chords: int, spline_end: str) -> Array:
    """Return points of paths (paths, N + 1, joints) at equal length of chords along the splines."""
    num = paths.shape[1] - 1
    rows, knots = np.arange(len(paths))[:, None], np.arange(num + 1)
    spline: Any = scipy.interpolate.CubicSpline(knots, paths, axis=1, bc_type=spline_end)
    steps = np.diff(spline(np.arange(num * chords + 1) / chords), axis=1)
    length = np.zeros((len(paths), num * chords + 1))
    np.cumsum(np.sqrt((steps * steps).sum(axis=2)), axis=1, out=length[:, 1:])
    target = length[:, -1:] * (np.arange(1, num) / num)
    before = [np.searchsorted(*each, side="right") - 1 for each in zip(length, target, strict=True)]
    k = np.clip(before, 0, num * chords - 1)
    begin, end = length[rows, k], length[rows, k + 1]
    u = (k + (target - begin) / np.where(end > begin, end - begin, 1.0)) / chords
    segment = np.minimum(u.astype(int), num - 1)
    t = (u - segment)[:, :, None]
    c3, c2, c1, c0 = spline.c[:, segment, rows]  # each (paths, N − 1, joints)
    result = paths.copy()
    values = ((c3 * t + c2) * t + c1) * t + c0
    result[:, 1:num] = np.where(length[:, -1, None, None] > 0.0, values, paths[:, 1:num])
    return result


def judge(rana: Rana, strings: Array) -> Judged:
    """Return Eqs. 2–7 for a population."""
    steps = np.sqrt((np.diff(strings, axis=2) ** 2).sum(axis=3))  # (individuals, arms, N)
    lengths = steps.sum(axis=2)
    unevenness = np.abs(steps - lengths[:, :, None] / steps.shape[2]).sum(axis=2)
    hits = colliding(rana, between(strings, rana.collision_substeps))
    collisions = hits.any(axis=2).sum(axis=1).astype(float)
    cost = rana.length_weight * lengths.sum(axis=1)
    cost = cost + rana.unevenness_weight * unevenness.sum(axis=1)
    cost = cost + rana.collision_weight * collisions
    return Judged(cost, lengths, unevenness, collisions)


def between(strings: Array, substeps: int) -> Array:
    """Return the configurations at 1/s, 2/s … 1 of every segment, (individuals, arms, N, s, 2)."""
    fractions = (np.arange(1, substeps + 1) / substeps)[:, None]
    first, second = strings[:, :, :-1, None], strings[:, :, 1:, None]
    return first + fractions * (second - first)


def colliding(rana: Rana, q: Array) -> NDArray[np.bool_]:
    """Return whether any two circles of different arms overlap, for q (individuals, arms, …, 2)."""
    circles = [_centers(rana, a, q[:, a]) for a in range(len(rana.start))]
    nearest = np.full(q.shape[:1] + q.shape[2:-1], np.inf)
    for (xs, ys), (other_x, other_y) in itertools.combinations(circles, 2):
        dx, dy = xs[..., :, None] - other_x[..., None, :], ys[..., :, None] - other_y[..., None, :]
        np.minimum(nearest, (dx * dx + dy * dy).min(axis=(-2, -1)), out=nearest)
    return np.sqrt(nearest) < 2.0 * rana.sphere_radius


def _centers(rana: Rana, arm: int, q: Array) -> tuple[Array, Array]:
    """Return x and y of the circles of one arm, the shared one once, (…, circles) each."""
    first, second = np.deg2rad(q[..., 0]), np.deg2rad(q[..., 0] + q[..., 1])
    lengths, fractions = rana.link_lengths[arm], np.linspace(0.0, 1.0, rana.spheres_per_link)
    coordinates = []
    ways = (np.cos(first), np.cos(second)), (np.sin(first), np.sin(second))
    for base, (one, two) in zip(rana.bases[arm], ways, strict=True):
        upper = base + lengths[0] * one[..., None] * fractions
        lower = upper[..., -1:] + lengths[1] * two[..., None] * fractions[1:]
        coordinates.append(np.concatenate([upper, lower], axis=-1))
    return coordinates[0], coordinates[1]


def roulette(rng: np.random.Generator, weights: Array, count: int) -> NDArray[np.int64]:
    """Draw parents in proportion to their weights; uniformly where all are zero."""
    uniforms, num = rng.random(count), len(weights)
    wheel = np.cumsum(weights)
    if wheel[-1] == 0.0:
        return np.minimum((uniforms * num).astype(np.int64), num - 1)
    last = int(np.flatnonzero(weights)[-1])
    return np.minimum(np.searchsorted(wheel, uniforms * wheel[-1], side="right"), last)


def crossover(rana: Rana, rng: np.random.Generator, parents: Array) -> Array:
    """Cross neighbouring parents at one site per arm, where both are close (section 3.4b)."""
    arms, num = parents.shape[1], rana.num_via_points
    first, second = parents[0 : len(parents) // 2 * 2 : 2], parents[1::2]
    uniforms = rng.random((len(first), 1 + arms))
    children = parents.copy()
    if num < 2:
        return children
    sites = 1 + np.minimum((uniforms[:, 1:] * (num - 1)).astype(int), num - 2)  # 1 … N − 1
    pair, arm = np.arange(len(first))[:, None], np.arange(arms)
    gap = np.linalg.norm(first[pair, arm, sites] - second[pair, arm, sites], axis=2)
    crossed = (uniforms[:, 0] < rana.crossover_rate) & (gap < rana.crossover_distance).all(axis=1)
    exchanged = np.arange(num + 1) >= sites[:, :, None]  # (pairs, arms, N + 1): the tails
    if rana.crossover_reading == "segment":  # of every second arm the head instead
        exchanged[:, 1::2] = ~exchanged[:, 1::2]
    after = exchanged & crossed[:, None, None]
    children[0 : len(parents) // 2 * 2 : 2] = np.where(after[..., None], second, first)
    children[1::2] = np.where(after[..., None], first, second)
    return children


def distinct(rng: np.random.Generator, num: int, count: int) -> NDArray[np.int64]:
    """Draw distinct indices: the head of a Fisher–Yates shuffle."""
    slots = np.arange(num)
    for k, uniform in enumerate(rng.random(count)):
        other = k + min(int(uniform * (num - k)), num - k - 1)
        slots[[k, other]] = slots[[other, k]]
    return slots[:count]
