"""Small grids with a path from corner to corner, and what a valid path is, spelled out."""

from typing import Any

import numpy as np

from evoexp.collision.potential_fields import PotentialFields
from evoexp.errors import SettingError
from evoexp.evolution.operators.operator import ScaledGenetic
from evoexp.planners.grid_path_ga.planner import GridPathGa, PathCost, Problem
from evoexp.robots.arms import FloorPlatform
from evoexp.scenarios.grid_motion import GridMotion

FIELDS = {
    "neighbourhood": 1,
    "goal_potentials": (1.0, 3.0),
    "obstacle_potentials": (10.0, 9.0, 7.0, 5.0, 3.0, 1.0),
}
GA: dict[str, Any] = {"population_size": 12, "num_generations": 8, "num_elites": 1}
GA |= {"crossover_rate": 0.9, "mutation_rate": 0.4, "scaling_multiple": 2.0}


def planner(weights: tuple[float, float] = (0.2, 1.0), **changed: Any) -> GridPathGa:
    cost = PathCost(distance_weight=weights[0], unsafeness_weight=weights[1])
    ga = ScaledGenetic(**(GA | {k: v for k, v in changed.items() if k in GA}))
    own = {"revisits": False, "crossover_reach": 2, "collision": PotentialFields(**FIELDS)}
    return GridPathGa(
        ga=ga, objective=cost, **(own | {k: v for k, v in changed.items() if k not in GA})
    )


def scenario(blocked: np.ndarray, **changed: Any) -> GridMotion:
    nodes = np.argwhere(blocked).tolist()
    settings = {
        "size": blocked.shape,
        "start": (0,) * blocked.ndim,
        "goal": tuple(n - 1 for n in blocked.shape),
        "obstacle_height": 0.5,
        "security_margin": 0.0,
        "length_unit": "unit",
        "obstacles": tuple((*node, *node) for node in nodes),
    }
    return GridMotion(**(settings | changed))


def robot(dimensions: Any = 2) -> FloorPlatform:
    return FloorPlatform(body_radius=0.4, body_height=0.5, dimensions=dimensions)


def solvable(shape: tuple[int, ...], share: float, seed: int, own: GridPathGa) -> Problem:
    """Return a random grid's problem; obstacles are taken away until the goal can be reached."""
    rng = np.random.default_rng(seed)
    height = rng.random(shape)
    height[(0,) * len(shape)] = height[(-1,) * len(shape)] = 1.0
    while True:
        try:
            return own.prepare(robot(len(shape)), scenario(height < share))
        except SettingError:
            share *= 0.8


def faults(problem: Problem, path: np.ndarray, *, revisits: bool) -> list[str]:
    """Return what is wrong with a path of a population."""
    grid, nodes = problem.fields.grid, path[1 : path[0] + 1]
    found = []
    if (nodes[0], nodes[-1]) != problem.ends:
        found.append("ends")
    if not grid.free.ravel()[nodes].all():
        found.append("blocked")
    if any(b not in grid.neighbours[a] for a, b in zip(nodes[:-1], nodes[1:], strict=True)):
        found.append("moves")
    if not revisits and len(set(nodes.tolist())) != len(nodes):
        found.append("loops")
    return found
