"""A batch runs what is missing, keeps what is there, and survives what fails."""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from batch_samples import WORDS, digests, failures, new_batch, run
from hypothesis import given
from hypothesis import strategies as st

import evoexp.batch.jobs as jobs_module
from evoexp.batch import jobs as job_module
from evoexp.batch.jobs import MAX_BUNDLE, NO_LIMITS, Job, Outcome, Replicates, read_curves
from evoexp.batch.replicate import BUDGET_SPENT, run_replicate
from evoexp.batch.replicate_limits import ReplicateLimits
from evoexp.cli import main
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.errors import DamagedStore, SettingError, portable
from evoexp.store import summaries
from evoexp.store.identity import Plan
from evoexp.store.log_reader import LogContents, read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import read_summaries

Fail = Callable[[str], None]
REASON = "ArithmeticError: replicate {} is [bold]told[/] to fail"


def job(condition: Condition, replicate: int = 0) -> Job:
    return Job(condition.id, condition.to_json(), replicate)


def stamps(directory: RunDirectory) -> dict[str, tuple[int, bytes]]:
    """Return name → modification time and content of every log, and of the manifest."""
    files = [*directory.replicates.glob("*.mcap"), directory.path / "manifest.json"]
    return {path.name: (path.stat().st_mtime_ns, path.read_bytes()) for path in files}


def test_only_what_is_missing_runs(faulty: Condition, tmp_path: Path) -> None:
    outcomes = run(tmp_path, (faulty, 5))
    assert [o[:2] for o in outcomes] == [(faulty.id, k) for k in range(5)]
    assert failures(outcomes) == {}
    directory = RunDirectory(tmp_path, faulty.id)
    before, first = digests(tmp_path, faulty), stamps(directory)
    assert len(set(before.values())) == 5
    for replicate in (1, 3):
        directory.log_path(replicate).unlink()
    directory.summary_path.unlink()
    assert [outcome.replicate for outcome in run(tmp_path, (faulty, 5))] == [1, 3]
    assert digests(tmp_path, faulty) == before
    again = stamps(directory)
    assert {name for name in again if again[name] != first[name]} <= {"0001.mcap", "0003.mcap"}
    summaries = read_summaries(directory)
    assert summaries["replicate"].tolist() == list(range(5))
    assert summaries["digest"].tolist() == list(before.values())


def test_more_replicates_leave_the_earlier_ones_alone(faulty: Condition, tmp_path: Path) -> None:
    run(tmp_path, (faulty, 2))
    directory = RunDirectory(tmp_path, faulty.id)
    before = stamps(directory)
    assert [outcome.replicate for outcome in run(tmp_path, (faulty, 4))] == [2, 3]
    assert stamps(directory) | before == stamps(directory)
    assert directory.plans() == [Plan(2, 0), Plan(4, 2)]
    assert read_summaries(directory)["replicate"].tolist() == [0, 1, 2, 3]
    assert run(tmp_path, (faulty, 1)) == []
    assert sorted(directory.completed()) == [0, 1, 2, 3], "fewer replicates take nothing away"


def test_a_damaged_replicate_runs_again_though_fewer_are_asked_for(
    faulty: Condition, tmp_path: Path
) -> None:
    run(tmp_path, (faulty, 3))
    before, log = digests(tmp_path, faulty), RunDirectory(tmp_path, faulty.id).log_path(2)
    log.write_bytes(log.read_bytes()[:-10])
    with pytest.warns(DamagedStore, match=r"run again: 0002\.mcap"):
        assert [outcome.replicate for outcome in run(tmp_path, (faulty, 1))] == [2]
    assert digests(tmp_path, faulty) == before


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
    monkeypatch.setattr(
        summaries, "read_summary", lambda path, _: pytest.fail(f"{path} is decoded")
    )
    batch = new_batch(tmp_path, (faulty, 10))
    assert [job.replicate for job in batch.jobs] == [0, 5, 7, 8, 9]
    assert not batch.is_damaged


