"""The planner of Lavoie & Boudreau 2001 in numpy, over whole populations.

Written from the paper and the operators' sources, without any kernel of evoexp but the normal
deviates. Uniform numbers are taken in the order in which `redundant_ga` takes them. A population is
an array (genes, individuals): joint angles [rad], or bits.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from evoexp.numeric.elementary import standard_normal

Array = NDArray[np.float64]


class Population(NamedTuple):
    """One generation: which search it belongs to, genomes, costs, and the best plan so far."""

    attempt: int
    sub_path: int
    genomes: Array
    costs: Array
    best_cost: float
    best: Array


class Scene:
    """A condition's arm, obstacles, targets and weights."""

    def __init__(self, condition: Any) -> None:
        robot, scenario, planner = condition.robot, condition.scenario, condition.planner
        self.lengths, self.base = np.array(robot.link_lengths), np.array(robot.base_position)
        self.turned = np.deg2rad(robot.base_angle)
        limits = robot.joint_limits
        self.low, self.high = np.array(limits * (len(self.lengths) // len(limits))).T[:, :, None]
        self.start, self.obstacles = np.array(scenario.q_start), scenario.obstacles
        self.shift, self.box = np.array(scenario.obstacle_shift), scenario.box
        self.targets = np.array([scenario.via_point, scenario.goal_point])
        self.weights = planner.objective.position_weight, planner.objective.displacement_weight
        self.num_positions = planner.collision.num_positions
        self.chords = planner.collision.swept == "chords"

    def joints(self, q: Array) -> Array:
        """Return base and link ends of postures (joints, individuals): (N + 1, individuals, 2)."""
        angles = self.turned + np.cumsum(q, axis=0)
        steps = self.lengths[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=2)
        return np.asarray(self.base + np.cumsum(np.insert(steps, 0, 0.0, axis=0), axis=0))

    def costs(self, sub_path: int, start: Array, ends: Array) -> Array:
        """Return Eq. 4 of postures (joints, individuals); inf if the path there is no solution."""
        tips = self.joints(ends)[-1]
        error = np.linalg.norm(tips - self.targets[sub_path], axis=1)
        turned = np.linalg.norm(start[:, None] - ends, axis=0)
        costs = self.weights[0] * error + self.weights[1] * turned
        left, right, bottom, top = self.box
        inside = (left <= tips[:, 0]) & (tips[:, 0] <= right)
        inside &= (bottom <= tips[:, 1]) & (tips[:, 1] <= top)
        bad = self.collide(start, ends) | (~inside if sub_path == 1 else np.zeros_like(inside))
        return np.where(bad, np.inf, costs)

    def collide(self, start: Array, ends: Array) -> NDArray[np.bool_]:
        """Return which straight paths touch an obstacle, at a position or on a chord (Eq. 3)."""
        shares = np.arange(self.num_positions + 1) / self.num_positions
        places = np.array(
            [self.joints(start[:, None] + s * (ends - start[:, None])) for s in shares]
        )
        hit = self._touch(places[1:, :-1], places[1:, 1:])
        return hit | self._touch(places[:-1], places[1:]) if self.chords else hit

    def _touch(self, p: Array, q: Array) -> NDArray[np.bool_]:
        """Return whose segments pq (…, individuals, 2) touch any ellipse."""
        hit = np.zeros(p.shape[-2], dtype=bool)
        for obstacle in self.obstacles:
            turn = np.deg2rad(obstacle.angle)
            into = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            middle = np.array(obstacle.center) + self.shift
            a, b = (((r - middle) @ into.T) / obstacle.semi_axes for r in (p, q))
            way = b - a
            squares = np.maximum((way * way).sum(axis=-1), 1e-300)
            share = np.clip(-(a * way).sum(axis=-1) / squares, 0.0, 1.0)
            near = np.linalg.norm(a + share[..., None] * way, axis=-1) <= 1.0
            hit |= near.reshape(-1, len(hit)).any(axis=0)
        return hit


class Breeding:
    """The operators of a condition's genetic algorithm."""

    def __init__(self, ga: Any, scene: Scene) -> None:
        self.ga, self.scene = ga, scene
        self.bits = getattr(ga, "bits_per_gene", 0)
        self.num_genes = len(scene.lengths) * (self.bits or 1)
        self.count = ga.population_size - ga.num_elites
        self.mutation_rate, self.crossover_rate = ga.mutation_rate, ga.crossover_rate

    def drawn(self, rng: np.random.Generator, count: int) -> Array:
        """Draw a population."""
        draws = rng.random((self.num_genes, count))
        if self.bits:
            return np.floor(2.0 * draws)
        return np.asarray(self.scene.low + (self.scene.high - self.scene.low) * draws)

    def angles(self, genomes: Array) -> Array:
        """Return the joint angles of genomes."""
        if not self.bits:
            return genomes
        powers = 2.0 ** np.arange(self.bits - 1, -1, -1)
        numbers = np.tensordot(powers, genomes.reshape(-1, self.bits, genomes.shape[1]), (0, 1))
        low, high = self.scene.low, self.scene.high
        return np.asarray(low + (high - low) * (numbers / (2.0**self.bits - 1.0)))

    def next(self, rng: np.random.Generator, genomes: Array, costs: Array, index: int) -> Array:
        """Return offspring, then elites, of generation `index`."""
        ga, count, genes = self.ga, self.count, self.num_genes
        one_point = self.bits > 0 or ga.crossover == "one_point"
        of_gene = self.bits > 0 or ga.mutation_scope == "gene"
        sizes = [
            count * (ga.tournament_size if ga.selection == "tournament" else 1),
            count // 2 * (2 if one_point else 1 + 2 * genes),
            count * (genes if of_gene else 3),
        ]
        choosing, crossing, mutating = np.split(rng.random(sum(sizes)), np.cumsum(sizes)[:-1])
        gaussian = not self.bits and ga.mutation == "gaussian"
        normals = standard_normal(rng, (genes, count)) if gaussian else np.zeros((genes, count))
        parents = self._choose(choosing, costs)
        children = genomes[:, parents].copy()
        (self._cut if one_point else self._blend)(crossing.reshape(count // 2, -1), children)
        children = self._mutate(
            mutating.reshape(genes if of_gene else count, -1), normals, children, index
        )
        kept = np.argsort(costs, kind="stable")[: ga.num_elites]
        return np.hstack([children, genomes[:, kept]])

    def _choose(self, draws: Array, costs: Array) -> NDArray[np.int64]:
        """Return the parents."""
        size = len(costs)
        if self.ga.selection == "tournament":
            drawn = (draws.reshape(self.count, -1) * size).astype(np.int64)
            best = np.argmin(costs[drawn], axis=1)
            return np.asarray(drawn[np.arange(self.count), best])
        with np.errstate(divide="ignore"):
            weights = 1.0 / costs
        if self.ga.selection == "rank":
            s, ranks = self.ga.rank_pressure, scipy.stats.rankdata(-costs) - 1.0
            weights = 2.0 - s + 2.0 * (s - 1.0) * ranks / (size - 1)
        if not weights.any():
            weights = np.ones(size)
        wheel = np.cumsum(weights)
        return np.searchsorted(wheel, draws * wheel[-1], side="right")

    def _cut(self, draws: Array, children: Array) -> None:
        """Exchange what pairs have behind a site."""
        for k, (decision, place) in enumerate(draws):
            if decision < self.crossover_rate:
                site = 1 + int(place * (self.num_genes - 1))
                pair = children[site:, 2 * k : 2 * k + 2]
                pair[:] = pair[:, ::-1].copy()

    def _blend(self, draws: Array, children: Array) -> None:
        """Cross pairs gene by gene."""
        low, high = self.scene.low[:, 0], self.scene.high[:, 0]
        for k, (decision, *rest) in enumerate(draws):
            if decision < self.crossover_rate:
                x, y = children[:, 2 * k].copy(), children[:, 2 * k + 1].copy()
                u, v = np.array(rest).reshape(-1, 2).T
                if self.ga.crossover == "uniform":
                    one, two = np.where(u < 0.5, y, x), np.where(u < 0.5, x, y)
                elif self.ga.crossover == "arithmetic":
                    one, two = y + u[0] * (x - y), x + u[0] * (y - x)
                else:
                    alpha, apart = self.ga.blend_alpha, np.abs(x - y)
                    lowest = np.minimum(x, y) - alpha * apart
                    one, two = (lowest + w * (1.0 + 2.0 * alpha) * apart for w in (u, v))
                children[:, 2 * k] = np.clip(one, low, high)
                children[:, 2 * k + 1] = np.clip(two, low, high)

    def _mutate(self, draws: Array, normals: Array, x: Array, index: int) -> Array:
        """Return the mutated children."""
        rate = self.mutation_rate
        if self.bits:
            return np.where(draws < rate, 1.0 - x, x)
        if self.ga.mutation_scope == "gene":
            chosen, amounts = draws < rate, draws / max(rate, 1e-300)
        else:
            genes = (draws[:, 1] * self.num_genes).astype(np.int64)
            chosen = (np.arange(self.num_genes)[:, None] == genes) & (draws[:, 0] < rate)
            amounts = np.broadcast_to(draws[:, 2], x.shape)
        low, high = self.scene.low, self.scene.high
        if self.ga.mutation == "gaussian":
            mutants = x + self.ga.mutation_std * (high - low) * normals
        elif self.ga.mutation == "uniform_reset":
            mutants = low + amounts * (high - low)
        else:
            spread = (1.0 - index / self.ga.num_generations) ** self.ga.mutation_power
            up = x + (high - x) * 2.0 * amounts * spread
            down = x - (x - low) * (2.0 * amounts - 1.0) * spread
            mutants = np.where(amounts < 0.5, up, down)
        return np.where(chosen, np.clip(mutants, low, high), x)


def evolve(condition: Any, rng: np.random.Generator, evolves: bool = True) -> Iterator[Population]:
    """Yield all generations of all searches; each is drawn afresh if nothing evolves."""
    planner, scene = condition.planner, Scene(condition)
    breeding = Breeding(planner.ga, scene)
    stops = planner.stop_cost_sp1, planner.stop_cost_sp2
    limits = stops if planner.success == "threshold" else (np.inf, np.inf)
    best_cost, best_via, best = np.inf, np.inf, np.empty(0)
    for attempt in range(1, planner.num_attempts + 1):
        start = scene.start
        for sub_path in range(2):
            genomes, lowest = breeding.drawn(rng, planner.ga.population_size), np.inf
            for index in range(planner.ga.num_generations + 1):
                angles = breeding.angles(genomes)
                costs = scene.costs(sub_path, start, angles)
                if evolves or costs.min() < lowest or index == 0:
                    end, lowest = angles[:, np.argmin(costs)], float(costs.min())
                if sub_path == 1 and lowest < best_cost:
                    best_cost, best = lowest, np.concatenate([scene.start, start, end])
                if sub_path == 0 and (not best.size or (best_cost == np.inf and lowest < best_via)):
                    best_via, best = lowest, np.concatenate([scene.start, end, end])
                yield Population(attempt, sub_path + 1, genomes, costs, best_cost, best)
                if lowest < stops[sub_path] or index == planner.ga.num_generations:
                    break
                if evolves:
                    genomes = breeding.next(rng, genomes, costs, index)
                else:
                    genomes = breeding.drawn(rng, breeding.count)
            if not lowest < limits[sub_path]:
                break
            start = end
        else:
            return
