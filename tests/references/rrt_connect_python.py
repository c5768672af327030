"""RRT-Connect and shortcuts, slow and obvious: lists of nodes, one configuration after the other.

Random numbers are drawn as the planner draws them.
"""

import itertools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Outcome(NamedTuple):
    """What a search came to."""

    path: list[Any]  # configurations from start to goal; none if there is no path
    first_length: float  # of the path before any shortcut [deg]
    asked: int  # configurations that were asked for
    iterations: int  # random configurations
    nodes: int  # of both trees


class Planner:
    """Grows two trees and shortens what they find."""

    def __init__(self, collides: Callable[[Any], bool], step: float, substeps: int) -> None:
        self.collides, self.step, self.resolution = collides, step, step / substeps
        self.asked = 0

    def free(self, one: Any, two: Any) -> bool:
        """Whether an edge is free: eight by eight spread over it, its first end left out."""
        parts = max(1, math.ceil(math.dist(one, two) / self.resolution - 1e-6))
        rounds = math.ceil(parts / 8)
        spread = [k for first in range(rounds) for k in range(parts - first, 0, -rounds)]
        places = [((parts - k) * one + k * two) / parts if k < parts else two for k in spread]
        for begin in range(0, parts, 8):
            eight = places[begin : begin + 8]
            self.asked += len(eight)
            if any(self.collides(q) for q in eight):
                return False
        return True

    def grow(self, tree: list[Any], q: Any, target: Any, near: int) -> tuple[Any, str]:
        """EXTEND: one step from a node."""
        far = math.dist(q, target)
        new = target if far <= self.step else q + self.step / far * (target - q)
        if np.array_equal(new, q):
            return near, "reached"
        if not self.free(q, new):
            return near, "trapped"
        tree.append((new, near))
        return len(tree) - 1, "reached" if new is target else "advanced"

    def search(self, start: Any, goal: Any, draw: Callable[[], Any], most: int) -> Any:
        """Return a path and how many iterations and nodes it took."""
        trees = [[(start, -1)], [(goal, -1)]]
        for turn in range(most):
            own, other = trees[turn % 2], trees[1 - turn % 2]
            target = draw()
            near = nearest(own, target)
            node, how = self.grow(own, own[near][0], target, near)
            if how == "trapped":
                continue
            new = own[node][0]
            met = nearest(other, new)
            met, how = self.grow(other, other[met][0], new, met)
            while how == "advanced":
                met, how = self.grow(other, other[met][0], new, met)
            if how == "reached":
                halves = [branch(own, node), branch(other, met)]
                first, last = halves if turn % 2 == 0 else halves[::-1]
                return first + last[-2::-1], turn + 1, len(own) + len(other)
        return [], most, sum(map(len, trees))

    def shorten(self, path: list[Any], uniforms: Any) -> list[Any]:
        """Return the path with the line between two random places, if that is free and shorter."""
        edges = list(zip(path[:-1], path[1:], strict=True))
        total = length(path)
        places = []
        for at in sorted(float(share) * total for share in uniforms):
            k = before = 0
            while k < len(edges) - 1 and before + math.dist(*edges[k]) <= at:
                before += math.dist(*edges[k])
                k += 1
            long, (one, two) = math.dist(*edges[k]), edges[k]
            parts = max(1, math.ceil(long / self.resolution - 1e-6))
            part = math.floor((at - before) / long * parts + 0.5)
            places.append((k, ((parts - part) * one + part * two) / parts))
        (first, one), (last, two) = places
        if first == last:
            return path
        rows = [*path[: first + 1], one, two, *path[last + 1 :]]
        new = [rows[0], *(b for a, b in itertools.pairwise(rows) if math.dist(a, b) > 1e-9)]
        return new if length(new) < total and self.free(one, two) else path


def nearest(tree: list[Any], q: Any) -> int:
    """Return the nearest node, the oldest among equals."""
    squares = [sum((a - b) ** 2 for a, b in zip(node, q, strict=True)) for node, _ in tree]
    return squares.index(min(squares))


def branch(tree: list[Any], node: int) -> list[Any]:
    """Return the nodes from the root to a node."""
    found = []
    while node >= 0:
        found.append(tree[node][0])
        node = tree[node][1]
    return found[::-1]


def length(path: list[Any]) -> float:
    """Return the length of a path."""
    return sum(math.dist(a, b) for a, b in zip(path[:-1], path[1:], strict=True))


def run(planner: Any, problem: Any, collides: Callable[[Any], bool], seed: Any) -> Outcome:
    """Run a search as `RrtConnect` with the same settings and seed does."""
    own = Planner(collides, planner.range, planner.collision.collision_substeps)
    rng = np.random.default_rng(seed)  # a generator stays as it is
    low, high = planner.box(problem)

    def draw() -> Any:
        return low + rng.random(len(low)) * (high - low)

    path, iterations, nodes = own.search(problem.start, problem.goal, draw, planner.max_iterations)
    first = length(path) if path else math.inf
    for _ in range(planner.num_shortcuts if path else 0):
        path = own.shorten(path, rng.random(2))
    return Outcome(path, first, own.asked, iterations, nodes)
