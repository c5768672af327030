"""Logs of which one part was replaced: `reproduce` names it, and `verify` if solutions show it.

All checksums, the content digest and the index of a forged log are right.
"""

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode

from composed import composed
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import contradictions, reproduce_log, stored_condition
from evoexp.errors import CorruptLog
from evoexp.store.integrity import LogCheck, check_log
from evoexp.store.log import SUMMARY, array_file
from evoexp.store.log_reader import LogContents, read_log
from forged_logs import Row, with_attachment, with_message, with_metadata
from matrix import first
from store.log_anatomy import put_together, take_apart

DATA = Path(__file__).parents[1] / "store" / "data"
PLANNERS = ("via_point_ga", "coevolution", "posture_es", "grid_path_ga", "random_search")
REFERENCE, GRIDS = "placement_optimum", ("grid_path_ga", "two_stage")
EVERY = (*PLANNERS, REFERENCE, "redundant_ga", "two_stage", "urdf")
Forgery = Callable[[bytes], bytes]


@functools.cache
def log_of(name: str) -> bytes:
    """Return a log written here and now, of the condition of a stored one if it can be run."""
    if name == REFERENCE:  # the stored one is of revision 1
        words = "experiment=chen_placement", "reference.num_angles=90"
        return run_replicate(composed(*words, label="A torque norm, optimum"), 0).content
    condition = stored_condition(DATA, read_log(DATA / f"{name}.mcap"))
    return run_replicate(condition, 0).content


def placed(content: bytes, folder: Path) -> Path:
    path = folder / "0000.mcap"
    path.write_bytes(content)
    return path


def verified(content: bytes, folder: Path) -> LogCheck:
    path = placed(content, folder)
    return check_log(path, read_log(path).condition_id, contradictions)


@pytest.mark.parametrize("name", EVERY)
def test_a_log_agrees_with_itself(name: str, tmp_path: Path) -> None:
    stored = [(DATA / f"{name}.mcap").read_bytes()] * (name != REFERENCE)
    for content in (log_of(name), *stored):
        assert verified(put_together(take_apart(content)), tmp_path)[1::2] == ("", "")
    assert reproduce_log(placed(log_of(name), tmp_path)).verdict == "MATCH"


def raised(topic: str, field: str, k: int | None = None, which: int = -1) -> Forgery:
    """Return a forgery of one number, which becomes the next larger one."""

    def change(row: Row) -> Row:
        place, key = (row, field) if k is None else (row[field], k)
        place[key] = math.nextafter(place[key], math.inf)
        return row

    return lambda log: with_message(log, topic, change, which)


def lowered(topic: str, field: str, which: int = -1) -> Forgery:
    return lambda log: with_message(log, topic, lambda row: row | {field: row[field] - 1e-3}, which)


def replaced(topic: str, which: int = -1, **fields: Any) -> Forgery:
    return lambda log: with_message(log, topic, lambda row: row | fields, which)


def removed(topic: str, which: int = -1) -> Forgery:
    return lambda log: with_message(log, topic, lambda row: None, which)


def summary(**values: Any) -> Forgery:
    return lambda log: with_metadata(log, SUMMARY, **values)


def attached(name: str, data: Callable[[LogContents], bytes | None]) -> Forgery:
    return lambda log: with_attachment(log, name, data(read_log(log)))


def new(log: LogContents) -> bytes:
    return array_file(np.zeros(1))


def more(log: LogContents) -> bytes:
    return array_file(np.nextafter(log.arrays()["minima"], np.inf))


def shorter(log: LogContents) -> bytes:
    return array_file(log.arrays()["minima"][:-1])


VIAS, FRONTS, MINIMA = "via_point_ga", "coevolution", REFERENCE
RECORDS: dict[str, tuple[Forgery, str]] = {
    f"{VIAS}: last solution": (raised("/solution", "values", 0), ": values differs by "),
    f"{VIAS}: first": (raised("/solution", "values", 0, 0), "of generation 0: values differs by "),
    f"{VIAS}: fewer": (removed("/solution"), "was 'missing', is 'there'"),
    f"{VIAS}: std": (raised("/generation", "std_cost", which=0), "generation 0: std_cost differs"),
    f"{VIAS}: chain": (replaced("/generation", 0, chain="0" * 32), "DIVERGES at generation 0"),
    f"{VIAS}: an unknown field": (replaced("/generation", note=1), "content digest"),
    f"{VIAS}: verdict": (summary(clearance=0.125), "clearance "),
    f"{VIAS}: term": (summary(term_of_mine=1.5), "term_of_mine was 1.5, is None"),
    f"{VIAS}: digest": (summary(digest="0" * 32), "DIVERGES in the last population"),
    f"{VIAS}: one more": (attached("a.npy", new), "a.npy was 'there', is 'missing'"),
    f"{VIAS}: another configuration": (
        attached("config.json", lambda log: log.config_json + b" "),
        "configuration differs",
    ),
    f"{FRONTS}: front": (raised("/front", "criteria", 1), "population 1: criteria differs by "),
    f"{FRONTS}: fewer": (removed("/front"), "of generation 10, population 1 was 'missing'"),
    f"{MINIMA}: array": (attached("minima.npy", more), "minima.npy: values differs by "),
    f"{MINIMA}: shorter": (attached("minima.npy", shorter), "minima.npy: values differs"),
    f"{MINIMA}: gone": (attached("minima.npy", lambda log: None), "minima.npy was 'missing'"),
}


