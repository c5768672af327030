"""Costs of the ends of a sub-path, compiled: Eq. 4, and which sub-paths collide."""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.ellipse_kernels import (
    Ellipses,
    PathChecks,
    TestedPath,
    check_paths,
    prepare_checks,
)
from evoexp.numeric.compilation import kernel
from evoexp.numeric.vectors import LANES
from evoexp.objectives.reaching import measure_reach
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.planar_ends import PlanarArm

RESULTS = 3  # last rows of a table of individuals: cost, position error, joint displacement


class Judging(NamedTuple):
    """The collision model and the objective of a sub-path."""

    arm: PlanarArm  # the arm
    ellipses: Ellipses  # the ellipses
    path: TestedPath  # the positions that are tested
    target: FloatArray  # (2,) desired place of the tip [length unit]
    box: FloatArray  # (4,) least and greatest x, least and greatest y of the tip [length unit]
    weights: tuple[float, float]  # w1, w2 of Eq. 4.


@kernel
def measure(
    starts: FloatArray, angles: FloatArray, count: int, judging: Judging, table: FloatArray
) -> None:
    """Write Eq. 4 without collisions, and its parts, for the first `count` individuals."""
    row, lanes = len(table) - RESULTS, np.arange(count + LANES)
    arm, target, box, weights = judging.arm, judging.target, judging.box, judging.weights
    results = table[row], table[row + 1], table[row + 2]
    measure_reach(starts, angles, lanes, count, arm, target, box, weights, *results)


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
    """Return Eq. 4 and its parts for some sub-paths, (3, individuals).

    An individual whose tip ends outside the box is not tested for collisions.

    Args:
        starts: (joints, individuals) [rad].
        ends: (joints, individuals) [rad].
    """
    count = starts.shape[1]
    results, lanes = np.empty((RESULTS, count)), np.empty(count + LANES, dtype=np.int64)
    measure(starts, ends, count, judging, results)
    left, hit = list_inside(results, count, lanes), np.zeros(count, dtype=np.bool_)
    checks = prepare_checks(judging.ellipses, len(starts), count)
    drop_collisions(starts, ends, lanes, left, judging, results, hit, checks)
    return results
