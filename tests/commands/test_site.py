"""`evoexp site`, `evoexp report --all` and `evoexp report --check`."""

import json
from pathlib import Path

import pytest
from command_samples import SMALL, Evoexp, content

from evoexp.commands import report
from evoexp.commands.report import KEYS
from evoexp.configuration.search_path import options
from evoexp.registry import CLAIMS, Registration, registrations
from evoexp.report.statistics.judging import registered_rules
from evoexp.shipped import shipped
from evoexp.store.run_directory import RunDirectory
from html_reader import Page
from store_lookup import find_runs

WORDS = ("rana_planar", *SMALL, "report.formats=[svg]")


@pytest.fixture
def drawn(stored: Path, evoexp: Evoexp) -> Path:
    """Return the folder of a report."""
    said = evoexp("report", *WORDS)
    assert said.code == 0, said
    return Path(said.out.removeprefix("report: ").strip()).parent


def test_the_home_page_lists_reports_and_runs(drawn: Path, stored: Path, evoexp: Evoexp) -> None:
    said = evoexp("site")
    home = stored / "reports" / "index.html"
    assert (said.code, said.out, said.err) == (0, f"site: {home}\n", "")
    first = home.read_bytes()
    page = Page(first)
    page.check(stored / "reports")
    runs = {run.hash12 for run in find_runs(stored)}
    states = {row[0]: row[4].split(":")[0] for row in page.tables()[0][1:]}
    assert states == dict.fromkeys(runs, "done")
    report = Page((drawn / "index.html").read_bytes())
    places = {f"run-{name}" for name in runs}
    assert places == {each.partition("#")[2] for each in page.addresses() if "?home#" in each}
    assert places <= {str(each.attributes.get("id")) for each in report.elements}
    assert str(stored).encode() not in first
    evoexp("site")
    assert home.read_bytes() == first


def test_all_reports_are_those_of_experiments_that_were_run(
    monkeypatch: pytest.MonkeyPatch, outputs: Path
) -> None:
    """Experiments share runs: a shared one alone does not make a report of each of them."""
    papers = [row for row in shipped() if row.budget == "paper"]
    ids = {(row.experiment, row.label): row.condition_id for row in papers}
    planar = ids["rana_planar", "via-point GA"]
    assert ids["rana_planar_ablations", "as printed"] == planar
    notes = {planar: ("rana_planar", "paper"), "f" * 64: ("rana_puma", "paper")}

    class Run(RunDirectory):
        def completed(self) -> set[int]:
            return {0}

        def manifest(self) -> dict[str, object]:
            return dict(zip(("experiment", "budget"), notes[self.condition_id], strict=True))

    runs = [(each, Run(outputs, each)) for each in notes]
    monkeypatch.setattr(report, "stored_runs", lambda outputs: runs)
    assert list(report.planned_reports(outputs)) == ["rana_planar"]


def test_all_reports_are_drawn_again_by_their_own_commands(
    drawn: Path, stored: Path, evoexp: Evoexp
) -> None:
    home = stored / "reports" / "index.html"
    evoexp("site")
    before = content(stored / "reports")
    for name in ("index.md", "fig_5_fitness.svg"):
        (drawn / name).write_bytes(b"")
    said = evoexp("report", "--all")
    assert said.out.splitlines() == [f"report: {drawn / 'index.html'}", f"site: {home}"]
    assert content(stored / "reports") == before


def test_the_check_names_every_file_that_is_not_as_it_should_be(
    drawn: Path, stored: Path, evoexp: Evoexp
) -> None:
    said = evoexp("report", "--check", *WORDS)
    assert (said.code, said.out.count("\n")) == (0, 1) and said.out.startswith("check: ")
    for name in ("fig_5_fitness.csv", "index.html"):
        (drawn / name).write_bytes((drawn / name).read_bytes()[:-2] + b"\n\n")
    (drawn / "fig_6_paths.svg").unlink()
    (drawn / "fig_99.svg").write_bytes(b"of an earlier report")
    before = content(stored)
    said = evoexp("report", "--check", *WORDS)
    *lines, last = said.out.splitlines()
    assert lines == [
        f"differs: {drawn / 'fig_5_fitness.csv'}",
        f"missing: {drawn / 'fig_6_paths.svg'}",
        f"differs: {drawn / 'index.html'}",
        f"left over: {drawn / 'fig_99.svg'}",
    ]
    assert said.code == 1 and last.endswith(": 4 not as they follow from the outputs")
    assert content(stored) == before


