"""What takes too long or too much memory is refused before it begins, or costs itself alone."""

import collections
import errno
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batch_samples import WORDS, digests

from evoexp.batch import runner_settings
from evoexp.batch.replicate import run_replicate
from evoexp.batch.replicate_limits import ReplicateLimits, TookTooLong, limited
from evoexp.batch.reproduction import reproduce_log
from evoexp.batch.runner import Batch
from evoexp.batch.runner_settings import RunnerSettings, allowed_memory, machine_memory
from evoexp.cli import KEPT, main
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.records import Generation, blocks
from evoexp.store import log as log_module
from evoexp.store.log import Log, LogTooLarge
from matrix import first
from shipped_conditions import of_kind


def test_time_is_limited_and_nothing_rings_afterwards() -> None:
    with limited(ReplicateLimits(0.2), in_worker=False):
        pass
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    with pytest.raises(TookTooLong), limited(ReplicateLimits(0.2), in_worker=False):
        signal.pause()

    def in_thread() -> None:  # of a cluster's worker, which no signal reaches
        with pytest.raises(TookTooLong), limited(ReplicateLimits(0.2), in_worker=True):
            any(threading.Event().wait(0.01) for _ in range(500))

    with ThreadPoolExecutor(1) as threads:
        threads.submit(in_thread).result()


def changed(name: str, value: Any) -> Condition:
    """Return a small condition with another setting of its planner's `ga`."""
    config = json.loads(of_kind(("rana_obstacles", 0), "smoke").to_json())
    config["planner"]["ga"][name] = value
    return Condition.from_json(json.dumps(config).encode())


def prepare(condition: Condition, outputs: Path, **settings: Any) -> None:
    Batch([(condition, 1, {"label": "mine"})], RunnerSettings(**settings), outputs).prepare()


def test_a_population_that_no_machine_holds_is_refused_before_anything_is_written(
    tmp_path: Path,
) -> None:
    with pytest.raises(SettingError) as refusal:
        prepare(changed("population_size", 10**9), tmp_path, num_workers=None)
    assert str(refusal.value).startswith("runner.memory_gb: must be at least ")
    assert "the estimate of a replicate of condition mine, was " in str(refusal.value)
    assert not list(tmp_path.iterdir())


def test_the_setting_raises_and_lowers_the_limit(tmp_path: Path) -> None:
    condition = changed("population_size", 10**5)
    planner, problem = condition.prepare()
    gigabytes = planner.memory(problem) / 1e9
    with pytest.raises(SettingError, match=r"runner\.memory_gb: must be at least "):
        prepare(condition, tmp_path, num_workers=1, memory_gb=gigabytes / 2)
    prepare(condition, tmp_path, num_workers=1, memory_gb=1e6)


def test_workers_share_the_memory_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner_settings, "machine_memory", lambda: 8e9)
    assert allowed_memory(RunnerSettings(num_workers=None), 4) == 2e9
    assert allowed_memory(RunnerSettings(num_workers=4, memory_gb=3.0), 4) == 3e9


def test_a_container_has_less_memory_than_its_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, path = machine_memory(), tmp_path / "memory.max"
    monkeypatch.setattr(runner_settings, "_CONTAINER", path)
    path.write_text("123456789\n")
    assert machine_memory() == 123456789
    path.write_text("max\n")
    assert machine_memory() >= whole > 1e8


def test_more_generations_than_a_log_holds_are_refused() -> None:
    must = "planner: must be one of fewer than 512,000 generations: a log holds 128 MB"
    with pytest.raises(SettingError, match=must):
        runner_settings.refuse_large(changed("num_generations", 10**9), 1e15)


def test_a_log_from_elsewhere_is_not_run_again_beyond_the_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "0000.mcap"
    path.write_bytes(run_replicate(changed("num_generations", 2), 0).content)
    monkeypatch.setattr("evoexp.batch.reproduction.machine_memory", lambda: 1000)
    with pytest.raises(SettingError, match=r"runner\.memory_gb"):
        reproduce_log(path)


