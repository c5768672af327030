"""Replicates on a cluster: the same digests as here, a killed worker loses nothing."""

import importlib.util
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from batch_samples import around_plug_in, digests, failures, new_batch, run
from process_table import eventually

from evoexp import shipped
from evoexp.batch import cluster
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.condition import Condition
from evoexp.errors import Notice
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table
from store_lookup import find_runs

pytest.importorskip("distributed", reason="needs distributed, from evoexp[cluster]")
pytestmark = pytest.mark.filterwarnings("ignore")  # distributed's own
DASK = {"backend": "dask", "num_workers": 2}


@pytest.fixture
def scheduler(tmp_path: Path, plug_in: Path) -> Iterator[str]:
    """Start a scheduler and two workers as commands, as on a cluster; return its address."""
    around = around_plug_in(plug_in, tmp_path)
    around["PYTHONPATH"] = os.pathsep.join([around["PYTHONPATH"], *sys.path])
    file = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--no-dashboard"]
    command += ["--port", "0", "--host", "127.0.0.1", "--scheduler-file", str(file), "--no-show"]
    workers = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file)]
    workers += ["--nworkers", "2", "--nthreads", "1", "--no-dashboard"]
    workers += ["--local-directory", str(tmp_path)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": around}
    started = [subprocess.Popen(words, **quiet) for words in (command, workers)]
    try:
        assert eventually(lambda: file.exists() and file.read_text().strip())
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
    assert failures(run(tmp_path / "outputs", (faulty, 12), **settings)) == {}
    assert digests(tmp_path / "outputs", faulty) == undisturbed
    assert not new_batch(tmp_path / "outputs", (faulty, 12), **settings).jobs


@pytest.mark.matrix
def test_a_killed_worker_loses_nothing_but_its_own_replicate(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path, fail: Callable[[str], None]
) -> None:
    fail("kill_once:3;kill:7;raise:9")
    reasons = failures(run(tmp_path / "outputs", (faulty, 12), **DASK))
    died = "worker process died twice"
    assert reasons.pop(9).startswith("ArithmeticError: ")
    assert reasons == {7: died}
    expected = {k: digest for k, digest in undisturbed.items() if k not in (7, 9)}
    assert digests(tmp_path / "outputs", faulty) == expected
    assert RunDirectory(tmp_path / "outputs", faulty.id).failed() == {7, 9}
    fail("slow:1")  # ended with its worker: sleep hears no exception
    assert failures(run(tmp_path / "late", (faulty, 2), **DASK, timeout_s=5.0)) == {1: died}


@pytest.mark.matrix
def test_a_scheduler_that_goes_away_is_told_and_what_is_finished_stays(
    faulty: Condition, tmp_path: Path, fail: Callable[[str], None]
) -> None:
    from distributed import LocalCluster

    fail("slow:11")
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as local:
        settings = {"backend": "dask", "address": local.scheduler_address}
        outcomes = new_batch(tmp_path / "outputs", (faulty, 12), **settings).run()
        next(outcomes)
        local.sync(local.scheduler.close)
        must = r"^runner\.address: the scheduler at tcp://.* went away; finished replicates"
        with pytest.raises(cluster.ClusterError, match=must):
            list(outcomes)
    assert RunDirectory(tmp_path / "outputs", faulty.id).completed()


@pytest.mark.matrix
def test_a_worker_with_other_code_is_refused(
    faulty: Condition, tmp_path: Path, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "code_identity", lambda: "0.0.1 (abc)")
    must = r"^runner\.address: the worker on .* must have evoexp 0\.0\.1 \(abc\), has "
    with pytest.raises(cluster.ClusterError, match=must):
        run(tmp_path / "outputs", (faulty, 3), backend="dask", address=scheduler)


@pytest.mark.matrix
def test_a_cluster_without_workers_waits_and_says_so(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path
) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, threads_per_worker=1, dashboard_address=None) as local:
        settings = {"backend": "dask", "address": local.scheduler_address}
        threading.Timer(2.0, local.scale, (2,)).start()
        with pytest.warns(Notice, match=r"^cluster at tcp://.*: no workers at .*, waiting for"):
            assert failures(run(tmp_path / "outputs", (faulty, 12), **settings)) == {}
    assert digests(tmp_path / "outputs", faulty) == undisturbed


def test_a_scheduler_that_does_not_answer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "SAY_S", 0.1)
    said = list[str]()
    monkeypatch.setattr(cluster.warnings, "warn", lambda line, *_, **__: said.append(line))
    client = SimpleNamespace(nthreads=lambda: eventually(lambda: said) and {"tcp://a:2": 1})
    client.scheduler_info = lambda n_workers: {"workers": {}}  # as distributed's, now and then
    assert cluster.ClusterWorkers(client, "at tcp://a:1", ReplicateLimits()).number() == 1
    silence = "the scheduler has not answered for 0 s, waiting for it"
    assert said[0] == f"cluster at tcp://a:1: {silence}"


def test_an_address_that_nobody_answers_is_refused(faulty: Condition, tmp_path: Path) -> None:
    import dask

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(cluster.ClusterError, match="must be the address of a scheduler that answ"),
    ):
        run(tmp_path / "outputs", (faulty, 3), backend="dask", address="tcp://127.0.0.1:1")


SCRIPT = Path(__file__).parents[2] / "docs" / "slurm_cluster.py"
SBATCH = """#!/bin/sh
cp "$1" "$JOBS.sh"  # the file is gone as soon as this script ends, as with Slurm
bash "$JOBS.sh" >"$JOBS.out" 2>&1 &
echo $! >>"$JOBS"
echo "Submitted batch job $!"
"""


# not by importing it: that replaces this process' SIGINT handler
@pytest.mark.skipif(importlib.util.find_spec("dask_jobqueue") is None, reason="needs dask-jobqueue")
@pytest.mark.matrix
def test_an_experiment_runs_on_slurms_workers(tmp_path: Path) -> None:
    programs = tmp_path / "bin"
    programs.mkdir()
    scancel = '#!/bin/sh\nkill "$@" 2>/dev/null || true\n'
    for name, text in (("sbatch", SBATCH), ("scancel", scancel)):
        (programs / name).write_text(text)
        (programs / name).chmod(0o755)
    around = os.environ | {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "EVOEXP_OUTPUTS": str(tmp_path / "outputs"),
        "JOBS": str(tmp_path / "jobs"),
    }
    words = "--jobs 1 --cores 2 --memory 2GB --interface lo experiment=rana_planar budget=smoke"
    done = subprocess.run(
        [sys.executable, str(SCRIPT), *words.split()],
        env=around,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "jobs").read_text().split()) == 1
    runs = find_runs(tmp_path / "outputs")
    assert len(runs) == 3
    for each in runs:
        (row,) = {row.digest for row in shipped.find(each.hash12)}
        assert row in summary_table(each)["digest"].to_pylist()
