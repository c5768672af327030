"""`evoexp verify`: a whole store is found whole, and every damage of it is found."""

import errno
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from command_samples import SERIAL, Evoexp, content

from evoexp.batch.replicate import run_replicate
from evoexp.commands import verify
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.planners.via_point_ga.planner import ViaPointGa
from evoexp.store import log as log_module
from evoexp.store import run_directory
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from forged_logs import Row, with_message

PLANAR = ("experiment=rana_planar", *SERIAL)


@pytest.fixture
def run(stored: Path) -> RunDirectory:
    """Return the stored run of the experiment's first condition, two replicates."""
    return RunDirectory(stored, compose.expand(PLANAR)[0].conditions[0].condition.id)


def flip(path: Path) -> None:
    """Change a byte, and keep the file's size and time."""
    status, data = path.stat(), bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def cut_the_table(run: RunDirectory) -> None:
    run.summary_path.write_bytes(run.summary_path.read_bytes()[:-20])


def other(run: RunDirectory) -> Path:
    return next(path for path in run.path.parent.iterdir() if path != run.path)


def change_a_row(run: RunDirectory) -> None:
    table = pq.read_table(run.summary_path)
    at = table.schema.get_field_index("clearance")
    raised = pc.add(table["clearance"], pa.scalar(1e-9))
    pq.write_table(table.set_column(at, table.schema.field(at), raised), run.summary_path)


def change_a_setting(run: RunDirectory) -> None:
    table = pq.read_table(run.summary_path)
    at = table.schema.get_field_index("population_size")
    doubled = pc.multiply(table["population_size"], 2.0)
    pq.write_table(table.set_column(at, table.schema.field(at), doubled), run.summary_path)


def forge(run: RunDirectory) -> None:
    """Write a log whose checksums are right and whose summary is not that of its generations."""
    stored = read_log(run.log_path(1))
    encode = log_module.encode_summary
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            log_module,
            "encode_summary",
            lambda row: encode(row._replace(best_cost=row.best_cost - 1.0)),
        )
        condition = Condition.from_json(stored.config_json)
        run.log_path(1).write_bytes(run_replicate(condition, 1).content)


