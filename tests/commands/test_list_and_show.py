"""`evoexp list`, and `evoexp show` of a configuration, a stored run and a log."""

import json
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from command_samples import SMALL, Evoexp, Said, with_manifest

from evoexp import shipped
from evoexp.commands import show
from evoexp.commands.list_ import EXPERIMENT_KEYS, RUN_KEYS
from evoexp.commands.show import INDENT, KEYS, MAX_LINES, screen
from evoexp.configuration import compose
from evoexp.configuration.search_path import find, options
from evoexp.evolution.operators.operator import GeneticSettings
from evoexp.shipped import Shipped, described
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import read_summaries
from store_lookup import find_runs

PLANAR = ("experiment=rana_planar", *SMALL)
ONE = (*PLANAR, "--only", "via-point GA")


def sections(out: str) -> dict[str, str]:
    """Return name → text of the entries of a screen, in one line each."""
    found: dict[str, str] = {}
    for line in out.splitlines():
        name = line[:13].strip() or [*found][-1]
        found[name] = f"{found.get(name, '')} {line[13:]}".strip()
    return found


def one_screen(said: Said, widest: int) -> dict[str, str]:
    lines = said.out.splitlines()
    assert said.code == 0 and len(lines) <= 42 and max(map(len, lines)) <= widest
    return sections(said.out)


def test_a_configuration_before_anything_ran(evoexp: Evoexp, outputs: Path, width: int) -> None:
    entries = one_screen(evoexp("show", *ONE), width)
    condition = compose.expand(PLANAR, only=["via-point GA"])[0].conditions[0].condition
    assert entries["condition"] == condition.id
    assert "via_point_ga 1" in entries["components"] and "genetic 1" in entries["components"]
    assert (
        "experiment rana_planar, budget paper, label via-point GA" in entries["origin"]
    )  # no cap changed it
    assert "ga=rana_planar" in entries["origin"]
    command = "evoexp run experiment=rana_planar budget=smoke"
    assert f"not run here; run it: {command}" in entries["result"]
    assert (entries["environment"], entries["verdict"]) == ("–", "–")
    assert "population_size=8" in entries["ga"]
    assert not outputs.exists(), "nothing is run, nothing is written"


def test_the_command_on_the_screen_makes_the_condition(evoexp: Evoexp) -> None:
    words = ("experiment=rana_obstacles", "scenario.length_unit=two words", "~control")
    facts = json.loads(evoexp("show", *words[:2], "--json").out)
    command, *typed = shlex.split(facts["origin"]["command"])[1:]
    assert command == "run"
    assert json.loads(evoexp("show", *typed, "--json").out) == facts


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
        entries = one_screen(evoexp("show", run.hash12), width)
        assert f"directory {run.path}".replace(" ", "") in re.sub(r"\s", "", entries["origin"])
        rows = read_summaries(run)
        certified = int(rows["certified"].fillna(value=False).sum())
        assert entries["verdict"].startswith(f"certified {certified}, refuted {2 - certified}")
        assert f"best cost {rows['best_cost'].min():.6g}, best replicate" in entries["result"]
    entries = one_screen(evoexp("show", *ONE), width)
    assert "planned 2, done 2" in entries["result"]
    assert "python 3." in entries["environment"]


def test_a_log_alone_is_enough(
    evoexp: Evoexp, run: RunDirectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    log = shutil.copy(run.log_path(1), tmp_path / "colleague.mcap")
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "none"))
    entries = one_screen(evoexp("show", str(log)), max(width, 13 + len(str(log)) + 14))
    assert entries["condition"] == run.condition_id
    assert "replicate 1" in entries["origin"]
    assert read_log(log).summary.digest in entries["result"]


