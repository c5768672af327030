"""No behaviour is tested with --all only: `matrix_counterparts.toml` names tests of examples."""

import ast
import tomllib
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
COUNTERPARTS = tomllib.loads((TESTS / "matrix_counterparts.toml").read_text())


def sorted_tests(source: str) -> dict[bool, set[str]]:
    """Return the names of a file's tests: those that run with --all only, and the others."""
    tree, found = ast.parse(source), {True: set[str](), False: set[str]()}
    assigned = [node for node in tree.body if isinstance(node, ast.Assign)]
    marks = [node for node in assigned if ast.unparse(node.targets[0]) == "pytestmark"]
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
            texts = map(ast.unparse, [*marks, *node.decorator_list])
            found[any("pytest.mark.matrix" in text for text in texts)].add(node.name)
    return found


FILES = {
    path.relative_to(TESTS).as_posix(): sorted_tests(path.read_text())
    for path in TESTS.rglob("test_*.py")
}


def test_every_test_of_the_matrices_has_a_counterpart_by_default() -> None:
    missing = [
        f"{file}::{name}"
        for file, tests in FILES.items()
        for name in tests[True]
        if not {name, "*"} & COUNTERPARTS.get(file, {}).keys()
    ]
    assert not missing, (
        "remove the mark, use `examples`, or name a test in matrix_counterparts.toml"
    )


@pytest.mark.parametrize("file", COUNTERPARTS)
def test_counterparts_run_by_default(file: str) -> None:
    for name, counterpart in COUNTERPARTS[file].items():
        assert FILES[file][True] and name in {*FILES[file][True], "*"}, f"{name} runs by default"
        place, _, other = counterpart.rpartition("::")
        assert FILES[place or file][False] and other in {*FILES[place or file][False], "*"}, other


def test_the_rule_can_fail() -> None:
    source = "import pytest\n@pytest.mark.matrix\ndef test_a(): ...\ndef test_b(): ...\n"
    assert sorted_tests(source) == {True: {"test_a"}, False: {"test_b"}}
    whole = "pytestmark = [pytest.mark.browser, pytest.mark.matrix]\ndef test_a(): ...\n"
    assert sorted_tests(whole) == {True: {"test_a"}, False: set()}
