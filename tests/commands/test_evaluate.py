"""`evoexp evaluate`: a motion out of a file is judged as the planner judges its own."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_samples import SMALL, Evoexp

from evoexp import shipped
from evoexp.collision.certifier.certificate import Certificate
from evoexp.commands.motion_files import flatten, nested
from evoexp.configuration import compose
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.store.tables import read_summaries

PLANAR = ("experiment=rana_planar", *SMALL)
LABELS = ("via-point GA", "random search", "multi-start")


@pytest.fixture(scope="module")
def runs(stored_once: Path) -> dict[str, RunDirectory]:
    """Return label → stored run."""
    conditions = compose.expand(PLANAR)[0].conditions
    return {label: RunDirectory(stored_once, condition.id) for label, condition in conditions}


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    """Return a file with the straight motion of the two arms, 21 instants."""
    ends = ([[45.0, 225.0], [225.0, 225.0]], [[135.0, 135.0], [315.0, 315.0]])
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(np.linspace(*ends, 21).swapaxes(0, 1).tolist()))
    return path


@pytest.mark.examples(2)
@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("replicate", [0, 1])
def test_the_best_of_a_stored_run_is_worth_what_is_recorded(
    evoexp: Evoexp, runs: dict[str, RunDirectory], tmp_path: Path, label: str, replicate: int
) -> None:
    log = read_log(runs[label].log_path(replicate))
    nested = log.solutions[-1].values.reshape(2, 21, 2)
    (tmp_path / "best.json").write_text(json.dumps(nested.tolist()))
    np.save(tmp_path / "best.npy", nested)
    answers = [
        evoexp("evaluate", *PLANAR, "--only", label, str(tmp_path / name), "--json")
        for name in ("best.json", "best.npy")
    ]
    assert [answer.code for answer in answers] == [0, 0]
    assert answers[0].out == answers[1].out
    said = json.loads(answers[0].out)
    head = {name: said.pop(name) for name in ("label", "condition", "length_unit")}
    assert head == {"label": label, "condition": runs[label].condition_id, "length_unit": "unit"}
    verdict = {name: said.pop(name) for name in Certificate._fields}
    assert verdict == {name: getattr(log.summary, name) for name in Certificate._fields}
    assert (said.pop("solution_of_the_task"), said.pop("departures")) == (True, [])
    assert said == log.summary.terms
    columns = read_summaries(runs[label]).columns
    assert {f"term_{name}" for name in said} == {
        name for name in columns if name.startswith("term_")
    }


def test_several_conditions_are_several_objects_and_columns(evoexp: Evoexp, motion: Path) -> None:
    rows = json.loads(evoexp("evaluate", *PLANAR, str(motion), "--json").out)
    assert [row["label"] for row in rows] == list(LABELS)
    assert rows[0]["condition"] != rows[1]["condition"]
    assert rows[0]["path_length_ratio"] == pytest.approx(1.0, abs=1e-12)
    assert rows[0]["collisions"] > 0.0
    for name in rows[0].keys() - {"label", "condition"}:
        assert rows[0][name] == rows[1][name]
    table = evoexp("evaluate", str(motion), *PLANAR).out
    assert all(row["condition"][:12] in table and row["label"] in table for row in rows)
    apart = {"label", "condition", "length_unit", "departures"}
    assert all(f"│ {name} " in table for name in rows[0].keys() - apart)
    (fitness,) = (line for line in table.splitlines() if "│ fitness " in line)
    assert fitness.count("│") == 3, "conditions that judge the motion alike share a column"


def test_a_motion_that_stays_at_the_start_is_no_solution_though_it_touches_nothing(
    evoexp: Evoexp, tmp_path: Path
) -> None:
    still = np.repeat([[[45.0, 225.0]], [[225.0, 225.0]]], 21, axis=1)
    np.save(tmp_path / "still.npy", still)
    words = ("evaluate", *PLANAR, "--only", LABELS[0], str(tmp_path / "still.npy"))
    said = json.loads(evoexp(*words, "--json").out)
    assert said["certified"] is True
    assert said["solution_of_the_task"] is False
    assert said["departures"] == [
        f"the goal of arm {arm} is not the task's: 90 deg away" for arm in (1, 2)
    ]
    assert f"{LABELS[0]} – no solution of the task: the goal of arm 1" in evoexp(*words).out


def test_overrides_and_only_narrow_it_down(evoexp: Evoexp, motion: Path) -> None:
    words = ("evaluate", *PLANAR, str(motion), "--json", "--only", "via-point GA")
    plain, weighted = (
        json.loads(evoexp(*words).out),
        json.loads(evoexp(*words, "objective.length_weight=1").out),
    )
    assert (plain["label"], weighted["label"]) == ("via-point GA", "via-point GA")
    assert plain["condition"] != weighted["condition"]
    lengths = plain["length_arm_1_deg"] + plain["length_arm_2_deg"]
    assert plain["fitness"] - weighted["fitness"] == pytest.approx(0.5 * lengths)


def test_tables_are_never_cut(
    evoexp: Evoexp, motion: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    swept = "objective.length_weight=0.5,1.0"
    words = ("evaluate", "-m", "experiment=rana_obstacles", swept, str(motion))
    rows = json.loads(evoexp(*words, "--json").out)
    assert len(rows) == 2
    for width in (60, 140):
        monkeypatch.setenv("COLUMNS", str(width))
        out = evoexp(*words).out
        assert "…" not in out
        assert max(map(len, out.splitlines())) <= width
        assert all(out.count(row["condition"][:12]) == 1 for row in rows)
        assert out.count("┏") == (2 if width == 60 else 1), "a second table where one is too wide"


def test_a_condition_of_another_shape_is_left_out(
    evoexp: Evoexp, motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    conf = tmp_path / "conf"
    shutil.copytree(shipped.config_directory(), conf)
    text = (conf / "experiment/rana_planar.yaml").read_text().split("conditions:")[0]
    entries = "{two: [], three: [robot=three_planar_2r, scenario=rana_three_arms]}"
    (conf / "experiment/mixed.yaml").write_text(f"{text}conditions: {entries}\n")
    monkeypatch.setattr(shipped, "config_directory", lambda: conf)
    two = json.loads(motion.read_text())
    files = {"two": two, "three": [*two, two[0]]}
    for label, values in files.items():
        path = tmp_path / f"{label}.json"
        path.write_text(json.dumps(values))
        assert (
            json.loads(evoexp("evaluate", "experiment=mixed", str(path), "--json").out)["label"]
            == label
        )
    (tmp_path / "none.json").write_text(json.dumps(two[:1]))
    said = evoexp("evaluate", "experiment=mixed", str(tmp_path / "none.json"))
    assert said.code == 2
    assert (
        "none.json: must be two: 2 × 21 × 2; three: 3 × 21 × 2 (start and goal included)"
        in said.err
    )
    assert said.err.endswith("was 1 × 21 × 2\n")


def test_parts_of_different_shapes() -> None:
    shape = ((3, 2), (3, 3))
    values: list[Any] = [[[1, 2], [3, 4], [5, 6]], [[1, 2, 3]] * 3]
    flat = flatten(values, shape)
    assert flat is not None
    assert flat.tolist() == [1, 2, 3, 4, 5, 6, 1, 2, 3, 1, 2, 3, 1, 2, 3]
    assert flatten(values[::-1], shape) is None
    assert flatten(values[:1], shape) is None
    assert flatten([[[1, 2], [3]], values[1]], shape) is None
    assert flatten([3, 4], shape) is None


NESTED = [[[0.0, 0.0]] * 21] * 2


def spoiled(value: Any) -> list[Any]:
    nested = json.loads(json.dumps(NESTED))
    nested[1][3][0] = value
    return nested


@pytest.mark.parametrize(
    ("name", "write", "message"),
    [
        ("missing.json", None, "cannot be read: No such file or directory"),
        ("missing.npy", None, "cannot be read: No such file or directory"),
        ("directory.json", lambda p: p.mkdir(), "cannot be read: Is a directory"),
        (
            "motion.txt",
            lambda p: p.write_text("[]"),
            "a motion file ends in .json, .npy, .csv, .yaml or .yml",
        ),
        ("cut.json", lambda p: p.write_text("[[[0,"), "is no json of numbers: Expecting value"),
        ("empty.json", lambda p: p.write_text(""), "is no json of numbers: Expecting value"),
        (
            "binary.json",
            lambda p: p.write_bytes(b"\xff\xfe\x00"),
            "is no json of numbers: 'utf-8' codec",
        ),
        (
            "deep.json",
            lambda p: p.write_text("[" * 100_000),
            "is no json of numbers: maximum recursion depth",
        ),
        (
            "nested.json",
            lambda p: p.write_text("[" * 900 + "]" * 900),
            "must hold nested lists of finite numbers, was [[",
        ),
        (
            "nan.json",
            lambda p: p.write_text(json.dumps(spoiled(float("nan")))),
            "was nan at [1][3][0]",
        ),
        (
            "inf.json",
            lambda p: p.write_text(json.dumps(spoiled(float("inf")))),
            "was inf at [1][3][0]",
        ),
        (
            "huge.json",
            lambda p: p.write_text(json.dumps(spoiled(10**400))),
            "was 1000000000000000000000000000000000000000",
        ),
        ("text.json", lambda p: p.write_text(json.dumps(spoiled("0"))), "was 0 at [1][3][0]"),
        ("null.json", lambda p: p.write_text(json.dumps(spoiled(None))), "was None at [1][3][0]"),
        ("true.json", lambda p: p.write_text(json.dumps(spoiled(True))), "was True at [1][3][0]"),
        (
            "object.json",
            lambda p: p.write_text('{"motion": []}'),
            "must have joint_names and points, as a JointTrajectory, has motion",
        ),
        (
            "number.json",
            lambda p: p.write_text("3"),
            "must hold nested lists of finite numbers, was 3 at its top",
        ),
        ("flat.json", lambda p: p.write_text("[1, 2, 3]"), "must be via-point GA: 2 × 21 × 2"),
        ("none.json", lambda p: p.write_text("[]"), "(start and goal included), was 0"),
        (
            "ragged.json",
            lambda p: p.write_text(json.dumps([*NESTED[:1], [[0.0]]])),
            "was a ragged list of 2",
        ),
        (
            "shape.npy",
            lambda p: np.save(p, np.zeros((2, 20, 2))),
            "(start and goal included), was 2 × 20 × 2",
        ),
        ("scalar.npy", lambda p: np.save(p, np.float64(3)), "was 3.0 at its top"),
        ("nan.npy", lambda p: np.save(p, np.full((2, 21, 2), np.nan)), "was nan at [0][0][0]"),
        (
            "complex.npy",
            lambda p: np.save(p, np.zeros((2, 21, 2), complex)),
            "is no npy of numbers: it holds no numbers but '<c16'",
        ),
        (
            "object.npy",
            lambda p: np.save(p, np.array([{}], dtype=object)),
            "is no npy of numbers: it holds no numbers but '|O'",
        ),
        (
            "cut.npy",
            lambda p: (np.save(p, np.zeros((2, 21, 2))), p.write_bytes(p.read_bytes()[:-8])),
            "is no npy of",
        ),
        ("empty.npy", lambda p: p.write_bytes(b""), "is no npy of numbers: it does not begin"),
        ("pickle.npy", lambda p: p.write_bytes(b"\x80\x04N."), "is no npy of numbers: "),
        (
            "archive.npy",
            lambda p: (np.savez(p, a=np.zeros(3)), Path(f"{p}.npz").rename(p)),
            "is no npy of numbers: it does not begin",
        ),
    ],
)
def test_motion_files_that_cannot_be_read(
    refused: Callable[..., str],
    tmp_path: Path,
    name: str,
    write: Callable[[Path], object] | None,
    message: str,
) -> None:
    path = tmp_path / name
    if write is not None:
        write(path)
    said = refused("evaluate", "experiment=rana_planar", "budget=smoke", str(path))
    assert said.startswith(f"{path}: ")
    assert message in said
    assert len(said) < 400


def test_an_experiment_that_does_not_exist(refused: Callable[..., str], motion: Path) -> None:
    assert "experiment: no option 'rana_planr'; did you mean" in refused(
        "evaluate", "experiment=rana_planr", str(motion)
    )


# Motions that evoexp knows, and templates


@pytest.mark.parametrize(
    "words",
    [
        ("experiment=rana_planar",),
        ("experiment=curkovic_motion",),
        ("experiment=lavoie", "--only", "7-DOF"),
        ("experiment=chen_path", "--only", "(b)"),
        ("experiment=chen_placement",),
        ("experiment=corsepius_ball",),
    ],
    ids=lambda words: words[0].partition("=")[2],
)
def test_a_template_is_written_and_read(
    evoexp: Evoexp, tmp_path: Path, words: tuple[str, ...]
) -> None:
    path = str(tmp_path / "motion.json")
    written = evoexp("evaluate", *words, "--write", path)
    assert (written.code, written.err) == (0, "")
    judged = evoexp("evaluate", *words, path, "--json")
    assert judged.code == 0
    assert json.loads(judged.out)


def test_solutions_of_several_shapes_have_no_common_template(
    evoexp: Evoexp, tmp_path: Path
) -> None:
    answer = evoexp("evaluate", "experiment=lavoie", "--write", str(tmp_path / "motion.json"))
    assert answer.code == 2
    assert answer.err == (
        "evoexp: --write: solutions differ in shape (3 × 7; 3 × 10); choose with --only '7-DOF' | "
        "'10-DOF'\n"
    )
    assert not list(tmp_path.iterdir())


def test_a_stored_run_is_judged_again_and_written(
    evoexp: Evoexp, stored: Path, runs: dict[str, RunDirectory], tmp_path: Path
) -> None:
    run, path = RunDirectory(stored, runs[LABELS[0]].condition_id), tmp_path / "best.json"
    table = read_summaries(run).sort_values("best_cost")
    for words, replicate in (
        ([run.hash12], int(table["replicate"].iloc[0])),
        ([run.hash12, "--replicate", "1"], 1),
        ([str(run.log_path(1))], 1),
    ):
        answer = evoexp("evaluate", *words, "--write", str(path), "--json")
        assert (answer.code, answer.err) == (0, "")
        said = json.loads(answer.out)
        log = read_log(run.log_path(replicate))
        assert said["label"] == f"{run.hash12} #{replicate}"
        assert said["clearance"] == log.summary.clearance
        assert said["certified"] is log.summary.certified
        nested = json.loads(path.read_text())
        assert np.array_equal(np.ravel(nested), log.solutions[-1].values)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--write", "motion.txt"), "--write: must be a file that ends in .json, was motion.txt"),
        (("--replicate", "3"), "--replicate: must go with a hash, was given with an experiment"),
    ],
)
def test_options_that_do_not_fit_are_refused(
    evoexp: Evoexp, words: tuple[str, ...], said: str
) -> None:
    answer = evoexp("evaluate", *PLANAR, *words)
    assert (answer.code, answer.err) == (2, f"evoexp: {said}\n")


def test_any_number_of_parts_are_nested_and_flattened() -> None:
    solution = np.arange(12.0)
    for shape in ((..., (3,)), ((2, 3), (6,)), ((), *[(11,)]), ((4, 3),)):
        lists = nested(solution, shape)
        assert np.array_equal(flatten(lists, shape), solution)