def test_a_log_too_large_for_readers_ends_its_replicate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_module, "MAX_LOG", 10_000)
    log = Log("0" * 64, b"{}", 0, np.random.Generator(np.random.PCG64(0)))
    row = (1.0, 1.0, 1.0, 0.0, 1, 1, 1, True, {}, np.ones(1), np.ones(1))
    generations = (Generation(index, np.ones(3), *row) for index in range(1000))
    with pytest.raises(LogTooLarge, match="run fewer generations"):
        collections.deque(map(log.write, blocks(generations)), maxlen=0)


# A full or defective disk ends a command in one line; what is finished stays, and it goes on

COMMAND = ["run", *WORDS, "runner=serial", "--no-report"]
FEW = [*WORDS[:-1], "num_replicates=2"]
FULL = Path("/dev/full")
Failed = Callable[..., str]


@pytest.fixture
def failed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Failed:
    """Return what runs a command that `os.fsync` fails from some call on; it says one line."""

    def run(words: list[str], number: int, after: int = 0) -> str:
        calls = [0]

        def fsync(descriptor: int) -> None:
            calls[0] += 1
            if calls[0] > after:
                raise OSError(number, os.strerror(number))

        capsys.readouterr()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "fsync", fsync)
            assert main(words) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"evoexp: {tmp_path}/") and said.count("\n") == 1
        assert not list(tmp_path.rglob("*.tmp"))
        assert main(words) == 0
        return said

    return run


@pytest.mark.parametrize(
    ("number", "after"), [(errno.ENOSPC, 0), (errno.EIO, 3), (errno.EDQUOT, 9)]
)
def test_a_run_stops_in_one_line_and_the_same_command_goes_on(
    number: int,
    after: int,
    faulty: Condition,
    undisturbed: dict[int, str],
    outputs: Path,
    failed: Failed,
) -> None:
    assert failed(COMMAND, number, after).endswith(f": {os.strerror(number)}; {KEPT}\n")
    assert digests(outputs, faulty) == undisturbed


@pytest.mark.usefixtures("blank_figures")
@pytest.mark.parametrize("command", ["report", "export", "new"])
def test_other_commands_name_the_file_and_leave_nothing(
    command: str, faulty: Condition, outputs: Path, failed: Failed
) -> None:
    assert main(["run", *FEW, "runner=serial", "--no-report"]) == 0
    words = {
        "report": ["report", *FEW, "report=paper", "report.formats=[svg]"],
        "export": ["export", faulty.id[:12]],
        "new": ["new", "planner", "thing_of_mine", "--directory", str(outputs.parent)],
    }
    assert failed(words[command], errno.ENOSPC).endswith(": No space left on device\n")


def run_to(path: Path | None, *words: str, unbuffered: bool) -> tuple[int, str]:
    """Run a command whose standard output is a file, or closed; return exit code and stderr."""
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONUNBUFFERED"}
    environment |= {"PYTHONUNBUFFERED": "1"} if unbuffered else {}
    with open(path or os.devnull, "w") as stdout:
        done = subprocess.run(
            [sys.executable, "-m", "evoexp", *words],
            env=environment,
            stdout=stdout,
            stderr=subprocess.PIPE,
            text=True,
            timeout=300,
            preexec_fn=None if path else lambda: os.close(1),
        )
    return done.returncode, done.stderr


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    ("words", "unbuffered"), first(1, [("completion bash", True), ("list", False)])
)
def test_a_full_standard_output_is_named_and_a_closed_one_no_error(
    words: str, unbuffered: bool
) -> None:
    full = "evoexp: standard output: No space left on device\n"
    assert run_to(FULL, *words.split(), unbuffered=unbuffered) == (2, full)
    assert run_to(None, *words.split(), unbuffered=unbuffered) == (0, "")
