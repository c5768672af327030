"""`reproduce` compares all that a log says but times, and names where a run was changed."""

import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from composed import composed
from evoexp.batch.replicate import EXACT_BOXES, run_replicate
from evoexp.batch.reproduction import ELSEWHERE, OLDER, compare, reproduce_log
from evoexp.condition import Condition
from evoexp.numeric.generator_state import state_bytes
from evoexp.records import TIMES, Generation, ReplicateSummary, generations
from evoexp.store.log_reader import LogContents, read_log

# the search itself, and what names the replicate
NAMED = {"condition", "replicate", "digest", "terms"}
FIELDS = [name for name in ReplicateSummary._fields if name not in {*TIMES, *NAMED}]


@pytest.fixture(scope="module")
def log() -> LogContents:
    """Return a log of a motion among boxes, whose exact distance is no whole number."""
    return read_log(run_replicate(composed("experiment=chen_path", "budget=smoke"), 0).content)


def changed(log: LogContents, **fields: Any) -> LogContents:
    return log._replace(summary=log.summary._replace(**fields))


def older(log: LogContents) -> LogContents:
    """Return a log as it was written before boxes were exact."""
    around = {name: value for name, value in log.environment.items() if name != EXACT_BOXES}
    return log._replace(environment=around)


def elsewhere(log: LogContents) -> LogContents:
    versions = log.environment["versions"] | {"numpy": "0.1"}
    return log._replace(environment=log.environment | {"versions": versions})


