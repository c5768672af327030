"""A batch that was killed and asked for again stores the bytes of an undisturbed one.

All of them: of every log, every row, every other file; only the times of a replicate differ. A
*blow* is one SIGKILL: at the main process, a worker, the server that workers are forked from, or
all processes of the command at once.
"""

import itertools
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import pytest
from process_table import of_group

from masked_logs import differing, masked_store
from matrix import counts

SEED = 20
NUM_BLOWS = counts(15, 50)  # with ./scripts/test --all
VICTIMS = ("main", "worker", "server", "group")
PATIENCE_S = 600.0  # [s] for a command on a busy machine
ALL = (  # every planner, control and reference
    *("rana_obstacles", "rana_planar", "curkovic_motion", "curkovic_pareto"),
    *("lavoie_controls", "lavoie_coding", "corsepius_ball", "corsepius_pick_and_place"),
    *("chen_path", "chen_placement", "chen_landscapes", "chen_mission"),
)
pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")


class Blow(NamedTuple):
    """One kill.

    Its moment is counted in logs, not from the start: else it would fall behind the end of a batch
    on a fast day, and into the loading of libraries on a slow one.
    """

    victim: str
    num_logs: int  # that are finished when the clock of `after_s` starts
    after_s: float


def random_blow(rng: random.Random, victim: str, finished: int, all_logs: int) -> Blow:
    """Return a blow between the present state of a batch and its end, a fifth while it starts."""
    if rng.random() < 0.2:
        return Blow(victim, 0, rng.uniform(0.0, 3.0))
    return Blow(victim, rng.randrange(finished, max(all_logs, finished + 1)), rng.expovariate(20.0))


def command(experiments: Sequence[str], count: int) -> list[str]:
    """Return the command that runs all conditions of these experiments, smoke budget."""
    words = [f"experiment={','.join(experiments)}", "budget=smoke", "runner.num_workers=2"]
    words += [f"budget.max_replicates={count}", f"num_replicates={count}", "--no-report"]
    return [sys.executable, "-m", "evoexp", "run", "-m", *words]


def num_logs(outputs: Path) -> int:
    return len(list(outputs.glob("runs/*/replicates/*.mcap")))


@contextmanager
def started(words: Sequence[str], outputs: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a command in a group of its own; nothing of it is left behind."""
    around = os.environ | {"EVOEXP_OUTPUTS": str(outputs), "TMPDIR": str(outputs.parent)}
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(words, env=around, start_new_session=True, **pipes)
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def run(words: Sequence[str], outputs: Path, blow: Blow | None = None) -> tuple[bool, bool]:
    """Run a command; return whether the blow met anybody, and whether it ended all the same."""
    with started(words, outputs) as process:
        met = blow is not None and strike(process, outputs, blow)
        if blow and met and blow.victim in ("main", "group"):
            process.wait(PATIENCE_S)
            return True, False
        complaints = process.communicate(timeout=PATIENCE_S)[1]
        assert (process.returncode, complaints) == (0, ""), blow
        return met, True


def strike(process: subprocess.Popen[str], outputs: Path, blow: Blow) -> bool:
    """Kill the victim when its moment has come, or as soon as it is there."""
    while process.poll() is None and num_logs(outputs) < blow.num_logs:
        time.sleep(0.002)
    with suppress(subprocess.TimeoutExpired):
        process.wait(blow.after_s)
    while process.poll() is None:
        group = of_group(process.pid)
        servers = [one.number for one in group if one.is_server and one.parent == process.pid]
        workers = [one.number for one in group if one.parent in servers]
        found = {"server": servers, "worker": workers}.get(blow.victim, [process.pid])
        with suppress(ProcessLookupError):  # it has just ended
            if found:
                kill = os.killpg if blow.victim == "group" else os.kill
                kill(random.Random(blow.after_s).choice(found), signal.SIGKILL)
                return True
        time.sleep(0.002)
    return False


@pytest.mark.matrix
def test_blows_at_random_moments_over_all_planners(tmp_path: Path) -> None:
    """Strike a batch until enough blows met; each time it is complete, compare and begin anew."""
    words, rng, met = command(ALL, 4), random.Random(SEED), list[Blow]()
    run(words, tmp_path / "undisturbed")
    expected = masked_store(tmp_path / "undisturbed")
    all_logs = num_logs(tmp_path / "undisturbed")
    for store in itertools.count():
        outputs, complete, since = tmp_path / f"struck_{store}", False, len(met)
        while not complete and len(met) < NUM_BLOWS:
            blow = random_blow(rng, VICTIMS[len(met) % len(VICTIMS)], num_logs(outputs), all_logs)
            hit, complete = run(words, outputs, blow)
            met += [blow] if hit else []
        if not complete:
            run(words, outputs)
        assert differing(expected, masked_store(outputs)) == [], f"after {met[since:]}"
        shutil.rmtree(outputs)
        if len(met) == NUM_BLOWS:
            return


def test_a_command_that_is_killed_at_half_of_its_logs_goes_on(tmp_path: Path) -> None:
    words = command(("rana_obstacles",), 12)
    run(words, tmp_path / "undisturbed")
    run(words, tmp_path / "struck", Blow("group", 6, 0.0))
    run(words, tmp_path / "struck")
    expected = masked_store(tmp_path / "undisturbed")
    assert differing(expected, masked_store(tmp_path / "struck")) == []
