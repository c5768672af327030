"""`evoexp show` of a configuration before anything ran, and of a log; `--json` of show and list."""

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from command_samples import SMALL, Evoexp

from evoexp.commands import facts
from evoexp.commands.facts import KEYS
from evoexp.commands.list_ import EXPERIMENT_KEYS, RUN_KEYS
from evoexp.commands.show import INDENT, MAX_LINES, screen
from evoexp.configuration import compose
from evoexp.configuration.search_path import options
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.store.log_reader import read_log
from evoexp.store.tables import read_summaries
from store_lookup import find_runs

Refused = Callable[..., str]
PLANAR = ("experiment=rana_planar", *SMALL)
ONE = (*PLANAR, "--only", "via-point GA")


@pytest.fixture(params=[80, 120])
def width(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setenv("COLUMNS", str(request.param))
    return int(request.param)


def sections(out: str) -> dict[str, str]:
    """Return name → text of the entries of a screen."""
    found: dict[str, str] = {}
    for line in out.splitlines():
        name, text = line[:13].strip(), line[13:]
        if name:
            found[name] = text
        else:
            last = list(found)[-1]
            found[last] = f"{found[last]}\n{text}"
    return found


def test_a_configuration_before_anything_ran(evoexp: Evoexp, outputs: Path, width: int) -> None:
    said = evoexp("show", *ONE)
    assert said.code == 0
    lines = said.out.splitlines()
    assert len(lines) <= 40
    assert max(map(len, lines)) <= width
    found = sections(said.out)
    (condition,) = (
        c.condition for c in compose.expand(PLANAR, only=["via-point GA"])[0].conditions
    )
    assert found["condition"] == condition.id
    assert "via_point_ga 1" in found["components"] and "genetic 1" in found["components"]
    assert "rana_planar, via-point GA, budget paper" in found["origin"]  # no cap changed it
    assert "ga=rana_planar" in found["origin"].replace("\n", " ")
    assert "not run here; run it: evoexp run experiment=rana_planar budget=smoke" in (
        found["result"].replace("\n", " ")
    )
    assert (found["environment"], found["verdict"]) == ("–", "–")
    assert "population_size=8" in found["ga"].replace("\n", " ")
    assert not outputs.exists(), "nothing is run, nothing is written"


def test_the_command_on_the_screen_makes_the_condition(evoexp: Evoexp) -> None:
    words = ("experiment=rana_obstacles", "scenario.length_unit=two words", "~control")
    facts = json.loads(evoexp("show", *words[:2], "--json").out)
    typed = shlex.split(facts["origin"]["command"])
    assert typed[:2] == ["evoexp", "run"]
    again = json.loads(evoexp("show", *typed[2:], "--json").out)
    assert again == facts


def test_a_configuration_that_ran_has_its_results(evoexp: Evoexp, stored: Path) -> None:
    found = sections(evoexp("show", *ONE).out)
    assert "2 of 2 replicates done" in found["result"]
    assert "python 3." in found["environment"]


def test_several_conditions_are_a_table_of_their_differences(evoexp: Evoexp, width: int) -> None:
    said = evoexp("show", *PLANAR, "-m", "ga.num_elites=0,2", "--only", "via-point GA")
    assert max(map(len, said.out.splitlines())) <= width
    assert "ga.num_elites=0" in said.out and "ga.num_elites=2" in said.out
    assert "population_size" not in said.out, "a setting in which they agree"
    with_control = evoexp("show", *PLANAR).out
    assert "control._target_=random_search" in with_control
    assert "one condition on a screen: --only LABEL" in with_control


def test_a_stored_run_is_one_screen(evoexp: Evoexp, stored: Path, width: int) -> None:
    for run in find_runs(stored):
        said = evoexp("show", run.hash12)
        assert said.code == 0
        lines = said.out.splitlines()
        assert len(lines) <= 40
        assert max(map(len, lines)) <= width
        found = sections(said.out)
        assert f"stored in {run.path}".replace(" ", "") in re.sub(r"\s", "", found["origin"])
        rows = read_summaries(run)
        certified = int((rows["certified"] == True).sum())  # noqa: E712  # a column
        assert found["verdict"].startswith(f"{certified} certified, {2 - certified} refuted")
        assert f"best cost {rows['best_cost'].min():.6g} (replicate" in found["result"]


def test_a_log_alone_is_enough(
    evoexp: Evoexp, stored: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    run = find_runs(stored)[0]
    log = tmp_path / "colleague.mcap"
    log.write_bytes(run.log_path(1).read_bytes())
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "none"))
    said = evoexp("show", str(log))
    assert said.code == 0
    assert len(said.out.splitlines()) <= 40
    assert max(map(len, said.out.splitlines())) <= max(width, 13 + len(str(log)) + 14)
    found = sections(said.out)
    assert found["condition"] == run.condition_id
    assert "replicate 1" in found["origin"]
    assert read_log(log).summary.digest in found["result"]


