"""Damaged files of a store: left out by readers, set aside by the writer, never deleted."""

import hashlib
import json
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from store_samples import CONDITION, CONFIG, ENVIRONMENT, generations, summary, write

from evoexp import attachments
from evoexp.errors import DamagedStore, StoreError, UnknownHash
from evoexp.records import Block
from evoexp.store import log as log_module
from evoexp.store import log_reader
from evoexp.store.files import is_set_aside, set_aside, write_files
from evoexp.store.integrity import lost_replicates, mend
from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory, resolve
from evoexp.store.summaries import damaged_logs, summary_table, whole_logs
from store_lookup import find_runs

Add = Callable[..., Finished]


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-10])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


def become_a_directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


def become_a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def become_unreadable(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.name)  # a loop: even root cannot read it


def lead_nowhere(path: Path) -> None:
    path.unlink()
    path.symlink_to("nowhere")


def be_of_another_replicate(path: Path) -> None:
    path.write_bytes(write(generations(6), 9).content)


def be_of_another_run(path: Path) -> None:
    other = hashlib.sha256(b"other").hexdigest()
    log = log_module.Log(other, b"other", 1, np.random.default_rng(0))
    log.write(Block.of(generations(1)[0]))
    path.write_bytes(log.finish(summary(1, condition=other)).content)


FAULTS = {
    cut: "cut",
    empty: "empty file",
    flip: "altered",
    become_a_directory: "cannot be read: Is a directory",
    become_a_pipe: "cannot be read: no regular file",
    become_unreadable: "cannot be read",
    lead_nowhere: "cannot be read: No such file",
    be_of_another_replicate: "holds replicate 9",
    be_of_another_run: "holds replicate 1 of",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_damaged_log_is_left_out_and_set_aside(
    run: RunDirectory, add: Add, fault: Callable[[Path], None]
) -> None:
    for replicate in (0, 1, 2):
        add(replicate)
    run.note_plan(3)
    summary_table(run)
    fault(run.log_path(1))
    with pytest.warns(DamagedStore, match=f"left out, damaged: 0001.mcap .{FAULTS[fault]}"):
        assert summary_table(run)["replicate"].to_pylist() == [0, 2]
    assert (whole_logs(run), lost_replicates(run)) == ({0, 2}, {1})
    with run.lock(), pytest.warns(DamagedStore, match="and run again: 0001.mcap") as said:
        mend(run, CONFIG, range(3))
    assert len(said) == 1
    assert "kept as 0001.mcap.damaged" in str(said[0].message)
    assert os.path.lexists(run.replicates / "0001.mcap.damaged")
    assert run.completed() == {0, 2}
    assert not damaged_logs(run)


def test_nothing_that_was_set_aside_is_overwritten(tmp_path: Path) -> None:
    path, names = tmp_path / "0001.mcap", []
    for content in ("first", "second", "third"):
        path.write_text(content)
        names.append(set_aside(path).name)
    assert names == ["0001.mcap.damaged", "0001.mcap.damaged.2", "0001.mcap.damaged.3"]
    assert [(tmp_path / name).read_text() for name in names] == ["first", "second", "third"]
    assert all(map(is_set_aside, names))
    assert not any(map(is_set_aside, ("0001.mcap", ".damaged", "0001.mcap.damaged.tmp")))


def test_damage_that_keeps_size_and_time_is_seen_by_who_reads_the_logs(
    run: RunDirectory, add: Add
) -> None:
    for replicate in (0, 1):
        add(replicate)
    assert summary_table(run).num_rows == 2
    status = run.log_path(1).stat()
    flip(run.log_path(1))
    os.utime(run.log_path(1), ns=(status.st_atime_ns, status.st_mtime_ns))
    assert summary_table(run).num_rows == 2
    with pytest.warns(DamagedStore, match="0001.mcap .altered"):
        assert summary_table(run, thorough=True).num_rows == 1
    assert whole_logs(run) == {0}, "and by everybody from then on"


def test_logs_that_are_noted_are_not_read_again(
    run: RunDirectory, add: Add, monkeypatch: pytest.MonkeyPatch
) -> None:
    for replicate in range(4):
        add(replicate)
    empty(run.log_path(3))
    with pytest.warns(DamagedStore):
        summary_table(run)
    names: list[str] = []
    read = log_reader.read_summary
    monkeypatch.setattr(
        log_reader, "read_summary", lambda path: names.append(path.name) or read(path)
    )  # type: ignore[func-returns-value]
    assert whole_logs(run) == {0, 1, 2}
    assert set(names) == {"0003.mcap"}, "the damaged one alone: it may have been repaired"
    add(3)
    assert whole_logs(run) == {0, 1, 2, 3}


def test_a_log_of_another_version_is_left_out_and_left_alone(
    run: RunDirectory, add: Add, monkeypatch: pytest.MonkeyPatch
) -> None:
    add(0)
    monkeypatch.setattr(log_module, "SCHEMA_VERSION", 99)
    add(1)
    monkeypatch.undo()
    with pytest.warns(DamagedStore, match="written by a newer evoexp"):
        assert summary_table(run).num_rows == 1
    with run.lock(), pytest.raises(StoreError, match="0001.mcap: written by a newer evoexp"):
        mend(run, CONFIG, range(3))
    assert run.log_path(1).exists()


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"reason": 1}'])
def test_a_damaged_failure_stays_a_failure(run: RunDirectory, add: Add, content: bytes) -> None:
    add(0)
    run.write_failure(1, "x", "y")
    run.failure_path(1).write_bytes(content)
    with pytest.warns(DamagedStore, match="0001.failed.json"):
        rows = summary_table(run).to_pylist()
    assert [row["status"] for row in rows] == ["done", "failed"]
    assert rows[1]["stop_reason"].startswith("unknown: 0001.failed.json: damaged")
    with run.lock(), pytest.warns(DamagedStore, match=r"0001\.failed\.json\.damaged"):
        mend(run, CONFIG, range(3))
    assert run.failed() == set()