def another(value: Any) -> Any:
    """Return a value that differs as little as one of its kind can."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, float):
        return 0.5 if math.isnan(value) else math.nextafter(value, math.inf)
    return 1 if value is None else value + (1 if isinstance(value, int) else "x")


def test_an_equal_log_matches(log: LogContents) -> None:
    for one in (log, older(log), elsewhere(log)):
        assert compare(one, log).verdict == "MATCH"
    times = dict.fromkeys(TIMES, 1e6)
    assert compare(changed(log, **times), log).verdict == "MATCH"


@pytest.mark.parametrize("name", FIELDS)
def test_every_field_is_compared_to_the_bit(log: LogContents, name: str) -> None:
    found = compare(changed(log, **{name: another(getattr(log.summary, name))}), log)
    assert not found.matches
    assert found.verdict.startswith(f"MATCH in the search; DIVERGES in the rest: {name} ")


def test_terms_are_compared(log: LogContents) -> None:
    name, value = next(iter(log.summary.terms.items()))
    terms = log.summary.terms | {name: math.nextafter(value, math.inf)}
    assert f"term_{name} differs by " in compare(changed(log, terms=terms), log).verdict


@pytest.mark.parametrize(("make", "why"), [(older, OLDER), (elsewhere, ELSEWHERE)])
def test_where_bits_may_differ_numbers_are_compared_and_it_is_said(
    log: LogContents, make: Any, why: str
) -> None:
    near, far = log.summary.clearance + 3e-10, log.summary.clearance + 3e-9
    found = compare(make(changed(log, clearance=near)), log)
    said = f"MATCH in the search, to 1e-09 in the rest: clearance differs by 3.0e-10 ({why})"
    assert (found.matches, found.verdict) == (True, said)
    found = compare(make(changed(log, clearance=far)), log)
    said = f"MATCH in the search; DIVERGES in the rest: clearance differs by 3.0e-09 ({why})"
    assert (found.matches, found.verdict) == (False, said)
    for fields in ({"certified": None}, {"solved": not log.summary.solved}, {"evaluations": 1}):
        found = compare(make(changed(log, **fields)), log)
        assert not found.matches, "what is no number agrees or does not"
        assert f"DIVERGES in the rest: {next(iter(fields))} was" in found.verdict
    found = compare(make(changed(log, clearance_at=0.25, clearance=near)), log)
    assert found.matches, "of two places equally close, rounding chooses"
    assert found.verdict.endswith(f"clearance differs by 3.0e-10, and 1 more field ({why})")
    rows = [row._replace(mean_cost=row.mean_cost + 1e-12) for row in log.generations]
    assert "mean_cost differs by " in compare(log._replace(generations=rows), log).verdict
    assert compare(make(log)._replace(generations=rows), log).matches


LAST = 10  # generations of the smoke budget
REPLICATE = 1
LABELS = {
    "via-point GA": "rana_planar",
    "random search": "rana_planar",
    "rana_obstacles": "rana_obstacles",
}
Rows = Iterator[Generation]
Change = Callable[[Rows, np.random.Generator], Rows]


def labelled(label: str) -> Condition:
    return composed(f"experiment={LABELS[label]}", "budget=smoke", label=label)


@pytest.fixture(params=LABELS, scope="module")
def condition(request: pytest.FixtureRequest) -> Condition:
    return labelled(request.param)


def recorded(condition: Condition, directory: Path, change: Change) -> Path:
    """Record a run whose generations are changed on their way out of the planner."""
    kind: Any = type(condition.planner)
    evolve, path = kind.evolve, directory / f"{REPLICATE:04d}.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kind, "evolve", lambda *given: change(generations(evolve(*given)), given[-1]))
        path.write_bytes(run_replicate(condition, REPLICATE).content)
    return path


def raised(values: Any, place: Any) -> Any:
    values[place] = np.nextafter(values[place], np.inf)
    return values


def cost(row: Generation, rng: np.random.Generator) -> Generation:
    raised(row.costs, 7)  # in the planner's own memory: what follows builds on it
    return row


def best(row: Generation, rng: np.random.Generator) -> Generation:
    return row._replace(best=raised(row.best.copy(), 5))


def generator(row: Generation, rng: np.random.Generator) -> Generation:
    rng.random()
    return row._replace(state=state_bytes(rng.bit_generator))


def population(row: Generation, rng: np.random.Generator) -> Generation:
    return row._replace(population=raised(row.population.copy(), (1, 8, 3)))


def at(generation: int, change: Callable[..., Generation]) -> Change:
    def changed(rows: Rows, rng: np.random.Generator) -> Rows:
        return (change(row, rng) if row.index == generation else row for row in rows)

    return changed


def longer(rows: Rows, rng: np.random.Generator) -> Rows:
    for row in rows:
        yield row
    yield row._replace(index=LAST + 1)


CHANGES: dict[str, tuple[Change, int | None]] = {
    "nothing": (lambda rows, rng: rows, None),
    **{f"cost {k}": (at(k, cost), k) for k in (0, 1, 6, LAST)},
    **{f"best solution {k}": (at(k, best), k) for k in (0, 4, LAST)},
    **{f"generator {k}": (at(k, generator), k) for k in (0, 4, LAST)},
    "last population": (at(LAST, population), None),
    "a shorter run": (lambda rows, rng: islice(rows, 7), 7),
    "a longer run": (longer, LAST + 1),
}


@pytest.mark.parametrize("name", CHANGES)
def test_the_first_changed_generation_is_named(
    condition: Condition, tmp_path: Path, name: str
) -> None:
    change, generation = CHANGES[name]
    found = reproduce_log(recorded(condition, tmp_path, change))
    verdicts = {"nothing": "MATCH", "last population": "DIVERGES in the last population"}
    assert found.verdict == verdicts.get(name, f"DIVERGES at generation {generation}")
    assert (found.diverged_at, found.matches) == (generation, name == "nothing")
    assert (found.condition_id, found.replicate) == (condition.id, REPLICATE)


def test_the_command_says_it_in_another_process(tmp_path: Path) -> None:
    path = recorded(labelled("via-point GA"), tmp_path, at(3, cost))
    done = subprocess.run(
        [sys.executable, "-m", "evoexp", "reproduce", str(path)],
        env=os.environ | {"COLUMNS": "120", "EVOEXP_OUTPUTS": str(tmp_path / "none")},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (1, "")
    for part in ("DIVERGES at generation 3", "0 of 1 MATCH", "the environment is the same"):
        assert part in done.stdout