FAULTS: dict[str, tuple[Callable[[RunDirectory], object], str]] = {
    "a flipped byte": (lambda run: flip(run.log_path(1)), "0001.mcap: altered"),
    "an empty log": (lambda run: run.log_path(1).write_bytes(b""), "0001.mcap: empty file"),
    "a forged summary": (forge, "0001.mcap: altered: best_cost of its summary"),
    "another place": (
        lambda run: run.log_path(1).rename(run.log_path(4)),
        "0004.mcap: holds replicate 1 of",
    ),
    "another run": (
        lambda run: shutil.copy(other(run) / "replicates/0001.mcap", run.log_path(1)),
        "0001.mcap: holds replicate 1 of",
    ),
    "no configuration": (
        lambda run: (run.path / "config.json").unlink(),
        "config.json: cannot be read: No such file",
    ),
    "a foreign configuration": (
        lambda run: shutil.copy(other(run) / "config.json", run.path / "config.json"),
        "config.json: damaged: its hash",
    ),
    "an empty manifest": (
        lambda run: (run.path / "manifest.json").write_bytes(b""),
        "manifest.json: damaged: empty file",
    ),
    "a foreign manifest": (
        lambda run: shutil.copy(other(run) / "manifest.json", run.path / "manifest.json"),
        "manifest.json: is of run",
    ),
    "damaged plans": (lambda run: (run.path / "plans.json").write_text("[]"), "plans.json: dam"),
    "a damaged failure": (lambda run: run.failure_path(7).touch(), "0007.failed.json: damaged"),
    "a damaged table": (cut_the_table, "summary.parquet: damaged"),
    "a foreign table": (
        lambda run: shutil.copy(other(run) / "summary.parquet", run.summary_path),
        "summary.parquet: is of run",
    ),
    "an altered setting": (
        change_a_setting,
        "summary.parquet: altered: population_size is not the setting",
    ),
    "an altered row": (change_a_row, "summary.parquet: altered: it does not repeat 0000.mcap"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_every_damage_is_found_and_mended_by_the_command_it_names(
    evoexp: Evoexp, run: RunDirectory, stored: Path, fault: str
) -> None:
    damage, expected = FAULTS[fault]
    damage(run)
    before = content(stored)
    said = evoexp("verify")
    assert (said.code, said.err) == (1, "")
    assert f"│ {run.hash12} │" in said.out
    assert expected[:30] in said.out
    assert said.out.count("mend: evoexp run experiment=") == 1
    assert content(stored) == before, "reads only"
    problems = [
        f"{name}: {text}"
        for each in json.loads(evoexp("verify", run.hash12[:6], "--json").out)
        for name, text in each["problems"].items()
    ]
    if fault == "another place":  # leaves its own empty
        assert problems.pop(0).startswith("replicates: missing: 1 of 2 replicates")
    (problem,) = problems
    assert problem.startswith(expected)
    for words in (("list",), ("show", run.hash12), ("reproduce", run.hash12), ("view", run.hash12)):
        said = evoexp(*words)
        assert said.code in (0, 1, 2)
        assert all(line.startswith("evoexp: ") for line in said.err.splitlines()), said.err
    if problem.endswith("; delete it, then run again"):
        (run.summary_path if fault.startswith("an altered") else run.log_path(1)).unlink()
    evoexp("run", *PLANAR, "--no-report")
    assert evoexp("verify").code == 0


def test_a_whole_store(evoexp: Evoexp, run: RunDirectory, stored: Path) -> None:
    for words in ((), (run.hash12[:5],)):
        said = evoexp("verify", *words)
        assert (said.code, said.err) == (0, "")
        runs, logs = (3, 6) if not words else (1, 2)
        assert said.out == f"{runs} runs, {logs} logs: all is well\n"


def test_a_log_that_is_gone_is_missed(evoexp: Evoexp, run: RunDirectory) -> None:
    run.note_plan(3)
    said = evoexp("verify", run.hash12)
    assert said.code == 1
    text = " ".join(said.out.replace("│", " ").split())
    assert "missing: 2 of 3 replicates that were asked for (gone, or not run yet)" in text
    assert "mend: evoexp run experiment=rana_planar" in text
    run.write_failure(2, "no memory", "none")
    assert evoexp("verify", run.hash12).code == 0, "a failure is known"
    run.log_path(0).unlink()
    with run.lock():
        assert evoexp("verify", run.hash12).code == 0, "another process is writing it"
    assert "missing: 0 of 3 replicates" in " ".join(evoexp("verify").out.split())


def test_a_replaced_solution_is_named(evoexp: Evoexp, run: RunDirectory) -> None:
    log = run.log_path(1)
    log.write_bytes(with_message(log.read_bytes(), "/solution", moved))
    said = evoexp("verify", run.hash12, "--json")
    (checked,) = json.loads(said.out)
    assert said.code == 1 and checked["unevaluated"] == ""
    assert checked["problems"]["0001.mcap"].startswith("altered: solution of generation ")
    assert checked["problems"]["0001.mcap"].endswith("; delete it, then run again")
    said = evoexp("reproduce", run.hash12)
    assert said.code == 1 and "values differs by" in " ".join(said.out.split())


def moved(row: Row) -> Row:
    row["values"][3] += 1e-3
    return row


def test_solutions_of_other_revisions_are_not_evaluated_and_no_damage(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ViaPointGa, "revision", ViaPointGa.revision + 1)
    said = evoexp("verify", run.hash12)
    assert said.code == 0
    assert f"run {run.hash12}: its solutions were not evaluated: " in said.out
    assert "was revision" in said.out and "all is well" in said.out


def test_leftovers_are_named_and_no_damage(evoexp: Evoexp, run: RunDirectory) -> None:
    (run.replicates / ".0001.mcap.77.tmp").write_bytes(b"half")
    (run.replicates / "0001.mcap.damaged.2").write_bytes(b"old")
    (run.path / "notes.txt").write_text("mine")
    said = evoexp("verify")
    assert said.code == 0
    assert said.out.splitlines() == [
        f"no part of run {run.hash12}: notes.txt (unknown), "
        "replicates/.0001.mcap.77.tmp (temporary), "
        "replicates/0001.mcap.damaged.2 (set aside earlier)",
        "3 runs, 6 logs: all is well",
    ]


def test_a_run_that_nothing_knows(evoexp: Evoexp, run: RunDirectory) -> None:
    for path in (run.path / "config.json", run.path / "manifest.json", *run.replicates.iterdir()):
        path.write_bytes(b"")
    for words in ((), (run.hash12,)):
        said = evoexp("verify", *words)
        assert said.code == 1
        assert "neither a log nor the manifest" in " ".join(said.out.replace("│", " ").split())


def test_large_stores_are_checked_by_workers(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verify, "LARGE", 1)
    monkeypatch.setattr(verify, "PART", 1)
    flip(run.log_path(1))
    said = evoexp("verify", "--json")
    assert said.code == 1
    found = {each["hash"]: each["problems"] for each in json.loads(said.out)}
    assert [len(problems) for problems in found.values()].count(0) == 2
    assert found[run.hash12]["0001.mcap"].startswith("altered")


def test_an_empty_store_and_unknown_hashes(
    evoexp: Evoexp, refused: Callable[..., str], outputs: Path
) -> None:
    assert evoexp("verify").out == "0 runs, 0 logs: all is well\n"
    assert not outputs.exists()
    assert "no run 'abcabcabcabc' among the 0" in refused("verify", "abcabcabcabc")


def test_a_directory_that_may_not_be_read_hides_no_other(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As root reads everything, the refusal is played."""
    known, listed = run_directory.stored_id, Path.iterdir

    def forbidden(path: Path) -> Path:
        if path == run.path:
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return path

    monkeypatch.setattr(run_directory, "stored_id", lambda path: known(forbidden(path)))
    monkeypatch.setattr(Path, "iterdir", lambda path: listed(forbidden(path)))
    said = evoexp("verify", "--json")
    assert said.code == 1
    found = {each["hash"]: each for each in json.loads(said.out)}
    text = f"{run.path}: Permission denied; change its permissions"
    assert found.pop(run.hash12)["problems"] == {"cannot be read": text}
    assert [each["problems"] for each in found.values()] == [{}, {}]
    rows = json.loads(evoexp("list", "--json").out)["runs"]
    damage = {row["hash"][:12]: row["damage"] for row in rows}
    assert damage.pop(run.hash12) == f"{run.path}: cannot be read: Permission denied"
    assert list(damage.values()) == [None, None]
    said = evoexp("reproduce", run.hash12)
    assert (said.code, said.out) == (2, "")