def test_a_directory_or_a_pipe_for_a_table(run: RunDirectory, add: Add) -> None:
    add(0)
    for replace in (become_a_directory, become_a_pipe):
        summary_table(run)
        replace(run.summary_path)
        assert summary_table(run).num_rows == 1
        assert run.summary_path.is_file()
    assert (run.path / "summary.parquet.damaged").is_dir()


def test_the_table_of_another_run_is_not_taken(run: RunDirectory, add: Add, tmp_path: Path) -> None:
    add(0)
    summary_table(run)
    other = RunDirectory(tmp_path, hashlib.sha256(b"other").hexdigest())
    other.create(b"other", {})
    other.summary_path.write_bytes(run.summary_path.read_bytes())
    assert summary_table(other).num_rows == 0


# Configuration and manifest


@pytest.mark.parametrize("fault", [Path.unlink, empty, flip, become_a_directory])
def test_a_lost_file_of_the_configuration_is_taken_from_a_log(
    tmp_path: Path, fault: Callable[[Path], object]
) -> None:
    content = b"<robot/>"
    sha256 = hashlib.sha256(content).hexdigest()
    config = json.dumps({"robot": {"path": {"sha256": sha256}}}).encode()
    run, files = (
        RunDirectory(tmp_path, hashlib.sha256(config).hexdigest()),
        {f"files/{sha256}": content},
    )
    run.create(config, {}, files)
    path = run.path / "files" / sha256
    log = log_module.Log(run.condition_id, config, 0, np.random.default_rng(0), files)
    log.write(Block.of(generations(1)[0]))
    row = summary(0, condition=run.condition_id)
    run.write_logs({0: log.finish(row).content})
    assert run.config_json() == config
    fault(path)
    attachments._contents.pop(sha256)
    with pytest.warns(DamagedStore, match=f"files/{sha256}: .*; taken from 0000.mcap"):
        assert run.config_json() == config
    assert attachments.File(sha256=sha256).content == content
    assert list(run.damaged_files()) == [f"files/{sha256}"]
    with run.lock(), pytest.warns(DamagedStore, match="written again"):
        mend(run, config, range(3))
    run.create(config, {}, files)
    assert path.read_bytes() == content
    assert not run.damaged_files()


def test_a_configuration_names_no_file_elsewhere(tmp_path: Path) -> None:
    config = b'{"robot": {"path": {"sha256": "../config.json"}}}'
    run = RunDirectory(tmp_path, hashlib.sha256(config).hexdigest())
    run.create(config, {})
    assert not run.damaged_files()


