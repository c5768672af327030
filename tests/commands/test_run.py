"""`evoexp run` and `evoexp reproduce` on small experiments."""

import json
import os
import re
import shlex
from pathlib import Path

import pandas as pd
import pytest
from command_samples import SERIAL, SMALL, Evoexp, exit_code

from evoexp import load
from evoexp.configuration import compose
from store_lookup import find_runs

PLANAR = ("experiment=rana_planar", *SERIAL)


def test_a_run_says_what_is_there_and_runs_nothing_twice(
    evoexp: Evoexp, outputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    first = evoexp("run", *PLANAR, "--no-report")
    assert (first.code, first.err) == (0, "")
    assert re.search(r"^replicates: 6 of 6 done, 0 failed, ETA 0 s$", first.out, re.MULTILINE)
    for label, condition in compose.expand(PLANAR)[0].conditions:
        assert condition.id[:12] in first.out
        assert label.split(" ")[0] in first.out
    assert first.out.count("2 of 2") == 3
    assert "…" not in first.out
    assert max(map(len, first.out.splitlines())) <= 80
    again = evoexp("run", *PLANAR, "--no-report")
    assert again.code == 0
    assert again.out.startswith("nothing to run: every replicate is there\n")
    assert again.out.split("\n", 1)[1] == first.out[first.out.index("rana_planar@smoke") :]
    assert not (outputs / "reports").exists()


def test_conditions_that_become_one_are_one_row_everywhere(
    evoexp: Evoexp, outputs: Path, wide_terminal: None
) -> None:
    words = ("experiment=rana_planar", "control=cma_es", "ga.num_generations=20", *SERIAL)
    words = tuple(word for word in words if word != "ga.num_generations=2")  # the cap counts
    said = evoexp("run", *words, "report.formats=[png]", "report.dpi=20")
    (condition,) = (c for _, c in compose.expand(words)[0].conditions)
    table = [line for line in said.out.splitlines() if condition.id[:12] in line]
    assert len(table) == 1 and table[0].split("│")[1].strip() == "cma_es"
    assert "via-point GA" not in said.out
    # the store, the Python door, and all pages and tables say the same
    (run,) = find_runs(outputs)
    row = pd.read_parquet(run.summary_path).iloc[0]
    named = {"experiment": "rana_planar", "label": "cma_es", "budget": "smoke"}
    assert {name: row[name] for name in named} == named and row["control"] == "cma_es"
    assert set(load("rana_planar", *words[1:], budget="smoke").summaries["label"]) == {"cma_es"}
    (listed,) = json.loads(evoexp("list", "--json").out)["runs"]
    assert {name: listed[name] for name in named} == named and listed["changed"]
    shown = json.loads(evoexp("show", run.hash12, "--json").out)["origin"]
    assert {name: shown[name] for name in named} == named
    (planned,) = json.loads(evoexp("plan", *words, "--json").out)
    (compared,) = json.loads(evoexp("compare", "rana_planar", *words[1:], "--json").out)
    assert planned["label"] == compared["condition"] == "cma_es"
    (page,) = (outputs / "reports").glob("rana_planar@smoke+*/index.md")
    assert f"{run.hash12}" in page.read_text() and "random search" not in page.read_text()
    assert evoexp("site").code == 0
    home = (outputs / "reports" / "index.html").read_text()
    assert "cma_es" in home and "via-point GA" not in home


def test_a_budget_of_fewer_replicates_is_no_budget_of_a_condition(
    evoexp: Evoexp, outputs: Path
) -> None:
    words = ("experiment=rana_planar", "budget=quick", "runner=serial", "num_replicates=1")
    small = ("ga.num_generations=2", "ga.population_size=8", "--only", "via-point GA")
    assert evoexp("run", *words, *small, "--no-report").code == 0
    (run,) = find_runs(outputs)
    (listed,) = json.loads(evoexp("list", "--json").out)["runs"]
    assert listed["budget"] == "paper" == pd.read_parquet(run.summary_path)["budget"][0]


def test_terminal_and_report_have_all_stored_replicates(evoexp: Evoexp, stored: Path) -> None:
    said = evoexp(
        "run", *PLANAR, "num_replicates=1", "report=paper", "report.formats=[png]", "report.dpi=20"
    )
    assert said.out.count("2 of 2") == 3
    assert "of 1 asked for: all that are stored, here and in the report" in said.out
    (page,) = (stored / "reports").glob("*/index.md")
    assert "| `num_replicates` | 2 |" in page.read_text()
    said = evoexp("run", *PLANAR, "--no-report")
    assert "asked for: all" not in said.out


def test_a_run_ends_with_its_report(outputs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("num_replicates=1", "report=paper", "report.formats=[png]", "report.dpi=20")
    assert exit_code("run", *PLANAR, *words) == 0
    out = capsys.readouterr().out
    (line,) = [line for line in out.splitlines() if line.startswith("report: ")]
    page = Path(line.removeprefix("report: "))
    assert page.name == "index.html"
    assert page.parent.parent == outputs / "reports"
    assert page.parent.name == compose.expand(PLANAR)[0].report_name
    assert "ga.population_size=8" in page.with_suffix(".md").read_text()
    assert len({path.read_bytes() for path in page.parent.glob("*.png")}) > 3, "figures are drawn"


def test_a_report_is_drawn_again_where_something_changed(evoexp: Evoexp, outputs: Path) -> None:
    words = ("run", *PLANAR, "num_replicates=1", "report.formats=[png]", "report.dpi=20")
    words = (*words, "--only", "via-point GA")
    assert "(as it was)" not in evoexp(*words).out
    (page,) = outputs.glob("reports/*/index.md")
    content, drawn = page.read_bytes(), page.stat().st_mtime_ns
    assert "index.html (as it was)\n" in evoexp(*words).out
    assert page.stat().st_mtime_ns == drawn
    assert evoexp("report", "--check", *words[1:]).code == 0
    (log,) = outputs.glob("runs/*/replicates/0000.mcap")
    changes = (
        lambda: page.write_bytes(b"altered"),
        lambda: page.with_suffix(".html").unlink(),
        lambda: os.utime(log, ns=(1, 1)),
    )
    for change in changes:
        change()
        assert "(as it was)" not in evoexp(*words).out
        assert page.read_bytes() == content
    assert "(as it was)" in evoexp(*words).out
    assert "(as it was)" not in evoexp(*words, "report.confidence=0.9").out


def test_several_experiments_share_a_batch_and_a_condition_runs_once(
    evoexp: Evoexp, outputs: Path
) -> None:
    words = (
        "-m",
        "experiment=rana_planar,rana_three_arms",
        *SERIAL,
        "num_replicates=1",
        "control=null",
        "--no-report",
    )
    said = evoexp("run", *words)
    assert said.code == 0
    assert "replicates: 2 of 2 done" in said.out, (
        "both labels of rana_planar are one condition without its control"
    )
    assert len(find_runs(outputs)) == 2
    assert "rana_planar@smoke+" in said.out
    assert "rana_three_arms@smoke+" in said.out


def test_the_manifest_holds_a_command_that_runs_it_again(evoexp: Evoexp, outputs: Path) -> None:
    assert (
        evoexp(
            "run",
            *PLANAR,
            "num_replicates=1",
            "-m",
            "seed=0,1",
            "--only",
            "random search · seed=1",
            "--no-report",
        ).code
        == 0
    )
    (run,) = find_runs(outputs)
    manifest = run.manifest()
    assert (manifest["experiment"], manifest["label"]) == ("rana_planar", "random search · seed=1")
    words = shlex.split(manifest["command"])
    assert words[:2] == ["evoexp", "run"]
    said = evoexp(*words[1:], "--no-report")
    assert "nothing to run: every replicate is there" in said.out
    assert len(find_runs(outputs)) == 1


def test_the_command_line_has_no_say_in_the_identity(evoexp: Evoexp, stored: Path) -> None:
    before = {run.hash12 for run in find_runs(stored)}
    for words in (
        (*reversed(SMALL), "experiment=rana_planar", "runner.num_workers=1", "num_replicates=1"),
        (*PLANAR, "scenario.security_margin=1", "report.dpi=50", "seed=0"),
        (*PLANAR, "--only", "via-point GA"),
        (*PLANAR, "-m"),
    ):
        said = evoexp("run", *words, "--no-report")
        assert said.out.startswith("nothing to run: every replicate is there\n"), words
    assert {run.hash12 for run in find_runs(stored)} == before


def test_reproduce_matches(evoexp: Evoexp, stored: Path) -> None:
    for run in find_runs(stored):
        said = evoexp("reproduce", run.hash12[:8])
        assert (said.code, said.err) == (0, "")
        assert said.out.count("MATCH") == 3
        assert said.out.endswith("2 of 2 MATCH\n")
        one = evoexp("reproduce", run.hash12, "--replicate", "1")
        assert (one.code, one.out.splitlines()[-1]) == (0, "1 of 1 MATCH")
        log = evoexp("reproduce", str(run.log_path(0)))
        assert (log.code, log.out.splitlines()[-1]) == (0, "1 of 1 MATCH")