def test_another_revision_and_environment_are_pointed_out(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_manifest(run, versions=run.manifest()["versions"] | {"numpy": "1.0"})
    monkeypatch.setattr(GeneticSettings, "revision", 2)
    found = sections(evoexp("show", run.hash12).out)
    assert "genetic 1 (here 2)" in found["components"]
    assert "differences: versions.numpy: was 1.0, now" in found["environment"]
    assert "was revision 1, installed is 2" in found["note"]


def strictly(text: str) -> Any:
    """Parse JSON; refuse NaN and Infinity, which JSON does not have."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    return json.loads(text, parse_constant=refuse)


def test_show_json_has_stable_keys(evoexp: Evoexp, run: RunDirectory) -> None:
    for words in (ONE, (run.hash12,), (str(run.log_path(0)),)):
        facts = strictly(evoexp("show", *words, "--json").out)
        assert list(facts) == list(KEYS)
        assert facts["condition"] == run.condition_id
        assert facts["settings"] == json.loads(run.config_json())
    several = strictly(evoexp("show", *PLANAR, "--json").out)
    assert [list(facts) for facts in several] == [list(KEYS)] * 3
    out = evoexp("show", "--help").text
    assert all(f"{key}: " in out for key in KEYS)


def test_json_is_valid_where_numbers_are_not_finite(evoexp: Evoexp, outputs: Path) -> None:
    words = ("experiment=chen_placement", "budget=smoke", "--only", "A torque norm")
    assert evoexp("run", *words, "num_replicates=1", "runner=serial", "--no-report").code == 0
    assert strictly(evoexp("show", *words, "--json").out)["result"]["done"] == 1
    runs = strictly(evoexp("list", "--json").out)["runs"]
    assert [list(run) for run in runs] == [list(RUN_KEYS)]


def test_list_json_has_stable_keys(evoexp: Evoexp, stored: Path, tmp_path: Path) -> None:
    conf = tmp_path / "mine"
    (conf / "experiment").mkdir(parents=True)
    head = "# @package _global_\n# evoexp run experiment=mine\n# An experiment of my own.\n"
    (conf / "experiment/mine.yaml").write_text(head)
    (find_runs(stored)[0].path / "config.json").write_text("{}")
    listed = strictly(evoexp("list", "--json", "--config-dir", str(conf)).out)
    every = [list(EXPERIMENT_KEYS)] * (len(options("experiment")) + 1)
    assert [list(each) for each in listed["experiments"]] == every
    (own,) = (each for each in listed["experiments"] if each["name"] == "mine")
    assert own["description"] == "An experiment of my own."
    assert (own["origin"], own["path"]) == (str(conf), str(conf / "experiment/mine.yaml"))
    assert [list(each) for each in listed["runs"]] == [list(RUN_KEYS)] * 3
    assert [bool(each["damage"]) for each in listed["runs"]] == [True, False, False]
    assert listed["runs"][1]["done"] == 2


SMOKE = ("experiment=rana_planar", "budget=smoke")


def test_what_needs_an_extra_is_shown(evoexp: Evoexp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(show, "lacking", lambda config_json: "nsga2 needs pip install evoexp[…]")
    assert evoexp("show", *SMOKE, "planner.num_new_trajectories=1000").code == 0


@pytest.mark.parametrize("count", [1, MAX_LINES, MAX_LINES + 1, MAX_LINES + 5])
def test_entries_are_cut_beyond_three_lines_and_say_so(count: int) -> None:
    room = 60 - INDENT
    names = [chr(ord("a") + k) * (room - 3) for k in range(count)]  # each fills a line
    parts = [
        {"component": name, "revision": 1, "installed_revision": 1, "package": "evoexp 1"}
        for name in names
    ]
    facts = dict.fromkeys(KEYS) | {"condition": "0" * 64, "components": parts, "settings": {}}
    facts |= {"shipped_as": [], "origin": {"command": "evoexp run experiment=mine"}}
    facts["notes"] = ["first line\nsecond\nthird\nfourth"]
    lines = list(screen(facts, 60))
    begin = next(k for k, line in enumerate(lines) if line.startswith("components"))
    shown = lines[begin : begin + min(count, MAX_LINES)]
    assert [name in line for name, line in zip(names, shown, strict=False)] == [True] * len(shown)
    assert not lines[begin + len(shown)].startswith(" ")
    assert shown[-1].endswith("…") == (count > MAX_LINES)
    assert not any(line.endswith("…") for line in lines if line not in shown)
    assert [line.split()[-1] for line in lines[-4:]] == ["line", "second", "third", "fourth"]


def test_all_is_shown(evoexp: Evoexp, run: RunDirectory, width: int) -> None:
    whole = evoexp("show", run.hash12, "--all").out
    assert width == 80 or all(digest in whole for digest in read_summaries(run)["digest"])
    run.write_failure(7, "ArithmeticError: [/] is told to fail", "Traceback …")
    out = evoexp("show", run.condition_id[:5].upper(), "--all").out
    assert out.startswith(f"condition    {run.condition_id}\n")
    assert "population_size: 8" in out and "  label: " in out
    assert "command: evoexp run experiment=rana_planar budget=smoke" in out
    lines = out.splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("replicates in"))
    table = lines[begin + 1 : lines.index("manifest:")]
    assert max(map(len, table)) <= width
    flat = re.sub(r"[\s│]+", "", "".join(table))
    assert "7failed–––" in flat and "ArithmeticError" in flat and "…" not in flat


@pytest.mark.usefixtures("wide_terminal")
def test_a_shipped_condition_that_never_ran_here(
    evoexp: Evoexp, outputs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    condition = compose.expand(SMOKE)[0].conditions[1].condition
    row = Shipped("rana_planar", "random search", "smoke", condition.id, "0" * 32)
    monkeypatch.setattr(shipped, "shipped", lambda: (row,))
    out = evoexp("show", condition.id[:6]).out
    named = "experiment rana_planar, label random search, budget smoke"
    assert out.startswith(f"condition    {condition.id}\nshipped as   {named}\n")
    assert "run it: evoexp run experiment=rana_planar budget=smoke --only 'random search'\n" in out
    assert "\ncontrol      random_search()\n" in out
    assert not outputs.exists()


def test_an_ambiguous_shipped_hash_lists_the_candidates(
    refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = tuple(Shipped("rana_planar", k, "smoke", f"abc{k}" * 16, "0" * 32) for k in "01")
    monkeypatch.setattr(shipped, "shipped", lambda: rows)
    for command in ("show", "reproduce"):
        assert refused(command, "abc") == "hash: 'abc' is ambiguous: abc0abc0abc0, abc1abc1abc1"


@pytest.mark.usefixtures("wide_terminal")
def test_show_says_what_the_chromosomes_length_violates(evoexp: Evoexp) -> None:
    out = evoexp("show", "experiment=curkovic_methods", "--only", "V").out
    for line in (
        "robot 1: Eq. 2 allows steps of 5.73 and 11.46 deg (printed: 11.5 and 23)",
        "robot 2: Eq. 3 requires L = 42 here (120 deg), L = 64 over 180 deg (printed: 32)",
        "L = 8 (K = 4) takes steps of 24.00 deg at best, which violates it 4.19 times over",
    ):
        assert line in out
    long = ("--only", "V", "planner.chromosome_length=42")
    assert "is within it" in evoexp("show", "experiment=curkovic_methods", *long).out


def cells(out: str) -> dict[str, list[str]]:
    """Return hash → the other cells of the first line of its row."""
    lines = [line.strip("│").split("│") for line in out.splitlines() if line.startswith("│")]
    rows = [[cell.strip() for cell in line] for line in lines]
    return {row[0]: row[1:] for row in rows if re.fullmatch("[0-9a-f]{12}", row[0])}


def test_without_runs(evoexp: Evoexp, outputs: Path) -> None:
    said = evoexp("list")
    assert said.code == 0
    assert f"no runs stored in {outputs}" in said.out
    for name in options("experiment"):
        assert f"│ {name} " in said.out
        assert described(Path(find("experiment", name).path)).split(" ")[0] in said.out
    assert not outputs.exists()


def test_stored_runs(evoexp: Evoexp, stored: Path, width: int) -> None:
    runs = find_runs(stored)
    runs[0].write_failure(7, "ArithmeticError: [/] is told to fail", "Traceback …")
    out = evoexp("list").out
    assert "…" not in out and max(map(len, out.splitlines())) <= width
    rows = cells(out)
    assert list(rows) == [run.hash12 for run in runs]
    assert [row[1:3] for row in rows.values()] == [["2 of 8", "1"], *2 * [["2 of 2", "0"]]]
    assert "(changed)" in out and "via-point" in out


def test_damaged_runs_are_listed_beside_the_others(
    evoexp: Evoexp, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    first, second, third = find_runs(stored)
    (first.path / "config.json").write_text("{}")
    second.log_path(1).write_bytes(b"")
    (third.path / "manifest.json").unlink()
    (stored / "runs/0123456789ab").mkdir()  # made, and killed before anything was written
    (stored / "runs/notes").mkdir()
    said = evoexp("list")
    rows = cells(said.out)
    assert said.code == 0 and list(rows) == [first.hash12, second.hash12, third.hash12]
    done = [row[1] for row in rows.values()]
    assert done == ["2 of 2", "1 of 2", "2 of 2"], "logs know what they are of"
    assert "config.json (damaged: its hash 44136fa355b3 is not the d" in rows[first.hash12][0]
    assert "0001.mcap (empty" in rows[second.hash12][0] and "0001.mcap (empty" in said.err


def test_a_pipe_gets_wide_tables(
    evoexp: Evoexp, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    lines = [line for line in evoexp("list").out.splitlines() if "rana_planar, " in line]
    assert len(lines) == 3
    assert all("paper" in line for line in lines), "a row is a line, for grep"
