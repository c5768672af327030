"""`evoexp evaluate`: a motion out of a file is judged as the planner judges its own."""

import functools
import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_samples import SMALL, Evoexp

from confinement import confined
from evoexp.collision.certifier.certificate import Certificate
from evoexp.commands.motion_files import flatten, nested, read_motion
from evoexp.configuration import compose
from evoexp.configuration.search_path import find
from evoexp.errors import SettingError
from evoexp.planners.answers import judge_motion
from evoexp.records import generations
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import read_summaries
from hostile_data import mutated, refusal
from matrix import counts, matrices_are_asked_for
from shipped_conditions import Kind, of_kind
from test_input_files import saved

PLANAR = ("experiment=rana_planar", *SMALL)
LABELS = ("via-point GA", "random search", "multi-start")


@pytest.fixture(scope="module")
def runs(stored_once: Path) -> dict[str, RunDirectory]:
    """Return label → stored run."""
    conditions = compose.expand(PLANAR)[0].conditions
    return {label: RunDirectory(stored_once, condition.id) for label, condition in conditions}


@pytest.mark.examples(2)
@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("replicate", [0, 1])
def test_the_best_of_a_stored_run_is_worth_what_is_recorded(
    evoexp: Evoexp, runs: dict[str, RunDirectory], tmp_path: Path, label: str, replicate: int
) -> None:
    log = read_log(runs[label].log_path(replicate))
    best = log.solutions[-1].values.reshape(2, 21, 2)
    (tmp_path / "best.json").write_text(json.dumps(best.tolist()))
    np.save(tmp_path / "best.npy", best)
    files = (str(tmp_path / f"best.{ending}") for ending in ("json", "npy"))
    out, other = (evoexp("evaluate", *PLANAR, "--only", label, f, "--json").out for f in files)
    assert out == other
    said = json.loads(out)
    expected = {name: getattr(log.summary, name) for name in Certificate._fields}
    expected |= {"label": label, "condition": runs[label].condition_id, "length_unit": "unit"}
    assert said == expected | log.summary.terms | {"solution_of_the_task": True, "departures": []}
    columns = [name for name in read_summaries(runs[label]).columns if name.startswith("term_")]
    assert sorted(columns) == sorted(f"term_{name}" for name in log.summary.terms)


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
    (fitness,) = (line for line in table.splitlines() if "│ fitness " in line)
    assert fitness.count("│") == 3, "conditions that judge the motion alike share a column"


def test_a_motion_that_stays_at_the_start_is_no_solution_though_it_touches_nothing(
    evoexp: Evoexp, tmp_path: Path
) -> None:
    np.save(tmp_path / "still.npy", np.repeat([[[45.0, 225.0]], [[225.0, 225.0]]], 21, axis=1))
    words = ("evaluate", *PLANAR, "--only", LABELS[0], str(tmp_path / "still.npy"))
    said = json.loads(evoexp(*words, "--json").out)
    assert (said["certified"], said["solution_of_the_task"]) == (True, False)
    assert said["departures"] == [
        f"the goal of arm {arm} is not the task's: 90 deg away" for arm in (1, 2)
    ]
    assert f"{LABELS[0]} – no solution of the task: the goal of arm 1" in evoexp(*words).out


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
    evoexp: Evoexp, motion: Path, tmp_path: Path
) -> None:
    text = Path(find("experiment", "rana_planar").path).read_text().split("conditions:")[0]
    entries = "{two: [], three: [robot=three_planar_2r, scenario=rana_three_arms]}"
    (tmp_path / "mixed.yaml").write_text(f"{text}conditions: {entries}\n")
    mixed, two = f"experiment={tmp_path / 'mixed.yaml'}", json.loads(motion.read_text())
    for label, values in {"two": two, "three": [*two, two[0]]}.items():
        motion.write_text(json.dumps(values))
        assert json.loads(evoexp("evaluate", mixed, str(motion), "--json").out)["label"] == label
    motion.write_text(json.dumps(two[:1]))
    said = evoexp("evaluate", mixed, str(motion))
    must = "must be two: 2 × 21 × 2; three: 3 × 21 × 2 (start and goal included), was 1 × 21 × 2\n"
    assert said.code == 2 and said.err.endswith(f"motion.json: {must}")


