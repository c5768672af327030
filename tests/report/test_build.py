import dataclasses
import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import pandas as pd
import pytest

from evoexp.configuration import compose
from evoexp.errors import NothingStored, UnknownOption
from evoexp.papers.rana import claims as rana_claims
from evoexp.papers.rana import motions
from evoexp.report.pages import build
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results import swept_settings
from evoexp.report.results.stored_results import Results
from evoexp.store.run_directory import RunDirectory
from report_samples import REPORT, expand, store

SCRIPT = """
import sys
from pathlib import Path
sys.path[:0] = sys.argv[2:]
from test_build import draw
draw(Path(sys.argv[1]))
"""
FIGURES = [
    "fig_1_arms",
    "fig_2_via_points",
    "fig_3_circles",
    "fig_4_snapshots",
    "fig_5_fitness",
    "fig_6_paths",
    "fig_7_distances",
]
SPATIAL = [
    "fig_8_arm",
    "fig_9_two_arms",
    "fig_11_snapshots",
    "fig_12a_fitness",
    "fig_12b_configuration_space",
    "fig_12b_operational_space",
    "fig_13_distances",
]


def draw(
    outputs: Path,
    page: str | None = "rana",
    name: str = "rana_planar",
    *overrides: str,
    formats: tuple[str, ...] = ("svg", "png"),
) -> Path:
    experiment = expand(name, *overrides)
    request = build.Request(
        experiment.report_name, experiment.name, experiment.budget, experiment.conditions
    )
    return build.write_report(
        build.derived(
            request,
            ReportSettings(**REPORT | {"formats": formats, "figures": page}),
            outputs,
            experiment.num_replicates,
        )
    ).with_suffix(".md")  # type: ignore[arg-type]


def contents(page: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(page.parent.iterdir())}


@pytest.fixture(scope="module")
def page(stored: Path) -> Path:
    return draw(stored)


def test_a_report_is_seven_figures_with_data_and_sidecars(page: Path) -> None:
    kinds = ("csv", "json", "png", "svg")
    tables = [name for name in contents(page) if name.endswith(".tex")]
    assert "table_1_conditions.tex" in tables and len(tables) == 7
    motions = [name for name in contents(page) if name.startswith("motion_")]
    assert len(motions) == 1
    assert sorted(contents(page)) == sorted(
        [f"{stem}.{kind}" for stem in FIGURES for kind in kinds]
        + ["index.html", "index.md", *motions, *tables]
    )


def test_the_motion_is_played_beside_the_figure_that_shows_it(page: Path, results: Results) -> None:
    first = results.conditions[0]
    name = f"motion_{first.condition.id[:12]}_{first.best_replicate:04d}.html"
    assert f"rana_planar · {first.label}" in (page.parent / name).read_text()
    figures = page.read_text().split("### ")
    assert [part.split(":")[0] for part in figures if f"]({name})" in part] == ["Fig. 4"]


def test_sidecars_tell_what_a_figure_was_drawn_from(page: Path, results: Results) -> None:
    for stem in FIGURES:
        sidecar = json.loads((page.parent / f"{stem}.json").read_text())
        assert sorted(sidecar["files"]) == [f"{stem}.png", f"{stem}.svg"]
        data = sidecar["data"]
        for name, digest in [*sidecar["files"].items(), (data["file"], data["sha256"])]:
            assert hashlib.sha256((page.parent / name).read_bytes()).hexdigest() == digest
        rows = pd.read_csv(page.parent / data["file"])
        assert len(rows) == data["rows"] and set(data["columns"]) == set(rows.columns)
        assert set(data["columns"].values()) <= {"text", "integer", "number", "true or false"}
        assert all(name in data["description"] for name in rows.columns), (stem, data)
        shown = results.conditions if stem == "fig_5_fitness" else results.conditions[:1]
        assert [c["run"] for c in sidecar["conditions"]] == [c.condition.id for c in shown]
        assert [c["label"] for c in sidecar["conditions"]] == [c.label for c in shown]
        assert all(
            (c["planned"], c["done"], c["failed"]) == (2, 2, 0) for c in sidecar["conditions"]
        )


@pytest.mark.matrix
def test_a_report_is_the_same_in_another_process(page: Path, stored: Path, tmp_path: Path) -> None:
    first = contents(page)
    for path in page.parent.iterdir():
        path.unlink()
    other = os.environ | {
        "PYTHONHASHSEED": "12345",
        "MPLCONFIGDIR": str(tmp_path),
        "TZ": "Asia/Tokyo",
        "LANG": "C",
    }
    folders = map(str, Path(__file__).parents[:2])
    command = [sys.executable, "-c", SCRIPT, str(stored), *folders]
    subprocess.run(command, check=True, env=other, cwd=tmp_path)
    again = contents(page)
    assert sorted(again) == sorted(first)
    assert [name for name in first if first[name] != again[name]] == []


