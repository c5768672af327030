"""Damaged files of a store: left out by readers, set aside by the writer, never deleted."""

import functools
import hashlib
import json
import os
import signal
import threading
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest
from store_samples import CONDITION, CONFIG, ENVIRONMENT, SUMMARY, generations, write

from evoexp import attachments
from evoexp.batch.runner import manifest_of
from evoexp.commands.chosen_motions import chosen_log
from evoexp.errors import DamagedStore, NothingStored, StoreError, UnknownHash
from evoexp.records import Block
from evoexp.store import log as log_module
from evoexp.store.files import is_set_aside, set_aside, write_files
from evoexp.store.integrity import lost_replicates, mend
from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory, resolve
from evoexp.store.summaries import damaged_logs, summary_table, whole_logs
from store_lookup import find_runs

Add = Callable[..., Finished]
Fault = Callable[[Path], object]
OTHER = b"other"


def log_of(config: bytes, replicate: int, files: dict[str, bytes] | None = None) -> bytes:
    """Return a log of one generation."""
    condition = hashlib.sha256(config).hexdigest()
    log = log_module.Log(condition, config, replicate, np.random.default_rng(0), files or {})
    log.write(Block.of(generations(1)[0]))
    return log.finish(SUMMARY._replace(replicate=replicate, condition=condition)).content


def empty(path: Path) -> None:
    path.write_bytes(b"")


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


def replaced_by(make: Fault) -> Fault:
    return lambda path: (path.unlink(), make(path))


directory, pipe = replaced_by(Path.mkdir), replaced_by(os.mkfifo)
loop = replaced_by(lambda path: path.symlink_to(path.name))  # even root cannot read it
FAULTS: list[tuple[Fault, str]] = [
    (lambda path: path.write_bytes(path.read_bytes()[:-10]), "cut"),
    (empty, "empty file"),
    (flip, "altered"),
    (directory, "cannot be read: Is a directory"),
    (pipe, "cannot be read: not a regular file"),
    (loop, "cannot be read"),
    (replaced_by(lambda path: path.symlink_to("nowhere")), "cannot be read: No such file"),
    (lambda path: path.write_bytes(write(generations(6), 9).content), "holds replicate 9"),
    (lambda path: path.write_bytes(log_of(OTHER, 1)), "holds replicate 1 of"),
]


def mended(run: RunDirectory, *told: str, again: Iterable[int] = range(3)) -> None:
    """Mend a run, and have this told."""
    with run.lock(), pytest.warns(DamagedStore) as warned:
        mend(run, CONFIG, set(again))
    assert len(warned) == len(told)
    assert all(text in str(each.message) for text, each in zip(told, warned, strict=True))


@pytest.mark.parametrize(("fault", "reason"), FAULTS, ids=[reason for _, reason in FAULTS])
def test_a_damaged_log_is_left_out_and_set_aside(
    run: RunDirectory, add: Add, fault: Fault, reason: str
) -> None:
    for replicate in (0, 1, 2):
        add(replicate)
    run.note_plan(3)
    summary_table(run)
    fault(run.log_path(1))
    with pytest.warns(DamagedStore, match=f"left out, damaged: 0001.mcap .{reason}"):
        assert summary_table(run)["replicate"].to_pylist() == [0, 2]
    assert (whole_logs(run), lost_replicates(run)) == ({0, 2}, {1})
    mended(run, "and run again: 0001.mcap")
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
    mended(run, "0001.failed.json.damaged")
    assert run.failed() == set()


def test_the_best_worst_and_refuted_replicates_are_chosen_of_whole_logs(
    run: RunDirectory, add: Add
) -> None:
    with pytest.raises(NothingStored, match="no finished replicate among 0"):
        chosen_log(run, "best")
    add(0, best_cost=3.0, certified=True)
    add(1, best_cost=float("inf"), certified=None)
    with pytest.raises(NothingStored, match="no refuted replicate among 2"):
        chosen_log(run, "refuted")
    add(2, best_cost=1.0, certified=False)
    add(3, best_cost=5.0, certified=False)
    run.write_failure(9, "ValueError: no", "Traceback")
    choices = {"best": 2, "worst": 3, "refuted": 2, 1: 1}
    assert {choice: int(chosen_log(run, choice).stem) for choice in choices} == choices
    run.failure_path(9).write_text("{")
    flip(run.log_path(2))
    with pytest.warns(DamagedStore, match=r"damaged: 0002\.mcap") as warned:
        assert chosen_log(run, "best").name == "0000.mcap"
    assert any("0009.failed.json" in str(each.message) for each in warned)


# Configuration and manifest


