"""Whole reports: their files, what these were drawn from, and what the index says of them."""

import dataclasses
import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import pandas as pd
import pytest

from evoexp import cli
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.papers.rana import claims as rana_claims
from evoexp.papers.rana import measures
from evoexp.report.pages import build
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from evoexp.store.run_directory import RunDirectory
from report_samples import REPORT, SMALL, expand, store

SCRIPT = """
import sys
from pathlib import Path
sys.path[:0] = sys.argv[2:]
from test_build import draw, expand
draw(Path(sys.argv[1]), expand("rana_planar"))
"""
FIGURES = ["fig_1_arms", "fig_2_via_points", "fig_3_circles", "fig_4_snapshots", "fig_5_fitness"]
FIGURES += ["fig_6_paths", "fig_7_distances"]


def draw(outputs: Path, experiment: Experiment, page: str | None = "rana", *formats: str) -> Path:
    """Write a report; return its page in Markdown."""
    name, budget = experiment.report_name, experiment.budget
    settings = ReportSettings(**REPORT | {"figures": page, "formats": formats or ("svg", "png")})
    planned = experiment.conditions, settings, experiment.num_replicates
    words = f"{experiment.name} budget={budget}"
    request = build.Request(name, experiment.name, budget, *planned, words)
    return request.write(outputs).with_suffix(".md")


def contents(page: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(page.parent.iterdir())}


@pytest.fixture(scope="module")
def page(stored: Path) -> Path:
    return draw(stored, expand("rana_planar"))


def test_a_report_is_seven_figures_with_data_and_sidecars(page: Path) -> None:
    tables = [name for name in contents(page) if name.endswith(".tex")]
    assert "table_1_claims.tex" in tables and len(tables) == 7
    (motion,) = (name for name in contents(page) if name.startswith("motion_"))
    files = [f"{stem}.{kind}" for stem in FIGURES for kind in ("csv", "json", "png", "svg")]
    assert sorted(contents(page)) == sorted([*files, "index.html", "index.md", motion, *tables])


def test_the_motion_is_played_beside_the_figure_that_shows_it(page: Path, results: Results) -> None:
    first = results.conditions[0]
    name = f"motion_{first.condition.id[:12]}_{first.best_replicate:04d}.html"
    assert f"rana_planar · {first.label}" in (page.parent / name).read_text()
    figures = page.read_text().split("### ")
    assert [part.split(":")[0] for part in figures if f"]({name})" in part] == ["Fig. 4"]


@pytest.mark.parametrize("stem", FIGURES)
def test_sidecars_tell_what_a_figure_was_drawn_from(
    page: Path, results: Results, stem: str
) -> None:
    sidecar = json.loads((page.parent / f"{stem}.json").read_text())
    data, files = sidecar["data"], sidecar["files"]
    assert sorted(files) == [f"{stem}.png", f"{stem}.svg"]
    for name, digest in [*files.items(), (data["file"], data["sha256"])]:
        assert hashlib.sha256((page.parent / name).read_bytes()).hexdigest() == digest
    rows = pd.read_csv(page.parent / data["file"])
    assert len(rows) == data["rows"] and set(data["columns"]) == set(rows.columns)
    assert set(data["columns"].values()) <= {"text", "integer", "number", "true or false"}
    assert all(name in data["description"] for name in rows.columns)
    shown = results.conditions if stem == "fig_5_fitness" else results.conditions[:1]
    keys = ("run", "label", "planned", "done", "failed")
    told = [tuple(c[key] for key in keys) for c in sidecar["conditions"]]
    assert told == [(c.condition.id, c.label, 2, 2, 0) for c in shown]


@pytest.mark.matrix
def test_a_report_is_the_same_in_another_process(page: Path, stored: Path, tmp_path: Path) -> None:
    first = contents(page)
    for path in page.parent.iterdir():
        path.unlink()
    other = {"PYTHONHASHSEED": "12345", "MPLCONFIGDIR": str(tmp_path), "TZ": "Asia/Tokyo"}
    folders = map(str, Path(__file__).parents[:2])
    command = [sys.executable, "-c", SCRIPT, str(stored), *folders]
    subprocess.run(command, check=True, env=os.environ | other | {"LANG": "C"}, cwd=tmp_path)
    again = contents(page)
    assert sorted(again) == sorted(first)
    assert [name for name in first if first[name] != again[name]] == []


def test_nothing_in_a_report_tells_where_or_when_it_was_made(page: Path, stored: Path) -> None:
    for name, content in contents(page).items():
        assert str(stored).encode() not in content, name
        assert not re.search(rb"20\d\d-\d\d-\d\d", content), name


def test_the_index_says_it_all(page: Path, results: Results) -> None:
    text = page.read_text()
    rows = [f"| {c.label} | `{c.condition.id[:12]}` | 2 | 2 | 0 |" for c in results.conditions]
    rows += ["| solved | certified | refuted | undecided | solved, yet refuted | required margin n"]
    rows += ["| `ga.crossover_rate` | 0.9 | – | paper: Tab. 1, cross_over_probability |"]
    rows += ["| `ga.population_size` | 12 | – | override |", "via-point GA against random search"]
    assert [row for row in rows if row not in text] == []
    assert text.count("not judged (budget smoke)") == 13
    assert re.search(r"C5 = [1-9]\d* of 20 instants", text)
    assert all((page.parent / link).is_file() for link in re.findall(r"\]\(([^)]+)\)", text))
    assert "Partial results" not in text
    assert "nan" not in text.lower().replace("dominan", "")