@pytest.mark.parametrize("what", RECORDS)
def test_reproduce_names_a_replaced_record(what: str, tmp_path: Path) -> None:
    forge, expected = RECORDS[what]
    found = reproduce_log(placed(forge(log_of(what.partition(":")[0])), tmp_path))
    assert not found.matches
    assert expected in found.verdict


def test_no_record_is_hidden_from_who_reads_the_whole_log(tmp_path: Path) -> None:
    """Readers of one array follow the index, to the first of two arrays of one name."""
    log = log_of(REFERENCE)
    other = array_file(read_log(log).arrays()["minima"] + 1.0)
    for name in ("minima.npy", "config.json"):
        with pytest.raises(CorruptLog, match="records of the same name"):
            read_log(with_attachment(log, name, other, beside=True))
    parts = take_apart(log)
    doubled = [part for part in parts if part.opcode == Opcode.METADATA]
    with pytest.raises(CorruptLog, match="records of the same name"):
        read_log(put_together([*parts, doubled[-1]]))


@pytest.mark.parametrize("which", first(1, [-1, 0]))
@pytest.mark.parametrize("name", EVERY)
def test_verify_evaluates_solutions(name: str, which: int, tmp_path: Path) -> None:
    # the last joint of the URDF rolls the tool, which no cost and no distance depends on
    joint, step = -2 if name == "urdf" else -1, 1.0 if name in GRIDS else 1e-3

    def move(row: Row) -> Row:
        row["values"][joint] += step
        return row

    forged = with_message(log_of(name), "/solution", move, which)
    generation = read_log(forged).solutions[which].generation
    problem = verified(forged, tmp_path).problem
    if name in ("redundant_ga", "two_stage") and which == 0:
        return  # of a solution that costs inf, what is no plan yet is not judged
    assert problem.startswith(f"altered: solution of generation {generation}")
    assert problem.endswith("; delete it, then run again")


def cheaper(log: bytes) -> bytes:
    """Return a log in which the best cost is lower wherever it is told."""
    rows = read_log(log).generations
    for k, row in enumerate(rows):
        if row.best_cost == rows[-1].best_cost:
            log = lowered("/generation", "best_cost", k)(log)
    log = lowered("/solution", "cost")(log)
    return summary(best_cost=rows[-1].best_cost - 1e-3)(log)


@pytest.mark.parametrize("name", ["via_point_ga", "coevolution", "grid_path_ga", "redundant_ga"])
def test_verify_compares_costs_that_agree_with_each_other(name: str, tmp_path: Path) -> None:
    problem = verified(cheaper(log_of(name)), tmp_path).problem
    generation = read_log(log_of(name)).solutions[-1].generation
    assert problem.startswith(f"altered: solution of generation {generation}: cost differs by ")


NO_MOTION = "solution of generation 4 was 'there', is 'none: "
SEEN: dict[str, tuple[Forgery, str]] = {
    "verdict": (summary(certified=None), "motion of the last solution: certified was "),
    "clearance": (summary(clearance=0.125), "motion of the last solution: clearance differs by "),
    "term": (summary(term_fitness=1.0), "last solution: fitness differs by "),
    "cost": (raised("/solution", "cost", which=0), "solution of generation 0: cost differs by "),
    "a hidden improvement": (removed("/solution", 1), "no solution of generation "),
    "another generation": (replaced("/solution", 1, generation=99), "no solution of generation "),
    "another size": (replaced("/solution", values=[0.5]), NO_MOTION),
    "no motion": (replaced("/solution", values=[1e300] * 84), f"{NO_MOTION}its numbers must be fi"),
}


@pytest.mark.parametrize("what", SEEN)
def test_verify_compares_all_that_a_solution_shows(what: str, tmp_path: Path) -> None:
    forge, expected = SEEN[what]
    problem = verified(forge(log_of("via_point_ga")), tmp_path).problem
    assert problem.startswith(f"altered: {expected}")


def test_what_cannot_be_evaluated_here_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = log_of("via_point_ga")
    planner: Any = type(stored_condition(tmp_path, read_log(content)).planner)
    monkeypatch.setattr(planner, "revision", planner.revision + 1)
    found = verified(content, tmp_path)
    assert found.problem == ""
    assert "revision" in found.unevaluated and str(tmp_path) not in found.unevaluated
