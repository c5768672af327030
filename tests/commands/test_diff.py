"""`evoexp diff`: two runs beside each other."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import Evoexp
from hypothesis import given
from hypothesis import strategies as st

from evoexp.commands.diff import changed
from evoexp.shipped import shipped
from evoexp.store.archive import pack
from evoexp.store.log import SUMMARY
from evoexp.store.run_directory import RunDirectory
from forged_logs import with_metadata
from store_lookup import find_runs

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


def test_a_planner_and_its_control_differ_by_their_types() -> None:
    plain = {"planner": {"_target_": "via_point_ga", "num_via_points": 4}, "seed": 1}
    control = {"planner": {"_target_": "random_search", "planner": plain["planner"]}, "seed": 2}
    assert list(changed(plain, control)) == [
        ("planner", "via_point_ga", "random_search around it"),
        ("seed", 1, 2),
    ]


def test_a_run_does_not_differ_from_itself(evoexp: Evoexp, stored: Path) -> None:
    run = find_runs(stored)[0]
    said = evoexp("diff", run.hash12, run.condition_id)
    assert said.code == 0
    assert "settings: the same" in said.out and "environment: the same" in said.out
    assert "2 of 2 common replicates are the same, bit for bit" in said.out


@pytest.fixture
def pair(stored: Path, tmp_path: Path) -> tuple[RunDirectory, Path]:
    """Return a stored run, and an archive of the same run."""
    run = find_runs(stored)[0]
    pack([run], tmp_path / "same.tar")
    return run, tmp_path / "same.tar"


def renamed(run: RunDirectory) -> None:
    manifest = json.loads((run.path / "manifest.json").read_text())
    manifest["versions"]["numpy"] = "0.1"
    (run.path / "manifest.json").write_text(json.dumps(manifest))


def changed_summary(run: RunDirectory, **values: object) -> None:
    log = run.log_path(1)
    log.write_bytes(with_metadata(log.read_bytes(), SUMMARY, **values))


DIFFERENCES: dict[str, tuple[Callable[[RunDirectory], object], int]] = {
    "nothing": (lambda run: None, 0),
    "times": (lambda run: changed_summary(run, cpu_s=9.0, wall_s=9.0), 0),
    "environment": (renamed, 1),
    "a replicate less": (lambda run: run.log_path(1).unlink(), 1),
    "digest": (lambda run: changed_summary(run, digest="0" * 32), 1),
    "a result": (lambda run: changed_summary(run, clearance=0.125), 1),
    "a verdict": (lambda run: changed_summary(run, certified=None), 1),
    "no configuration": (lambda run: shutil.rmtree(run.path), 2),
}


@pytest.mark.parametrize("what", DIFFERENCES)
def test_the_exit_code_is_that_of_diff(
    evoexp: Evoexp, pair: tuple[RunDirectory, Path], what: str
) -> None:
    """0: nothing differs, 1: something does, by itself; 2: they cannot be compared."""
    run, archive = pair
    change, code = DIFFERENCES[what]
    change(run)
    for words in ((run.hash12, str(archive)), (str(archive), run.hash12)):
        assert evoexp("diff", *words).code == code


def test_settings_alone_differ(evoexp: Evoexp, stored: Path) -> None:
    """Both have no results here."""
    assert evoexp("diff", "4da921", "4da921").code == 0
    row = next(row for row in shipped() if row.condition_id[:6] != "4da921")
    assert evoexp("diff", "4da921", row.condition_id[:12]).code == 1


def test_settings_results_and_environment_are_named(evoexp: Evoexp, stored: Path) -> None:
    one, two, *_ = find_runs(stored)
    manifest = json.loads((two.path / "manifest.json").read_text())
    manifest["versions"]["numpy"] = "0.1"
    (two.path / "manifest.json").write_text(json.dumps(manifest))
    said = evoexp("diff", one.hash12, two.hash12, "--json")
    assert said.code == 1
    found = json.loads(said.out)
    assert (found["a"], found["b"]) == (one.condition_id, two.condition_id)
    assert any(name.startswith("planner") for name, _, _ in found["settings"])
    assert {name: two for name, _, two in found["environment"]}["versions.numpy"] == "0.1"
    assert ["replicates", 2, 2] in found["results"] and found["same_replicates"] == []


def test_a_shipped_condition_has_settings_alone(evoexp: Evoexp, stored: Path) -> None:
    run = find_runs(stored)[0]
    said = evoexp("diff", run.hash12, "4da921")
    assert said.code == 1 and "ga" in said.out and "environment" not in said.out


def test_an_unknown_hash_is_refused(evoexp: Evoexp, stored: Path) -> None:
    run = find_runs(stored)[0]
    said = evoexp("diff", run.hash12, "ffff")
    assert said.code == 2 and "no run 'ffff'" in said.err and said.err.count("\n") == 1