def test_partial_results_are_drawn_and_said(tmp_path: Path, blank_figures: None) -> None:
    experiment = expand("rana_planar", "ga.num_generations=1")
    store(tmp_path, experiment)
    ga, *controls = (RunDirectory(tmp_path, c.condition.id) for c in experiment.conditions)
    ga.write_failure(1, "ValueError: no luck | at all", "traceback")
    for log in (ga.log_path(1), *(c.log_path(k) for c in controls for k in (0, 1))):
        log.unlink()
    page = draw(tmp_path, experiment, "rana", "svg")
    text = page.read_text()
    partial = "via-point GA: 1 of 2 replicates done, 1 failed; random search: 0 of 2"
    assert f"**Partial results.** {partial}" in text
    assert "| via-point GA | 1 | ValueError: no luck \\| at all |" in text
    assert "no control beside it" in text
    assert (page.parent / "fig_7_distances.svg").is_file()
    (only,) = json.loads((page.parent / "fig_5_fitness.json").read_text())["conditions"]
    assert (only["done"], only["failed"]) == (1, 1)
    ga.log_path(0).unlink()
    text = draw(tmp_path, experiment, "rana", "svg").read_text()
    assert "0 of 2 replicates done, 1 failed" in text
    left = {name for name in contents(page) if not name.endswith(".tex")}
    assert left == {"index.html", "index.md"}  # the figures of before are gone


def test_methods_of_co_evolution_are_drawn_and_paired(tmp_path: Path) -> None:
    words = ("ga.num_generations=3", "num_replicates=3")
    name, hall = ("experiment=curkovic_methods", "budget=smoke"), "ga.hall_depth=0.25"
    with_hall = compose.expand([*name, hall, *words], only=["V", "VI"])[0]
    plain = compose.expand([*name, *words], only=["I", "II"])[0]
    experiment = with_hall._replace(conditions=plain.conditions + with_hall.conditions)
    store(tmp_path, experiment)
    page = draw(tmp_path, experiment, "curkovic", "svg")
    text = page.read_text()
    assert "V against I |" in text and "VI against II |" in text
    assert "VII against III" not in text
    series = dict(list(pd.read_csv(page.parent / "fig_6_methods.csv").groupby("series")))
    assert set(series) == {"best so far", "final", "lower bound", "threshold"}
    bound, final = series["lower bound"]["value"].item(), series["final"]
    assert bound == pytest.approx(7.48, abs=0.005)
    assert (final["value"] >= bound).all()
    curve = series["best so far"].query("method == 'V'")
    assert curve["value"].is_monotonic_decreasing
    last = final.loc[final["method"] == "V", "value"]
    assert curve["value"].iloc[-1] == pytest.approx(last.mean())
    assert curve["deviation"].iloc[-1] == pytest.approx(last.std())


def test_claims_are_judged_only_on_the_papers_own_settings(results: Results) -> None:
    (_, paper), *_ = compose.expand(["experiment=rana_planar"])[0].conditions
    own, judged = results.conditions[0], results._replace(budget="paper")
    for given, condition, planned, reason in (
        (judged, paper, 200, ""),
        (results, paper, 200, "budget smoke"),
        (judged, paper, 3, "3 of 200 replicates planned"),
        (judged, own.condition, 200, "overridden: ga.population_size, ga.num_generations"),
    ):
        changed = dataclasses.replace(own, condition=condition, planned=planned)
        assert rana_claims.not_judged(given, changed) == reason


def test_redistribution_is_applied_to_solved_strings_only(results: Results) -> None:
    search = results.conditions[1]
    assert 0 <= measures.colliding_after(search, relaxed=False) <= search.solved
    none = dataclasses.replace(search, summaries=search.summaries.assign(solved=False))
    assert measures.colliding_after(none, relaxed=True) == 0


def test_drawing_leaves_matplotlib_as_it_was(page: Path) -> None:
    assert mpl.rcParams["svg.hashsalt"] == mpl.rcParamsDefault["svg.hashsalt"]
    pyplot = sys.modules.get("matplotlib.pyplot")  # axes in space import it
    assert pyplot is None or pyplot.get_fignums() == []


Report = Callable[..., Path]


@pytest.fixture
def report(
    stored: Path,
    monkeypatch: pytest.MonkeyPatch,
    blank_figures: None,
    capsys: pytest.CaptureFixture[str],
) -> Report:
    """Return the function that runs `evoexp report`; it gives the page in Markdown."""
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))

    def report(*words: str) -> Path:
        assert cli.main(["report", *words]) == 0
        named = Path(capsys.readouterr().out.removeprefix("report: ").strip())
        assert named.name == "index.html"
        return named.with_suffix(".md")

    return report


def test_a_report_names_the_command_that_draws_it(report: Report, stored: Path) -> None:
    index = report("rana_planar", *SMALL)
    assert index == stored / "reports" / expand("rana_planar").report_name / "index.md"
    others = " ".join(word for word in SMALL if not word.startswith("budget"))
    made_by = f"Made by `evoexp report rana_planar budget=smoke {others}`"
    assert made_by in index.read_text()


def test_the_experiment_may_be_an_override_as_for_run(report: Report) -> None:
    words = "experiment=rana_planar", *SMALL, "report.dpi=40", "--only", "random search"
    text = report(*words).read_text()
    assert "--only 'random search'`" in text and "| via-point GA |" not in text


def test_runs_by_prefixes_of_their_hashes(report: Report) -> None:
    one, two, *_ = (c.condition.id for c in expand("rana_planar").conditions)
    index = report(one[:6], two[:8].upper())
    assert index.parent.name == f"{one[:12]}+{two[:12]}"
    text = index.read_text()
    assert f"`evoexp report {one[:12]} {two[:12]}`" in text
    assert f"{one[:12]} against {two[:12]}" in text
