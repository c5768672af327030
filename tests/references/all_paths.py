"""All paths without loops of small grids, and the cost of one, the obvious way."""

from typing import Any


def all_simple_paths(problem: Any) -> list[list[int]]:
    start, goal = problem.ends
    found, stack = [], [[start]]
    while stack:
        path = stack.pop()
        for other in problem.fields.grid.neighbours[path[-1]]:
            if other == goal:
                found.append([*path, int(other)])
            elif other >= 0 and other not in path:
                stack.append([*path, int(other)])
    return found


def path_cost(own: Any, problem: Any, path: Any) -> float:
    nodes = problem.fields.grid.coordinates[path].astype(float)
    return float(own.evaluate(problem, nodes.ravel())["cost"])