@pytest.mark.parametrize("fault", [Path.unlink, empty, flip, directory])
def test_a_lost_file_of_the_configuration_is_taken_from_a_log(tmp_path: Path, fault: Fault) -> None:
    content = b"<robot/>"
    sha256 = hashlib.sha256(content).hexdigest()
    name = f"files/{sha256}"
    config = json.dumps({"robot": {"path": {"sha256": sha256}}}).encode()
    run = RunDirectory(tmp_path, hashlib.sha256(config).hexdigest())
    run.create(config, {}, {name: content})
    run.write_logs({0: log_of(config, 0, {name: content})})
    assert run.config_json() == config
    fault(run.path / name)
    attachments._contents.pop(sha256)
    with pytest.warns(DamagedStore, match=f"{name}: .*; taken from 0000.mcap"):
        assert run.config_json() == config
    assert attachments.File(sha256=sha256).content == content
    assert list(run.damaged_files()) == [name]
    with run.lock(), pytest.warns(DamagedStore, match="written again"):
        mend(run, config, range(3))
    run.create(config, {}, {name: content})
    assert (run.path / name).read_bytes() == content
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
    path = run.path / "config.json"
    path.unlink() if content is None else path.write_bytes(content)
    (run.path / "manifest.json").unlink()
    assert resolve(tmp_path, run.hash12[:4]).condition_id == CONDITION
    assert [each.condition_id for each in find_runs(tmp_path)] == [CONDITION]
    with pytest.warns(DamagedStore, match=r"config\.json: .*; taken from 0001\.mcap"):
        assert run.config_json() == CONFIG
    assert set(run.damaged_files(CONFIG)) == {"config.json", "manifest.json"}
    mended(run, "and written again: config.json", "and run again: 0000.mcap")
    run.create(CONFIG, {})
    assert not run.damaged_files(CONFIG)
    assert run.config_json() == CONFIG
    assert (run.path / "config.json.damaged").exists() == (content is not None)


@pytest.mark.parametrize(
    ("content", "why"),
    [('{"condition": ', "damaged"), (f'{{"condition": "{"f" * 64}"}}', "is of run")],
)
def test_a_lost_manifest_is_named_with_the_command_that_renews_it(
    run: RunDirectory, add: Add, content: str, why: str
) -> None:
    """The new one tells the environment of the logs, not that of today."""
    add(0)
    (run.path / "manifest.json").write_text(content)
    with pytest.warns(DamagedStore, match=rf"manifest\.json: {why}.*Mend it: evoexp run"):
        assert run.manifest() == {}
    mended(run, "and written again: manifest.json")
    run.create(CONFIG, manifest_of(run, CONFIG))
    assert run.manifest() == {"condition": CONDITION, **ENVIRONMENT, "git": None}


def test_the_manifest_alone_knows_the_name(run: RunDirectory, tmp_path: Path) -> None:
    (run.path / "config.json").unlink()
    assert resolve(tmp_path, run.hash12).condition_id == CONDITION
    (run.path / "manifest.json").write_text("{}")
    with pytest.raises(StoreError, match="neither a log nor the manifest"):
        resolve(tmp_path, run.hash12)
    (run.path / "manifest.json").unlink()
    with pytest.raises(UnknownHash):
        resolve(tmp_path, run.hash12)  # nothing of a run is there


def test_damage_is_named_and_a_damaged_run_hides_no_other(
    run: RunDirectory, tmp_path: Path
) -> None:
    run.write_failure(1, "x", "y")
    run.failure_path(1).write_text("{}")
    with pytest.raises(StoreError, match=r"0001\.failed\.json: damaged"):
        run.failure(1)
    (run.path / "manifest.json").write_text('{"condition": ')
    (run.path / "config.json").write_bytes(CONFIG[:-1])
    create = functools.partial(run.create, CONFIG, {})
    for action in (run.check, run.config_json, create, lambda: resolve(tmp_path, run.hash12)):
        with pytest.raises(StoreError, match=r"config\.json: damaged"):
            action()
    other = RunDirectory(tmp_path, hashlib.sha256(OTHER).hexdigest())
    other.create(OTHER, {})
    assert [each.path for each in find_runs(tmp_path)] == [other.path]
    assert resolve(tmp_path, other.hash12).path == other.path
    (run.path / "config.json").unlink()
    with pytest.raises(StoreError, match="cannot be read: No such file"):
        run.check()


def test_a_file_for_the_directory_of_the_logs(run: RunDirectory) -> None:
    run.replicates.rmdir()
    run.replicates.touch()
    assert (run.completed(), summary_table(run).num_rows) == (set(), 0)
    mended(run, "replicates (damaged: not a directory")
    run.create(CONFIG, {})
    assert run.replicates.is_dir()


def test_an_interrupted_writer_leaves_no_temporary_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its threads are in the middle of their files when the signal arrives."""
    others, begun, interrupted = set(threading.enumerate()), threading.Event(), threading.Event()

    def interrupt() -> None:
        begun.wait()
        os.kill(os.getpid(), signal.SIGINT)
        interrupted.set()

    monkeypatch.setattr(os, "fsync", lambda descriptor: (begun.set(), interrupted.wait()))
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