@pytest.mark.parametrize("content", [None, b"", b"{}", b"[", b"\xff\xfe"])
def test_a_lost_configuration_is_taken_from_a_log(
    run: RunDirectory, add: Add, tmp_path: Path, content: bytes | None
) -> None:
    empty(run.log_path(0))
    add(1)
    (run.path / "config.json").unlink()
    if content is not None:
        (run.path / "config.json").write_bytes(content)
    (run.path / "manifest.json").unlink()
    assert resolve(tmp_path, run.hash12[:4]).condition_id == CONDITION
    assert [each.condition_id for each in find_runs(tmp_path)] == [CONDITION]
    with pytest.warns(DamagedStore, match=r"config\.json: .*; taken from 0001\.mcap"):
        assert run.config_json() == CONFIG
    with pytest.warns(DamagedStore, match=r"manifest\.json: .*; taken from 0001\.mcap"):
        manifest = run.manifest()
    expected = {"condition": CONDITION, **ENVIRONMENT}
    assert manifest == expected | {"git": None, "restored_from": "0001.mcap"}
    assert set(run.damaged_files(CONFIG)) == {"config.json", "manifest.json"}
    with (
        run.lock(),
        pytest.warns(DamagedStore, match="and written again: config.json"),
        pytest.warns(DamagedStore, match="and run again: 0000.mcap"),
    ):
        mend(run, CONFIG, range(3))
    run.create(CONFIG, manifest)
    assert not run.damaged_files(CONFIG)
    assert (run.config_json(), run.manifest()) == (CONFIG, manifest)
    aside = run.path / "config.json.damaged"
    assert aside.exists() == (content is not None)


def test_a_manifest_of_another_run_is_foreign(run: RunDirectory, add: Add) -> None:
    add(0)
    (run.path / "manifest.json").write_text(json.dumps({"condition": "f" * 64}))
    with pytest.warns(DamagedStore, match="is of run ffffffffffff"):
        assert run.manifest()["restored_from"] == "0000.mcap"


def test_the_manifest_alone_knows_the_name(run: RunDirectory, tmp_path: Path) -> None:
    (run.path / "config.json").unlink()
    assert resolve(tmp_path, run.hash12).condition_id == CONDITION
    (run.path / "manifest.json").write_text("{}")
    with pytest.raises(StoreError, match="neither a log nor the manifest"):
        resolve(tmp_path, run.hash12)
    (run.path / "manifest.json").unlink()
    with pytest.raises(UnknownHash):
        resolve(tmp_path, run.hash12)  # nothing of a run is there


def test_a_damaged_run_hides_no_other(run: RunDirectory, tmp_path: Path) -> None:
    other = RunDirectory(tmp_path, hashlib.sha256(b"other").hexdigest())
    other.create(b"other", {})
    (run.path / "config.json").write_bytes(b"")
    (run.path / "manifest.json").write_bytes(b"")
    assert [each.path for each in find_runs(tmp_path)] == [other.path]
    assert resolve(tmp_path, other.hash12).path == other.path


@pytest.mark.parametrize("content", ["", "{", '{"plans": 1}', '{"plans": [{"n": 1}]}'])
def test_damaged_plans_are_set_aside(run: RunDirectory, content: str) -> None:
    (run.path / "plans.json").write_text(content)
    with run.lock(), pytest.warns(DamagedStore, match="plans.json"):
        mend(run, CONFIG, range(3))
    run.note_plan(3)
    assert run.plans()[0].num_replicates == 3


def test_a_file_for_the_directory_of_the_logs(run: RunDirectory) -> None:
    run.replicates.rmdir()
    run.replicates.touch()
    assert (run.completed(), summary_table(run).num_rows) == (set(), 0)
    with run.lock(), pytest.warns(DamagedStore, match="replicates .damaged: not a directory"):
        mend(run, CONFIG, range(3))
    run.create(CONFIG, {})
    assert run.replicates.is_dir()


def test_stray_files_are_no_logs(run: RunDirectory, add: Add) -> None:
    add(1)
    for name in ("00001.mcap", "1.mcap", "notes.txt", "0001.mcap.damaged", "١٢٣٤.mcap", "x.mcap"):
        (run.replicates / name).write_bytes(b"")
    (run.replicates / "folder").mkdir()
    assert run.completed() == {1}
    assert summary_table(run).num_rows == 1


def test_an_interrupted_writer_leaves_no_temporary_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its threads are in the middle of their files when the signal arrives."""
    others, begun, interrupted = set(threading.enumerate()), threading.Event(), threading.Event()

    def slow_sync(descriptor: int) -> None:
        begun.set()
        interrupted.wait()

    def interrupt() -> None:
        begun.wait()
        os.kill(os.getpid(), signal.SIGINT)
        interrupted.set()

    monkeypatch.setattr(os, "fsync", slow_sync)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Thread(target=interrupt).start()
        with pytest.raises(KeyboardInterrupt):
            write_files({tmp_path / f"{number}.mcap": b"log" for number in range(100)})
    finally:
        signal.signal(signal.SIGINT, before)
    while set(threading.enumerate()) - others:  # those of its files
        pass
    assert list(tmp_path.iterdir()) == []
