"""What a planner says of its memory is what its run takes, within a factor."""

import ctypes
import functools
import json
import os
from pathlib import Path
from typing import Any

import pytest

from evoexp.condition import Condition
from evoexp.records import generations
from shipped_conditions import of_kind

FACTOR = 4.0  # between the estimate and what is measured, either way
SMALL = 50  # individuals of a run that compiles, and finds the memory that is taken anyway
RUNS = (  # (experiment, number of its condition), individuals, generations that are run
    (("rana_obstacles", 0), 20_000, 3),
    (("rana_planar", 1), 20_000, 3),  # random search
    (("rana_planar", 2), 20_000, 3),  # multi-start
    (("curkovic_motion", 1), 3_000, 3),
    (("lavoie_7dof", 0), 60_000, 3),
    (("lavoie_coding", 1), 20_000, 3),  # binary
    (("corsepius_ball", 0), 60_000, 3),
    (("chen_mission", 0), 1_000, 104),  # two stages
    (("chen_path", 0), 2_000, 3),
    (("chen_placement", 0), 20_000, 3),
)


def with_population(condition: Condition, size: int) -> Condition:
    """Return a condition with populations of another size."""

    def changed(value: Any) -> Any:
        if isinstance(value, list):
            return [changed(item) for item in value]
        if not isinstance(value, dict):
            return value
        found = {key: changed(item) for key, item in value.items()}
        if "population_size" in found:
            found |= {"population_size": size, "num_elites": min(found["num_elites"], size // 2)}
        if "initial_size" in found:
            found |= {"initial_size": size, "num_offspring": size}
        return found

    return Condition.from_json(json.dumps(changed(json.loads(condition.to_json()))).encode())


def evolve(condition: Condition, num_generations: int) -> None:
    """Run the first generations."""
    planner, problem = condition.prepare()
    for index, _ in enumerate(generations(planner.evolve(problem, condition.rng(0)))):
        if index == num_generations:
            break


def memory(name: str) -> int:
    """Return the memory of this process now, `VmRSS`, or at most since the mark, `VmHWM` [B]."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith(name)).split()[1]) * 1024


def peak(small: Condition, large: Condition, num_generations: int) -> int:
    """Return the memory that a run takes beyond that of a small one, in its own process [B]."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        evolve(small, num_generations)
        large.prepare()
        ctypes.CDLL(None).malloc_trim(0)  # what was freed before would serve the run unseen
        before = memory("VmRSS")
        Path("/proc/self/clear_refs").write_text("5")  # the greatest memory so far is that of now
        evolve(large, num_generations)
        os.write(writer, str(memory("VmHWM") - before).encode())
        os._exit(0)
    os.close(writer)
    os.waitpid(child, 0)
    with os.fdopen(reader, "rb") as answer:
        return int(answer.read() or -1)


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="no /proc of Linux")
@pytest.mark.parametrize(("kind", "size", "num_generations"), RUNS, ids=str)
def test_the_estimate_is_near_the_peak(
    kind: tuple[str, int], size: int, num_generations: int
) -> None:
    resized = functools.partial(with_population, of_kind(kind, "smoke"))
    small, large = resized(SMALL), resized(size)
    planner, problem = large.prepare()
    measured = peak(small, large, num_generations)
    estimate = planner.memory(problem)
    assert measured > 4e6, "too little to be compared"
    assert estimate / FACTOR < measured < FACTOR * estimate
