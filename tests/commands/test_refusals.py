"""What cannot be done is said in one line that names the field, before anything is written."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import SERIAL, Evoexp

from evoexp.configuration.search_path import options
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from forged_logs import with_attachment
from store_lookup import find_runs

Refused = Callable[..., str]

PLANAR = ("experiment=rana_planar", *SERIAL)
ARMS = ("experiment=rana_obstacles", *SERIAL)
CHOSEN = f"must be chosen: experiment=NAME, one of {len(options('experiment'))}: evoexp list"


OVERRIDES = {
    # unknown names
    "ga.mutation_rat=1": "ga.mutation_rat: unknown setting; did you mean 'mutation_rate'? (known ",
    "gaa.mutation_rate=1": "gaa: unknown setting; did you mean 'ga'?",
    "mutation_rate=1": "mutation_rate: unknown setting; did you mean 'ga.mutation_rate'?",
    "+ga.temperature=1": "ga.temperature: unknown setting",
    "+reference=x": "reference: no option 'x' (options: grid_frontier, placement_conventional, ",
    "robot.arms.0.length=1": "robot.arms[0].length: unknown setting; did you mean 'link_lengths'?",
    "ga=rana_plana": "ga: no option 'rana_plana'; did you mean 'rana_planar'? (options: ",
    "robot=../robot/two_planar_2r": "robot: no option '../robot/two_planar_2r'",
    "report.figures=ranna": "report.figures: no option 'ranna'; did you mean 'rana'?",
    "runner.workers=1": "runner.workers: unknown setting; did you mean 'num_workers'?",
    # types and ranges
    "ga.mutation_rate=often": "ga.mutation_rate: must be a number, was 'often'",
    "ga.num_elites=1.5": "ga.num_elites: must be a whole number, was 1.5",
    "planner.spline_end=natur": "spline_end: must be one of 'natural' or 'clamped', was 'natur'; ",
    "scenario.obstacles=[{shape:cone}]": "scenario.obstacles[0]: must be one of 'sphere', 'box', ",
    "report.dpi=fine": "report.dpi: must be a whole number, was 'fine'",
    # pairs
    "ga.num_elites=9": "ga.num_elites: must be at most population_size (8), was 9",
    "ga.num_elites=8": "must be at most the offspring of a generation (0), was 1",
    "scenario.q_start=[[90,0],[270,0]]": "must be free of collision (two arms overlap by 1 unit)",
    "scenario.q_goal=[[0,0]]": "scenario.q_goal: must be one list per arm of the robot",
    "robot=three_planar_2r": "one list per arm of the robot, with 2, 2, 2 joint angles",
    # what a configuration may not name
    "ga._target_=os.system": "ga._target_: must be a registered component, was 'os.system'",
    "+ga.x={_target_:builtins.eval}": "must be a registered component, was 'builtins.eval'",
    "hydra.run.dir=/tmp/x": "(nothing of Hydra's own; EVOEXP_OUTPUTS names the folder), was 'hydra",
    "hydra/launcher=basic": "nothing of Hydra's own",
    "conditions={}": "must be left to the experiment's file (choose among them: --only LABEL)",
    "budget.name=paper": "budget.name: must be left as it is: claims are judged by it",
    # sweeps, malformed, twice
    "ga.num_elites=0,2": "must be one value (or add -m to sweep over several), was '0,2'",
    "ga.num_elites": "override: must be key=value, was 'ga.num_elites'",
    "ga.num_elites==1": "ga.num_elites: must be a number, a word, a [list], a {mapping} or",
    "": "override: must be key=value, was ''",
    f"seed={'9' * 5000}": "seed: must be a number, a word, a [list], a {mapping} or",
    "ga.population_size=9": "must be given once, was 'ga.population_size=8 ga.population_size=9'",
    "experiment=rana_planar": "experiment: must be given once",
    "ga.mutation_rate=${nothing}": "the name of another setting in ${…} (there is no 'nothing')",
    "~robot": "robot: must be given, was '~robot'",
    "~control=random_search": "control: must be an option that is chosen, to be deleted, was '~co",
}


@pytest.mark.examples(11)
@pytest.mark.parametrize("override", OVERRIDES, ids=lambda text: text[:40])
def test_overrides(refused: Refused, override: str) -> None:
    assert OVERRIDES[override] in refused("run", *ARMS, override)


NO_FOLDER = "--config-dir: must be a folder, was 'nowhere'"
NO_EXPERIMENT = "experiment: no option 'rana_planr'; did you mean 'rana_planar'? (options: rana_"
NO_MOTION = "motion file: one is needed (.json, .npy, .csv, .yaml or .yml), got"
COMMANDS = {
    "run experiment=rana_planr": NO_EXPERIMENT,
    "run experiment=": "experiment: no option '' (options: ",
    "run experiment=null": f"experiment: {CHOSEN} (without one, every group is",
    "run robot=two_planar_2r": f"experiment: {CHOSEN}",
    "run --cfg job": "no option '--cfg': evoexp show experiment=NAME; with --all",
    "run experiment=rana_planar,rana_obstacles": "experiment: must be one value (or add -m",
    "run -m experiment=rana_planar scenario.length_unit=choice(a',m)": "must be a number, a word, ",
    "run experiment=rana_planar --only GA": "--only: no option 'GA'",
    "run experiment=rana_planar --only ,": "argument --only: must name a condition, was ','",
    "run experiment=rana_planar --nolreport": "'--nolreport'; did you mean '--no-report'?",
    "run experiment=rana_planar --no-rep": "no option '--no-rep'; did you mean '--no-report'?",
    "run --fast experiment=rana_planar": "no option '--fast' (options: -h, --help, --config-dir",
    "rum experiment=rana_planar": "no command 'rum'; did you mean 'run'? (commands: run, plan, ",
    "--fast": "no option '--fast'",
    "list runs": "no option 'runs'",
    "plan experiment=rana_planr": NO_EXPERIMENT,
    "show": "the following arguments are required: HASH",
    "report --all rana": "--all: must be given alone, was 'rana'",
    "report --all": "no experiment is stored",
    "report --all --check": "no experiment is stored",
    "report": "experiment: must be named, or --all given, was 'none'",
    "site": "; try: evoexp run experiment=rana_planar",
    "verify abcabcabcabc": "no run 'abcabcabcabc' among the 0",
    "pack ffff": "no run 'ffff'",
    "clean temporry": "did you mean 'temporary'",
    "new robot mine": "kind: must be one of planner, operator, was 'robot'",
    "claims lavoi": "paper: no option 'lavoi'; did you mean 'lavoie'?",
    "completion bash ga": "completion: must be bash alone, was 'ga'",
    "evaluate experiment=rana_planr MOTION": NO_EXPERIMENT,
    "evaluate experiment=rana_planar": f"{NO_MOTION} 0: none",
    "evaluate a.json b.json experiment=rana_planar": f"{NO_MOTION} 2: a",
    "evaluate experiment=lavoie --write a.json": "(3 × 7; 3 × 10); choose with --only '7-DOF' | '1",
    "evaluate experiment=rana_planar --write a.txt": "--write: must be a file that ends in .json",
    "evaluate experiment=rana_planar --replicate 3": "--replicate: must go with a hash, was given",
    "evaluate MOTION": f"experiment: {CHOSEN}",
    "view MOTION": f"experiment: {CHOSEN}",
    "play MOTION": f"experiment: {CHOSEN}",
    "export MOTION": f"experiment: {CHOSEN}",
    "view experiment=rana_planar": f"{NO_MOTION} 0: none",
    "view ffffffff": "hash: no run 'ffffffff' among the 0 in ",
    "view 4da921ed6875": "condition 4da921ed6875: not run here; run it: evoexp run experi",
    "reproduce no/such.mcap": "no/such.mcap: cannot be read: No such file or directory",
    "reproduce abcabcabcabc": "NOTHING TO COMPARE: hash: no run 'abcabcabcabc' among the 0 in",
    "reproduce xyz": "NOTHING TO COMPARE: hash: must be 1 to 64 hexadecimal digits, was 'xyz'",
    "show xyz": "hash: must be 1 to 64 hexadecimal digits, was 'xyz'; no shipped condition either ",
    "show abc def": "show: must be given one hash or log, was 'abc def'",
    "show rana_planar": "did you mean 'experiment=rana_planar'?",
    "show experiment=rana_planr": NO_EXPERIMENT,
    "show experiment=rana_planar planner.num_new_trajectories=1000 --json": "must be at most the",
    "show experiment=rana_planar scenario.q_start=[[90,0],[90,180]]": "must be free of collision",
    "show experiment=rana_planar robot=urdf robot.path=none.urdf --all": "none.urdf",
    "show nobody.mcap": "cannot be read: No such file",
    "show experiment=rana_planar --config-dir nowhere": NO_FOLDER,
    "run experiment=rana_planar --config-dir nowhere": NO_FOLDER,
    "list --config-dir nowhere": NO_FOLDER,
    "compare rana_planet": "did you mean 'rana_planar'?",
    "compare lavoie_7dof": "nothing stored",
    "compare rana_planar 4da921": "experiment: no option '4da921'",
    "compare RUN ga.num_elites=1": "left out where runs are given by their hashes",
    "diff RUN ffff": "no run 'ffff'",
    "view RUN --replicate 9": "no finished replicate 9 (finished: 0, 1)",
    "view RUN RUN RUN RUN RUN": "motions: at most 4 go together, got 5",
    "view RUN --turn-speed 0": "--turn-speed: must be greater than 0, was 0.0",
    "play RUN RUN": "motion: one at a time, got 2; choose with --only LABEL",
    "export RUN --format jsn": "must be one of csv, json, ros, was 'jsn'; did you mean 'json'?",
    "export RUN --ramp -1": "--ramp: must be greater than 0, was -1.0",
}


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