def test_nothing_in_a_report_tells_where_or_when_it_was_made(page: Path, stored: Path) -> None:
    for name, content in contents(page).items():
        assert str(stored).encode() not in content, name
        assert not re.search(rb"20\d\d-\d\d-\d\d", content), name


def test_the_index_says_it_all(page: Path, results: Results) -> None:
    text = page.read_text()
    for condition in results.conditions:
        assert f"| {condition.label} | `{condition.condition.id[:12]}` | 2 | 2 | 0 |" in text
    assert (
        "| solved | certified | refuted | undecided | solved, yet refuted "
        "| required margin not kept |" in text
    )
    assert "| `ga.crossover_rate` | 0.9 | – | paper: Tab. 1, cross_over_probability |" in text
    assert "| `ga.population_size` | 12 | – | override |" in text
    assert text.count("not judged (budget smoke)") == 4
    assert re.search(r"C5 = [1-9]\d* of 20 instants", text)
    assert "via-point GA against random search" in text
    for link in re.findall(r"\]\(([^)]+)\)", text):
        assert (page.parent / link).is_file(), link
    assert "Partial results" not in text
    assert "nan" not in text.lower().replace("dominan", "")


def test_the_command_in_the_index_makes_this_report(
    page: Path, stored: Path, monkeypatch: pytest.MonkeyPatch, blank_figures: None
) -> None:
    from evoexp import cli

    hashes = re.search(r"Made by `evoexp report ([^`]+)`", page.read_text())
    assert hashes
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    assert cli.main(["report", *hashes[1].split()]) == 0


def test_files_of_an_earlier_report_are_named_in_order(tmp_path: Path) -> None:
    for name in ("b.svg", "a.svg", "c.svg", build.INDEX, ".kept"):
        (tmp_path / name).touch()
    stale = build.stale_files(build.ReportFiles(tmp_path, {build.INDEX: b""}))
    assert [path.name for path in stale] == ["a.svg", "b.svg", "c.svg"]
    assert build.stale_files(build.ReportFiles(tmp_path / "none", {})) == []


def test_partial_results_are_drawn_and_said(tmp_path: Path, blank_figures: None) -> None:
    experiment = expand("rana_planar", "ga.num_generations=1")
    store(tmp_path, experiment)
    runs = [RunDirectory(tmp_path, c.condition.id) for c in experiment.conditions]
    ga, *controls = runs
    ga.log_path(1).unlink()
    ga.write_failure(1, "ValueError: no luck | at all", "traceback")
    for control in controls:
        for replicate in (0, 1):
            control.log_path(replicate).unlink()
    page = draw(tmp_path, "rana", "rana_planar", "ga.num_generations=1", formats=("svg",))
    text = page.read_text()
    assert (
        "**Partial results.** via-point GA: 1 of 2 replicates done, 1 failed; random search: 0 of 2"
        in text
    )
    assert "| via-point GA | 1 | ValueError: no luck \\| at all |" in text
    assert "no control beside it" in text
    assert (page.parent / "fig_7_distances.svg").is_file()
    sidecar = json.loads((page.parent / "fig_5_fitness.json").read_text())
    assert [(c["done"], c["failed"]) for c in sidecar["conditions"]] == [(1, 1)]
    ga.log_path(0).unlink()
    text = draw(
        tmp_path, "rana", "rana_planar", "ga.num_generations=1", formats=("svg",)
    ).read_text()
    assert "0 of 2 replicates done, 1 failed" in text
    left = {name for name in contents(page) if not name.endswith(".tex")}
    assert left == {"index.html", "index.md"}  # the figures of before are gone


