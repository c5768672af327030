"""`evoexp run`, `evoexp plan` and `evoexp reproduce` on small experiments."""

import io
import json
import os
import re
import shlex
from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from command_samples import SERIAL, Evoexp, content, exit_code
from rich.console import Console

import evoexp.batch.jobs as jobs_module
from evoexp import load
from evoexp.batch.jobs import NUM_POINTS, CurveFile, Outcome, read_curves
from evoexp.commands.batch_progress import MOST_ROWS, BatchProgress, drawn
from evoexp.configuration import compose
from evoexp.records import Block, Generation
from evoexp.store.run_directory import RunDirectory
from store_lookup import find_runs

PLANAR = ("experiment=rana_planar", *SERIAL)
DRAFT = ("report.formats=[png]", "report.dpi=20")


def test_a_run_says_what_is_there_and_runs_nothing_twice(
    evoexp: Evoexp, outputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    first = evoexp("run", *PLANAR, "--no-report")
    assert (first.code, first.err) == (0, "")
    assert re.search(r"^replicates: 6 of 6 done, 0 failed, ETA 0 s$", first.out, re.MULTILINE)
    for label, condition in compose.expand(PLANAR)[0].conditions:
        assert condition.id[:12] in first.out and label.split(" ")[0] in first.out
    assert first.out.count("2 of 2") == 3 and "…" not in first.out
    assert max(map(len, first.out.splitlines())) <= 80
    again = evoexp("run", *PLANAR, "--no-report")
    assert again.code == 0
    assert again.out.startswith("nothing to run: every replicate is stored\n")
    assert again.out.split("\n", 1)[1] == first.out[first.out.index("rana_planar@smoke") :]
    assert not (outputs / "reports").exists()


def test_conditions_that_become_one_are_one_row_everywhere(
    evoexp: Evoexp, outputs: Path, wide_terminal: None
) -> None:
    label = "control=cma_es"
    words = ("experiment=rana_planar", label, "ga.num_generations=20", *SERIAL)
    words = tuple(word for word in words if word != "ga.num_generations=2")  # the cap counts
    said = evoexp("run", *words, *DRAFT)
    (condition,) = (c for _, c in compose.expand(words)[0].conditions)
    table = [line for line in said.out.splitlines() if condition.id[:12] in line]
    assert len(table) == 1 and table[0].split("│")[2].strip() == label
    assert "via-point GA" not in said.out
    # the store, the Python door, and all pages and tables say the same
    (run,) = find_runs(outputs)
    row = pd.read_parquet(run.summary_path).iloc[0]
    named = {"experiment": "rana_planar", "label": label, "budget": "smoke"}
    assert {name: row[name] for name in named} == named and row["control"] == "cma_es"
    assert set(load("rana_planar", *words[1:], budget="smoke").summaries["label"]) == {label}
    (listed,) = json.loads(evoexp("list", "--json").out)["runs"]
    assert {name: listed[name] for name in named} == named and listed["changed"]
    shown = json.loads(evoexp("show", run.hash12, "--json").out)["origin"]
    assert {name: shown[name] for name in named} == named
    (planned,) = json.loads(evoexp("plan", *words, "--json").out)
    (compared,) = json.loads(evoexp("compare", "rana_planar", *words[1:], "--json").out)
    assert planned["label"] == compared["condition"] == label
    (page,) = (outputs / "reports").glob("rana_planar@smoke+*/index.md")
    assert f"{run.hash12}" in page.read_text() and "random search" not in page.read_text()
    assert evoexp("site").code == 0
    home = (outputs / "reports" / "index.html").read_text()
    assert label in home and "via-point GA" not in home


def test_terminal_and_report_have_all_stored_replicates(evoexp: Evoexp, stored: Path) -> None:
    said = evoexp("run", *PLANAR, "num_replicates=1", "report=paper", *DRAFT)
    assert said.out.count("2 of 2") == 3
    assert "asked for: 1 of each; more are stored, and all count, here" in said.out
    (page,) = (stored / "reports").glob("*/index.md")
    assert "| `num_replicates` | 2 |" in page.read_text()
    said = evoexp("run", *PLANAR, "--no-report")
    assert "asked for: " not in said.out


def test_a_run_ends_with_its_report(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("run", *PLANAR, "num_replicates=1", "report=paper", *DRAFT) == 0
    (line,) = [each for each in capsys.readouterr().out.splitlines() if "report: " in each]
    page = Path(line.removeprefix("report: "))
    assert page == outputs / "reports" / compose.expand(PLANAR)[0].report_name / "index.html"
    assert "ga.population_size=8" in page.with_suffix(".md").read_text()
    assert len({path.read_bytes() for path in page.parent.glob("*.png")}) > 3, "figures are drawn"


def test_a_report_is_drawn_again_where_something_changed(evoexp: Evoexp, outputs: Path) -> None:
    words = ("run", *PLANAR, "num_replicates=1", *DRAFT, "--only", "via-point GA")
    assert "(unchanged)" not in evoexp(*words).out
    (page,) = outputs.glob("reports/*/index.md")
    content, drawn = page.read_bytes(), page.stat().st_mtime_ns
    assert "index.html (unchanged)\n" in evoexp(*words).out
    assert page.stat().st_mtime_ns == drawn
    assert evoexp("report", "--check", *words[1:]).code == 0
    (log,) = outputs.glob("runs/*/replicates/0000.mcap")
    for change in (
        lambda: page.write_bytes(b"altered"),
        lambda: page.with_suffix(".html").unlink(),
        lambda: os.utime(log, ns=(1, 1)),
    ):
        change()
        assert "(unchanged)" not in evoexp(*words).out
        assert page.read_bytes() == content
    assert "(unchanged)" in evoexp(*words).out
    assert "(unchanged)" not in evoexp(*words, "report.confidence=0.9").out


def test_several_experiments_share_a_batch_and_a_condition_runs_once(
    evoexp: Evoexp, outputs: Path
) -> None:
    experiments = ("-m", "experiment=rana_planar,rana_three_arms", "control=null")
    said = evoexp("run", *experiments, *SERIAL, "num_replicates=1", "--no-report")
    assert said.code == 0
    assert "replicates: 2 of 2 done" in said.out, "all labels of rana_planar are one condition"
    assert len(find_runs(outputs)) == 2
    assert all(f"{name}@smoke+" in said.out for name in ("rana_planar", "rana_three_arms"))


def test_the_manifest_holds_a_command_that_runs_it_again(evoexp: Evoexp, outputs: Path) -> None:
    label = "random search · seed=1"
    swept = ("num_replicates=1", "-m", "seed=0,1", "--only", label, "--no-report")
    assert evoexp("run", *PLANAR, *swept, "runner.address=tcp://host:1").code == 0
    (run,) = find_runs(outputs)
    manifest = run.manifest()
    assert "host" not in manifest["command"]
    assert (manifest["experiment"], manifest["label"]) == ("rana_planar", label)
    words = shlex.split(manifest["command"])
    assert words[:2] == ["evoexp", "run"]
    assert "nothing to run" in evoexp(*words[1:], "--no-report").out
    assert len(find_runs(outputs)) == 1


def test_reproduce_matches(evoexp: Evoexp, stored: Path) -> None:
    for run in find_runs(stored):
        said = evoexp("reproduce", run.hash12[:8])
        assert (said.code, said.err) == (0, "")
        assert said.out.count("MATCH") == 3 and said.out.endswith("2 of 2 MATCH\n")
        for words in ((run.hash12, "--replicate", "1"), (str(run.log_path(0)),)):
            one = evoexp("reproduce", *words)
            assert (one.code, one.out.splitlines()[-1]) == (0, "1 of 1 MATCH")


def test_counts_of_a_stored_experiment(evoexp: Evoexp, stored: Path) -> None:
    first, second, *_ = find_runs(stored)
    first.log_path(1).write_bytes(b"cut")
    second.log_path(0).unlink()
    second.write_failure(0, "MemoryError", "Traceback")
    before = content(stored)
    said = evoexp("plan", *PLANAR, "--json")
    assert said.code == 0
    rows = {row["hash"]: row for row in json.loads(said.out)}
    cut, failed = rows[first.condition_id], rows[second.condition_id]
    assert (cut["planned"], cut["cached"], cut["missing"], cut["damaged"]) == (2, 1, 1, 1)
    assert (failed["cached"], failed["missing"], failed["failed"]) == (1, 0, 1)
    said = evoexp("plan", *PLANAR).out
    assert "1 replicate to run; " in said and "; 1 failed before, which start with --retry" in said
    assert cut["cpu_s_each"] > 0.0 and cut["cpu_s_from"] == "1 of its own"
    changed = {path for path, data in content(stored).items() if before.get(path) != data}
    assert {path.suffix for path in changed} <= {".parquet"}


def test_times_come_from_other_runs_of_the_scene(evoexp: Evoexp, stored: Path) -> None:
    longer = [word.replace("num_generations=2", "num_generations=8") for word in PLANAR]
    said = evoexp("plan", *longer, "--json")
    rows = json.loads(said.out)
    assert all("1 other runs of the scene" in row["cpu_s_from"] for row in rows)
    assert all(row["cpu_s_least"] < row["cpu_s_each"] < row["cpu_s_most"] for row in rows)
    assert " to " in evoexp("plan", *longer).out
    known = json.loads(evoexp("plan", *PLANAR, "--json").out)
    for row, own in zip(rows, known, strict=True):
        assert row["cached"] == 0 and row["cpu_s_each"] > own["cpu_s_each"] > 0.0


def test_nothing_is_known_where_nothing_is_stored(evoexp: Evoexp, outputs: Path) -> None:
    said = evoexp("plan", *PLANAR)
    assert said.code == 0 and not outputs.exists()
    assert "6 replicates to run; of unknown length; at most " in said.out


def test_runs_of_other_revisions_are_named(evoexp: Evoexp, run: RunDirectory, stored: Path) -> None:
    text = (run.path / "config.json").read_bytes().replace(b'"revision":1', b'"revision":0')
    name = sha256(text).hexdigest()[:12]
    (stored / "runs" / name).mkdir()
    (stored / "runs" / name / "config.json").write_bytes(text)
    rows = {row["hash"]: row for row in json.loads(evoexp("plan", *PLANAR, "--json").out)}
    assert rows[run.condition_id]["other_revision"] == [name]
    assert sum(len(row["other_revision"]) for row in rows.values()) == 1
    found = json.loads(evoexp("clean", "old_revision", "--json").out)
    assert [Path(each["path"]).name for each in found] == [name]


# Progress of a batch: condition by condition on a terminal, lines in a pipe

WANTED = {"a": ("via-point GA", 3), "b": ("[bold]random search", 2)}


def outcome(key: str, cost: float | None) -> Outcome:
    if cost is None:
        return Outcome(key, 0, "broken", "", b"", 0.1)
    summary: Any = SimpleNamespace(best_cost=cost)
    return Outcome(key, 0, "", "", b"", 0.1, summary)


def console(is_terminal: bool) -> Console:
    settings = {"width": 120, "markup": False, "color_system": None}
    return Console(file=io.StringIO(), force_terminal=is_terminal, **settings)


def lines(of: Console) -> list[str]:
    assert isinstance(of.file, io.StringIO)
    return of.file.getvalue().splitlines()


def test_a_pipe_has_lines() -> None:
    out, clock = console(is_terminal=False), [0.0]
    progress = BatchProgress(out, WANTED, clock=lambda: clock[0])
    with progress.shown():
        for clock[0], key, cost in ((60.0, "a", 5.0), (70.0, "b", 5.0), (71.0, "a", None)):
            progress.count(outcome(key, cost))
    assert lines(out) == [
        "replicates: 1 of 5 done, 0 failed, ETA –",  # the first one compiles
        "replicates: 2 of 5 done, 0 failed, ETA 30 s",
        "replicates: 2 of 5 done, 1 failed, ETA 11 s",
    ]


def test_a_terminal_has_a_row_per_condition() -> None:
    out = console(is_terminal=True)
    progress = BatchProgress(out, WANTED)
    with progress.shown():
        for key, cost in (("a", 5.0), ("a", 3.0), ("b", None)):
            progress.count(outcome(key, cost))
    first, second, total = lines(out)[-4:-1]
    assert "via-point GA" in first and "2/3 0 failed best 3" in first
    assert "[bold]random search" in second and "1/2 1 failed" in second
    assert "replicates" in total and "3/5 1 failed" in total
    assert lines(out)[-1].endswith("\x1b[?25h"), "the cursor is given back"


def test_of_many_conditions_the_last_ones_are_shown() -> None:
    out = console(is_terminal=True)
    progress = BatchProgress(out, {str(k): (f"condition {k}", 1) for k in range(40)})
    with progress.shown():
        for k in range(40):
            progress.count(outcome(str(k), 1.0))
    shown = [line for line in lines(out)[-MOST_ROWS - 3 :] if "condition" in line]
    assert "condition 28 " in shown[0] and "condition 39 " in shown[-1]
    assert len(shown) == MOST_ROWS


# `--live`


@pytest.fixture
def heard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return what has a worker leave a curve of best costs."""
    monkeypatch.setattr(jobs_module, "INTERVAL_S", 0.0)
    file, best = CurveFile(tmp_path, "b", 1), np.zeros(1)

    def hear(costs: Iterable[float]) -> None:
        for k, cost in enumerate(costs):
            numbers = (cost, cost, cost, 0.0, 1, k, k, cost < np.inf)
            file.hear(Block.of(Generation(k, best, *numbers, {}, np.array([cost]), best)))

    return hear


def test_workers_leave_curves_that_are_shown(tmp_path: Path, heard: Callable[..., None]) -> None:
    heard([np.inf, 8.0, 4.0])
    (tmp_path / "1.json").write_text("half a fi")
    (curve,) = read_curves(tmp_path)
    out = console(is_terminal=True)
    progress = BatchProgress(out, WANTED, tmp_path)
    with progress.shown():
        progress.count(outcome("a", 5.0))
    (row,) = [line for line in lines(out)[-4:] if "random search" in line]
    assert f"{curve.generation} {drawn(curve.costs)}" in row


@pytest.mark.parametrize(
    ("costs", "expected"),
    [
        ([3.0], "▁"),
        ([3.0, 3.0], "▁▁"),
        ([np.inf], "x"),
        ([8.0, 4.5, 1.0], "█▅▁"),
        (list(np.arange(100.0)[::-1]), "██▇▇▆▆▅▅▄▄▃▃▂▂▁▁"),
    ],
)
def test_a_curve_is_drawn_between_its_extremes(costs: list[float], expected: str) -> None:
    assert drawn(costs) == expected


@pytest.mark.parametrize("last", [0, 40, NUM_POINTS - 1, NUM_POINTS, 1000])
def test_curves_are_thinned_with_both_ends(
    tmp_path: Path, heard: Callable[..., None], last: int
) -> None:
    heard(map(float, range(last + 1)))
    (curve,) = read_curves(tmp_path)
    assert len(curve.costs) == min(last + 1, NUM_POINTS)
    assert (curve.costs[0], curve.costs[-1]) == (0.0, float(last))
    assert curve.costs == sorted(set(curve.costs))
