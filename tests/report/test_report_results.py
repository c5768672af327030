import math
from pathlib import Path

import numpy as np
import pytest

from evoexp.batch.replicate import run_replicate
from evoexp.condition import Condition
from evoexp.errors import NothingStored
from evoexp.report.pages import markdown
from evoexp.report.pages.index import document
from evoexp.report.pages.page_parts import Page
from evoexp.report.results.stored_results import Results, gather
from evoexp.store.identity import Plan
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from report_samples import expand, page_settings, store


def gathered(outputs: Path, count: int | None, *overrides: str) -> Results:
    conditions = expand("rana_planar", *overrides).conditions
    return gather(outputs, conditions, count, "rana_planar", "smoke", "evoexp run it")


def test_nothing_stored_is_one_line_with_the_command(tmp_path: Path) -> None:
    line = r"^rana_planar: nothing stored in .*; try: evoexp run it$"
    with pytest.raises(NothingStored, match=line):
        gathered(tmp_path, 2)
    assert not list(tmp_path.iterdir())


def test_results_are_what_the_logs_hold(stored: Path, results: Results) -> None:
    labels = {c.label: c.is_control for c in results.conditions}
    assert labels == {"via-point GA": False, "random search": True, "multi-start": True}
    ga = results.conditions[0]
    assert (ga.done, ga.planned, ga.failed) == (2, 2, 0) and results.main == (ga,)
    run = RunDirectory(stored, ga.condition.id)
    assert Condition.from_json(run.config_json()) == ga.condition
    logs = [read_log(run.log_path(k)) for k in range(2)]
    costs = [log.summary.best_cost for log in logs]
    assert list(ga.column("best_cost")) == costs
    assert costs[ga.best_replicate] == min(costs)
    solutions = logs[ga.best_replicate].solutions
    np.testing.assert_array_equal(ga.solutions[ga.best_replicate], solutions[-1].values)
    np.testing.assert_array_equal(ga.first_solution(ga.best_replicate), solutions[0].values)
    assert len(ga.generations) == sum(len(log.generations) for log in logs)
    assert ga.code["version"] == run.manifest()["versions"]["evoexp"]
    assert math.isnan(ga.spread("no such column").median)


def test_replicates_asked_for_when_results_were_there_are_told_apart(tmp_path: Path) -> None:
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
    # the experiment's own number was fixed before
    assert [found.added(fixed=fixed) for fixed in (1, 2, 3)] == [2, 1, 0]
    parts = Page("title", ""), Results("", "", (found,)), page_settings("", "generic")
    text = markdown.page(document(*parts, "evoexp report", {}))
    assert f"**Replicates added later.** {found.label}: 2 of 3" in text


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