def test_the_check_of_all_looks_at_the_home_page_too(
    drawn: Path, stored: Path, evoexp: Evoexp
) -> None:
    home = stored / "reports" / "index.html"
    said = evoexp("report", "--check", "--all")
    assert said.code == 1 and said.out.startswith(f"missing: {home}\n")
    evoexp("site")
    assert evoexp("report", "--check", "--all").code == 0
    find_runs(stored)[0].write_failure(7, "ValueError: no luck", "traceback")
    said = evoexp("report", "--check", "--all")
    assert said.code == 1
    assert {f"differs: {drawn / 'index.html'}", f"differs: {home}"} <= {*said.out.splitlines()}


def test_a_report_that_names_no_command_is_left_as_it_is(stored: Path, evoexp: Evoexp) -> None:
    for name, command in (("strange", "clean --delete"), ("other", "report --nonsense")):
        summary = json.dumps({"title": name, "command": command})
        (stored / "reports" / name).mkdir(parents=True)
        (stored / "reports" / name / "index.html").write_text(
            f'<script type="application/json" id="summary">{summary}</script>'
        )
    before = content(stored / "reports" / "strange")
    said = evoexp("report", "--all")
    assert said.code == 1
    assert "cannot be drawn: strange: strange: names no command that draws it" in said.out
    assert "cannot be drawn: other: no option '--nonsense'" in said.out
    assert content(stored / "reports" / "strange") == before


@pytest.mark.usefixtures("drawn")
def test_a_sweep_that_runs_is_told(run: RunDirectory, stored: Path, evoexp: Evoexp) -> None:
    run.note_plan(9)
    assert "being written now" not in evoexp("site").out
    with RunDirectory(stored, run.condition_id).lock():
        said = evoexp("site")
    assert f"1 run is being written now ({run.hash12})" in said.out
    home = Page((stored / "reports" / "index.html").read_bytes())
    states = {row[0]: row[4] for row in home.tables()[0][1:]}
    assert states[run.hash12].startswith("partial: ")
    evoexp("report", *WORDS)
    evoexp("site")
    home = Page((stored / "reports" / "index.html").read_bytes())
    assert "Partial results." in home.all("div", class_="notice")[0].text


# `evoexp claims`: every claim with rule, numbers, n and verdict, run or not


def test_a_claim_that_nothing_was_run_for_names_the_command(evoexp: Evoexp) -> None:
    said = evoexp("claims", "lavoie")
    assert said.code == 0 and "{" not in said.out
    assert "evoexp run experiment=lavoie_controls" in said.out and "not run" in said.out


def test_a_claim_is_traced_to_rule_numbers_and_n(evoexp: Evoexp, outputs: Path) -> None:
    assert evoexp("run", "experiment=chen_fields", "--no-report").code == 0
    every = json.loads(evoexp("claims", "chen", "--json").out)
    rows = [row for row in every if row["experiment"] == "chen_fields"]
    assert rows
    for row in rows:
        assert list(row) == list(KEYS)
        assert row["rule"].startswith("reproduced if ")
        assert row["verdict"] in ("reproduced", "contradicted")
        assert row["command"] == "evoexp report chen_fields"
    assert any("nodes as printed" in row["evidence"] for row in rows)


def test_a_rule_is_listed_once_for_the_same_runs_by_who_was_run(evoexp: Evoexp) -> None:
    """`rana` has the conditions of `rana_planar`; where it was not run, these are not hidden."""
    for experiment, judging in (("rana_planar", "rana_planar"), ("rana", "rana")):
        said = evoexp("run", f"experiment={experiment}", "num_replicates=1", "--no-report")
        assert said.code == 0
        rows = json.loads(evoexp("claims", "rana", "--json").out)
        found = {r["experiment"] for r in rows if r["name"] == "margin_of_bodies"}
        ran = {r["experiment"] for r in rows if r["verdict"] != "not run"}
        assert judging in found & ran
    assert "rana_planar" not in found


@pytest.mark.parametrize("paper", registrations(CLAIMS), ids=lambda each: each.name)
def test_every_experiment_that_a_rule_names_is_there(paper: Registration) -> None:
    for rule in registered_rules(paper).values():
        assert rule.experiments, rule.name
        assert not set(rule.experiments) - set(options("experiment")), rule.name
