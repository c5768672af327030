"""`view`, `play` and `export` on stored runs, logs, and motions of one's own."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import SMALL, Evoexp

from evoexp.store.run_context import origin_of
from store_lookup import find_runs

Refused = Callable[..., str]
STRAIGHT = [[[180.0, 90.0], [0.0, 90.0]]] * 2


@pytest.fixture
def runs(stored: Path) -> list[str]:
    return [run.hash12 for run in find_runs(stored)]


def test_view_writes_a_page_of_the_best_replicate(
    evoexp: Evoexp, stored: Path, runs: list[str]
) -> None:
    said = evoexp("view", runs[0])
    assert said.code == 0
    (path,) = (stored / "motions").glob("*.html")
    assert path.name.startswith(f"{runs[0]}-000")
    assert str(path) in said.out and "kB" in said.out
    assert "rana_planar · " in path.read_text()


def test_a_page_that_was_removed_is_written_again(
    evoexp: Evoexp, stored: Path, runs: list[str]
) -> None:
    assert evoexp("view", runs[1]).code == 0
    (path,) = (stored / "motions").glob("*.html")
    drawn = path.read_bytes()
    path.unlink()
    assert str(path) in evoexp("view", runs[1]).out
    assert path.read_bytes() == drawn


def test_view_puts_two_runs_side_by_side(
    evoexp: Evoexp, tmp_path: Path, stored: Path, runs: list[str]
) -> None:
    path = tmp_path / "deep" / "two.html"
    assert evoexp("view", *runs, "--worst", "-o", str(path)).code == 0
    text = path.read_text()
    assert all(run in text for run in runs)
    for run in find_runs(stored):  # named as `list` names them
        origin = origin_of(run)
        title = json.dumps(f"{origin['experiment']} · {origin['label']}")
        assert f'"title":{title}' in text


def test_a_log_alone_is_enough(
    evoexp: Evoexp, stored: Path, runs: list[str], tmp_path: Path
) -> None:
    log = tmp_path / "log.mcap"
    log.write_bytes((stored / "runs" / runs[0] / "replicates" / "0001.mcap").read_bytes())
    from_run, from_log = tmp_path / "a.html", tmp_path / "b.html"
    assert evoexp("view", runs[0], "--replicate", "1", "-o", str(from_run)).code == 0
    assert evoexp("view", str(log), "-o", str(from_log)).code == 0
    assert '"replicate","1"' in from_run.read_text()
    assert '"replicate","1"' in from_log.read_text()


def test_view_of_a_motion_of_ones_own(evoexp: Evoexp, tmp_path: Path, outputs: Path) -> None:
    motion = tmp_path / "mine.json"
    ends = [[[90.0 + 9.0 * k, 9.0 * k] for k in range(21)], [[0.0, -9.0 * k] for k in range(21)]]
    motion.write_text(json.dumps(ends))
    said = evoexp("view", "experiment=rana_planar", str(motion), *SMALL, "--only", "via-point GA")
    assert said.code == 0, said
    assert "mine.json · via-point GA" in (outputs / "motions" / "mine.html").read_text()


def test_what_cannot_be_shown_is_said(refused: Refused, runs: list[str], tmp_path: Path) -> None:
    assert refused("view", runs[0], "--replicate", "9") == (
        f"run {runs[0]}: no finished replicate 9 (finished: 0, 1)"
    )
    assert "hash: no run 'ffffffff' among the 3 in " in refused("view", "ffffffff")
    assert refused("view", *runs * 3) == "motions: at most 4 go together, got 9"
    assert refused("view", "experiment=rana_planar") == (
        "motion file: one is needed (.json, .npy, .csv, .yaml or .yml), got 0: none"
    )
    short = tmp_path / "short.json"
    short.write_text(json.dumps(STRAIGHT))
    assert "must be via-point GA: 2 × 21 × 2" in refused(
        "view", "experiment=rana_planar", str(short)
    )
    assert (
        refused("view", runs[0], "--turn-speed", "0")
        == "--turn-speed: must be greater than 0, was 0.0"
    )
    assert refused("play", *runs) == "motion: one at a time, got 3; choose with --only LABEL"


def test_a_condition_that_was_not_run_here_says_how(refused: Refused) -> None:
    said = refused("view", "4da921ed6875")
    assert (
        said == "condition 4da921ed6875: not run here; run it: evoexp run experiment=rana_planar "
        "--only 'via-point GA'"
    )


def test_play_writes_a_log_and_its_layout(evoexp: Evoexp, stored: Path, runs: list[str]) -> None:
    assert evoexp("play", runs[0]).code == 0
    assert {path.suffix for path in (stored / "motions").iterdir()} == {".mcap", ".json"}


def test_export_writes_trajectories(evoexp: Evoexp, stored: Path, runs: list[str]) -> None:
    assert evoexp("export", runs[0], "--timing", "uniform").code == 0
    assert evoexp("export", runs[0], "--format", "csv", "--timing", "uniform").code == 0
    assert {path.suffix for path in (stored / "motions").iterdir()} == {".csv", ".json"}


@pytest.mark.examples(3)
@pytest.mark.parametrize("timing", ["uniform", "optimal"])
@pytest.mark.parametrize("form", ["csv", "json", "ros", "yaml"])
def test_an_exported_trajectory_is_judged_as_the_motion_was(
    evoexp: Evoexp, stored: Path, runs: list[str], tmp_path: Path, form: str, timing: str
) -> None:
    if timing == "optimal":
        pytest.importorskip("toppra", reason="needs toppra, from evoexp[timing]")
    path = tmp_path / f"exported.{'csv' if form == 'csv' else 'json'}"
    words = ("--format", "ros" if form == "yaml" else form, "--timing", timing)
    assert evoexp("export", runs[0], *words, "-o", str(path)).code == 0
    if form == "yaml":  # JSON is YAML
        path = path.rename(path.with_suffix(".yaml"))
    before = json.loads(evoexp("evaluate", runs[0], "--json").out)
    found = json.loads(evoexp("evaluate", *SCENE, str(path), "--json").out)
    rounded = form in ("ros", "yaml")  # whole nanoseconds
    for name in ("certified", "certified_margin", "clearance_pair", "refuted_pair"):
        assert found[name] == before[name], name
    # at rest where lines meet, or along the very lines
    assert found["clearance"] == pytest.approx(before["clearance"], abs=1e-3 if rounded else 2e-4)
    assert found["remarks"][0].startswith("a joint trajectory: judged by its bodies")
    assert "fitness" not in found and found["departures"] == []


SCENE = ("experiment=rana_planar", "budget=smoke", "--only", "via-point GA")


def test_a_trajectory_of_others_is_shown_and_played(
    evoexp: Evoexp, outputs: Path, tmp_path: Path
) -> None:
    path = tmp_path / "theirs.csv"
    path.write_text(
        "time;arm_1_joint_1_deg;arm_1_joint_0_deg;arm_0_joint_0_deg;arm_0_joint_1_deg;gripper\n"
        "0;10,5;10;180;90;1\n1;0;0;90;90;2\n"
    )
    said = evoexp("evaluate", *SCENE, str(path))
    assert said.code == 0 and "straight lines between the points" in said.out
    assert "not read: gripper" in said.out
    for command, ending in (("view", ".html"), ("play", ".mcap"), ("export", ".json")):
        said = evoexp(command, *SCENE, str(path))
        assert said.code == 0, said
        assert "theirs.csv: not read: gripper" in said.out
        assert (outputs / "motions" / f"theirs{ending}").exists()
    points = json.loads((outputs / "motions" / "theirs.json").read_text())
    assert points["joint_names"][0] == "arm_0_joint_0"
    assert points["points"][0]["positions"][3] == pytest.approx(0.0174532925199 * 10.5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time,turn\n0,0\n1,1\n", "lacks joints arm_0_joint_0, .* arm_0_joint_0_rad.; has turn"),
        (
            "arm_0_joint_0,arm_0_joint_1,arm_1_joint_0,arm_1_joint_1\n0,0,0,90\n0,0,0,0\n",
            "arm_1_joint_1: 90 without a unit is hardly in rad: name its column arm_1_joint_1_deg",
        ),
        ("a,b\n0,x\n", "line 2: must be a number in column b, was 'x'"),
    ],
)
def test_a_trajectory_that_does_not_fit_is_refused(
    refused: Refused, tmp_path: Path, text: str, said: str
) -> None:
    path = tmp_path / "theirs.csv"
    path.write_text(text)
    for command in ("evaluate", "view", "play", "export"):
        assert re.search(said, refused(command, *SCENE, str(path)))
    written = str(tmp_path / "out.json")
    path.write_text("arm_0_joint_0,arm_0_joint_1,arm_1_joint_0,arm_1_joint_1\n0,0,0,0\n0,0,0,1\n")
    assert refused("evaluate", *SCENE, str(path), "--write", written) == (
        "--write: must go with a solution, was given with a trajectory"
    )


def test_export_refuses_what_cannot_be(refused: Refused, runs: list[str]) -> None:
    said = refused("export", runs[0], "--format", "jsn")
    assert said == "--format: must be one of csv, json, ros, was 'jsn'; did you mean 'json'?"
    assert refused("export", runs[0], "--ramp", "-1") == "--ramp: must be greater than 0, was -1.0"
