"""Every library that evoexp imports is one that it declares."""

import ast
import re
import sys
import tomllib
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
MODULES = {  # of libraries that metadata name otherwise, or that are not installed
    "coacd": "coacd",
    "example_robot_data": "example-robot-data",
    "ompl": "ompl",
    "pinocchio": "pin",  # its module lies where packages_distributions does not look
    "toppra": "toppra",
}
DEEP = ("coal", "hydra-core", "mcap", "numba", "numpy", "omegaconf", "pin", "pydantic")


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def declared(*extras: str) -> dict[str, str]:
    """Return distribution → its requirement."""
    lines = list(PROJECT["dependencies"])
    for extra in extras:
        lines += PROJECT["optional-dependencies"][extra]
    return {plain(re.match(r"[\w.-]+", line)[0]): line for line in lines}  # type: ignore[index]


@cache
def imported() -> dict[str, str]:
    """Return top-level module → a file of evoexp that imports it."""
    modules = {}
    for path in sorted((ROOT / "src" / "evoexp").rglob("*.py")):
        if "assets" in path.parts:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            for name in names:
                modules[name.partition(".")[0]] = str(path.relative_to(ROOT))
    return {
        name: path
        for name, path in modules.items()
        if name not in sys.stdlib_module_names and name != "evoexp"
    }


installed = cache(packages_distributions)


@pytest.mark.parametrize("module", imported())
def test_an_imported_library_is_declared(module: str) -> None:
    extras = [name for name in PROJECT["optional-dependencies"] if name not in ("test", "docs")]
    known = declared(*extras)
    owners = installed().get(module, [MODULES.get(module, module)])
    assert {plain(owner) for owner in owners} & known.keys(), (
        f"{imported()[module]} imports {module}, of {owners}, which pyproject.toml does not name"
    )


@pytest.mark.parametrize("distribution", DEEP)
def test_what_evoexp_depends_on_in_depth_has_an_upper_bound(distribution: str) -> None:
    assert "<" in declared()[distribution]


def test_every_locked_distribution_has_its_licence() -> None:
    lock, page = ((ROOT / name).read_text() for name in ("requirements.lock", "docs/licences.md"))
    _, _, table = page.rpartition("| --- | --- |\n")
    listed = re.findall(r"^\| (\S+) \| \S.* \|$", table, re.MULTILINE)
    assert set(listed) == set(re.findall(r"^([^ =]+)==", lock, re.MULTILINE))
