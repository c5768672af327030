"""Logs of which one part was replaced: `reproduce` names it, and `verify` if solutions show it.

All checksums, the content digest and the index of a forged log are right.
"""

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.opcode import Opcode

from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log, stored_condition
from evoexp.batch.stored_solutions import contradictions
from evoexp.errors import CorruptLog
from evoexp.store.integrity import LogCheck, check_log
from evoexp.store.log import SUMMARY, array_file
from evoexp.store.log_reader import read_log
from forged_logs import Row, with_attachment, with_message, with_metadata
from matrix import first
from store.log_anatomy import put_together, take_apart

DATA = Path(__file__).parents[1] / "store" / "data"
PLANNERS = ("via_point_ga", "coevolution", "posture_es", "grid_path_ga", "random_search")
REFERENCE = "placement_optimum"
Forgery = Callable[[bytes], bytes]


@functools.cache
def log_of(name: str) -> bytes:
    """Return a log written here and now, of the condition of a stored one."""
    condition = stored_condition(DATA, read_log(DATA / f"{name}.mcap"))
    return run_replicate(condition, 0).content


def ulp(row: Row, field: str, k: int | None = None) -> Row:
    """Return a record of which one number is the next larger one."""
    if k is None:
        return row | {field: math.nextafter(row[field], math.inf)}
    row[field][k] = math.nextafter(row[field][k], math.inf)
    return row


def placed(content: bytes, folder: Path) -> Path:
    path = folder / "0000.mcap"
    path.write_bytes(content)
    return path


def reproduced(content: bytes, folder: Path) -> str:
    """Return the verdict of `reproduce`, which is no match."""
    found = reproduce_log(placed(content, folder))
    assert not found.matches
    return found.verdict


def verified(content: bytes, folder: Path) -> LogCheck:
    path = placed(content, folder)
    return check_log(path, read_log(path).condition_id, contradictions)


@pytest.mark.parametrize("name", [*PLANNERS, REFERENCE, "redundant_ga", "two_stage", "urdf"])
def test_a_log_agrees_with_itself(name: str, tmp_path: Path) -> None:
    for content in (log_of(name), (DATA / f"{name}.mcap").read_bytes()):
        assert verified(put_together(take_apart(content)), tmp_path)[1::2] == ("", "")
    assert reproduce_log(placed(log_of(name), tmp_path)).verdict == "MATCH"


RECORDS: dict[str, tuple[Forgery, str]] = {
    "last solution": (
        lambda log: with_message(log, "/solution", lambda row: ulp(row, "values", 0)),
        ": values differs by ",
    ),
    "first solution": (
        lambda log: with_message(log, "/solution", lambda row: ulp(row, "values", 0), 0),
        "solution 1, of generation 0: values differs by ",
    ),
    "fewer solutions": (
        lambda log: with_message(log, "/solution", lambda row: None),
        "was 'missing', is 'there'",
    ),
    "mean cost": (
        lambda log: with_message(log, "/generation", lambda row: ulp(row, "std_cost"), 0),
        "generation 0: std_cost differs by ",
    ),
    "chain": (
        lambda log: with_message(log, "/generation", lambda row: row | {"chain": "0" * 32}, 0),
        "DIVERGES at generation 0",
    ),
    "an unknown field": (
        lambda log: with_message(log, "/generation", lambda row: row | {"note": 1}),
        "content digest",
    ),
    "verdict": (
        lambda log: with_metadata(log, SUMMARY, clearance=0.125),
        "clearance ",
    ),
    "term": (
        lambda log: with_metadata(log, SUMMARY, term_of_mine=1.5),
        "term_of_mine was 1.5, is None",
    ),
    "last population": (
        lambda log: with_metadata(log, SUMMARY, digest="0" * 32),
        "DIVERGES in the last population",
    ),
    "another attachment": (
        lambda log: with_attachment(log, "more.npy", array_file(read_log(log).solutions[0].values)),
        "attachment more.npy was 'there', is 'missing'",
    ),
    "configuration": (
        lambda log: with_attachment(log, "config.json", read_log(log).config_json + b" "),
        "configuration differs",
    ),
}


@pytest.mark.parametrize("what", RECORDS)
def test_reproduce_names_a_replaced_record(what: str, tmp_path: Path) -> None:
    forge, expected = RECORDS[what]
    assert expected in reproduced(forge(log_of("via_point_ga")), tmp_path)


def criterion(row: Row) -> Row:
    return ulp(row, "criteria", 1)


def test_reproduce_names_a_replaced_front(tmp_path: Path) -> None:
    forged = with_message(log_of("coevolution"), "/front", criterion)
    expected = "front 2, of generation 10, population 1: criteria differs by "
    assert expected in reproduced(forged, tmp_path)
    gone = with_message(log_of("coevolution"), "/front", lambda row: None)
    assert "front 2, of generation 10, population 1 was 'missing'" in reproduced(gone, tmp_path)


