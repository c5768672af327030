"""A damaged store: commands go on without what is damaged and say so; `run` mends it."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import SERIAL, Evoexp

import evoexp as package
from evoexp.configuration import compose
from evoexp.errors import DamagedStore
from evoexp.store.run_directory import RunDirectory

PLANAR = ("experiment=rana_planar", *SERIAL)


@pytest.fixture
def run(stored: Path) -> RunDirectory:
    """Return the stored run of the experiment's first condition, two replicates."""
    return RunDirectory(stored, compose.expand(PLANAR)[0].conditions[0].condition.id)


def lines(text: str) -> list[str]:
    assert "Traceback" not in text
    return text.splitlines()


def test_a_damaged_log_stops_no_command_and_is_run_again(evoexp: Evoexp, run: RunDirectory) -> None:
    whole = run.log_path(1).read_bytes()
    digest = evoexp("show", str(run.log_path(1)), "--json").out
    run.log_path(1).write_bytes(whole[:-10])
    left_out = f"evoexp: run {run.hash12}: left out, damaged: 0001.mcap (cut or overwritten: "
    for words in (
        ("list",),
        ("show", run.hash12),
        ("report", *PLANAR),
        ("view", run.hash12),
        ("export", run.hash12),
    ):
        said = evoexp(*words)
        assert said.code == 0, said
        (line,) = lines(said.err)
        assert line.startswith(left_out)
        assert line.endswith(
            "; run again by: evoexp run experiment=rana_planar budget=smoke "
            "ga.population_size=8 ga.num_generations=2 planner.num_new_trajectories=1 "
            "runner=serial"
        )
    said = evoexp("reproduce", run.hash12)
    assert said.code == 1
    assert "damaged: cut or overwritten" in said.out
    assert "1 of 2 MATCH, 1 damaged" in said.out

    said = evoexp("run", *PLANAR, "--no-report")
    assert said.code == 0
    (line,) = lines(said.err)
    assert line.startswith(f"evoexp: run {run.hash12}: damaged, and run again: 0001.mcap (cut")
    assert line.endswith("; kept as 0001.mcap.damaged")
    assert "replicates: 1 of 1 done" in said.out
    assert (run.replicates / "0001.mcap.damaged").read_bytes() == whole[:-10]
    again = evoexp("show", str(run.log_path(1)), "--json").out
    assert json.loads(again)["result"]["digest"] == json.loads(digest)["result"]["digest"]
    said = evoexp("run", *PLANAR, "--no-report")
    assert (said.code, said.err) == (0, "")
    assert "nothing to run" in said.out


def test_the_page_names_damaged_logs(evoexp: Evoexp, run: RunDirectory, stored: Path) -> None:
    run.log_path(1).write_bytes(b"")
    assert evoexp("report", *PLANAR).code == 0
    (page,) = stored.glob("reports/*/index.md")
    text = page.read_text()
    assert "> **Damaged logs.** via-point GA: 1 (0001.mcap) could not be read" in text
    assert "via-point GA: 1 of 2 replicates done" in text


def test_load_warns(run: RunDirectory) -> None:
    status = run.log_path(0).stat()
    content = bytearray(run.log_path(0).read_bytes())
    content[len(content) // 2] ^= 8
    run.log_path(0).write_bytes(bytes(content))
    os.utime(run.log_path(0), ns=(status.st_atime_ns, status.st_mtime_ns))
    with pytest.warns(DamagedStore, match="0000.mcap .altered"):
        frames = package.load(run.hash12)
    assert frames.summaries["replicate"].tolist() == [1]
    assert frames.generations["replicate"].unique().tolist() == [1]


def test_a_damaged_log_that_was_never_asked_for_is_set_aside_alone(
    evoexp: Evoexp, run: RunDirectory
) -> None:
    """Two replicates were asked for: 0 and 1."""
    shutil.copy(run.log_path(1), run.log_path(3))
    run.log_path(2).write_bytes(b"")
    said = evoexp("run", *PLANAR, "--no-report")
    assert said.code == 0 and "nothing to run" in said.out
    (line,) = lines(said.err)
    assert f"run {run.hash12}: damaged, and set aside: never asked for: 0002.mcap" in line
    assert run.completed() == {0, 1}
    assert {path.name for path in run.replicates.glob("*.damaged")} == {
        "0002.mcap.damaged",
        "0003.mcap.damaged",
    }
    assert evoexp("verify", run.hash12).code == 0


def test_two_logs_that_changed_places(
    evoexp: Evoexp, run: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    first, second = run.log_path(0), run.log_path(1)
    contents = first.read_bytes(), second.read_bytes()
    first.write_bytes(contents[1])
    second.write_bytes(contents[0])
    said = evoexp("reproduce", run.hash12)
    assert said.code == 1
    assert f"damaged: holds replicate 1 of {run.hash12}, which does not belong here" in said.out
    assert "0 of 2 MATCH, 2 damaged" in said.out
    assert evoexp("reproduce", str(first)).code == 0, "anywhere, a log is compared by itself"
    assert evoexp("run", *PLANAR, "--no-report").code == 0
    assert evoexp("reproduce", run.hash12).code == 0


def test_a_run_without_its_configuration_is_not_answered_from_the_shipped_table(
    evoexp: Evoexp, refused: Callable[..., str], outputs: Path
) -> None:
    words = ("experiment=rana_planar", "budget=smoke", "--only", "via-point GA", "runner=serial")
    assert evoexp("run", *words, "--no-report").code == 0
    (path,) = (outputs / "runs").iterdir()
    (path / "config.json").unlink()
    said = evoexp("reproduce", path.name[:6])
    assert said.code == 0
    assert "2 of 2 MATCH" in said.out
    assert "shipped" not in said.out
    (path / "manifest.json").unlink()
    for log in path.glob("replicates/*.mcap"):
        log.write_bytes(b"")
    said = evoexp("list", "--json")
    assert "neither a log nor the manifest" in json.loads(said.out)["runs"][0]["damage"]
    assert "config.json: cannot be read" in refused("reproduce", path.name[:6])
    shutil.rmtree(path)
    assert "against the shipped table" in evoexp("reproduce", path.name[:6]).out
