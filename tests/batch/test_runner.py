"""A batch runs what is missing, keeps what is there, and survives what fails."""

import json
import math
import os
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path

import pytest
from batch_samples import WORDS, digests, new_batch, run
from hypothesis import given
from hypothesis import strategies as st

from evoexp.batch import jobs, live_curves
from evoexp.batch.fan_out import MAX_BUNDLE, TASK_S, Replicates, fan_out
from evoexp.batch.jobs import NO_LIMITS, Job, Outcome, run_jobs
from evoexp.batch.live_curves import read_curves
from evoexp.batch.replicate import run_replicate
from evoexp.batch.workers import Workers
from evoexp.cli import main
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import Busy, DamagedStore, SettingError
from evoexp.store import log_reader
from evoexp.store.identity import Plan
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.store.tables import read_summaries


def stamps(directory: RunDirectory) -> dict[str, tuple[int, bytes]]:
    """Return name → modification time and content of every log."""
    return {
        path.name: (path.stat().st_mtime_ns, path.read_bytes())
        for path in directory.replicates.glob("*.mcap")
    }


def test_only_what_is_missing_runs(faulty: Condition, tmp_path: Path) -> None:
    outcomes = run(tmp_path, (faulty, 5))
    assert [(o.condition_id, o.replicate, o.reason) for o in outcomes] == [
        (faulty.id, k, "") for k in range(5)
    ]
    directory = RunDirectory(tmp_path, faulty.id)
    before, first = digests(tmp_path, faulty), stamps(directory)
    assert len(set(before.values())) == 5
    for replicate in (1, 3):
        directory.log_path(replicate).unlink()
    directory.summary_path.unlink()
    assert [outcome.replicate for outcome in run(tmp_path, (faulty, 5))] == [1, 3]
    assert digests(tmp_path, faulty) == before
    again = stamps(directory)
    assert all(again[name] == first[name] for name in ("0000.mcap", "0002.mcap", "0004.mcap"))
    assert directory.summary_path.exists()
    summaries = read_summaries(directory)
    assert summaries["replicate"].tolist() == list(range(5))
    assert summaries["digest"].tolist() == list(before.values())
    assert run(tmp_path, (faulty, 5)) == []


def test_more_replicates_leave_the_earlier_ones_alone(faulty: Condition, tmp_path: Path) -> None:
    run(tmp_path, (faulty, 2))
    directory = RunDirectory(tmp_path, faulty.id)
    before = stamps(directory) | {"": (0, (directory.path / "manifest.json").read_bytes())}
    assert [outcome.replicate for outcome in run(tmp_path, (faulty, 4))] == [2, 3]
    after = stamps(directory) | {"": (0, (directory.path / "manifest.json").read_bytes())}
    assert {name: after[name] for name in before} == before
    assert directory.plans() == [Plan(2, 0), Plan(4, 2)]
    assert read_summaries(directory)["replicate"].tolist() == [0, 1, 2, 3]
    assert run(tmp_path, (faulty, 1)) == []
    assert sorted(directory.completed()) == [0, 1, 2, 3], "fewer replicates take nothing away"


def test_a_damaged_replicate_runs_again_though_fewer_are_asked_for(
    faulty: Condition, tmp_path: Path
) -> None:
    run(tmp_path, (faulty, 3))
    directory, before = RunDirectory(tmp_path, faulty.id), digests(tmp_path, faulty)
    log = directory.log_path(2)
    log.write_bytes(log.read_bytes()[:-10])
    with pytest.warns(DamagedStore, match=r"run again: 0002\.mcap"):
        assert [outcome.replicate for outcome in run(tmp_path, (faulty, 1))] == [2]
    assert digests(tmp_path, faulty) == before
    assert run(tmp_path, (faulty, 1)) == []


