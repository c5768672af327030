"""`reproduce` names the very generation at which a run was changed.

Were it by the last bit of one number.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import Comparison, reproduce_log
from evoexp.condition import Condition
from evoexp.numeric.generator_state import state_bytes
from evoexp.records import Generation, generations

LAST = 10  # generations of the smoke budget
REPLICATE = 1
LABELS = {
    "via-point GA": "rana_planar",
    "random search": "rana_planar",
    "rana_obstacles": "rana_obstacles",
}

Change = Callable[[Iterator[Generation], np.random.Generator], Iterator[Generation]]


def labelled(label: str) -> Condition:
    words = [f"experiment={LABELS[label]}", "budget=smoke"]
    return composed(*words, label=label)


@pytest.fixture(params=LABELS, scope="module")
def condition(request: pytest.FixtureRequest) -> Condition:
    return labelled(request.param)


def one_ulp_more(values: Any, index: Any) -> None:
    values[index] = np.nextafter(values[index], np.inf)


def record(condition: Condition, directory: Path) -> Path:
    """Run the replicate as this process is now; return its log."""
    path = directory / f"{REPLICATE:04d}.mcap"
    path.write_bytes(run_replicate(condition, REPLICATE).content)
    return path


def record_changed(condition: Condition, directory: Path, change: Change) -> Path:
    """Record a run whose generations are changed on their way out of the planner."""
    kind: Any = type(condition.planner)
    evolve = kind.evolve
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            kind,
            "evolve",
            lambda planner, problem, rng: change(generations(evolve(planner, problem, rng)), rng),
        )
        return record(condition, directory)


def compare_changed(condition: Condition, directory: Path, change: Change) -> Comparison:
    """Compare a changed run with the true one."""
    return reproduce_log(record_changed(condition, directory, change))


def nudged_at(generation: int) -> Change:
    """Raise one cost of one generation by one ulp, in the planner's own memory.

    What follows builds on it.
    """

    def change(generations: Iterator[Generation], rng: np.random.Generator) -> Iterator[Generation]:
        for row in generations:
            if row.index == generation:
                one_ulp_more(row.costs, 7)
            yield row

    return change


@pytest.mark.examples(1)
def test_an_unchanged_run_matches(condition: Condition, tmp_path: Path) -> None:
    comparison = reproduce_log(record(condition, tmp_path))
    assert comparison.verdict == "MATCH"
    assert (comparison.condition_id, comparison.replicate) == (condition.id, REPLICATE)
    assert comparison.num_generations == LAST + 1


@pytest.mark.parametrize("generation", [0, 1, 6, LAST])
def test_one_ulp_in_one_cost(condition: Condition, tmp_path: Path, generation: int) -> None:
    comparison = compare_changed(condition, tmp_path, nudged_at(generation))
    assert comparison.verdict == f"DIVERGES at generation {generation}"
    assert comparison.diverged_at == generation
    assert not comparison.matches


@pytest.mark.parametrize("generation", [0, 4, LAST])
def test_one_ulp_in_the_best_solution(
    condition: Condition, tmp_path: Path, generation: int
) -> None:
    def change(generations: Iterator[Generation], rng: np.random.Generator) -> Iterator[Generation]:
        for row in generations:
            best = row.best.copy()
            if row.index == generation:
                one_ulp_more(best, 5)
            yield row._replace(best=best)

    assert (
        compare_changed(condition, tmp_path, change).verdict
        == f"DIVERGES at generation {generation}"
    )


@pytest.mark.parametrize("generation", [0, 4, LAST])
def test_one_number_drawn_from_the_generator(
    condition: Condition, tmp_path: Path, generation: int
) -> None:
    def change(generations: Iterator[Generation], rng: np.random.Generator) -> Iterator[Generation]:
        for row in generations:
            if row.index == generation:
                rng.random()
                yield row._replace(state=state_bytes(rng.bit_generator))
            else:
                yield row

    assert (
        compare_changed(condition, tmp_path, change).verdict
        == f"DIVERGES at generation {generation}"
    )


def test_one_ulp_in_the_last_population(condition: Condition, tmp_path: Path) -> None:
    def change(generations: Iterator[Generation], rng: np.random.Generator) -> Iterator[Generation]:
        for row in generations:
            population = row.population.copy()
            if row.index == LAST:
                one_ulp_more(population, (1, 8, 3))
            yield row._replace(population=population)

    comparison = compare_changed(condition, tmp_path, change)
    assert comparison.verdict == "DIVERGES in the last population"
    assert comparison.diverged_at is None
    assert not comparison.matches


def test_a_shorter_run(condition: Condition, tmp_path: Path) -> None:
    def change(generations: Iterator[Generation], rng: np.random.Generator) -> Iterator[Generation]:
        return (row for row in generations if row.index <= 6)

    assert compare_changed(condition, tmp_path, change).verdict == "DIVERGES at generation 7"


def test_a_longer_run(condition: Condition, tmp_path: Path) -> None:
    def change(generations: Iterator[Generation], rng: np.random.Generator) -> Iterator[Generation]:
        for row in generations:
            yield row
        yield row._replace(index=LAST + 1)

    assert (
        compare_changed(condition, tmp_path, change).verdict == f"DIVERGES at generation {LAST + 1}"
    )


def test_the_command_says_it_in_another_process(tmp_path: Path) -> None:
    path = record_changed(labelled("via-point GA"), tmp_path, nudged_at(3))
    command = [sys.executable, "-m", "evoexp", "reproduce", str(path)]
    environment = os.environ | {"COLUMNS": "120", "EVOEXP_OUTPUTS": str(tmp_path / "none")}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env=environment, cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (1, "")
    assert "DIVERGES at generation 3" in done.stdout
    assert "0 of 1 MATCH" in done.stdout
    assert "the environment is the same" in done.stdout
