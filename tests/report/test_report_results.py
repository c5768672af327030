import math
from pathlib import Path

import numpy as np
import pytest

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import NothingStored, StoreError
from evoexp.report.pages import markdown
from evoexp.report.pages.index import document
from evoexp.report.pages.page_parts import Page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import stored_results as results_module
from evoexp.report.results.stored_results import Results, gather
from evoexp.store.identity import Plan
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from report_samples import REPORT, expand, store


def gathered(outputs: Path, count: int | None, *overrides: str) -> Results:
    return gather(
        outputs,
        expand("rana_planar", *overrides).conditions,
        count,
        "rana_planar",
        "smoke",
        "evoexp run it",
    )


def test_nothing_stored_is_one_line_with_the_command(tmp_path: Path) -> None:
    with pytest.raises(
        NothingStored, match=r"^rana_planar: nothing stored in .*; try: evoexp run it$"
    ):
        gathered(tmp_path, 2)
    assert not list(tmp_path.iterdir())


def test_results_are_what_the_logs_hold(stored: Path, results: Results) -> None:
    ga, search, starts = results.conditions
    labels = ["via-point GA", "random search", "multi-start"]
    assert [c.label for c in results.conditions] == labels
    assert (ga.done, ga.planned, ga.failed) == (2, 2, 0)
    assert [c.is_control for c in (ga, search, starts)] == [False, True, True]
    assert results.main == (ga,)
    run = RunDirectory(stored, ga.condition.id)
    logs = [read_log(run.log_path(k)) for k in range(2)]
    assert list(ga.column("best_cost")) == [log.summary.best_cost for log in logs]
    best = ga.best_replicate
    assert logs[best].summary.best_cost == ga.column("best_cost").min()
    np.testing.assert_array_equal(ga.solutions[best], logs[best].solutions[-1].values)
    np.testing.assert_array_equal(ga.first_solution, logs[best].solutions[0].values)
    assert len(ga.generations) == sum(len(log.generations) for log in logs)
    assert ga.code["version"] == run.manifest()["versions"]["evoexp"]
    assert math.isnan(ga.spread("no such column").median)


def test_every_stored_replicate_is_read_however_many_are_planned(stored: Path) -> None:
    ga = gathered(stored, 1).conditions[0]
    assert (ga.done, ga.planned, list(ga.solutions)) == (2, 2, [0, 1])
    assert set(ga.generations["replicate"]) == {0, 1}
    assert gathered(stored, None).conditions[0].planned == 2
    five = gathered(stored, 5).conditions[0]
    assert (five.done, five.planned) == (2, 5)


def test_replicates_asked_for_when_results_were_there_are_told_apart(tmp_path: Path) -> None:
    settings = ReportSettings(**REPORT, figures="generic")  # type: ignore[arg-type]
    experiment = expand("rana_planar", "num_replicates=1", "ga.num_generations=1")
    ga = experiment.conditions[0].condition
    run = RunDirectory(tmp_path, ga.id)
    run.note_plan(1)
    store(tmp_path, experiment)
    run.note_plan(1)  # the same again, and fewer, are no other plan
    assert run.plans() == [Plan(1, 0)]
    run.note_plan(3)
    assert run.plans() == [Plan(1, 0), Plan(3, 1)]
    run.write_logs({k: run_replicate(ga, k).content for k in (1, 2)})
    found = gather(tmp_path, experiment.conditions, 1, "", "", "").conditions[0]
    assert (found.done, found.planned) == (3, 3)
    assert found.added(fixed=1) == 2
    assert found.added(fixed=2) == 1  # the experiment's own number was fixed before
    assert found.added(fixed=3) == 0
    text = markdown.page(
        document(Page("title", ""), Results("", "", (found,)), settings, "evoexp report")
    )
    assert f"**Replicates added later.** {found.label}: 2 of 3" in text
    (run.path / "plans.json").write_text('{"plans": [{"num_replicates": "3", "stored": 1}]}')
    with pytest.raises(StoreError, match=r"plans\.json: damaged"):
        run.plans()


def test_failed_and_missing_replicates_are_counted(tmp_path: Path) -> None:
    experiment = expand("rana_planar", "num_replicates=1", "ga.num_generations=1")
    store(tmp_path, experiment)
    ga, search, _ = (RunDirectory(tmp_path, c.condition.id) for c in experiment.conditions)
    ga.write_failure(1, "worker died", "traceback")
    search.log_path(0).unlink()
    found = gather(tmp_path, experiment.conditions, 3, "rana_planar", "smoke", "")
    first, second, third = found.conditions
    assert (first.done, first.failed, first.failures) == (1, 1, {1: "worker died"})
    assert (second.done, second.failed, second.solutions) == (0, 0, {})
    assert found.with_data == (first, third)


def test_a_condition_is_read_back_from_its_run(stored: Path, results: Results) -> None:
    ga = results.conditions[0]
    assert Condition.from_json(RunDirectory(stored, ga.condition.id).config_json()) == ga.condition


def test_logs_are_opened_when_a_page_asks_for_what_they_hold(
    stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gathered(stored, 2)  # summary.parquet is there

    def never(*_: object) -> None:
        raise AssertionError("a log is opened")

    for name in ("read_generations", "read_solution", "read_log"):
        monkeypatch.setattr(results_module, name, never)
    ga = gathered(stored, 2).conditions[0]
    assert (ga.done, ga.solved) == (2, int(ga.summaries["solved"].sum()))
    for part in ("generations", "solutions", "first_solution"):
        with pytest.raises(AssertionError, match="a log is opened"):
            getattr(ga, part)
    monkeypatch.undo()
    assert ga.generations is ga.generations and ga.solutions is ga.solutions, "read once"
