"""Tests notice small changes of the code: drawn ones, and those that were once overlooked.

`./scripts/test --exhaustive` tries them; `EVOEXP_MUTATION_SEED` draws others. A mutant that
survives shows a test that is missing. One that changes nothing is listed in `equivalent.toml`.
"""

import os
from pathlib import Path

import pytest
from mutant_trials import TRIAL_S, Trials, near_tests
from mutants import Mutant, drawn, entries, mutants_of, plant

from matrix import EXHAUSTIVE

ROOT = Path(__file__).parents[2]
NUM_MUTANTS = 60
SEED = int(os.environ.get("EVOEXP_MUTATION_SEED", "39"))
DRAWN = drawn(ROOT, SEED, NUM_MUTANTS) if EXHAUSTIVE in os.environ else []
TOY = {
    "pyproject.toml": "",
    "src/evoexp/__init__.py": "",
    "src/evoexp/paths/limits.py": "def is_above(x: float) -> bool:\n    return x > 3.0\n",
    "tests/paths/test_limits.py": """
from evoexp.paths.limits import is_above
def test_limit() -> None:
    assert is_above(3.5) and not is_above(3.0)
""",
    "src/evoexp/store/ends.py": "def first(x: list[int]) -> int:\n    return x[0]\n",
    "tests/store/test_ends.py": """
from evoexp.store.ends import first
def test_first() -> None:
    assert first([7]) == 7
""",
    "src/evoexp/batch/signs.py": "def negative(x: int) -> int:\n    return -x\n",
    "tests/batch/test_signs.py": """
def test_nothing() -> None:
    assert False
def test_something() -> None:
    assert True
""",
}


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> Trials:
    return Trials(ROOT, tmp_path_factory.mktemp("mutants"))


@pytest.mark.exhaustive
@pytest.mark.timeout(3 * TRIAL_S)
@pytest.mark.parametrize("mutant", DRAWN, ids=lambda mutant: f"{mutant.file}:{mutant.line}")
def test_a_drawn_mutant_is_killed(mutant: Mutant, trials: Trials) -> None:
    outcome = trials.run(mutant)
    assert outcome.is_killed, f"{mutant} {outcome.text}"


@pytest.mark.exhaustive
@pytest.mark.timeout(3 * TRIAL_S)
@pytest.mark.parametrize("row", entries("plants"), ids=lambda row: row["name"])
def test_a_plant_is_killed(row: dict[str, str], trials: Trials) -> None:
    mutant = plant(ROOT, row)
    outcome = trials.run(mutant)
    assert outcome.is_killed, f"{mutant} {outcome.text}"


@pytest.mark.parametrize("row", entries("plants"), ids=lambda row: row["name"])
def test_a_plant_fits_the_code(row: dict[str, str]) -> None:
    assert plant(ROOT, row).after != plant(ROOT, row).before


def test_equivalent_mutants_are_mutants_with_a_reason() -> None:
    for row in entries("equivalent"):
        source = (ROOT / row["file"]).read_text()
        changes = {(mutant.before, mutant.after) for _, mutant in mutants_of(row["file"], source)}
        assert (row["before"], row["after"]) in changes, row
        assert len(row["reason"]) > 10, row


def test_covered_mutants_are_killed_others_survive_and_broken_tests_kill_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    for file, text in TOY.items():
        (tmp_path / "toy" / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "toy" / file).write_text(text)
    (tmp_path / "place").mkdir()
    trials = Trials(tmp_path / "toy", tmp_path / "place")
    sources = [file for file in TOY if file.startswith("src")]
    mutants = [mutant for file in sources for _, mutant in mutants_of(file, TOY[file])]
    outcomes = {str(mutant): trials.run(mutant) for mutant in mutants}
    assert outcomes == {
        "src/evoexp/paths/limits.py:2: return x > 3.0 → return x >= 3.0": (
            True,
            "tests/paths/test_limits.py::test_limit",
        ),
        "src/evoexp/store/ends.py:2: return x[0] → return x[-1]": (False, "survives 1 test files"),
        "src/evoexp/batch/signs.py:2: return -x → return (x)": (False, "survives 1 test files"),
    }
    for file, text in TOY.items():
        assert (tmp_path / "toy" / file).read_text() == (trials.tree / file).read_text() == text


@pytest.mark.parametrize(
    ("code", "changed"),
    [
        ("a < b", ["a <= b"]),
        ("a == b", ["a != b"]),
        ("a and b", ["(a or b)"]),
        ("not a", ["(a)"]),
        ("-a", ["(a)"]),
        ("a + b", ["(a - b)"]),
        ("a[-1]", ["a[0]"]),
        ("a[:, 1]", ["a[:, 0]"]),
        ("a[1:]", ["a[:]"]),
        ("min(a, b)", ["max(a, b)"]),
        ("a.max(axis=0)", ["a.min(axis=0)"]),
        ("range(a)", ["range(a - 1)"]),
        ("range(1, a)", ["range(1, a - 1)"]),
        ("sorted(a)", ["sorted(a, reverse=True)"]),
        ("a @ b", ["(b @ a)"]),
        ("placement * shift", ["(shift * placement)"]),
        ("matrix_product(a, b)", ["matrix_product(b, a)"]),
        ("lambda: 0", []),
        ("'text' + a", []),
        ("f'{a + b}'", []),
    ],
)
def test_expressions_have_their_mutants(code: str, changed: list[str]) -> None:
    source = f"# é\nvalue = {code}  # why\n"
    mutants = [mutant for _, mutant in mutants_of("file.py", source)]
    assert [mutant.applied(source) for mutant in mutants] == [
        source.replace(code, text) for text in changed
    ]
    assert [str(mutant) for mutant in mutants] == [
        f"file.py:2: value = {code} # why → value = {text} # why" for text in changed
    ]


def test_exit_codes_and_defaults_have_mutants_but_harmful_code_has_none() -> None:
    source = "def main(a: bool = True) -> int:\n    return 0\n"
    changed = {kind: mutant.applied(source) for kind, mutant in mutants_of("file.py", source)}
    assert changed == {
        "default": source.replace("True", "False"),
        "exit code": source.replace("0", "1"),
    }
    harmful = "def f(a: int = 1) -> None:\n    os.kill(-a, 9)\n"
    assert not list(mutants_of("file.py", harmful))
    assert not list(mutants_of("file.py", "raise ValueError(a[0])\nassert a < b"))


def test_a_seed_draws_the_same_mutants_of_all_rooms() -> None:
    mutants = drawn(ROOT, 1, 60)
    assert mutants == drawn(ROOT, 1, 60)
    assert mutants != drawn(ROOT, 2, 60)
    rooms = {path.parent.name for path in (ROOT / "src/evoexp").glob("*/__init__.py")} - {"assets"}
    assert rooms <= {Path(mutant.file).parts[2] for mutant in mutants}
    for mutant in mutants:
        compile(mutant.applied((ROOT / mutant.file).read_text()), mutant.file, "exec")


def test_tests_that_mirror_a_module_come_before_those_that_import_it() -> None:
    near, room = near_tests(ROOT, Path("src/evoexp/evolution/mutation.py"))
    assert near[0] == "tests/evolution/test_mutation.py"
    assert "tests/evolution/test_operators.py" in room + near
    near, room = near_tests(ROOT, Path("src/evoexp/papers/rana/rules.py"))
    assert "tests/papers/test_rana_pages.py" in near
    assert "tests/papers/test_lavoie_pages.py" in room
