"""`evoexp compare`: a table of proven answers; `evoexp diff`: two runs beside each other."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import SERIAL, Evoexp, with_manifest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.shipped import shipped
from evoexp.store.archive import pack
from evoexp.store.identity import changed
from evoexp.store.log import SUMMARY
from evoexp.store.run_directory import RunDirectory
from forged_logs import with_metadata
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
    assert row["condition"] == "rana_planar: control=null ≡ rana_obstacles: rana_obstacles"


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
    for option, file, message in (
        ("--data", data, "given.csv, line 2, cost: must be a length"),
        ("--data", tmp_path / "no.csv", "No such file"),
        ("--csv", data / "table.csv", "File exists"),
    ):
        said = evoexp("compare", "rana_planar", *SERIAL, option, str(file))
        assert said.code == 2 and message in said.err and said.err.count("\n") == 1


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


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 3) | st.text("ab", max_size=2),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text("xyz", max_size=1), inner),
    max_leaves=8,
)


@given(PLAIN, PLAIN)
def test_plain_data_differ_where_they_are_not_equal(one: object, two: object) -> None:
    def stripped(value: object) -> object:  # what is None counts as not there
        if isinstance(value, dict):
            return {k: stripped(v) for k, v in value.items() if v is not None}
        return [stripped(v) for v in value] if isinstance(value, list) else value

    assert bool(list(changed(stripped(one), stripped(two)))) == (stripped(one) != stripped(two))


def test_a_run_does_not_differ_from_itself(evoexp: Evoexp, run: RunDirectory) -> None:
    said = evoexp("diff", run.hash12, run.condition_id)
    assert said.code == 0
    assert "settings: the same" in said.out and "environment: the same" in said.out
    assert "2 of 2 common replicates are the same, bit for bit" in said.out


@pytest.fixture
def archive(run: RunDirectory, tmp_path: Path) -> str:
    """Return an archive of the stored run."""
    pack([run], tmp_path / "same.tar")
    return str(tmp_path / "same.tar")


def on_other_numpy(run: RunDirectory) -> None:
    with_manifest(run, versions=run.manifest()["versions"] | {"numpy": "0.1"})


def changed_summary(run: RunDirectory, **values: object) -> None:
    log = run.log_path(1)
    log.write_bytes(with_metadata(log.read_bytes(), SUMMARY, **values))


DIFFERENCES: dict[str, tuple[Callable[[RunDirectory], object], int]] = {
    "nothing": (lambda run: None, 0),
    "times": (lambda run: changed_summary(run, cpu_s=9.0, wall_s=9.0), 0),
    "environment": (on_other_numpy, 1),
    "a replicate less": (lambda run: run.log_path(1).unlink(), 1),
    "digest": (lambda run: changed_summary(run, digest="0" * 32), 1),
    "a result": (lambda run: changed_summary(run, clearance=0.125), 1),
    "a verdict": (lambda run: changed_summary(run, certified=None), 1),
    "no configuration": (lambda run: shutil.rmtree(run.path), 2),
}


@pytest.mark.parametrize("what", DIFFERENCES)
def test_the_exit_code_is_that_of_diff(
    evoexp: Evoexp, run: RunDirectory, archive: str, what: str
) -> None:
    """0: nothing differs, 1: something does, by itself; 2: they cannot be compared."""
    change, code = DIFFERENCES[what]
    change(run)
    for words in ((run.hash12, archive), (archive, run.hash12)):
        assert evoexp("diff", *words).code == code


def test_a_shipped_condition_has_settings_alone(evoexp: Evoexp, run: RunDirectory) -> None:
    other = next(row for row in shipped() if row.condition_id[:6] != "4da921").condition_id
    for words, code in ((("4da921",) * 2, 0), (("4da921", other), 1), ((run.hash12, "4da921"), 1)):
        said = evoexp("diff", *words)
        assert said.code == code and "environment" not in said.out


def test_settings_results_and_environment_are_named(evoexp: Evoexp, stored: Path) -> None:
    one, two, *_ = find_runs(stored)
    on_other_numpy(two)
    said = evoexp("diff", one.hash12, two.hash12, "--json")
    assert said.code == 1
    found = json.loads(said.out)
    assert (found["a"], found["b"]) == (one.condition_id, two.condition_id)
    components = {name: pair for name, *pair in found["settings"] if name.endswith("_target_")}
    assert "control._target_" in components, "all else is a setting of its planner, too"
    assert {name: two for name, _, two in found["environment"]}["versions.numpy"] == "0.1"
    assert ["replicates", 2, 2] in found["results"] and found["same_replicates"] == []