def test_another_revision_and_environment_are_pointed_out(
    evoexp: Evoexp, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = find_runs(stored)[0]
    manifest = run.manifest()
    manifest["versions"]["numpy"] = "1.0"
    (run.path / "manifest.json").write_text(json.dumps(manifest))
    monkeypatch.setattr(GeneticSettings, "revision", 2)
    found = sections(evoexp("show", run.hash12).out)
    assert "genetic 1 (here 2)" in found["components"].replace("\n", " ")
    assert "not as here: versions.numpy: was 1.0, now" in found["environment"]
    assert "was revision 1, installed is 2" in found["note"]


def test_what_is_neither_hash_nor_configuration(refused: Refused) -> None:
    assert refused("show", "abc", "def") == "show: must be given one hash or log, was 'abc def'"
    assert "did you mean 'experiment=rana_planar'?" in refused("show", "rana_planar")
    assert "no option 'rana_planr'" in refused("show", "experiment=rana_planr")
    assert "cannot be read: No such file" in refused("show", "nobody.mcap")


def strictly(text: str) -> Any:
    """Parse JSON; refuse NaN and Infinity, which JSON does not have."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    return json.loads(text, parse_constant=refuse)


def test_show_json_has_stable_keys(evoexp: Evoexp, stored: Path) -> None:
    run = find_runs(stored)[0]
    for words in (ONE, (run.hash12,), (str(run.log_path(0)),)):
        facts = strictly(evoexp("show", *words, "--json").out)
        assert list(facts) == list(KEYS)
    assert facts["condition"] == run.condition_id
    assert facts["settings"] == json.loads(run.config_json())
    several = strictly(evoexp("show", *PLANAR, "--json").out)
    assert [list(facts) for facts in several] == [list(KEYS)] * 3
    out = " ".join(evoexp("show", "--help").out.split())
    assert all(f"{key}: " in out for key in KEYS)


def test_json_is_valid_where_numbers_are_not_finite(evoexp: Evoexp, outputs: Path) -> None:
    words = (
        "experiment=chen_placement",
        "budget=smoke",
        "num_replicates=1",
        "runner=serial",
        "--only",
        "A torque norm",
    )
    assert evoexp("run", *words, "--no-report").code == 0
    facts = strictly(evoexp("show", *words[:2], *words[4:], "--json").out)
    assert facts["result"]["done"] == 1
    runs = strictly(evoexp("list", "--json").out)["runs"]
    assert [list(run) for run in runs] == [list(RUN_KEYS)]


def test_list_json_has_stable_keys(evoexp: Evoexp, stored: Path, tmp_path: Path) -> None:
    (tmp_path / "mine/experiment").mkdir(parents=True)
    head = "# @package _global_\n# evoexp run experiment=mine\n# An experiment of my own.\n"
    (tmp_path / "mine/experiment/mine.yaml").write_text(head)
    first, *_ = find_runs(stored)
    (first.path / "config.json").write_text("{}")
    said = evoexp("list", "--json", "--config-dir", str(tmp_path / "mine"))
    listed = strictly(said.out)
    assert [list(each) for each in listed["experiments"]] == (
        [list(EXPERIMENT_KEYS)] * (len(options("experiment")) + 1)
    )
    by_name = {each["name"]: each for each in listed["experiments"]}
    assert by_name["mine"] == {
        "name": "mine",
        "description": "An experiment of my own.",
        "origin": str(tmp_path / "mine"),
        "path": str(tmp_path / "mine/experiment/mine.yaml"),
    }
    assert by_name["rana_planar"]["origin"] == "evoexp"
    assert [list(each) for each in listed["runs"]] == [list(RUN_KEYS)] * 3
    assert [bool(each["damage"]) for each in listed["runs"]] == [True, False, False]
    assert listed["runs"][1]["done"] == 2


SMOKE = ("experiment=rana_planar", "budget=smoke")
UNFIT = {
    "settings that do not fit": (*SMOKE, "planner.num_new_trajectories=1000"),
    "a start in collision": (*SMOKE, "scenario.q_start=[[90,0],[90,180]]"),
    "a robot that is not there": (*SMOKE, "robot=urdf", "robot.path=none.urdf"),
}


@pytest.mark.parametrize(
    ("what", "more"),
    list(zip(UNFIT, [("--json",), ("--only", "via-point GA"), ("--all",)], strict=True)),
)
def test_what_cannot_be_built_is_refused(
    refused: Refused, what: str, more: tuple[str, ...]
) -> None:
    assert refused("show", *UNFIT[what], *more)


def test_what_needs_an_extra_is_shown(evoexp: Evoexp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(facts, "lacking", lambda config_json: "nsga2 needs pip install evoexp[…]")
    assert evoexp("show", *UNFIT["settings that do not fit"]).code == 0


@pytest.mark.parametrize("count", [1, MAX_LINES, MAX_LINES + 1, MAX_LINES + 5])
def test_entries_are_cut_beyond_three_lines_and_say_so(count: int) -> None:
    room = 60 - INDENT
    names = [chr(ord("a") + k) * (room - 3) for k in range(count)]  # each fills a line
    parts = [
        {"component": name, "revision": 1, "installed_revision": 1, "package": "evoexp 1"}
        for name in names
    ]
    facts = {
        "condition": "0" * 64,
        "shipped_as": [],
        "components": parts,
        "origin": {"command": "evoexp run experiment=mine"},
        "environment": None,
        "result": None,
        "verdict": None,
        "settings": {},
        "notes": ["first line\nsecond\nthird\nfourth"],
    }
    lines = list(screen(facts, 60))
    begin = next(k for k, line in enumerate(lines) if line.startswith("components"))
    shown = lines[begin : begin + min(count, MAX_LINES)]
    assert [name in line for name, line in zip(names, shown, strict=False)] == [True] * len(shown)
    assert not lines[begin + len(shown)].startswith(" ")
    assert shown[-1].endswith("…") == (count > MAX_LINES)
    assert not any(line.endswith("…") for line in lines if line not in shown)
    assert [line.split()[-1] for line in lines[-4:]] == ["line", "second", "third", "fourth"]
