"""Kills processes of a running batch at random moments, and starts the same command again.

A *blow* is one SIGKILL: at the main process, a worker, the server that workers are forked from, or
all processes of the command at once.
"""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

VICTIMS = ("main", "worker", "server", "group")
PATIENCE_S = 600.0  # [s] for a command on a busy machine
STARTING_S = 3.0  # [s] in which a command loads libraries and starts workers
FEW = ("rana_obstacles",)  # experiments
ALL = (  # every planner, control and reference
    *("rana_obstacles", "rana_planar", "curkovic_motion", "curkovic_pareto"),
    *("lavoie_controls", "lavoie_coding", "corsepius_ball", "corsepius_pick_and_place"),
    *("chen_path", "chen_placement", "chen_landscapes", "chen_mission"),
)


class Blow(NamedTuple):
    """One kill: at whom, and at which moment.

    The moment is counted in logs, not from the start: else it would fall behind the end of a batch
    on a fast day, and into the loading of libraries on a slow one.
    """

    victim: str
    num_logs: int  # that are finished when the clock of `after_s` starts
    after_s: float


def random_blow(rng: random.Random, victim: str, finished: int, all_logs: int) -> Blow:
    """Return a blow between the present state of a batch and its end, a fifth while it starts."""
    if rng.random() < 0.2:
        return Blow(victim, 0, rng.uniform(0.0, STARTING_S))
    return Blow(victim, rng.randrange(finished, max(all_logs, finished + 1)), rng.expovariate(20.0))


def command(experiments: Sequence[str], num_replicates: int) -> list[str]:
    """Return the command that runs all conditions of these experiments, smoke budget."""
    words = [
        f"experiment={','.join(experiments)}",
        "budget=smoke",
        f"budget.max_replicates={num_replicates}",
        f"num_replicates={num_replicates}",
        "runner.num_workers=2",
    ]
    return [sys.executable, "-m", "evoexp", "run", "-m", *words, "--no-report"]


def num_logs(outputs: Path) -> int:
    """Return how many replicates of a store are finished."""
    return sum(1 for _ in outputs.glob("runs/*/replicates/*.mcap"))


@contextmanager
def started(words: Sequence[str], outputs: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a command in a group of its own; nothing of it is left behind."""
    process = subprocess.Popen(
        words,
        env=os.environ | {"EVOEXP_OUTPUTS": str(outputs), "TMPDIR": str(outputs.parent)},
        stdout=subprocess.DEVNULL,
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


def run_undisturbed(words: Sequence[str], outputs: Path) -> None:
    """Run a command to its end."""
    with started(words, outputs) as process:
        _, complaints = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, complaints) == (0, "")


def run_struck(words: Sequence[str], outputs: Path, blow: Blow) -> tuple[bool, bool]:
    """Run a command and strike it once.

    Returns:
        Whether the blow met anybody, and whether the command came to its end all the same.
    """
    with started(words, outputs) as process:
        met = _strike(process, outputs, blow)
        if met and blow.victim in ("main", "group"):
            process.wait(timeout=PATIENCE_S)
            return True, False
        _, complaints = process.communicate(timeout=PATIENCE_S)
        assert (process.returncode, complaints) == (0, ""), f"{blow}: {complaints}"
        return met, True


def _strike(process: subprocess.Popen[str], outputs: Path, blow: Blow) -> bool:
    """Kill the victim when its moment has come, or as soon as it is there."""
    while process.poll() is None and num_logs(outputs) < blow.num_logs:
        time.sleep(0.002)
    with suppress(subprocess.TimeoutExpired):
        process.wait(blow.after_s)
    while process.poll() is None:
        with suppress(ProcessLookupError):  # it has just ended
            if blow.victim == "group":
                os.killpg(process.pid, signal.SIGKILL)
                return True
            if found := _processes(process.pid)[blow.victim]:
                os.kill(random.Random(blow.after_s).choice(found), signal.SIGKILL)
                return True
        time.sleep(0.002)
    return False


def _processes(main: int) -> dict[str, list[int]]:
    """Return the processes of a command by their part: main process, server, workers."""
    parents, servers = dict[int, int](), list[int]()
    for directory in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            _, _, rest = (directory / "stat").read_text().rpartition(") ")
            state, parent, group = rest.split()[:3]
            if int(group) == main and state != "Z":
                parents[int(directory.name)] = int(parent)
                if int(parent) == main and b"worker_server" in (directory / "cmdline").read_bytes():
                    servers.append(int(directory.name))
    workers = [process for process, parent in parents.items() if parent in servers]
    return {"main": [main], "server": servers, "worker": workers}
