"""`view`, `play` and `export` on stored runs, logs, and motions of one's own."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import Evoexp

from store_lookup import find_runs

Refused = Callable[..., str]
SCENE = ("experiment=rana_planar", "budget=smoke", "--only", "via-point GA")
JOINTS = "arm_0_joint_0,arm_0_joint_1,arm_1_joint_0,arm_1_joint_1\n"


@pytest.fixture
def runs(stored: Path) -> list[str]:
    return [run.hash12 for run in find_runs(stored)]


def test_view_writes_a_page_of_the_best_replicate(
    evoexp: Evoexp, stored: Path, runs: list[str]
) -> None:
    said = evoexp("view", runs[0])
    (path,) = (stored / "motions").glob("*.html")
    assert path.name.startswith(f"{runs[0]}-000")
    assert said.code == 0 and str(path) in said.out and "kB" in said.out
    drawn = path.read_text()
    assert "rana_planar · " in drawn
    path.unlink()
    assert str(path) in evoexp("view", runs[0]).out
    assert path.read_text() == drawn


def test_view_puts_two_runs_side_by_side(
    evoexp: Evoexp, tmp_path: Path, stored: Path, runs: list[str]
) -> None:
    path = tmp_path / "deep" / "two.html"
    assert evoexp("view", *runs, "--worst", "-o", str(path)).code == 0
    text = path.read_text()
    assert all(run in text for run in runs)
    for run in find_runs(stored):  # named as `list` names them
        origin = run.origin()
        title = json.dumps(f"{origin['experiment']} · {origin['label']}")
        assert f'"title":{title}' in text


def test_a_log_alone_is_enough(
    evoexp: Evoexp, stored: Path, runs: list[str], tmp_path: Path
) -> None:
    log = shutil.copy(stored / "runs" / runs[0] / "replicates" / "0001.mcap", tmp_path)
    for words in ((runs[0], "--replicate", "1"), (str(log),)):
        page = tmp_path / f"{len(words)}.html"
        assert evoexp("view", *words, "-o", str(page)).code == 0
        assert '"replicate","1"' in page.read_text()


@pytest.mark.parametrize(
    ("line", "endings"),
    [
        ("play RUN", {".mcap", ".json"}),
        ("export RUN --timing uniform", {".json"}),
        ("export RUN --format csv --timing uniform", {".csv"}),
    ],
)
def test_files_are_written_beside_the_runs(
    evoexp: Evoexp, stored: Path, runs: list[str], line: str, endings: set[str]
) -> None:
    assert evoexp(*line.replace("RUN", runs[0]).split()).code == 0
    assert {path.suffix for path in (stored / "motions").iterdir()} == endings


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


def test_a_trajectory_of_others_is_shown_and_played(
    evoexp: Evoexp, outputs: Path, tmp_path: Path
) -> None:
    path = tmp_path / "theirs.csv"
    path.write_text(
        "time;arm_1_joint_1_deg;arm_1_joint_0_deg;arm_0_joint_0_deg;arm_0_joint_1_deg;gripper\n"
        "0;10.5;10;180;90;1\n1;0;0;90;90;2\n"
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
        (f"{JOINTS}0,0,0,90\n0,0,0,0\n", "arm_1_joint_1: 90 without a unit is hardly in rad: name"),
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
    path.write_text(f"{JOINTS}0,0,0,0\n0,0,0,1\n")
    assert refused("evaluate", *SCENE, str(path), "--write", written) == (
        "--write: must go with a solution, was given with a trajectory"
    )