def test_of_many_the_missing_ones_are_found_without_decoding_a_log(
    faulty: Condition, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Completion is a whole log under its name: the summary table notes which ones are."""
    run(tmp_path, (faulty, 8))
    directory = RunDirectory(tmp_path, faulty.id)
    for replicate in (0, 5, 7):
        directory.log_path(replicate).unlink()
    (directory.replicates / ".0007.mcap.1.tmp").touch()
    (directory.replicates / "00005.mcap").touch()  # no name of a log
    read_summaries(directory)
    canonical = Condition.to_json
    calls: list[Condition] = []
    monkeypatch.setattr(Condition, "to_json", lambda self: calls.append(self) or canonical(self))  # type: ignore[func-returns-value]
    monkeypatch.setattr(log_reader, "read_summary", lambda path: pytest.fail(f"{path} is decoded"))
    batch = new_batch(tmp_path, (faulty, 10))
    assert [job.replicate for job in batch.jobs] == [0, 5, 7, 8, 9]
    assert not batch.is_damaged
    assert len(calls) <= 5, "a configuration is put into words per condition, not per replicate"


def test_a_condition_is_built_once_per_process(
    faulty: Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs, "LONGEST_TASK_S", math.inf)  # kernels may have to be compiled
    own = faulty._replace(seed=97)  # which no test has run before
    build, calls = Condition.from_config, []
    monkeypatch.setattr(
        Condition, "from_config", lambda config: calls.append(config) or build(config)
    )  # type: ignore[func-returns-value]
    outcomes = run_jobs([Job(own.id, own.to_json(), k) for k in range(3)])
    assert [outcome.reason for outcome in outcomes] == ["", "", ""]
    assert len(calls) == 1
    again = run_replicate(own, 2).content
    assert read_log(outcomes[2].content).content_digest == read_log(again).content_digest


def test_a_batch_tells_how_its_replicates_converge(
    faulty: Condition, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_curves, "INTERVAL_S", 0.0)
    (tmp_path / "curves").mkdir()
    batch = new_batch(tmp_path / "outputs", (faulty, 1), num_workers=1, curves=tmp_path / "curves")
    deque(batch.run(), maxlen=0)
    (curve,) = read_curves(tmp_path / "curves")
    log = read_log(RunDirectory(tmp_path / "outputs", faulty.id).log_path(0))
    assert curve[:3] == (faulty.id, 0, log.summary.num_generations)
    assert curve.costs[-1] == log.summary.best_cost


def test_a_condition_wanted_twice_runs_once(faulty: Condition, tmp_path: Path) -> None:
    other = faulty._replace(seed=1)
    batch = new_batch(tmp_path, (faulty, 1), (other, 1), (faulty, 3))
    assert [(job.condition_id, job.replicate) for job in batch.jobs] == [
        *((faulty.id, k) for k in range(3)),
        (other.id, 0),
    ]
    assert len(list(batch.run())) == 4
    assert len(batch.runs) == 2


def test_planning_and_preparing_write_nothing(faulty: Condition, tmp_path: Path) -> None:
    batch = new_batch(tmp_path / "outputs", (faulty, 2))
    batch.prepare()
    assert len(batch.jobs) == 2
    assert not (tmp_path / "outputs").exists()
    bad = compose.expand([*WORDS, "scenario.q_start=[[90,0],[270,0]]"])[0].conditions[0].condition
    with pytest.raises(SettingError, match="scenario.q_start: must be free of collision"):
        new_batch(tmp_path / "outputs", (faulty, 2), (bad, 2)).prepare()
    assert not (tmp_path / "outputs").exists()


def test_a_failed_replicate_is_a_row_and_a_file_and_the_others_go_on(
    faulty: Condition, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FAULTY", "raise:0,2")
    outcomes = run(tmp_path, (faulty, 4))
    assert [(o.replicate, bool(o.reason)) for o in outcomes] == [
        (0, True),
        (1, False),
        (2, True),
        (3, False),
    ]
    assert outcomes[2].reason == "ArithmeticError: replicate 2 is [bold]told[/] to fail"
    directory = RunDirectory(tmp_path, faulty.id)
    assert (directory.completed(), directory.failed()) == ({1, 3}, {0, 2})
    failure = json.loads(directory.failure_path(2).read_bytes())
    assert failure["reason"] == outcomes[2].reason
    assert failure["traceback"].startswith("Traceback (most recent call last):\n")
    assert failure["traceback"].endswith("to fail\nand says why\n")
    assert "in evolve" in failure["traceback"]
    rows = read_summaries(directory)
    assert rows["status"].tolist() == ["failed", "done", "failed", "done"]
    assert rows["stop_reason"][2] == outcomes[2].reason

    monkeypatch.setenv("FAULTY", "raise:2")
    left = new_batch(tmp_path, (faulty, 4))
    assert (left.jobs, left.num_left_failed) == ([], 2)
    assert [
        (o.replicate, bool(o.reason)) for o in run(tmp_path, (faulty, 4), retry_failed=True)
    ] == [
        (0, False),
        (2, True),
    ]
    monkeypatch.delenv("FAULTY")
    assert [
        (o.replicate, bool(o.reason)) for o in run(tmp_path, (faulty, 4), retry_failed=True)
    ] == [(2, False)]
    assert directory.failed() == set()
    assert not list(directory.replicates.glob("*.failed.json"))
    assert (read_summaries(directory)["status"] == "done").all()


def test_failures_on_the_command_line(
    faulty: Condition,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path))
    monkeypatch.setenv("FAULTY", "raise:1")
    monkeypatch.setenv("COLUMNS", "200")
    words = ["run", *WORDS[:-1], "num_replicates=3", "runner=serial", "--no-report"]
    assert main(words) == 1
    out, err = capsys.readouterr()
    assert (
        err
        == f"failed: {faulty.id[:12]} #1: ArithmeticError: replicate 1 is [bold]told[/] to fail\n"
    )
    assert "replicates: 2 of 3 done, 1 failed, ETA 0 s" in out
    table = out[out.index("\n1 failed ") :]
    assert all(f"┃ {column} " in table for column in ("hash", "reason", "traceback in"))
    assert (
        f"│ {faulty.id[:12]} │ 1 │ ArithmeticError: replicate 1 is [bold]told[/] to fail │ "
        in table
    )
    assert "2 of 3" in out[: out.index("\n1 failed ")]
    monkeypatch.setenv("COLUMNS", "80")
    assert main(words) == 1
    left = capsys.readouterr().out
    assert "1 replicate failed before" in " ".join(left.split())
    assert main(["list", "--failed"]) == 0
    assert "ArithmeticError" in capsys.readouterr().out
    words.append("--retry-failed")
    assert main(words) == 1
    narrow = capsys.readouterr().out
    assert max(map(len, narrow[narrow.index("\n1 failed") :].splitlines())) <= 80
    assert "…" not in narrow

    monkeypatch.delenv("FAULTY")
    assert main(words) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "replicates: 1 of 1 done, 0 failed" in out
    assert "3 of 3" in out


def test_where_every_replicate_failed_there_is_still_a_table_and_exit_code_1(
    faulty: Condition,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    blank_figures: None,
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path))
    monkeypatch.setenv("FAULTY", "raise:0,1")
    code = main(
        [
            "run",
            *WORDS[:-1],
            "num_replicates=2",
            "runner=serial",
            "report=paper",
            "report.formats=[svg]",
        ]
    )
    out = capsys.readouterr().out
    assert code == 1
    assert "\n2 failed" in out
    assert "report: " in out


def test_stopping_keeps_what_is_finished_and_leaves_no_lock(
    faulty: Condition, tmp_path: Path
) -> None:
    batch = new_batch(tmp_path, (faulty, 4))
    outcomes = batch.run()
    assert [next(outcomes).replicate, next(outcomes).replicate] == [0, 1]
    with pytest.raises(Busy, match=f"run {faulty.id[:12]}: another process is writing it now"):
        next(new_batch(tmp_path, (faulty, 5)).run())
    outcomes.close()
    directory = RunDirectory(tmp_path, faulty.id)
    with directory.lock():
        assert directory.completed() == {0, 1}
    assert directory.summary_path.exists()
    assert [outcome.replicate for outcome in run(tmp_path, (faulty, 4))] == [2, 3]


def test_a_clock_that_is_set_back_changes_nothing(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outputs = tmp_path / "outputs"
    run(outputs, (faulty, 6))
    for path in RunDirectory(outputs, faulty.id).path.rglob("*"):
        os.utime(path, (4e9, 4e9))  # written in what is now the future
    monkeypatch.setattr(time, "time", lambda: 0.0)
    run(outputs, (faulty, 12))
    assert digests(outputs, faulty) == undisturbed


# Workers


def test_a_killed_worker_costs_its_own_replicate_a_retry(
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FAULTY", "kill_once:3;kill:7;raise:9")
    monkeypatch.setenv("FAULTY_FLAGS", str(tmp_path))
    outcomes = run(tmp_path / "outputs", (faulty, 12), num_workers=2)
    assert sorted(outcome.replicate for outcome in outcomes) == list(range(12)), "each ends once"
    assert all(outcome.content == b"" for outcome in outcomes), "logs are written and let go"
    reasons = {outcome.replicate: outcome.reason for outcome in outcomes if outcome.reason}
    assert reasons == {
        7: "worker process died twice",
        9: "ArithmeticError: replicate 9 is [bold]told[/] to fail",
    }
    assert (tmp_path / "3").read_text() == "1"
    assert (tmp_path / "7").read_text() in ("2", "3"), "twice alone, and perhaps among others"
    expected = {k: digest for k, digest in undisturbed.items() if k not in reasons}
    assert digests(tmp_path / "outputs", faulty) == expected
    assert "terminated" in RunDirectory(tmp_path / "outputs", faulty.id).failure(7)["traceback"]


# Tasks


def outcomes_of(jobs: Sequence[Job], wall_s: float) -> list[Outcome]:
    return [Outcome(job.condition_id, job.replicate, "", "", b"", wall_s) for job in jobs]


@given(
    st.integers(0, 300),
    st.integers(2, 8),
    st.lists(st.tuples(st.floats(1e-5, 1.0), st.integers(1, MAX_BUNDLE)), min_size=1, max_size=20),
)
def test_every_job_is_run_once_and_in_order(
    num_jobs: int, num_workers: int, tasks: list[tuple[float, int]]
) -> None:
    waiting = [Job(str(k % 3) * 64, b"", k) for k in range(num_jobs)]
    replicates = Replicates(waiting, num_workers, NO_LIMITS)
    seen: list[Job] = []
    for count, (bundle,) in enumerate(iter(lambda: replicates.next_task(0), None)):
        assert 1 <= len(bundle) <= MAX_BUNDLE
        assert len(bundle) <= max(1, -(-(num_jobs - len(seen)) // (2 * num_workers))), (
            "nobody waits for one worker"
        )
        wall, done = tasks[count % len(tasks)]
        seen += bundle[:done]  # the worker stopped there
        replicates.end_task((bundle,), outcomes_of(bundle[:done], wall))
    assert seen == waiting


def test_bundles_are_as_long_as_a_task() -> None:
    waiting = [Job("0" * 64, b"", k) for k in range(1000)]
    replicates = Replicates(waiting, 2, NO_LIMITS)
    bundles = (task[0] for task in iter(lambda: replicates.next_task(0), None))
    first = next(bundles)
    assert len(first) == MAX_BUNDLE, "nothing is known yet"
    replicates.end_task((first,), outcomes_of(first[:3], TASK_S / 10))
    second = next(bundles)
    assert second == waiting[3:13]
    replicates.end_task((second,), outcomes_of(second, 1.0))
    assert len(next(bundles)) == 1
    for _ in range(60):
        bundle = next(bundles)
        replicates.end_task((bundle,), outcomes_of(bundle, TASK_S / 10))
    assert len(next(bundles)) in (9, 10), "slow ones are forgotten"


def test_a_task_that_takes_long_begins_no_further_replicate(
    faulty: Condition, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = [Job(faulty.id, faulty.to_json(), k) for k in range(3)]
    monkeypatch.setattr(jobs, "LONGEST_TASK_S", math.inf)
    assert [outcome.replicate for outcome in run_jobs(asked)] == [0, 1, 2]
    monkeypatch.setattr(jobs, "LONGEST_TASK_S", 0.0)
    assert [outcome.replicate for outcome in run_jobs(asked)] == [0]
    assert run_jobs([]) == []


def test_no_jobs_are_no_outcomes() -> None:
    assert list(fan_out([], None)) == []
    with Workers(2) as workers:
        assert list(fan_out([], workers)) == []
