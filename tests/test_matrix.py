"""No behaviour is tested with --all only: each such test has a counterpart in the default command.

A test marked `matrix` makes a check again of all shipped conditions, of other pages, at the papers'
budgets, in a browser or another environment. `matrix_counterparts.toml` names the test that makes
it of an example. Tests marked `examples(count)` are examples themselves.
"""

import ast
import tomllib
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
COUNTERPARTS = tomllib.loads((TESTS / "matrix_counterparts.toml").read_text())


def is_marked(node: ast.AST, name: str) -> bool:
    return any(
        isinstance(part, ast.Attribute) and ast.unparse(part) == f"pytest.mark.{name}"
        for part in ast.walk(node)
    )


def sorted_tests(source: str) -> dict[bool, set[str]]:
    """Return the names of a file's tests: those that run with --all only, and the others."""
    tree, found = ast.parse(source), {True: set[str](), False: set[str]()}
    constants = [node for node in tree.body if isinstance(node, ast.Assign)]
    marks = [node for node in constants if ast.unparse(node.targets[0]) == "pytestmark"]
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
            places = [*marks, *(mark for mark in node.decorator_list)]
            found[any(is_marked(place, "matrix") for place in places)].add(node.name)
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