@pytest.mark.matrix
def test_arms_in_space_have_the_papers_other_figures(tmp_path: Path) -> None:
    store(tmp_path, expand("rana_puma", "ga.num_generations=2"))
    page = draw(tmp_path, "rana", "rana_puma", "ga.num_generations=2", formats=("svg",))
    assert sorted(path.stem for path in page.parent.glob("*.svg")) == sorted(SPATIAL)
    text = page.read_text()
    assert [
        text.index(f"### Fig. {number}:") for number in ("8", "9", "11", "12a", "12b", "13")
    ] == sorted(
        text.index(f"### Fig. {number}:") for number in ("8", "9", "11", "12a", "12b", "13")
    )
    assert "C5 = 3 of 40 instants" in text
    both = pd.read_csv(page.parent / "fig_9_two_arms.csv")
    assert set(both["reach"]) == {2.0}
    assert len(both) == 2 * 2 * 3
    paths = pd.read_csv(page.parent / "fig_12b_operational_space.csv")
    assert {"x", "y", "z", "joint_3_deg"} <= set(paths)
    ends = paths[(paths["instant"] == 40) & (paths["arm"] == 0)]
    assert len(ends.round(9)[["x", "y", "z"]].drop_duplicates()) == 1


@pytest.mark.matrix
def test_one_page_holds_the_whole_paper(tmp_path: Path) -> None:
    words = ("ga.num_generations=1", "num_replicates=1")
    store(tmp_path, expand("rana", *words))
    page = draw(tmp_path, "rana", "rana", *words, formats=("svg",))
    stems = {path.stem for path in page.parent.glob("*.svg")}
    assert len(stems) == len(FIGURES) + len(SPATIAL)
    assert {f"{stem}_1_planar_arms" for stem in FIGURES} <= stems
    text = page.read_text()
    assert text.startswith("# Rana & Zalzala 1995: two planar arms and two PUMA-like arms")
    assert "PUMA-like arms against PUMA-like arms, random search" in text


@pytest.mark.matrix
def test_ablations_are_compared_with_the_first_condition(tmp_path: Path) -> None:
    words = ("ga.num_generations=2", "num_replicates=2")
    experiment = expand("rana_planar_ablations", *words)
    assert len(experiment.conditions) == 13
    store(tmp_path, experiment)
    page = draw(tmp_path, "ablations", "rana_planar_ablations", *words, formats=("svg",))
    assert {path.stem for path in page.parent.glob("*.svg")} == {
        "values",
        "effects",
        "convergence",
        "scene",
    }
    text = page.read_text()
    assert "## best cost: as printed against …" in text
    assert text.count("Relaxation and redistribution improve the search: against") == 3
    effects = pd.read_csv(page.parent / "effects.csv")
    assert len(effects) == 3 * 12
    assert effects["a12"].between(0.0, 1.0).all()
    values = pd.read_csv(page.parent / "values.csv")
    assert len(values) == 3 * 13 * 2


def test_methods_of_co_evolution_are_drawn_and_paired(tmp_path: Path) -> None:
    words = ("ga.hall_depth=0.25", "ga.num_generations=3", "num_replicates=3")
    methods = [f"experiment=curkovic_methods budget=smoke {' '.join(words)}"]
    experiment = compose.expand(methods[0].split(), only=["V", "VI"])[0]
    plain = compose.expand([w for w in methods[0].split() if "hall" not in w], only=["I", "II"])[0]
    together = experiment._replace(conditions=plain.conditions + experiment.conditions)
    store(tmp_path, together)
    request = build.Request("methods", together.name, together.budget, together.conditions)
    settings = ReportSettings(**REPORT | {"formats": ("svg",), "figures": "curkovic"})  # type: ignore[arg-type]
    page = build.write_report(build.derived(request, settings, tmp_path, 3)).with_suffix(".md")
    text = page.read_text()
    assert "V against I |" in text
    assert "VI against II |" in text
    assert "VII against III" not in text
    table = pd.read_csv(page.parent / "fig_6_methods.csv")
    assert set(table["series"]) == {"best so far", "final", "lower bound", "threshold"}
    bound = table.loc[table["series"] == "lower bound", "value"].item()
    assert bound == pytest.approx(7.48, abs=0.005)
    final = table[table["series"] == "final"]
    assert (final["value"] >= bound).all()
    curves = table[(table["series"] == "best so far") & (table["method"] == "V")]
    assert curves["value"].is_monotonic_decreasing
    last = final.loc[final["method"] == "V", "value"]
    assert curves["value"].iloc[-1] == pytest.approx(last.mean())
    assert curves["deviation"].iloc[-1] == pytest.approx(last.std())


def test_nothing_stored_names_the_command(tmp_path: Path) -> None:
    experiment = compose.expand(["experiment=rana_planar", "budget=smoke"])[0]
    request = build.Request(
        experiment.report_name, experiment.name, experiment.budget, experiment.conditions
    )
    with pytest.raises(
        NothingStored, match=r"try: evoexp run experiment=rana_planar budget=smoke$"
    ):
        build.write_report(build.derived(request, experiment.report, tmp_path, 2))
    assert not (tmp_path / "reports").exists()


