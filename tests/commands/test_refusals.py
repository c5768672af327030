"""What cannot be done is said in one line that names the field, before anything is written."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from command_samples import SERIAL, Evoexp

from evoexp.evolution.operators.operator import GeneticSettings
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from forged_logs import with_attachment
from store_lookup import find_runs

Refused = Callable[..., str]

PLANAR = ("experiment=rana_planar", *SERIAL)
ARMS = ("experiment=rana_obstacles", *SERIAL)
LINES: dict[str, dict[str, str]] = yaml.safe_load(
    Path(__file__).with_name("refusals.yaml").read_text()
)
COMMANDS, OVERRIDES = LINES["commands"], LINES["overrides"]
OVERRIDES |= {"": "override: must be key=value, was ''"}
OVERRIDES |= {f"seed={'9' * 5000}": "seed: must be a number, a word, a [list], a {mapping} or"}


@pytest.mark.examples(11)
@pytest.mark.parametrize("override", OVERRIDES, ids=lambda text: text[:40])
def test_overrides(refused: Refused, override: str) -> None:
    assert OVERRIDES[override] in refused("run", *ARMS, override)


@pytest.mark.parametrize("line", COMMANDS)
def test_commands(refused: Refused, line: str, request: pytest.FixtureRequest) -> None:
    words = line
    if "RUN" in line:
        words = line.replace("RUN", request.getfixturevalue("run").hash12)
    if "MOTION" in line:
        words = line.replace("MOTION", str(request.getfixturevalue("motion")))
    assert COMMANDS[line] in refused(*words.split())


def test_a_missing_replicate_lists_those_that_are_there(
    refused: Refused, run: RunDirectory
) -> None:
    said = refused("reproduce", run.hash12, "--replicate", "7")
    assert said == f"run {run.hash12}: no finished replicate 7 (finished: 0, 1)"
    log = run.log_path(0).read_bytes()
    for replicate in (2, 3, 5, 6):
        run.log_path(replicate).write_bytes(log)
    said = refused("reproduce", run.hash12, "--replicate", "7")
    assert said.endswith("(finished: 0–3, 5, 6)"), "thousands fit in a line"
    assert "invalid int value: 'x'" in refused("reproduce", run.hash12, "--replicate", "x")


def test_a_damaged_log_is_named(refused: Refused, stored: Path) -> None:
    log = find_runs(stored)[0].log_path(1)
    whole, middle = log.read_bytes(), log.stat().st_size // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
    for damaged in (whole[:-1], whole[:middle], b"", flipped, b"PAR1" * 100):
        log.write_bytes(damaged)
        for command in ("reproduce", "show"):
            assert refused(command, str(log)).startswith(f"{log}: ")


def with_config(run: RunDirectory, old: bytes, new: bytes) -> str:
    """Write a log that is whole, but whose configuration says something else; return its path."""
    content = run.log_path(0).read_bytes()
    config = read_log(content).config_json.replace(old, new)
    run.log_path(0).write_bytes(with_attachment(content, "config.json", config))
    return str(run.log_path(0))


@pytest.mark.parametrize(
    ("target", "message"),
    [
        (b"os.system", "ga._target_: must be a registered component, was 'os.system'"),
        (b"subprocess:Popen", "ga._target_: must be a registered component, was"),
        (b"arms", "ga.arms: must be given, was None"),
    ],
)
def test_a_log_cannot_name_other_code(
    refused: Refused, run: RunDirectory, target: bytes, message: str
) -> None:
    log = with_config(run, b'"genetic"', b'"' + target + b'"')
    assert f"planner.{message}" in refused("reproduce", log)


def test_a_log_whose_configuration_is_another_one_is_refused(
    refused: Refused, run: RunDirectory
) -> None:
    said = refused("reproduce", with_config(run, b'"seed":0', b'"seed":1'))
    assert "its configuration has hash" in said


def test_another_revision_says_how_to_run_anew(
    refused: Refused, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(GeneticSettings, "revision", 2)
    said = refused("reproduce", run.hash12)
    assert said.startswith(f"run {run.hash12}: ")
    assert "ga was revision 1, installed is 2" in said
    anew = "Run it anew with what is installed: evoexp run experiment=rana_planar budget=smoke"
    assert anew in said


def test_outputs_that_cannot_be_written_are_named(
    evoexp: Evoexp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "file"))
    said = evoexp("run", *PLANAR, "--no-report")
    assert said.code == 2
    assert re.fullmatch(rf"evoexp: {tmp_path}/file/runs\S*: Not a directory\n", said.err)
