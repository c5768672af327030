"""`reproduce` compares everything that a summary says but times, and says to how many digits."""

import math
from pathlib import Path
from typing import Any

import pytest

from composed import composed
from evoexp.batch.replicate import EXACT_BOXES, run_replicate
from evoexp.batch.reproduction import ELSEWHERE, OLDER, compare
from evoexp.cli import main
from evoexp.records import TIMES, ReplicateSummary
from evoexp.store import log as log_module
from evoexp.store.log_reader import LogContents, read_log

# the search itself, and what names the replicate
NAMED = {"condition", "replicate", "digest", "terms"}
FIELDS = [name for name in ReplicateSummary._fields if name not in {*TIMES, *NAMED}]
WORDS = ["experiment=chen_path", "budget=smoke"]  # boxes, whose exact distance is no whole number


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a small log of a motion among boxes."""
    condition = composed(*WORDS)
    path = tmp_path_factory.mktemp("logs") / "0000.mcap"
    path.write_bytes(run_replicate(condition, 0).content)
    return path


@pytest.fixture(scope="module")
def log(path: Path) -> LogContents:
    return read_log(path)


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
    found = compare(changed(log, terms=terms), log)
    assert not found.matches
    assert f"term_{name} differs by " in found.verdict
    fewer = {key: term for key, term in log.summary.terms.items() if key != name}
    assert f"term_{name} was None" in compare(changed(log, terms=fewer), log).verdict


def test_generations_are_compared(log: LogContents) -> None:
    rows = list(log.generations)
    rows[3] = rows[3]._replace(mean_cost=rows[3].mean_cost + 1e-12)
    found = compare(log._replace(generations=rows), log)
    assert not found.matches
    assert "generation 3: mean_cost differs by " in found.verdict
    assert compare(elsewhere(log)._replace(generations=rows), log).matches


@pytest.mark.parametrize(("make", "why"), [(older, OLDER), (elsewhere, ELSEWHERE)])
def test_where_bits_may_differ_numbers_are_compared_and_it_is_said(
    log: LogContents, make: Any, why: str
) -> None:
    near, far = log.summary.clearance + 3e-10, log.summary.clearance + 3e-9
    found = compare(make(changed(log, clearance=near)), log)
    assert found.matches
    assert found.verdict == (
        f"MATCH in the search, to 1e-09 in the rest: clearance differs by 3.0e-10 ({why})"
    )
    found = compare(make(changed(log, clearance=far)), log)
    assert not found.matches
    assert found.verdict == (
        f"MATCH in the search; DIVERGES in the rest: clearance differs by 3.0e-09 ({why})"
    )
    for fields in ({"certified": None}, {"solved": not log.summary.solved}, {"evaluations": 1}):
        found = compare(make(changed(log, **fields)), log)
        assert not found.matches, "what is no number agrees or does not"
        assert f"DIVERGES in the rest: {next(iter(fields))} was" in found.verdict
    found = compare(make(changed(log, clearance_at=0.25, clearance=near)), log)
    assert found.matches, "of two places equally close, rounding chooses"
    assert found.verdict.endswith(f"clearance differs by 3.0e-10, and 1 more field ({why})")


def test_the_command_names_the_field(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    condition = composed(*WORDS)
    encode = log_module.encode_summary
    with monkeypatch.context() as patch:
        patch.setattr(
            log_module,
            "encode_summary",
            lambda row: encode(row._replace(clearance=row.clearance + 3e-10)),
        )
        (tmp_path / "other.mcap").write_bytes(run_replicate(condition, 0).content)
    monkeypatch.setenv("COLUMNS", "200")
    assert main(["reproduce", str(tmp_path / "other.mcap")]) == 1
    said = capsys.readouterr().out
    assert "MATCH in the search; DIVERGES in the rest: clearance differs by 3.0e-10" in said
    assert "0 of 1 MATCH" in said
    assert main(["reproduce", str(path)]) == 0
