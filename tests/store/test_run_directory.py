"""Run directories: whole files or none, one writer, and hashes that find their run."""

import hashlib
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from store_samples import CONDITION, CONFIG

from evoexp.errors import AmbiguousHash, Busy, StoreError, UnknownHash
from evoexp.store.files import NUM_THREADS
from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory, lock_all, resolve
from store_lookup import find_runs

HOLD = """
    import sys, time
    from pathlib import Path
    from evoexp.store.run_directory import RunDirectory
    run = RunDirectory(Path(sys.argv[1]), sys.argv[2])
    with run.lock():
        print("held", flush=True)
        time.sleep(1000)
"""


@contextmanager
def holder(*arguments: str | Path) -> Iterator[subprocess.Popen[str]]:
    """Have another process hold the lock of a run."""
    command = [sys.executable, "-c", textwrap.dedent(HOLD), *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "held\n"
        try:
            yield process
        finally:
            process.send_signal(signal.SIGKILL)


def create(outputs: Path, config: bytes) -> RunDirectory:
    run = RunDirectory(outputs, hashlib.sha256(config).hexdigest())
    run.create(config, {})
    return run


def test_create_keeps_what_is_there(run: RunDirectory) -> None:
    run.create(CONFIG, {"condition": "later"})
    assert run.manifest() == {"condition": CONDITION}
    assert run.config_json() == CONFIG
    assert sorted(os.listdir(run.path)) == ["config.json", "manifest.json", "replicates"]


def test_completion_is_the_file_itself(run: RunDirectory, add: Callable[..., Finished]) -> None:
    assert run.completed() == run.failed() == set()
    run.write_failure(3, "no path", "Traceback …\n")
    run.write_failure(12345, "no path", "")
    assert run.failed() == {3, 12345}
    assert run.failure(3)["reason"] == "no path" and run.failure(3)["traceback"] == "Traceback …\n"
    content = add(3).content
    assert (run.completed(), run.failed()) == ({3}, {12345})
    assert not run.failure_path(3).exists()
    assert (run.replicates / "0003.mcap").read_bytes() == content
    (run.replicates / ".0004.mcap.1.tmp").write_bytes(b"half")
    run.write_logs({5: content, 12345: content})
    assert (run.completed(), run.failed()) == ({3, 5, 12345}, set())


@pytest.mark.parametrize("count", [1, 2, NUM_THREADS, 3 * NUM_THREADS])
def test_nothing_gets_its_name_before_its_bytes_are_on_the_disk(
    run: RunDirectory, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    """A machine that loses its power keeps what was synced: every file before the first name."""
    events: list[tuple[str, str]] = []
    fsync, replace = os.fsync, os.replace

    def note_fsync(descriptor: int) -> None:
        events.append(("sync", os.readlink(f"/proc/self/fd/{descriptor}")))
        fsync(descriptor)

    def note_replace(source: Path, target: Path) -> None:
        events.append(("rename", str(source)))
        replace(source, target)

    monkeypatch.setattr(os, "fsync", note_fsync)
    monkeypatch.setattr(os, "replace", note_replace)
    run.write_logs({k: bytes([k]) * 1000 for k in range(count)})
    assert [kind for kind, _ in events] == ["sync"] * count + ["rename"] * count + ["sync"]
    synced, renamed = (
        sorted(path for _, path in part) for part in (events[:count], events[count:-1])
    )
    assert synced == renamed and len(set(synced)) == count, "each file itself"
    assert events[-1] == ("sync", str(run.replicates)), "then their names"
    assert all(run.log_path(k).read_bytes() == bytes([k]) * 1000 for k in range(count))


def test_the_lock_dies_with_its_process(run: RunDirectory, tmp_path: Path) -> None:
    with holder(tmp_path, CONDITION):
        with pytest.raises(Busy, match=f"run {CONDITION[:12]}"), run.lock():
            pass
    with run.lock(), run.lock():
        with pytest.raises(Busy), RunDirectory(tmp_path, CONDITION).lock():
            pass
    with RunDirectory(tmp_path, CONDITION).lock():
        pass


def test_lock_all_releases_what_it_took(tmp_path: Path) -> None:
    runs = [create(tmp_path, bytes([65 + k])) for k in range(4)]
    runs.sort(key=lambda run: run.condition_id)
    with holder(tmp_path, runs[2].condition_id):
        with pytest.raises(Busy, match=runs[2].hash12), lock_all(reversed(runs)):
            pass
        for run in (runs[0], runs[1], runs[3]):
            with RunDirectory(tmp_path, run.condition_id).lock():
                pass
    with lock_all([*runs, RunDirectory(tmp_path, runs[0].condition_id)]):
        with pytest.raises(Busy), RunDirectory(tmp_path, runs[3].condition_id).lock():
            pass


def test_another_condition_with_the_same_twelve_digits(run: RunDirectory, tmp_path: Path) -> None:
    other = RunDirectory(tmp_path, CONDITION[:12] + "0" * 52)
    with pytest.raises(StoreError, match=f"{CONDITION}, which shares"):
        other.check()
    with pytest.raises(UnknownHash):
        resolve(tmp_path, CONDITION[:12] + ("0" if CONDITION[12] != "0" else "1"))


def test_prefixes(tmp_path: Path) -> None:
    runs = [create(tmp_path, str(number).encode()) for number in range(20)]
    (tmp_path / "runs" / ("0" * 12)).mkdir()  # killed before it had a configuration
    (tmp_path / "runs" / "notes").mkdir()
    ids = sorted(run.condition_id for run in runs)
    assert [run.condition_id for run in find_runs(tmp_path)] == ids
    for condition_id in ids:
        for length in (12, 13, 64):
            prefix = condition_id[:length].upper()
            assert resolve(tmp_path, prefix).condition_id == condition_id
    digits = [condition_id[0] for condition_id in ids]
    shared = next(digit for digit in digits if digits.count(digit) > 1)
    alone = next(digit for digit in digits if digits.count(digit) == 1)
    assert resolve(tmp_path, alone).condition_id[0] == alone
    with pytest.raises(AmbiguousHash) as caught:
        resolve(tmp_path, shared)
    assert caught.value.candidates == [each[:12] for each in ids if each[0] == shared]


def test_unknown_prefixes_say_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(UnknownHash, match="no run 'abc' among the 0"):
        resolve(tmp_path, "abc")
    run = create(tmp_path, b"one")
    wrong = run.hash12[:-1] + ("0" if run.hash12[-1] != "0" else "1")
    with pytest.raises(UnknownHash, match=f"among the 1 .* did you mean '{run.hash12}'"):
        resolve(tmp_path, wrong)
    for text in ("", "xyz", "abc ", "../..", "0" * 65):
        with pytest.raises(UnknownHash, match="hexadecimal"):
            resolve(tmp_path, text)
