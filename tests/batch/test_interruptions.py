"""Ctrl-C and `kill -9` at any moment, then the same command again.

The same digests as an undisturbed run.
"""

import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from batch_samples import WORDS, digests, run

from evoexp.cli import main
from evoexp.condition import Condition
from evoexp.store.run_directory import RunDirectory
from evoexp.store.tables import read_summaries

HERE = Path(__file__).parent
COMMAND = ["run", *WORDS, "runner.num_workers=2", "--no-report"]
HANGING = "hang:6,7,8,9,10,11"  # these take an hour; the first task of each worker ends
PATIENCE_S = 120.0  # [s] for anything that a busy machine may take long for


@contextmanager
def started(outputs: Path, plug_in: Path, faults: str = HANGING) -> Iterator[subprocess.Popen[str]]:
    """Run the command in a group of its own; nothing of it is left behind."""
    environment = os.environ | {
        "EVOEXP_OUTPUTS": str(outputs),
        "PYTHONPATH": os.pathsep.join((str(plug_in), str(HERE), os.environ.get("PYTHONPATH", ""))),
        "FAULTY": faults,
        "FAULTY_FLAGS": str(outputs.parent),
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "evoexp", *COMMAND],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def wait_for(directory: RunDirectory, count: int, process: subprocess.Popen[str]) -> None:
    """Wait until some replicates are finished."""
    end = time.monotonic() + PATIENCE_S
    while len(directory.completed()) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.005)


def alive(group: int) -> list[str]:
    """Return the living processes of a group.

    A dead one may still wait for whoever inherited it.
    """
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            name, _, rest = stat.read_text().rpartition(") ")
            state, _, of_group = rest.split()[:3]
            if of_group == str(group) and state != "Z":
                found.append(name)
    return found


def test_ctrl_c_keeps_what_is_finished_and_the_same_command_goes_on(
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    plug_in: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    outputs = tmp_path / "outputs"
    directory = RunDirectory(outputs, faulty.id)
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(outputs))
    with started(outputs, plug_in) as process:
        wait_for(directory, 2, process)
        # Another process may not write the same run meanwhile.
        assert main([*COMMAND[:-1], "runner=serial", "--no-report"]) == 2
        said = capsys.readouterr()
        assert said.out == "replicates of each condition, fixed before they run: 12\n"
        assert (
            said.err == f"evoexp: run {faulty.id[:12]}: another process is writing it now "
            f"({directory.path})\n"
        )

        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: parent and workers
        out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert (
        err
        == "evoexp: interrupted; finished replicates are kept, the same command runs the others\n"
    )
    assert re.search(
        r"^replicates: \d+ of 12 done, 0 failed, ETA (–|\d+ (s|min))$", out, re.MULTILINE
    )
    assert "\x1b" not in out, "plain lines in a pipe"

    kept = digests(outputs, faulty)
    assert 2 <= len(kept) < 12
    assert kept == {k: undisturbed[k] for k in kept}
    with directory.lock():
        assert directory.summary_path.exists()
    assert read_summaries(directory)["replicate"].tolist() == sorted(kept)

    assert main([*COMMAND[:-2], "runner=serial", "--no-report"]) == 0
    assert f"replicates: {12 - len(kept)} of {12 - len(kept)} done" in capsys.readouterr().out
    assert digests(outputs, faulty) == undisturbed
    assert read_summaries(directory)["digest"].tolist() == list(undisturbed.values())


@pytest.mark.matrix
def test_kill_9_at_any_moment(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path, plug_in: Path
) -> None:
    outputs = tmp_path / "outputs"
    directory = RunDirectory(outputs, faulty.id)
    moment = random.Random(os.getpid()).uniform(
        0.0, 0.3
    )  # any moment will do: the assertions hold at all of them
    with started(outputs, plug_in) as process:
        wait_for(directory, 1, process)
        time.sleep(moment)
        os.kill(process.pid, signal.SIGKILL)  # the parent alone
        process.wait()
        kept = digests(outputs, faulty)
        run(
            outputs, (faulty, 12)
        )  # at once: the lock died with its process, the orphans write nothing
        end = time.monotonic() + PATIENCE_S
        while alive(process.pid) and time.monotonic() < end:
            time.sleep(0.1)
        assert alive(process.pid) == [], "workers leave soon after their parent"
    assert kept == {k: undisturbed[k] for k in kept}, f"killed {moment:.3f} s after the first log"
    assert digests(outputs, faulty) == undisturbed
    assert read_summaries(directory)["digest"].tolist() == list(undisturbed.values())
    assert not list(directory.replicates.glob(".*"))


@pytest.mark.matrix
def test_a_worker_forked_from_the_server_may_die(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path, plug_in: Path
) -> None:
    outputs = tmp_path / "outputs"
    with started(outputs, plug_in, "kill_once:3;kill:7;tell:9") as process:
        out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    reason = RunDirectory(outputs, faulty.id).failure(9)["reason"]
    assert reason == "RuntimeError: a server's worker"
    assert RunDirectory(outputs, faulty.id).failure(7)["reason"] == "worker process died twice"
    assert sorted(re.findall(r"^failed: \w+ #(\d+)", err, re.MULTILINE)) == ["7", "9"], out
    assert digests(outputs, faulty) == {
        k: digest for k, digest in undisturbed.items() if k not in (7, 9)
    }
