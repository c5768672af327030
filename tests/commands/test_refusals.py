"""Whatever cannot be done is said in one line that names the field.

Before anything is computed or written.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import SERIAL, Evoexp

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.search_path import options
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.records import Block, generations
from evoexp.store.log import Log
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from store_lookup import find_runs

Refused = Callable[..., str]

PLANAR = ("experiment=rana_planar", *SERIAL)
ARMS = ("experiment=rana_obstacles", *SERIAL)
CHOSEN = f"must be chosen: experiment=NAME, one of {len(options('experiment'))}: evoexp list"


@pytest.mark.examples(11)
@pytest.mark.parametrize(
    ("override", "message"),
    [
        # unknown names
        (
            "ga.mutation_rat=1",
            "ga.mutation_rat: unknown setting; did you mean 'mutation_rate'? (known here: "
            "crossover, crossover_rate",
        ),
        ("gaa.mutation_rate=1", "gaa: unknown setting; did you mean 'ga'?"),
        ("mutation_rate=1", "mutation_rate: unknown setting; did you mean 'ga.mutation_rate'?"),
        ("+ga.temperature=1", "ga.temperature: unknown setting"),
        (
            "+reference=x",
            "reference: no option 'x' (options: grid_frontier, placement_conventional, ",
        ),
        (
            "robot.arms.0.length=1",
            "robot.arms[0].length: unknown setting; did you mean 'link_lengths'?",
        ),
        ("ga=rana_plana", "ga: no option 'rana_plana'; did you mean 'rana_planar'? (options: "),
        ("robot=../robot/two_planar_2r", "robot: no option '../robot/two_planar_2r'"),
        ("report.figures=ranna", "report.figures: no option 'ranna'; did you mean 'rana'?"),
        ("runner.workers=1", "runner.workers: unknown setting; did you mean 'num_workers'?"),
        # types and ranges
        ("ga.mutation_rate=often", "ga.mutation_rate: must be a number, was 'often'"),
        ("ga.num_elites=1.5", "ga.num_elites: must be a whole number, was 1.5"),
        (
            "planner.spline_end=natur",
            "planner.spline_end: must be one of 'natural' or 'clamped', was 'natur'; did you",
        ),
        (
            "scenario.obstacles=[{shape:cone}]",
            "scenario.obstacles[0]: must be one of 'sphere', 'box', 'capsule', 'cylinder', "
            "'half_space', 'ellipse'",
        ),
        ("report.dpi=fine", "report.dpi: must be a whole number, was 'fine'"),
        # pairs
        ("ga.num_elites=9", "ga.num_elites: must be at most population_size (8), was 9"),
        (
            "ga.num_elites=8",
            "planner.num_new_trajectories: must be at most the offspring of a generation (0), "
            "was 1",
        ),
        (
            "scenario.q_start=[[90,0],[270,0]]",
            "scenario.q_start: must be free of collision (two arms overlap by 1 unit)",
        ),
        ("scenario.q_goal=[[0,0]]", "scenario.q_goal: must be one list per arm of the robot"),
        (
            "robot=three_planar_2r",
            "scenario.q_start: must be one list per arm of the robot, with 2, 2, 2 joint angles",
        ),
        # what a configuration may not name
        ("ga._target_=os.system", "ga._target_: must be a registered component, was 'os.system'"),
        (
            "+ga.x={_target_:builtins.eval}",
            "ga.x._target_: must be a registered component, was 'builtins.eval'",
        ),
        (
            "hydra.run.dir=/tmp/x",
            "(nothing of Hydra's own; EVOEXP_OUTPUTS names the folder), was 'hydra.run.dir",
        ),
        ("hydra/launcher=basic", "nothing of Hydra's own"),
        (
            "conditions={}",
            "conditions: must be left to the experiment's file (choose among them: --only LABEL)",
        ),
        ("budget.name=paper", "budget.name: must be left as it is: claims are judged by it"),
        # sweeps, malformed, twice
        (
            "ga.num_elites=0,2",
            "ga.num_elites: must be one value (or add -m to sweep over several), was '0,2'",
        ),
        ("ga.num_elites", "override: must be key=value, was 'ga.num_elites'"),
        ("ga.num_elites==1", "ga.num_elites: must be a number, a word, a [list], a {mapping} or"),
        ("", "override: must be key=value, was ''"),
        (f"seed={'9' * 5000}", "seed: must be a number, a word, a [list], a {mapping} or"),
        (
            "ga.population_size=9",
            "ga.population_size: must be given once, was 'ga.population_size=8 "
            "ga.population_size=9'",
        ),
        ("experiment=rana_planar", "experiment: must be given once"),
        (
            "ga.mutation_rate=${nothing}",
            "ga.mutation_rate: must be a value, or the name of another setting in ${…} (there is "
            "no 'nothing')",
        ),
        ("~robot", "robot: must be given, was '~robot'"),
        (
            "~control=random_search",
            "control: must be an option that is chosen, to be deleted, was '~control=random_",
        ),
    ],
)
def test_overrides(refused: Refused, override: str, message: str) -> None:
    assert message in refused("run", *ARMS, override)


@pytest.mark.examples(4)
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("run", "experiment=rana_planr"),
            "experiment: no option 'rana_planr'; did you mean 'rana_planar'? (options: rana_",
        ),
        (("run", "experiment="), "experiment: no option '' (options: "),
        (("run", "experiment=null"), f"experiment: {CHOSEN} (without one, every group is"),
        (("run", "robot=two_planar_2r"), f"experiment: {CHOSEN}"),
        (("run", "--cfg", "job"), "no option '--cfg': evoexp show experiment=NAME; with --all"),
        (
            ("run", "experiment=rana_planar,rana_obstacles"),
            "experiment: must be one value (or add -m",
        ),
        (
            ("run", "-m", "experiment=rana_planar", 'scenario.length_unit=choice("foot\'",m)'),
            "scenario.length_unit: must be a number, a word, a [list], a {mapping} or 'any",
        ),
        (("run", "experiment=rana_planar", "--only", "GA"), "--only: no option 'GA'"),
        (
            ("run", "experiment=rana_planar", "--only", " , "),
            "argument --only: must name a condition, was ' , '",
        ),
        (
            ("run", "experiment=rana_planar", "--nolreport"),
            "no option '--nolreport'; did you mean '--no-report'?",
        ),
        (
            ("run", "--fast", "experiment=rana_planar"),
            "no option '--fast' (options: -h, --help, --config-dir, -m, --multirun, --only",
        ),
        (
            ("run", "--no-rep", "experiment=rana_planar"),
            "no option '--no-rep'; did you mean '--no-report'?",
        ),
        (
            ("rum", "experiment=rana_planar"),
            "no command 'rum'; did you mean 'run'? (commands: run, plan, report, site, compare,",
        ),
        (("--fast",), "no option '--fast'"),
        (("list", "runs"), "no option 'runs'"),
        (("show",), "the following arguments are required: HASH"),
        (
            ("report", "rana_planr"),
            "experiment: no option 'rana_planr'; did you mean 'rana_planar'? (options: rana_",
        ),
        (("report", "rana_planar"), "rana_planar: nothing stored in"),
        (
            ("evaluate", "experiment=rana_planar"),
            "motion file: one is needed (.json, .npy, .csv, .yaml or .yml), got 0: none",
        ),
        (
            ("evaluate", "a.json", "b.json", "experiment=rana_planar"),
            "motion file: one is needed (.json, .npy, .csv, .yaml or .yml), got 2: a",
        ),
        (("reproduce", "no/such.mcap"), "no/such.mcap: cannot be read: No such file or directory"),
        (
            ("reproduce", "abcabcabcabc"),
            "NOTHING TO COMPARE: hash: no run 'abcabcabcabc' among the 0 in",
        ),
        (
            ("reproduce", "xyz"),
            "NOTHING TO COMPARE: hash: must be 1 to 64 hexadecimal digits, was 'xyz'",
        ),
        (
            ("show", "xyz"),
            "hash: must be 1 to 64 hexadecimal digits, was 'xyz'; no shipped condition either "
            "(stored: none",
        ),
    ],
)
def test_commands(refused: Refused, words: tuple[str, ...], message: str) -> None:
    assert message in refused(*words)


# Hashes


def test_an_unknown_hash_lists_what_is_stored(refused: Refused, stored: Path) -> None:
    names = [run.hash12 for run in find_runs(stored)]
    for command in ("show", "reproduce"):
        said = refused(command, "abcdef")
        assert "hash: no run 'abcdef' among the 3 in" in said
        assert f"(stored: {', '.join(names)}; see: evoexp list)" in said
    near = names[0][:11] + ("0" if names[0][11] != "0" else "1")
    assert f"did you mean '{names[0]}'?" in refused("show", near)


def test_an_ambiguous_hash_lists_the_candidates(refused: Refused, stored: Path) -> None:
    for k in range(16):  # seeds until two runs share their first digit
        condition = compose.expand([*PLANAR, f"seed={k + 1}"])[0].conditions[0].condition
        RunDirectory(stored, condition.id).create(condition.to_json(), {})
        names = [run.hash12 for run in find_runs(stored)]
        shared = {a[0]: (a, b) for a, b in zip(names, names[1:], strict=False) if a[0] == b[0]}
        if shared:
            break
    digit, pair = next(iter(shared.items()))
    for command in ("show", "reproduce"):
        assert refused(command, digit) == f"hash: '{digit}' is ambiguous: {', '.join(pair)}"


def test_a_missing_replicate_lists_those_that_are_there(refused: Refused, stored: Path) -> None:
    run = find_runs(stored)[0]
    said = refused("reproduce", run.hash12, "--replicate", "7")
    assert said == f"run {run.hash12}: no finished replicate 7 (finished: 0, 1)"
    log = run.log_path(0).read_bytes()
    for replicate in (2, 3, 5, 6):
        run.log_path(replicate).write_bytes(log)
    said = refused("reproduce", run.hash12, "--replicate", "7")
    assert said.endswith("(finished: 0–3, 5, 6)"), "thousands fit in a line"
    assert "invalid int value: 'x'" in refused("reproduce", run.hash12, "--replicate", "x")


# Logs


def test_a_damaged_log_is_named(refused: Refused, stored: Path) -> None:
    run = find_runs(stored)[0]
    log = run.log_path(1)
    whole = log.read_bytes()
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
    for damaged in (whole[:-1], whole[:middle], b"", flipped, b"PAR1" * 100):
        log.write_bytes(damaged)
        assert refused("reproduce", str(log)).startswith(f"{log}: ")
        assert refused("show", str(log)).startswith(f"{log}: ")
    log.write_bytes(whole[:middle])
    log.unlink()
    assert refused("reproduce", str(log)) == f"{log}: cannot be read: No such file or directory"


def crafted(config: bytes, path: Path, source: Path) -> Path:
    """Write a log that is whole, but whose configuration says something else."""
    stored, condition = read_log(source), Condition.from_json(read_log(source).config_json)
    rng = condition.rng(0)
    log = Log(stored.condition_id, config, 0, rng, environment={})
    planner, problem = condition.prepare()
    for generation in generations(planner.evolve(problem, rng)):
        log.write(Block.of(generation))
    path.write_bytes(log.finish(stored.summary).content)
    return path


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("os.system", "planner.ga._target_: must be a registered component, was 'os.system'"),
        (
            "subprocess:Popen",
            "planner.ga._target_: must be a registered component, was 'subprocess:Popen'",
        ),
        ("arms", "planner.ga.arms: must be given, was None"),
    ],
)
def test_a_log_cannot_name_other_code(
    refused: Refused, stored: Path, tmp_path: Path, target: str, message: str
) -> None:
    source = find_runs(stored)[0].log_path(0)
    config = json.loads(read_log(source).config_json)
    inner = config["planner"].get("planner", config["planner"])
    inner["ga"]["_target_"] = target
    said = refused(
        "reproduce", str(crafted(json.dumps(config).encode(), tmp_path / "0000.mcap", source))
    )
    assert message.split(": ", 1)[1] in said
    assert re.search(r"planner\.ga\.", said)


def test_a_log_whose_configuration_is_another_one_is_refused(
    refused: Refused, stored: Path, tmp_path: Path
) -> None:
    source = find_runs(stored)[0].log_path(0)
    config = read_log(source).config_json
    other = config.replace(b'"seed":0', b'"seed":1')
    said = refused("reproduce", str(crafted(other, tmp_path / "0000.mcap", source)))
    assert "its configuration has hash" in said
    assert read_log(source).condition_id[:12] in said


def test_another_revision_says_how_to_run_anew(
    refused: Refused, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = find_runs(stored)[0]
    monkeypatch.setattr(GeneticSettings, "revision", 2)
    said = refused("reproduce", run.hash12)
    assert said.startswith(f"run {run.hash12}: ")
    assert "ga was revision 1, installed is 2" in said
    assert (
        "Run it anew with what is installed: evoexp run experiment=rana_planar budget=smoke" in said
    )


# Files and directories


def test_outputs_that_cannot_be_written_are_named(
    evoexp: Evoexp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "file"))
    said = evoexp("run", *PLANAR, "--no-report")
    assert said.code == 2
    assert re.fullmatch(rf"evoexp: {tmp_path}/file/runs\S*: Not a directory\n", said.err)