def test_a_batch_tells_how_its_replicates_converge(
    faulty: Condition, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs_module, "INTERVAL_S", 0.0)
    (tmp_path / "curves").mkdir()
    run(tmp_path / "outputs", (faulty, 1), curves=tmp_path / "curves")
    (curve,) = read_curves(tmp_path / "curves")
    log = read_log(RunDirectory(tmp_path / "outputs", faulty.id).log_path(0))
    assert curve[:3] == (faulty.id, 0, log.summary.num_generations)
    assert curve.costs[-1] == log.summary.best_cost


def test_a_failed_replicate_is_a_row_and_a_file_and_the_others_go_on(
    faulty: Condition,
    tmp_path: Path,
    fail: Fail,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    blank_figures: None,
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path))
    directory = RunDirectory(tmp_path, faulty.id)
    words = ["run", *WORDS[:-1], "num_replicates=3", "runner=serial"]

    def said(code: int, *more: str, width: int = 80) -> tuple[str, str]:
        monkeypatch.setenv("COLUMNS", str(width))
        assert main([*words, *more]) == code
        return capsys.readouterr()

    fail("raise:0,1,2")
    out, _ = said(1, "report=paper", "report.formats=[svg]")
    assert "\n3 failed" in out and "report: " in out
    fail("raise:1")
    out, err = said(1, "--retry-failed", "--no-report", width=200)
    assert err == f"failed: {faulty.id[:12]} #1: {REASON.format(1)}\n"
    assert "replicates: 2 of 3 done, 1 failed, ETA 0 s" in out
    result, table = out.split("\n1 failed ")
    assert "2 of 3" in result
    assert all(f"┃ {column} " in table for column in ("hash", "reason", "traceback in"))
    assert f"│ {faulty.id[:12]} │ 1 │ {REASON.format(1)} │ " in table
    assert (directory.completed(), directory.failed()) == ({0, 2}, {1})
    failure = json.loads(directory.failure_path(1).read_bytes())
    assert failure["reason"] == read_summaries(directory)["stop_reason"][1] == REASON.format(1)
    assert failure["traceback"].startswith("Traceback (most recent call last):\n")
    assert failure["traceback"].endswith("to fail\nand says why\n")
    assert 'File "evoexp/batch/jobs.py"' in failure["traceback"], "no folder of this machine"
    assert portable("no file '/home/me/a/b.stl', 2 m/s") == "no file 'b.stl', 2 m/s"
    assert read_summaries(directory)["status"].tolist() == ["done", "failed", "done"]
    assert "1 replicate failed before" in " ".join(said(1, "--no-report")[0].split())
    assert main(["list", "--failed"]) == 0
    assert "ArithmeticError" in capsys.readouterr().out
    narrow, _ = said(1, "--retry-failed", "--no-report")
    assert max(map(len, narrow[narrow.index("\n1 failed") :].splitlines())) <= 80
    assert "…" not in narrow
    fail("")
    out, err = said(0, "--retry-failed", "--no-report")
    assert (err, "3 of 3" in out, directory.failed()) == ("", True, set())