@pytest.mark.parametrize("shape", [(..., (3,)), ((2, 3), (6,)), ((), *[(11,)]), ((4, 3),)])
def test_any_number_of_parts_are_nested_and_flattened(shape: tuple[Any, ...]) -> None:
    assert np.array_equal(flatten(nested(np.arange(12.0), shape), shape), np.arange(12.0))


NESTED = [[[0.0, 0.0]] * 21] * 2
NO_NUMBERS = "must hold nested lists of finite numbers, was"


def with_value(value: Any) -> str:
    changed = json.loads(json.dumps(NESTED))
    changed[1][3][0] = value
    return json.dumps(changed)


FILES: dict[str, tuple[str | bytes | None, str]] = {
    "missing.json": (None, "cannot be read: No such file or directory"),
    "motion.txt": ("[]", "a motion file ends in .json, .npy, .csv, .yaml or .yml"),
    "cut.json": ("[[[0,", "is no json of numbers: Expecting value"),
    "binary.json": (b"\xff\xfe\x00", "is no json of numbers: 'utf-8' codec"),
    "deep.json": ("[" * 10**6, "is no json of numbers: maximum recursion depth"),
    "digits.json": ("[" + "9" * 10**5 + "]", "is no json of numbers"),
    "nested.json": ("[" * 900 + "]" * 900, f"{NO_NUMBERS} [["),
    "nan.json": (with_value(float("nan")), "was nan at [1][3][0]"),
    "inf.json": (with_value(float("inf")), "was inf at [1][3][0]"),
    "huge.json": (with_value(10**400), "was 1000000000000000000000000000000000000000"),
    "text.json": (with_value("0"), "was 0 at [1][3][0]"),
    "null.json": (with_value(None), "was None at [1][3][0]"),
    "true.json": (with_value(True), "was True at [1][3][0]"),
    "object.json": ('{"motion": []}', "must have joint_names and points, as a JointTrajectory"),
    "number.json": ("3", f"{NO_NUMBERS} 3 at its top"),
    "flat.json": ("[1, 2, 3]", "must be via-point GA: 2 × 21 × 2"),
    "none.json": ("[]", "(start and goal included), was 0"),
    "ragged.json": (json.dumps([*NESTED[:1], [[0.0]]]), "was a ragged list of 2"),
    "shape.npy": (saved(np.zeros((2, 20, 2))), "(start and goal included), was 2 × 20 × 2"),
    "scalar.npy": (saved(np.float64(3)), "was 3.0 at its top"),
    "nan.npy": (saved(np.full((2, 21, 2), np.nan)), "was nan at [0][0][0]"),
    "cut.npy": (saved(np.zeros((2, 21, 2)))[:-8], "is no npy of"),
}


@pytest.mark.parametrize("name", FILES)
def test_motion_files_that_cannot_be_read(
    refused: Callable[..., str], tmp_path: Path, name: str
) -> None:
    content, message = FILES[name]
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    said = refused("evaluate", "experiment=rana_planar", "budget=smoke", str(path))
    assert said.startswith(f"{path}: ") and message in said and len(said) < 400


# Motions that evoexp knows, and templates


@pytest.mark.parametrize(
    "line",
    [
        *("rana_planar", "curkovic_motion", "lavoie --only 7-DOF", "chen_path --only (b)"),
        *("chen_placement", "corsepius_ball"),
    ],
)
def test_a_template_is_written_and_read(evoexp: Evoexp, tmp_path: Path, line: str) -> None:
    words, path = f"experiment={line}".split(), str(tmp_path / "motion.json")
    written = evoexp("evaluate", *words, "--write", path)
    assert (written.code, written.err) == (0, "")
    judged = evoexp("evaluate", *words, path, "--json")
    assert judged.code == 0 and json.loads(judged.out)


def test_a_stored_run_is_judged_again_and_written(
    evoexp: Evoexp, run: RunDirectory, tmp_path: Path
) -> None:
    path = tmp_path / "best.json"
    best = int(read_summaries(run).sort_values("best_cost")["replicate"].iloc[0])
    for words, replicate in (
        ([run.hash12], best),
        ([run.hash12, "--replicate", "1"], 1),
        ([str(run.log_path(1))], 1),
    ):
        answer = evoexp("evaluate", *words, "--write", str(path), "--json")
        assert (answer.code, answer.err) == (0, "")
        said, log = json.loads(answer.out), read_log(run.log_path(replicate))
        assert said["label"] == f"{run.hash12} #{replicate}"
        assert said["clearance"] == log.summary.clearance
        assert said["certified"] is log.summary.certified
        assert np.array_equal(np.ravel(json.loads(path.read_text())), log.solutions[-1].values)


