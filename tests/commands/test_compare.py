"""`evoexp compare`: a page and a table of proven answers."""

import json
from pathlib import Path

from command_samples import SERIAL, Evoexp

from store_lookup import find_runs

KEYS = {"condition", "runs", "proven", "queries", "interval", "lengths", "refuted"}


def test_an_experiment_is_compared(evoexp: Evoexp, stored: Path) -> None:
    said = evoexp("compare", "rana_planar", *SERIAL, "--json")
    assert (said.code, said.err) == (0, "")
    rows = json.loads(said.out)
    assert [row["condition"] for row in rows] == ["via-point GA", "random search", "multi-start"]
    assert all(row["runs"] == 2 and row.keys() >= KEYS for row in rows)
    (page,) = (stored / "reports").glob("compare_rana_planar@smoke*/index.md")
    text = page.read_text()
    assert "Made by `evoexp compare rana_planar budget=smoke " in text
    assert {"targets_reached.svg", "proven_lengths.csv"} <= {p.name for p in page.parent.iterdir()}


def test_runs_are_compared_by_their_hashes(evoexp: Evoexp, stored: Path) -> None:
    one, two, *_ = sorted(run.hash12 for run in find_runs(stored))
    said = evoexp("compare", one, two)
    assert said.code == 0 and "refuted" in said.out
    page = stored / "reports" / f"compare_{one}+{two}" / "index.html"
    assert str(page) in said.out and page.exists()


def test_a_condition_of_two_experiments_is_one_row(evoexp: Evoexp, stored: Path) -> None:
    words = (*SERIAL, "scenario=rana_planar", "control=null", "--json")
    said = evoexp("compare", "rana_planar", "rana_obstacles", *words)
    (row,) = json.loads(said.out)
    assert row["condition"] == "rana_planar: via-point GA ≡ rana_obstacles: rana_obstacles"


def test_what_is_neither_is_refused(evoexp: Evoexp, stored: Path) -> None:
    said = evoexp("compare", "rana_planet")
    assert said.code == 2 and "did you mean 'rana_planar'?" in said.err
    (run, *_) = find_runs(stored)
    said = evoexp("compare", run.hash12, "ga.num_elites=1")
    assert said.code == 2 and "left out where runs are given by their hashes" in said.err
    said = evoexp("compare", "lavoie_7dof")
    assert said.code == 2 and "nothing stored" in said.err


def test_a_hash_beside_an_experiment_is_refused(evoexp: Evoexp, stored: Path) -> None:
    said = evoexp("compare", "rana_planar", "4da921")
    assert said.code == 2
    assert said.err.startswith("evoexp: experiment: no option '4da921'")


def test_given_runs_stand_beside_ours(evoexp: Evoexp, stored: Path, tmp_path: Path) -> None:
    data = tmp_path / "given.csv"
    data.write_text("planner,problem,seed,queries,cost\nRRT*,rana_planar,0,70,5.5\n")
    said = evoexp("compare", "rana_planar", *SERIAL, "--data", str(data), "--json")
    assert (said.code, said.err) == (0, "")
    *_, last = json.loads(said.out)
    assert (last["condition"], last["proven"], last["queries"]) == ("RRT* (given)", 1, 70.0)
    assert last["problem"] == "rana_planar" and last["first_own"] is None
    (page,) = (stored / "reports").glob("compare_rana_planar@smoke*+given_*/index.md")
    assert f"--data {data}`" in page.read_text()
    data.write_text("planner,problem,seed,queries,cost\nRRT*,rana_plan,0,70,x\n")
    said = evoexp("compare", "rana_planar", *SERIAL, "--data", str(data))
    assert said.code == 2 and "given.csv, line 2, cost: must be a length" in said.err
    said = evoexp("compare", "rana_planar", *SERIAL, "--data", str(tmp_path / "none.csv"))
    assert said.code == 2 and "No such file" in said.err and said.err.count("\n") == 1


def test_the_table_is_written_as_csv_and_latex(
    evoexp: Evoexp, stored: Path, tmp_path: Path
) -> None:
    table, latex = tmp_path / "table.csv", tmp_path / "table.tex"
    files = ("--csv", str(table), "--latex", str(latex))
    said = evoexp("compare", "rana_planar", *SERIAL, *files)
    assert said.code == 0 and f"csv: {table}" in said.out and f"latex: {latex}" in said.out
    names = [line.split(",")[0] for line in table.read_text().splitlines()]
    assert names == ["planner", "via-point GA", "random search", "multi-start"]
    assert all(f"\n{name} & 2 & " in latex.read_text() for name in names[1:])
    said = evoexp("compare", "rana_planar", *SERIAL, "--csv", str(tmp_path / "none" / "t.csv"))
    assert said.code == 2 and "No such file" in said.err and said.err.count("\n") == 1


def test_runs_are_written_for_iohprofiler_into_an_empty_folder(
    evoexp: Evoexp, stored: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "ioh" / "data"
    words = ("compare", "rana_planar", *SERIAL, "--ioh", str(folder))
    assert evoexp(*words).code == 0
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["multi-start", "random_search", "via-point_GA"]
    assert all((folder / name / "IOHprofiler_f1_rana_planar.json").is_file() for name in names)
    said = evoexp(*words)
    assert said.code == 2 and "--ioh: must be a folder that is empty or not there yet" in said.err