def test_a_clock_that_is_set_back_changes_nothing(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(tmp_path, (faulty, 6))
    for path in RunDirectory(tmp_path, faulty.id).path.rglob("*"):
        os.utime(path, (4e9, 4e9))  # written in what is now the future
    monkeypatch.setattr(time, "time", lambda: 0.0)
    run(tmp_path, (faulty, 12))
    assert digests(tmp_path, faulty) == undisturbed


LATE = "took longer than runner.timeout_s = 2"
DIED, WORKERS = "worker process died twice", {"num_workers": 2, "timeout_s": 2.0}


@pytest.mark.parametrize(
    ("faults", "settings", "reasons"),
    [
        ("slow:1;slow_once:2", {"timeout_s": 2.0}, {1: LATE}),
        ("kill_once:3;kill:7;raise:9", {"num_workers": 2}, {7: DIED, 9: REASON.format(9)}),
        ("slow:1;slow_once:4;deaf:6", WORKERS, {1: LATE, 6: f"{LATE}, in compiled code: its pro"}),
        ("eat:8", WORKERS | {"memory_gb": 1.0}, {8: ""}),
    ],
)
def test_a_killed_or_slow_worker_costs_its_own_replicate_a_retry(
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    fail: Fail,
    faults: str,
    settings: dict[str, Any],
    reasons: dict[int, str],
) -> None:
    fail(faults)
    outcomes = run(tmp_path / "outputs", (faulty, 12), **settings)
    assert all(outcome.content == b"" for outcome in outcomes), "logs are written and let go"
    found = failures(outcomes)
    assert found.keys() == reasons.keys()
    assert all(found[k].startswith(reasons[k]) for k in reasons)
    expected = {k: digest for k, digest in undisturbed.items() if k not in reasons}
    assert digests(tmp_path / "outputs", faulty) == expected


# Tasks


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
        share = -(-(num_jobs - len(seen)) // (2 * num_workers))  # nobody waits for one worker
        assert 1 <= len(bundle) <= min(MAX_BUNDLE, max(1, share))
        wall, done = tasks[count % len(tasks)]
        own = bundle[:done]  # the worker stopped there
        seen += own
        outcomes = [Outcome(job.condition_id, job.replicate, "", "", b"", wall) for job in own]
        replicates.end_task((bundle,), outcomes)
    assert seen == waiting


@pytest.mark.parametrize("fault", ["raise:0", "slow:0"])
def test_what_fails_or_takes_too_long_is_left_to_the_replicates(
    fault: str, faulty: Condition, fail: Fail, monkeypatch: pytest.MonkeyPatch
) -> None:
    fail(fault)
    monkeypatch.setattr(jobs_module, "COMPILING_S", 1.0)
    begun = time.monotonic()
    job_module.warm_kernels([job(faulty)], ReplicateLimits(timeout_s=0.1))
    assert time.monotonic() - begun < 60.0


# Budgets in collision queries: a part of the identity, and a prefix of the run without a cap

FEW = ("ga.num_generations=30", "num_replicates=1")


def condition(*words: str, label: str = "via-point GA") -> Condition:
    (experiment,) = compose.expand(["experiment=rana_planar", *FEW, *words])
    return next(each.condition for each in experiment.conditions if each.label == label)


def log(chosen: Condition) -> LogContents:
    return read_log(run_replicate(chosen, 0).content)


@pytest.mark.parametrize("label", ["via-point GA", "random search", "multi-start"])
@pytest.mark.parametrize("most", [1000, 9000, 9001, 20_000])
def test_a_capped_run_is_the_beginning_of_the_uncapped_one(label: str, most: int) -> None:
    whole = log(condition(label=label))
    capped = log(condition(f"budget.collision_queries={most}", label=label))
    kept = [row for row in whole.generations if row.collision_queries <= most]
    assert 0 < len(kept) < len(whole.generations)
    assert [row.chain for row in capped.generations] == [row.chain for row in kept]
    assert capped.summary.stop_reason == BUDGET_SPENT
    assert capped.summary.collision_queries == kept[-1].collision_queries
    assert capped.summary.digest != whole.summary.digest
    assert whole.summary.stop_reason == "generations"


def test_a_cap_that_is_never_reached_changes_the_hash_alone() -> None:
    free, capped = condition(), condition("budget.collision_queries=1e9")
    assert capped.id != free.id
    assert b"max_collision_queries" not in free.to_json()
    whole, same = log(free), log(capped)
    assert [row.chain for row in same.generations] == [row.chain for row in whole.generations]
    assert same.summary.stop_reason == "generations"


def test_caps_are_whole_numbers_as_one_types_them() -> None:
    chosen = condition("budget.collision_queries=2e4")
    assert chosen.max_collision_queries == 20_000
    assert Condition.from_json(chosen.to_json()) == chosen
    assert condition("budget.collision_queries=20000").id == chosen.id
    assert condition("budget.collision_queries=null").id == condition().id


@pytest.mark.parametrize("wrong", [b"0", b"true", b'"7"', b"7.0"])
def test_a_stored_cap_is_checked(wrong: bytes) -> None:
    text, name = condition("budget.collision_queries=7").to_json(), b'"max_collision_queries":'
    assert name + b"7" in text
    with pytest.raises(SettingError, match="max_collision_queries: must be a whole number"):
        Condition.from_json(text.replace(name + b"7", name + wrong))


def test_a_cap_below_the_initial_population_is_one_line() -> None:
    must = r"budget\.collision_queries: must be at least the queries of the initial population"
    with pytest.raises(SettingError, match=must + r" \(1,000\), was 999"):
        run_replicate(condition("budget.collision_queries=999"), 0)
