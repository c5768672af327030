"""`evoexp verify` finds every damage; other commands go on without it, and `run` mends it."""

import errno
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from command_samples import SERIAL, Evoexp, content

import evoexp as package
from evoexp.commands import store_care
from evoexp.errors import DamagedStore
from evoexp.planners.via_point_ga.planner import ViaPointGa
from evoexp.store import identity
from evoexp.store.log import SUMMARY
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from forged_logs import Row, with_message, with_metadata

PLANAR = ("experiment=rana_planar", *SERIAL)
Damage = Callable[[RunDirectory], object]


def flip(path: Path) -> None:
    """Change a byte, and keep the file's size and time."""
    status, data = path.stat(), bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def other(run: RunDirectory) -> Path:
    return next(path for path in run.path.parent.iterdir() if path != run.path)


def change(name: str) -> Damage:
    """Return what makes the numbers of a column a little larger."""

    def raised(run: RunDirectory) -> None:
        table = pq.read_table(run.summary_path)
        at = table.schema.get_field_index(name)
        column = pc.add(table[name], 1e-9)
        pq.write_table(table.set_column(at, table.schema.field(at), column), run.summary_path)

    return raised


def forge(run: RunDirectory) -> None:
    """Write a log whose checksums are right and whose summary is not that of its generations."""
    log = run.log_path(1)
    log.write_bytes(with_metadata(log.read_bytes(), SUMMARY, best_cost=-1.0))


def copy(name: str) -> Damage:
    return lambda run: shutil.copy(other(run) / name, run.path / name)


def write(name: str, content: bytes) -> Damage:
    return lambda run: (run.path / name).write_bytes(content)


FAULTS: dict[str, tuple[Damage, str]] = {
    "a flipped byte": (lambda run: flip(run.log_path(1)), "0001.mcap: altered"),
    "an empty log": (write("replicates/0001.mcap", b""), "0001.mcap: empty file"),
    "a forged summary": (forge, "0001.mcap: altered: best_cost of its summary"),
    "another place": (lambda run: run.log_path(1).rename(run.log_path(4)), "0004.mcap: holds re"),
    "another run": (copy("replicates/0001.mcap"), "0001.mcap: holds replicate 1 of"),
    "no configuration": (lambda run: (run.path / "config.json").unlink(), "config.json: cannot be"),
    "a foreign configuration": (copy("config.json"), "config.json: damaged: its hash"),
    "an empty manifest": (write("manifest.json", b""), "manifest.json: damaged: empty file"),
    "a foreign manifest": (copy("manifest.json"), "manifest.json: is of run"),
    "damaged plans": (write("plans.json", b"[]"), "plans.json: damaged"),
    "a damaged failure": (write("replicates/0007.failed.json", b""), "0007.failed.json: damaged"),
    "a damaged table": (lambda run: os.truncate(run.summary_path, 99), "summary.parquet: damaged"),
    "a foreign table": (copy("summary.parquet"), "summary.parquet: is of run"),
    "an altered setting": (change("population_size"), "summary.parquet: altered: population_size"),
    "an altered row": (change("clearance"), "summary.parquet: altered: it does not repeat 0000"),
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
    assert f"│ {run.hash12} │" in said.out and expected[:30] in said.out
    assert said.out.count("mend: evoexp run experiment=") == 1
    (checked,) = json.loads(evoexp("verify", run.hash12[:6], "--json").out)
    assert content(stored) == before, "reads only"
    problems = [f"{name}: {text}" for name, text in checked["problems"].items()]
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


def test_a_whole_store_and_none(
    evoexp: Evoexp, run: RunDirectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert evoexp("verify") == (0, "3 runs, 6 logs: all is well\n", "")
    assert evoexp("verify", run.hash12[:5]) == (0, "1 runs, 2 logs: all is well\n", "")
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "none"))
    assert evoexp("verify").out == "0 runs, 0 logs: all is well\n"
    assert not (tmp_path / "none").exists()


def test_a_log_that_is_gone_is_missed(evoexp: Evoexp, run: RunDirectory) -> None:
    run.note_plan(3)
    said = evoexp("verify", run.hash12)
    assert said.code == 1
    assert "missing: 2 of 3 replicates that were asked for (gone, or not run yet)" in said.text
    assert "mend: evoexp run experiment=rana_planar" in said.text
    run.write_failure(2, "no memory", "none")
    assert evoexp("verify", run.hash12).code == 0, "a failure is known"
    run.log_path(0).unlink()
    with run.lock():
        assert evoexp("verify", run.hash12).code == 0, "another process is writing it"
    assert "missing: 0 of 3 replicates" in evoexp("verify").text


def test_a_replaced_solution_is_named(evoexp: Evoexp, run: RunDirectory) -> None:
    def turned(row: Row) -> Row:
        return row | {"values": row["values"][::-1]}

    log = run.log_path(1)
    log.write_bytes(with_message(log.read_bytes(), "/solution", turned))
    said = evoexp("verify", run.hash12, "--json")
    (checked,) = json.loads(said.out)
    assert said.code == 1 and checked["unevaluated"] == ""
    assert checked["problems"]["0001.mcap"].startswith("altered: solution of generation ")
    said = evoexp("reproduce", run.hash12)
    assert said.code == 1 and "values differs by" in said.text


def test_solutions_of_other_revisions_are_not_evaluated_and_no_damage(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ViaPointGa, "revision", ViaPointGa.revision + 1)
    said = evoexp("verify", run.hash12)
    assert said.code == 0 and "all is well" in said.out
    assert f"run {run.hash12}: its solutions were not evaluated: " in said.out
    assert "was revision" in said.out