def test_reproduce_names_a_replaced_array_of_a_reference(tmp_path: Path) -> None:
    log = log_of(REFERENCE)
    minima = read_log(log).arrays()["minima"]
    minima.flat[0] = math.nextafter(minima.flat[0], math.inf)
    forged = with_attachment(log, "minima.npy", array_file(minima))
    assert "attachment minima.npy: values differs by " in reproduced(forged, tmp_path)
    forged = with_attachment(log, "minima.npy", array_file(minima[:-1]))
    assert "attachment minima.npy: values differs" in reproduced(forged, tmp_path)
    gone = with_attachment(log, "minima.npy", None)
    assert "attachment minima.npy was 'missing'" in reproduced(gone, tmp_path)


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


def moved(name: str) -> Callable[[Row], Row]:
    """Return what moves a solution by a step that is one of its planner."""

    def move(row: Row) -> Row:
        # the last joint of the URDF rolls the tool, which no cost and no distance depends on
        row["values"][-2 if name == "urdf" else -1] += (
            1.0 if name in ("grid_path_ga", "two_stage") else 1e-3
        )
        return row

    return move


@pytest.mark.parametrize("which", first(1, [-1, 0]))
@pytest.mark.parametrize("name", [*PLANNERS, REFERENCE, "redundant_ga", "two_stage", "urdf"])
def test_verify_evaluates_solutions(name: str, which: int, tmp_path: Path) -> None:
    forged = with_message(log_of(name), "/solution", moved(name), which)
    generation = read_log(forged).solutions[which].generation
    problem = verified(forged, tmp_path).problem
    if name in ("redundant_ga", "two_stage") and which == 0:
        return  # of a solution that costs inf, what is no plan yet is not judged
    assert problem.startswith(f"altered: solution of generation {generation}")
    assert problem.endswith("; delete it, then run again")


def cheaper(log: bytes) -> bytes:
    """Return a log in which the best cost is lower wherever it is told."""
    rows = read_log(log).generations
    last = [k for k, row in enumerate(rows) if row.best_cost == rows[-1].best_cost]
    for k in last:
        log = with_message(log, "/generation", lower_best, k)
    log = with_message(log, "/solution", lambda row: row | {"cost": row["cost"] - 1e-3})
    return with_metadata(log, SUMMARY, best_cost=rows[-1].best_cost - 1e-3)


def lower_best(row: Row) -> Row:
    return row | {"best_cost": row["best_cost"] - 1e-3}


@pytest.mark.parametrize("name", ["via_point_ga", "coevolution", "grid_path_ga", "redundant_ga"])
def test_verify_compares_costs_that_agree_with_each_other(name: str, tmp_path: Path) -> None:
    problem = verified(cheaper(log_of(name)), tmp_path).problem
    generation = read_log(log_of(name)).solutions[-1].generation
    assert problem.startswith(f"altered: solution of generation {generation}: cost differs by ")


def beyond(row: Row) -> Row:
    row["values"][0] = 1e300
    return row


SEEN: dict[str, tuple[Forgery, str]] = {
    "verdict": (
        lambda log: with_metadata(log, SUMMARY, certified=None),
        "altered: motion of the last solution: certified was ",
    ),
    "clearance": (
        lambda log: with_metadata(log, SUMMARY, clearance=0.125),
        "altered: motion of the last solution: clearance differs by ",
    ),
    "term": (
        lambda log: with_metadata(log, SUMMARY, term_fitness=1.0),
        "altered: last solution: fitness differs by ",
    ),
    "cost of a solution": (
        lambda log: with_message(log, "/solution", lambda row: ulp(row, "cost"), 0),
        "altered: solution of generation 0: cost differs by ",
    ),
    "a hidden improvement": (
        lambda log: with_message(log, "/solution", lambda row: None, 1),
        "altered: no solution of generation ",
    ),
    "another generation": (
        lambda log: with_message(log, "/solution", lambda row: row | {"generation": 99}, 1),
        "altered: no solution of generation ",
    ),
    "another size": (
        lambda log: with_message(log, "/solution", lambda row: row | {"values": [0.5]}),
        "altered: solution of generation 4 was 'there', is 'none: ",
    ),
    "numbers of no motion": (
        lambda log: with_message(log, "/solution", beyond),
        "altered: solution of generation 4 was 'there', is 'none: its numbers must be finite",
    ),
}


@pytest.mark.parametrize("what", SEEN)
def test_verify_compares_all_that_a_solution_shows(what: str, tmp_path: Path) -> None:
    forge, expected = SEEN[what]
    assert verified(forge(log_of("via_point_ga")), tmp_path).problem.startswith(expected)


def test_what_cannot_be_evaluated_here_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = log_of("via_point_ga")
    planner: Any = type(stored_condition(tmp_path, read_log(content)).planner)
    monkeypatch.setattr(planner, "revision", planner.revision + 1)
    found = verified(content, tmp_path)
    assert found.problem == ""
    assert "revision" in found.unevaluated and str(tmp_path) not in found.unevaluated
