"""Replicates on a cluster: the same digests as here, a killed worker loses nothing."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from batch_samples import digests, new_batch, run

from evoexp.batch import cluster
from evoexp.condition import Condition
from evoexp.store.run_directory import RunDirectory

pytest.importorskip("distributed", reason="needs distributed, from evoexp[cluster]")
pytestmark = pytest.mark.filterwarnings("ignore")  # distributed's own
DASK = {"backend": "dask", "num_workers": 2}


@pytest.fixture
def scheduler(tmp_path: Path, plug_in: Path) -> Iterator[str]:
    """Start a scheduler and two workers as commands, as on a cluster; return its address."""
    paths = [str(plug_in), str(Path(__file__).parent), *filter(None, sys.path)]
    around = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    file = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--no-dashboard"]
    command += ["--port", "0", "--host", "127.0.0.1", "--scheduler-file", str(file), "--no-show"]
    workers = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file)]
    workers += ["--nworkers", "2", "--nthreads", "1", "--no-dashboard"]
    workers += ["--local-directory", str(tmp_path)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": around}
    started = [subprocess.Popen(words, **quiet) for words in (command, workers)]  # type: ignore[call-overload]
    try:
        for _ in range(600):
            if file.exists() and file.read_text().strip():
                break
            time.sleep(0.1)
        yield str(json.loads(file.read_text())["address"])
    finally:
        for process in started[::-1]:
            process.terminate()
        for process in started:
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:  # seen once; nannies run no code of ours
                process.kill()
                process.wait()


@pytest.mark.matrix
def test_workers_of_a_scheduler_give_the_same_digests(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path, scheduler: str
) -> None:
    settings = {"backend": "dask", "address": scheduler}
    outcomes = run(tmp_path / "outputs", (faulty, 12), **settings)
    assert sorted(outcome.replicate for outcome in outcomes) == list(range(12))
    assert digests(tmp_path / "outputs", faulty) == undisturbed
    assert not new_batch(tmp_path / "outputs", (faulty, 12), **settings).jobs


@pytest.mark.matrix
def test_a_killed_worker_loses_nothing_but_its_own_replicate(
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FAULTY", "kill_once:3;kill:7;raise:9;slow:5")
    monkeypatch.setenv("FAULTY_FLAGS", str(tmp_path))
    outcomes = run(tmp_path / "outputs", (faulty, 12), **DASK, timeout_s=5.0)
    assert sorted(outcome.replicate for outcome in outcomes) == list(range(12)), "each ends once"
    reasons = {outcome.replicate: outcome.reason for outcome in outcomes if outcome.reason}
    died = "worker process died twice"
    assert reasons == {
        5: died,  # ended by its own time limit, which a thread cannot tell
        7: died,
        9: "ArithmeticError: replicate 9 is [bold]told[/] to fail",
    }
    expected = {k: digest for k, digest in undisturbed.items() if k not in reasons}
    assert digests(tmp_path / "outputs", faulty) == expected
    assert RunDirectory(tmp_path / "outputs", faulty.id).failed() == set(reasons)


@pytest.mark.matrix
def test_a_worker_with_other_code_is_refused(
    faulty: Condition, tmp_path: Path, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "code_identity", lambda: "0.0.1 (abc)")
    settings = {"backend": "dask", "address": scheduler}
    with pytest.raises(
        cluster.ClusterError,
        match=r"^runner\.address: the worker on .* must have evoexp 0\.0\.1 \(abc\), has ",
    ):
        run(tmp_path / "outputs", (faulty, 3), **settings)


def test_an_address_that_nobody_answers_is_refused(
    faulty: Condition, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import dask

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(cluster.ClusterError, match="must be the address of a scheduler that answ"),
    ):
        run(tmp_path / "outputs", (faulty, 3), backend="dask", address="tcp://127.0.0.1:1")
