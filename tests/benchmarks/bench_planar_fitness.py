"""The fitness of two planar arms, beside careful C with the vector sines of the C library."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from evoexp.condition import Condition
from evoexp.objectives.motion_criteria import StringTerms
from evoexp.planners.via_point_ga.strings import Strings, judge
from evoexp.records import FloatArray, generations
from evoexp.testing import conditions

SOURCE = Path(__file__).with_name("reference_planar_fitness.c")
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-shared", "-fPIC")
INDIVIDUALS, POINTS, CIRCLES, ARMS = 100, 16, 9, 2
BLOCK = -(-INDIVIDUALS // 8) * 8  # its fastest: all individuals in the first-level cache
COMPILER = shutil.which("gcc") or shutil.which("cc")


class Fitness(NamedTuple):
    """Three judges of one population, each of which returns the costs."""

    ours: Callable[[], FloatArray]  # the planner's kernel
    theirs: Callable[[], FloatArray]  # the C reference
    by_planner: Callable[[], FloatArray]  # `Planner.cost`, with the work of Python around it


class _Arms(ctypes.Structure):
    _fields_ = (
        ("base", ctypes.c_double * 2 * ARMS),
        ("link", ctypes.c_long * CIRCLES),
        ("along", ctypes.c_double * CIRCLES * ARMS),
        ("length", ctypes.c_double * ARMS),
        ("radius", ctypes.c_double),
        ("weights", ctypes.c_double * 3),
    )


def compiled() -> Any:
    """Compile the reference and return its function."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "reference.so"
        sizes = (f"-DPOINTS={POINTS}", f"-DCIRCLES={CIRCLES}", f"-DBLOCK={BLOCK}")
        command = [str(COMPILER), *FLAGS, *sizes, str(SOURCE), "-o", str(library), "-lmvec", "-lm"]
        subprocess.run(command, check=True)
        function = ctypes.CDLL(str(library)).planar_fitness  # stays loaded
    function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_long, ctypes.c_void_p]
    function.restype = None
    return function


def _arms(condition: Condition, problem: Any) -> _Arms:
    """Return the scene as the C reference takes it."""
    arms, shapes, first = _Arms(), problem.collision.shapes, 0
    assert not condition.scenario.obstacles
    for a, robot in enumerate(condition.robot.arms):
        stop = first + CIRCLES
        assert (
            problem.collision.counts[a] == CIRCLES
            and len(robot.link_lengths) == 2
            and not robot.base_angle
        )
        arms.base[a][:] = robot.base_position
        arms.length[a] = robot.link_lengths[0]
        arms.along[a][:] = shapes.start[first:stop, 0]
        arms.link[:] = shapes.joint[first:stop] - shapes.joint[first]
        first = stop
    arms.radius = problem.collision.radius
    arms.weights[:] = condition.planner.objective.weights
    return arms


def prepared(when: str) -> Fitness:
    """Return judges of a population of fresh walks, or of the last one of a finished run."""
    words = (f"ga.population_size={INDIVIDUALS}", f"planner.num_via_points={POINTS}")
    condition = next(iter(conditions("experiment=rana_planar", *words, budget="paper").values()))
    (planner, problem), rng = condition.prepare(), np.random.default_rng(0)
    population = planner.sample(problem, rng, INDIVIDUALS)
    if when == "finished":
        *_, last = generations(planner.evolve(problem, np.random.default_rng(0)))
        population = last.population
    strings = np.zeros((len(population), POINTS + 1, BLOCK))
    strings[:, :, :INDIVIDUALS] = population[:, :, :INDIVIDUALS]
    function, arms, cost = compiled(), _arms(condition, problem), np.empty(BLOCK)
    settings = Strings(planner, problem).settings
    lengths = np.empty((ARMS, BLOCK)), np.empty((ARMS, BLOCK))
    terms = StringTerms(*lengths, np.empty(BLOCK), np.empty(BLOCK))

    def theirs() -> FloatArray:
        function(ctypes.addressof(arms), strings.ctypes.data, BLOCK, cost.ctypes.data)
        return cost[:INDIVIDUALS]

    def ours() -> FloatArray:
        judge(strings, settings, terms)
        return terms.cost[:INDIVIDUALS]

    return Fitness(ours, theirs, lambda: planner.cost(problem, strings).cost[:INDIVIDUALS])


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
@pytest.mark.parametrize("when", ["fresh", "finished"])
def bench_planar_fitness(beside: Any, when: str) -> None:
    """The kernel alone: lengths, unevenness, collisions at all instants and the cost."""
    one = prepared(when)
    assert np.allclose(one.ours(), one.theirs(), rtol=0.0, atol=1e-9)
    assert np.array_equal(one.ours(), one.by_planner())
    beside(
        f"fitness of {INDIVIDUALS} individuals, {POINTS} instants, two arms of "
        f"{CIRCLES} circles, {when}",
        one.ours,
        {"C, -O3 -march=native, vector sines": (one.theirs, INDIVIDUALS, 20)},
        unit="individual",
        amount=INDIVIDUALS,
        repeat=20,
        rounds=200,
    )