@pytest.mark.matrix
def test_three_arms_have_figures_too(stored: Path) -> None:
    page = draw(
        stored, "planar_arms", "rana_three_arms", "scenario=rana_three_arms", formats=("svg",)
    )
    assert {"snapshots.svg", "paths.svg", "distances.svg", "convergence.svg"} <= set(contents(page))
    snapshots = pd.read_csv(page.parent / "snapshots.csv")
    assert set(snapshots["arm"]) == {0, 1, 2}
    text = page.read_text()
    assert "| length arm 3 | deg |" in text


def test_an_experiment_without_a_page_has_results_pictures_and_parameters(
    stored: Path, blank_figures: None
) -> None:
    page = draw(stored, None, "rana_three_arms", "scenario=rana_three_arms")
    kinds = ("csv", "json", "png", "svg")
    stems = ("convergence", "values", "scene", "stages", "joints", "covers")
    files = {f"{stem}.{kind}" for stem in stems for kind in kinds}
    found, text = set(contents(page)), page.read_text()
    assert files < found
    tables = {name for name in found if name.endswith(".tex")}
    assert tables and all(f"[tex]({name})" in text for name in tables)
    motions = found - files - tables - {"index.html", "index.md"}
    assert motions and all(f"({name})" in text and name.startswith("motion") for name in motions)
    assert "## Claims" not in text


def test_an_unknown_page_is_named(stored: Path) -> None:
    with pytest.raises(
        UnknownOption, match=r"report\.figures: no option 'ranna'; did you mean 'rana'"
    ):
        draw(stored, "ranna")


def test_claims_are_judged_only_on_the_papers_own_settings(results: Results) -> None:
    paper = compose.expand(["experiment=rana_planar"])[0]
    condition = dataclasses.replace(
        results.conditions[0], condition=paper.conditions[0].condition, planned=20
    )
    judged = results._replace(budget="paper")
    assert rana_claims.not_judged(judged, condition) == ""
    assert rana_claims.not_judged(results, condition) == "budget smoke"
    assert (
        rana_claims.not_judged(judged, dataclasses.replace(condition, planned=3))
        == "3 of 20 replicates planned"
    )
    assert rana_claims.not_judged(
        judged, dataclasses.replace(results.conditions[0], planned=20)
    ).startswith("overridden: ga.")


def test_redistribution_is_applied_to_solved_strings_only(results: Results) -> None:
    search = results.conditions[1]
    count = motions.colliding_after(search, relaxed=False)
    assert 0 <= count <= search.solved
    none = search.summaries.assign(solved=False)
    assert motions.colliding_after(dataclasses.replace(search, summaries=none), relaxed=True) == 0


def test_drawing_leaves_matplotlib_as_it_was(page: Path) -> None:
    assert mpl.rcParams["svg.hashsalt"] == mpl.rcParamsDefault["svg.hashsalt"]
    pyplot = sys.modules.get("matplotlib.pyplot")  # axes in space import it
    assert pyplot is None or pyplot.get_fignums() == []


@pytest.mark.matrix
def test_varied_conditions_are_told_apart_and_compared_with_their_own_control(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where an experiment names its conditions so; those of `run -m` have their own page."""
    monkeypatch.setattr(swept_settings, "sweep_of", lambda results: None)
    words = [
        "experiment=rana_planar",
        "budget=smoke",
        "ga.num_generations=1",
        "ga.population_size=8,10",
    ]
    experiment = compose.expand(words, multirun=True)[0]
    store(tmp_path, experiment)
    request = build.Request("swept", experiment.name, experiment.budget, experiment.conditions)
    settings = ReportSettings(**REPORT | {"formats": ("svg",), "figures": "rana"})  # type: ignore[arg-type]
    page = build.write_report(build.derived(request, settings, tmp_path, 2)).with_suffix(".md")
    text = page.read_text()
    assert sorted(re.findall(r"^## (.* against .*)$", text, re.MULTILINE)) == [
        f"via-point GA · population_size={size} against {control} · population_size={size}"
        for size in (10, 8)
        for control in ("multi-start", "random search")
    ]
    assert (
        "### Fig. 4: snapshots of the motion in operational space (via-point GA · "
        "population_size=8)" in text
    )
    assert (page.parent / "fig_7_distances_2_via_point_ga_population_size_10.svg").is_file()
    assert re.search(r"\| `ga\.population_size` \([^|]*population_size=8[^|]*\) \| 8 \|", text)