KINDS: tuple[Kind, ...] = (
    *(("rana_obstacles", 0), ("curkovic_motion", 1), ("lavoie_7dof", 0)),
    *(("corsepius_ball", 0), ("chen_path", 0), ("chen_placement", 0)),
)
PER_KIND = counts(170, 1700) if matrices_are_asked_for() else 15  # × 6 kinds: 10^3
MEMORY = 1000  # [MiB] beyond what the process has
NUMBERS: tuple[Any, ...] = (
    *(float("nan"), float("inf"), 1e308, 1e7, -1e7, 1e-320, 0.0, -1.0, 10**400, 2**63, 1.5, 7),
    *(None, True, "0", [], [[]], {}, [1, 2], "\x1b[31m"),
)


@functools.cache
def intact(kind: Kind) -> Any:
    """Return a solution of a kind in its documented shape, as nested lists."""
    condition = of_kind(kind, "smoke")
    planner, problem = condition.prepare()
    best = next(iter(generations(planner.evolve(problem, condition.rng(0))))).best
    return nested(best, planner.shape(problem))


def spoiled(content: bytes, rng: random.Random) -> bytes:
    """Return a file of which some bytes are other ones, or missing."""
    k = rng.randrange(min(len(content), 200))
    other = bytes([rng.choice((0, 48, 57, 91, 93, 123, 255))])
    return rng.choice((content[:k], content[:k] + other + content[k + 1 :], content[k:]))


def judge(kind: Kind, path: Path) -> None:
    planner, problem = of_kind(kind, "smoke").prepare()
    solution = flatten(read_motion(path), planner.shape(problem))
    if solution is None:
        raise SettingError("motion", "of the planner's shape", "another")
    planner.departures(problem, solution)
    planner.evaluate(problem, solution)
    judge_motion(planner, problem, planner.motion(problem, solution))
    planner.listing(problem, solution)


@pytest.mark.examples(3)
@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_a_mutated_motion_is_refused_in_one_line_or_judged(kind: Kind, tmp_path: Path) -> None:
    def tries() -> int:
        rng, refused = random.Random(str(kind)), 0
        for k in range(PER_KIND):
            path = tmp_path / rng.choice(("motion.json", "motion.npy"))
            if path.suffix == ".npy":
                np.save(path, np.array(values_0, dtype=object).astype(np.float64))
            else:
                path.write_text(json.dumps(mutated(values_0, rng, NUMBERS)))
            if path.suffix == ".npy" or rng.random() < 0.2:
                path.write_bytes(spoiled(path.read_bytes(), rng))
            try:
                refused += bool(refusal(lambda: judge(kind, path)))  # noqa: B023
            except BaseException as error:
                raise AssertionError(f"case {k}: {path.read_bytes()[:3000]!r}") from error
        return refused

    values_0 = intact(kind)
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(values_0))
    assert refusal(lambda: judge(kind, path)) == ""
    assert confined(tries, tmp_path, MEMORY) > PER_KIND // 4


HEADER = b"{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000,), }         \n"
LARGE = {
    "long.json": (b"[" + b"0," * 10**6 + b"0]", "at most 200,000 numbers"),
    "lists.json": (b"[" + b"[]," * 10**6 + b"0]", "at most 200,000 numbers"),
    "large.json": (b" " * 10**7, "larger than 8 MB"),
    "far.json": (b"[[[1e8]]]", "of at most 1e+07"),
    "claims.npy": (b"\x93NUMPY\x01\x00\x50\x00" + HEADER + b" " * 20, "is no npy of numbers"),
}


@pytest.mark.parametrize("name", LARGE)
def test_a_motion_that_takes_more_than_it_is_worth(name: str, tmp_path: Path) -> None:
    content, reason = LARGE[name]
    path, kind = tmp_path / name, ("rana_obstacles", 0)
    path.write_bytes(content)
    of_kind(kind, "smoke").prepare()
    assert reason in confined(lambda: refusal(lambda: judge(kind, path)), tmp_path, MEMORY)
