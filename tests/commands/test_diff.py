"""`evoexp diff`: two runs beside each other."""

import json
from pathlib import Path

from command_samples import Evoexp
from hypothesis import given
from hypothesis import strategies as st

from evoexp.commands.diff import changed
from evoexp.store.run_directory import find_runs

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