def test_leftovers_are_named_and_no_damage(evoexp: Evoexp, run: RunDirectory) -> None:
    (run.replicates / ".0001.mcap.77.tmp").write_bytes(b"half")
    (run.replicates / "0001.mcap.damaged.2").write_bytes(b"old")
    (run.path / "notes.txt").write_text("mine")
    said = evoexp("verify")
    assert said.code == 0
    assert said.out.splitlines() == [
        f"not part of run {run.hash12}: notes.txt (unknown), "
        "replicates/.0001.mcap.77.tmp (temporary), "
        "replicates/0001.mcap.damaged.2 (set aside earlier)",
        "3 runs, 6 logs: all is well",
    ]


def test_a_run_that_nothing_knows(evoexp: Evoexp, run: RunDirectory) -> None:
    for path in (run.path / "config.json", run.path / "manifest.json", *run.replicates.iterdir()):
        path.write_bytes(b"")
    said = evoexp("verify")
    assert said.code == 1
    assert "neither a log nor the manifest" in said.text
    assert "config.json: " in evoexp("reproduce", run.hash12).err


def test_large_stores_are_checked_by_workers(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_care, "LARGE", 1)
    flip(run.log_path(1))
    said = evoexp("verify", "--json")
    assert said.code == 1
    found = {each["hash"]: each["problems"] for each in json.loads(said.out)}
    assert [len(problems) for problems in found.values()].count(0) == 2
    assert found[run.hash12]["0001.mcap"].startswith("altered")


def test_a_directory_that_may_not_be_read_hides_no_other(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As root reads everything, the refusal is played."""
    known, listed = identity.stored_id, Path.iterdir

    def forbidden(path: Path) -> Path:
        if path == run.path:
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return path

    monkeypatch.setattr(identity, "stored_id", lambda path: known(forbidden(path)))
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


def test_a_damaged_log_stops_no_command_and_is_run_again(
    evoexp: Evoexp, run: RunDirectory, stored: Path
) -> None:
    whole = run.log_path(1).read_bytes()
    run.log_path(1).write_bytes(whole[:-10])
    left_out = f"evoexp: run {run.hash12}: left out, damaged: 0001.mcap (cut or overwritten: "
    for words in ("list", f"show {run.hash12}", f"view {run.hash12}", f"export {run.hash12}"):
        said = evoexp(*words.split())
        (line,) = said.err.splitlines()
        assert said.code == 0 and line.startswith(left_out)
        assert line.endswith(f"; run again by: evoexp run {' '.join(PLANAR)}")
    assert evoexp("report", *PLANAR).err.startswith(left_out)
    (page,) = stored.glob("reports/*/index.md")
    said_there = "> **Damaged logs.** via-point GA: 1 (0001.mcap) could not be read"
    assert said_there in page.read_text()
    assert "via-point GA: 1 of 2 replicates done" in page.read_text()
    said = evoexp("reproduce", run.hash12)
    assert said.code == 1 and "damaged: cut or overwritten" in said.out
    assert "1 of 2 MATCH, 1 damaged" in said.out

    said = evoexp("run", *PLANAR, "--no-report")
    (line,) = said.err.splitlines()
    assert line.startswith(f"evoexp: run {run.hash12}: damaged, and run again: 0001.mcap (cut")
    assert line.endswith("; kept as 0001.mcap.damaged")
    assert said.code == 0 and "replicates: 1 of 1 done" in said.out
    assert (run.replicates / "0001.mcap.damaged").read_bytes() == whole[:-10]
    assert read_log(run.log_path(1)).summary.digest == read_log(whole).summary.digest
    said = evoexp("run", *PLANAR, "--no-report")
    assert (said.code, said.err, "nothing to run" in said.out) == (0, "", True)


def test_load_warns(run: RunDirectory) -> None:
    run.log_path(0).write_bytes(b"")
    with pytest.warns(DamagedStore, match="0000.mcap .empty"):
        frames = package.load(run.hash12)
    assert frames.summaries["replicate"].tolist() == [1]
    assert frames.generations["replicate"].unique().tolist() == [1]


def test_a_damaged_log_that_was_never_asked_for_is_set_aside_alone(
    evoexp: Evoexp, run: RunDirectory
) -> None:
    """Two replicates were asked for: 0 and 1."""
    shutil.copy(run.log_path(1), run.log_path(3))
    run.log_path(2).write_bytes(b"")
    said = evoexp("run", *PLANAR, "--no-report")
    assert said.code == 0 and "nothing to run" in said.out
    (line,) = said.err.splitlines()
    assert f"run {run.hash12}: damaged, and set aside: never asked for: 0002.mcap" in line
    assert run.completed() == {0, 1}
    aside = {path.name for path in run.replicates.glob("*.damaged")}
    assert aside == {"0002.mcap.damaged", "0003.mcap.damaged"}
    assert evoexp("verify", run.hash12).code == 0


def test_a_run_without_its_configuration_is_not_answered_from_the_shipped_table(
    evoexp: Evoexp, outputs: Path
) -> None:
    words = ("experiment=rana_planar", "budget=smoke", "--only", "via-point GA", "runner=serial")
    assert evoexp("run", *words, "--no-report").code == 0
    (path,) = (outputs / "runs").iterdir()
    (path / "config.json").unlink()
    said = evoexp("reproduce", path.name[:6])
    assert said.code == 0 and "2 of 2 MATCH" in said.out and "shipped" not in said.out
    shutil.rmtree(path)
    assert "against the shipped table" in evoexp("reproduce", path.name[:6]).out
