"""Both genetic algorithms of Chen & Zalzala 1995 in plain Python, individual by individual.

Written from the paper without any kernel of evoexp. Uniform numbers are taken one by one, in the
order in which `grid_path_ga` and `placement_ga` take them. The first population is given: random
walks are drawn by bits. A path is a list of nodes, a posture two strings of bits, one per angle.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

Draw = Callable[[], float]


class Settings(NamedTuple):
    """Settings that both algorithms share."""

    num_elites: int
    crossover_rate: float
    mutation_rate: float
    multiple: float

    @classmethod
    def of(cls, ga: Any) -> "Settings":
        """Return the settings of a `ScaledGenetic`."""
        return cls(ga.num_elites, ga.crossover_rate, ga.mutation_rate, ga.scaling_multiple)

    def elites(self, costs: list[float]) -> list[int]:
        """Return the individuals that stay, the best first."""
        return sorted(range(len(costs)), key=lambda k: (costs[k], k))[: self.num_elites]

    def parents(self, draw: Draw, costs: list[float]) -> list[int]:
        """Choose parents by linear scaling and stochastic remainders without replacement."""
        count = len(costs) - self.num_elites
        mean, least = sum(costs) / len(costs), min(costs)
        copies = [1.0] * len(costs)
        if mean > least:
            for k, cost in enumerate(costs):
                copies[k] = max(1.0 + (self.multiple - 1.0) * (mean - cost) / (mean - least), 0.0)
        total = sum(copies)
        copies = [value * count / total for value in copies]
        whole = [int(value + 1e-12) for value in copies]
        parents = [k for k, times in enumerate(whole) for _ in range(times)][:count]
        order = list(range(len(costs)))
        for k in range(len(order)):
            other = k + int(draw() * (len(order) - k))
            order[k], order[other] = order[other], order[k]
        left = [max(value - times, 0.0) for value, times in zip(copies, whole, strict=True)]
        share = (count - len(parents)) / sum(left) if sum(left) > 0.0 else 0.0
        pointer, scanned = draw(), 0.0
        for k in order:
            scanned += share * left[k]
            if scanned > pointer and len(parents) < count:
                parents.append(k)
                pointer += 1.0
        assert len(parents) == count, "rounding left a place: choose another seed"
        for k in range(count):
            other = k + int(draw() * (count - k))
            parents[k], parents[other] = parents[other], parents[k]
        return parents


# ------------------------------------------------------------------------------------------- paths


class Paths:
    """Operators on paths over the grid of a problem of `grid_path_ga`."""

    def __init__(self, planner: Any, problem: Any, draw: Draw) -> None:
        grid = problem.fields.grid
        self.settings, self.draw = Settings.of(planner.ga), draw
        self.moves = [[int(n) for n in row if n >= 0] for row in grid.neighbours]
        self.where, self.most = grid.coordinates.tolist(), grid.num_nodes
        self.unsafeness, self.fields = problem.fields.unsafeness.tolist(), problem.fields
        self.erase, self.reach = not planner.revisits, planner.crossover_reach
        self.weights = planner.objective.distance_weight, planner.objective.unsafeness_weight

    def cost(self, path: list[int]) -> float:
        """Return Eq. 1 of a path."""
        squares = [
            sum((a - b) ** 2 for a, b in zip(self.where[i], self.where[j], strict=True))
            for i, j in zip(path, path[1:], strict=False)
        ]
        kinds = [squares.count(k) * np.sqrt(float(k)) for k in (1, 2, 3)]
        mean = sum(self.unsafeness[node] for node in path) / len(path)
        return float(self.weights[0] * sum(kinds) + self.weights[1] * mean)

    def next(self, paths: list[list[int]], costs: list[float]) -> list[list[int]]:
        """Return offspring, then elites."""
        kept = [paths[k] for k in self.settings.elites(costs)]
        parents = [paths[k] for k in self.settings.parents(self.draw, costs)]
        children: list[list[int]] = []
        for first in range(0, len(parents), 2):
            pair = parents[first : first + 2]
            if len(pair) == 2 and self.draw() < self.settings.crossover_rate:
                pair = self._cross(*pair)
            for path in pair:
                mutated = self.draw() < self.settings.mutation_rate
                children.append(self._mutate(path) if mutated else path)
        return children + kept

    def _any(self, items: list[Any]) -> Any:
        return items[min(int(self.draw() * len(items)), len(items) - 1)]

    def _cross(self, one: list[int], two: list[int]) -> list[list[int]]:
        """Exchange remainders at a common node, or at two near ones if there is none."""
        last = {node: i for i, node in enumerate(one) if 0 < i < len(one) - 1}
        inner = range(1, len(two) - 1)
        if common := [(last[two[j]], j) for j in inner if two[j] in last]:
            i, j = self._any(common)
            return [self._settled(one[:i] + two[j:]), self._settled(two[:j] + one[i:])]
        near = [(i, j) for j in inner for i in range(1, len(one) - 1) if self._near(one[i], two[j])]
        if not near:
            return [one, two]
        i, j = self._any(near)
        link: list[int] = []
        if two[j] not in self.moves[one[i]]:
            between = [n for n in self.moves[one[i]] if two[j] in self.moves[n]]
            if not between:
                return [one, two]
            link = [self._any(between)]
        ways = one[: i + 1] + link + two[j:], two[: j + 1] + link + one[i:]
        return [self._settled(way) for way in ways]

    def _near(self, one: int, two: int) -> bool:
        pairs = zip(self.where[one], self.where[two], strict=True)
        return max(abs(a - b) for a, b in pairs) <= self.reach

    def _mutate(self, path: list[int]) -> list[int]:
        """Replace what lies between two nodes by a random walk."""
        first = self._any(list(range(len(path))))
        second = self._any([k for k in range(len(path)) if k != first])
        low, high = min(first, second), max(first, second)
        return self._settled(path[:low] + self._walk(path[low], path[high]) + path[high + 1 :])

    def _walk(self, node: int, target: int) -> list[int]:
        """Walk at random, with more chance toward the target (section 2.3)."""
        potential = self.fields.goal_field(target)
        walked = [node]
        while walked[-1] != target:
            options = self.moves[walked[-1]]
            values = [potential[n] for n in options]
            weights = [max(values) - value + 1.0 for value in values]
            left, chosen = self.draw() * sum(weights), 0
            while chosen < len(options) - 1 and left >= weights[chosen]:
                left -= weights[chosen]
                chosen += 1
            if not self.erase and len(walked) == self.most:  # a row of the table is full
                walked = without_loops(walked)
            walked.append(options[chosen])
        return without_loops(walked) if self.erase else walked

    def _settled(self, path: list[int]) -> list[int]:
        return without_loops(path) if self.erase or len(path) > self.most else path


def without_loops(nodes: list[int]) -> list[int]:
    """Cut out the first loop that closes, until there is none."""
    kept: list[int] = []
    for node in nodes:
        kept = kept[: kept.index(node)] if node in kept else kept
        kept.append(node)
    return kept


def evolve_paths(
    planner: Any, problem: Any, first: list[list[int]], rng: np.random.Generator
) -> Iterator[tuple[list[list[int]], list[float]]]:
    """Yield paths and costs of all generations from the first one on."""
    own, paths = Paths(planner, problem, lambda: float(rng.random())), first
    for _ in range(planner.ga.num_generations + 1):
        costs = [own.cost(path) for path in paths]
        yield paths, costs
        paths = own.next(paths, costs)


# ---------------------------------------------------------------------------------------- postures


class Postures:
    """Operators of a problem of `placement_ga`."""

    def __init__(self, planner: Any, problem: Any, draw: Draw) -> None:
        self.settings, self.draw = Settings.of(planner.ga), draw
        self.bits, self.gray = planner.bits_per_gene, planner.coding == "gray"
        self.least, self.most = planner.angle_range
        self.model = problem.model  # beside Pinocchio in `test_placement_criteria`

    def string(self, individual: Any) -> str:
        """Return the bits of an individual, θ1 first."""
        return "".join(f"{int(number):0{self.bits}b}" for number in individual)

    def angles(self, string: str) -> list[float]:
        """Return θ1 and θ2 [deg]."""
        found = []
        for gene in (string[: self.bits], string[self.bits :]):
            bits = [int(bit) for bit in gene]
            for k in range(1, self.bits if self.gray else 0):
                bits[k] ^= bits[k - 1]
            number = int("".join(map(str, bits)), 2)
            share = number / (2**self.bits - 1)
            found.append(self.least + (self.most - self.least) * share)
        return found

    def cost(self, string: str) -> tuple[float, bool]:
        """Return E of the better θ3 (Eq. 14), and whether any is feasible."""
        branch, own, _ = self.model.posture(*self.angles(string))
        return float(own[0]), branch >= 0

    def next(self, strings: list[str], costs: list[float]) -> list[str]:
        """Return offspring, then elites."""
        kept = [strings[k] for k in self.settings.elites(costs)]
        children = [strings[k] for k in self.settings.parents(self.draw, costs)]
        for first in range(0, len(children) - 1, 2):  # Eq. 16: one cut through both genes
            decision, place = self.draw(), self.draw()
            if decision < self.settings.crossover_rate:
                site = 1 + int(place * (2 * self.bits - 1))
                one, two = children[first : first + 2]
                children[first : first + 2] = one[:site] + two[site:], two[:site] + one[site:]
        return self._mutated(children) + kept

    def _mutated(self, children: list[str]) -> list[str]:
        """Flip bits: a number tells how many stay until the next one is flipped."""
        whole, rate, at = list("".join(children)), self.settings.mutation_rate, -1
        while rate > 0.0:
            drawn = np.log1p(-self.draw())
            left = drawn / np.log1p(-rate) if rate < 1.0 else 0.0
            if left >= len(whole) - 1 - at:
                break
            at += 1 + int(left)
            whole[at] = "10"[int(whole[at])]
        size = 2 * self.bits
        return ["".join(whole[k : k + size]) for k in range(0, len(whole), size)]


def evolve_postures(
    planner: Any, problem: Any, rng: np.random.Generator
) -> Iterator[tuple[list[str], list[float], int]]:
    """Yield strings, costs and the number of feasible postures of all generations."""
    own = Postures(planner, problem, lambda: float(rng.random()))
    first = np.floor(2.0**own.bits * rng.random((2, planner.ga.population_size)))
    strings = [own.string(individual) for individual in first.T]
    for _ in range(planner.ga.num_generations + 1):
        measured = [own.cost(string) for string in strings]
        costs = [cost for cost, _ in measured]
        yield strings, costs, sum(feasible for _, feasible in measured)
        strings = own.next(strings, costs)
