"""The C of `reference_planar_fitness.c`, compiled into a temporary folder, beside the planner.

Run as a programme it prints both times and their ratio.
"""

import ctypes
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.objectives.string_fitness import StringTerms
from evoexp.planners.via_point_ga.kernels import judge
from evoexp.planners.via_point_ga.strings import Strings
from evoexp.records import FloatArray, generations

SOURCE = Path(__file__).with_suffix(".c")
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-shared", "-fPIC")
INDIVIDUALS, POINTS, CIRCLES, ARMS = 100, 16, 9, 2
BLOCK = -(-INDIVIDUALS // 8) * 8  # its fastest: all individuals in the first-level cache


class Fitness(NamedTuple):
    """One population, judged by both.

    Attributes:
        strings: (nq, POINTS + 1, individuals padded to whole vectors) [deg].
        ours: Judges it by the planner's kernel; returns the costs.
        theirs: Judges it by the C reference; returns the costs.
        by_planner: Judges it as `Planner.cost` does, with the work of Python around the kernel.
    """

    strings: FloatArray
    ours: Callable[[], FloatArray]
    theirs: Callable[[], FloatArray]
    by_planner: Callable[[], FloatArray]


class _Arms(ctypes.Structure):
    _fields_ = (
        ("base", ctypes.c_double * 2 * ARMS),
        ("link", ctypes.c_long * CIRCLES),
        ("along", ctypes.c_double * CIRCLES * ARMS),
        ("length", ctypes.c_double * ARMS),
        ("radius", ctypes.c_double),
        ("weights", ctypes.c_double * 3),
    )


def compiler() -> str | None:
    """Return the C compiler; None where there is none."""
    return shutil.which("gcc") or shutil.which("cc")


def compiled(block: int = BLOCK) -> Any:
    """Compile the reference and return its function."""
    found = compiler()
    assert found is not None, "there is no C compiler"
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "reference.so"
        sizes = (f"-DPOINTS={POINTS}", f"-DCIRCLES={CIRCLES}", f"-DBLOCK={block}")
        command = [found, *FLAGS, *sizes, str(SOURCE), "-o", str(library), "-lmvec", "-lm"]
        subprocess.run(command, check=True)
        function = ctypes.CDLL(str(library)).planar_fitness  # stays loaded
    function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_long, ctypes.c_void_p]
    function.restype = None
    return function


def condition() -> Condition:
    """Return the condition whose population is judged: two arms, no obstacles."""
    overrides = ["experiment=rana_planar", f"ga.population_size={INDIVIDUALS}"]
    overrides.append(f"planner.num_via_points={POINTS}")
    return compose.expand(overrides)[0].conditions[0].condition


def _arms(given: Condition, problem: Any) -> _Arms:
    """Return the scene as the C reference takes it."""
    arms, spheres = _Arms(), problem.collision.spheres
    for a, ((first, stop), robot) in enumerate(
        zip(problem.collision.arm_spheres, given.robot.arms, strict=True)
    ):
        assert stop - first == CIRCLES
        assert len(robot.link_lengths) == 2
        assert not robot.base_angle
        assert not given.scenario.obstacles
        arms.base[a][:] = robot.base_position
        arms.length[a] = robot.link_lengths[0]
        arms.along[a][:] = spheres.local[first:stop, 0]
        links = spheres.joint[first:stop] - spheres.joint[first]
        arms.link[:] = links
    arms.radius = problem.collision.spheres.radius
    arms.weights[:] = given.planner.objective.weights
    return arms


def prepared(when: str = "fresh", block: int = BLOCK) -> Fitness:
    """Return a population of fresh walks, or the last one of a finished run, and both judges."""
    given = condition()
    planner, problem = given.prepare()
    rng = np.random.default_rng(0)
    if when == "fresh":
        population = planner.sample(problem, rng, INDIVIDUALS)
    else:
        *_, last = generations(planner.evolve(problem, rng))
        population = last.population
    strings = np.zeros((len(population), POINTS + 1, BLOCK))
    strings[:, :, :INDIVIDUALS] = population[:, :, :INDIVIDUALS]
    function, arms, cost = compiled(block), _arms(given, problem), np.empty(BLOCK)

    def theirs() -> FloatArray:
        function(ctypes.addressof(arms), strings.ctypes.data, BLOCK, cost.ctypes.data)
        return cost[:INDIVIDUALS]

    settings = Strings(planner, problem).settings
    lengths = np.empty((ARMS, BLOCK)), np.empty((ARMS, BLOCK))
    terms = StringTerms(*lengths, np.empty(BLOCK), np.empty(BLOCK))

    def ours() -> FloatArray:
        judge(strings, settings, terms)
        return terms.cost[:INDIVIDUALS]

    def by_planner() -> FloatArray:
        found: FloatArray = planner.cost(problem, strings).cost
        return found[:INDIVIDUALS]

    return Fitness(strings, ours, theirs, by_planner)


def _least(work: Callable[[], object], calls: int = 20) -> float:
    begin = time.process_time()
    for _ in range(calls):
        work()
    return (time.process_time() - begin) / calls


def main() -> None:
    """Print both times, in turns, and their ratio."""
    for when in ("fresh", "finished"):
        one = prepared(when)
        assert np.allclose(one.ours(), one.theirs(), rtol=0.0, atol=1e-9)
        assert np.array_equal(one.ours(), one.by_planner())
        pairs = [(_least(one.ours), _least(one.theirs)) for _ in range(300)]
        ours, theirs = (1e6 * min(column) for column in zip(*pairs, strict=True))
        ratio = f"{theirs / ours:.2f}"
        print(f"{when}: ours {ours:.1f} µs, C {theirs:.1f} µs, C / ours {ratio}")


if __name__ == "__main__":
    main()
