"""The house rules that no linter knows."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src" / "evoexp").rglob("*.py"))
OPTIONS = sorted((ROOT / "conf").rglob("*.yaml"))
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")
SOURCE = re.compile(r"# \[[^\]]+\] (paper: \S+|assumed)")


@pytest.mark.parametrize("path", OPTIONS, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_every_number_has_unit_and_source(path: Path) -> None:
    for line in path.read_text().splitlines():
        code, _, comment = line.partition("#")
        value = code.partition(":")[2] if ":" in code else code
        value = re.sub(r"\"[^\"]*\"|'[^']*'|=\S*", "", value)
        if NUMBER.search(value):
            assert SOURCE.match("#" + comment), (
                f"{path.name}: no '# [unit] paper: …' or '# [unit] assumed': {line}"
            )


def test_the_rule_about_numbers_can_fail() -> None:
    assert NUMBER.search(" 0.5 ")
    assert NUMBER.search(" [4.0, 4.0]")
    assert not NUMBER.search(" rana_planar")
    assert not SOURCE.match("# assumed")
    assert not SOURCE.match("# [deg] guessed")
    assert SOURCE.match("# [1/deg] paper: Tab. 1, k1")


@pytest.mark.parametrize(
    "path", sorted((ROOT / "conf" / "experiment").glob("*.yaml")), ids=lambda p: p.stem
)
def test_every_experiment_says_its_command_and_what_it_is(path: Path) -> None:
    first, second, third, *_ = path.read_text().splitlines()
    assert first == "# @package _global_"
    assert second == f"# evoexp run experiment={path.stem}"
    assert third.startswith("# ")
    assert len(third) > 20


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: p.stem)
def test_files_and_functions_are_short(path: Path) -> None:
    text = path.read_text()
    assert len(text.splitlines()) <= 400
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno is not None
            assert node.end_lineno - node.lineno < 60, f"{path.name}: {node.name}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: p.stem)
def test_no_global_randomness_and_nothing_irreproducible(path: Path) -> None:
    text = path.read_text()
    allowed = ("Generator", "PCG64", "SeedSequence")
    assert all(
        name in allowed for name in re.findall(r"np\.random\.(\w+)", text) if name != "default_rng"
    )
    assert not re.search(r"fastmath *= *True", text)
    if any(
        room in path.parts for room in ("planners", "evolution", "paths", "objectives", "collision")
    ):
        assert not re.search(
            r"np\.(sin|cos|tan|exp|log|power|arc\w+|linalg\.norm|dot|random\.default_rng)\(", text
        ), path


@pytest.mark.parametrize(
    ("module", "absent"),
    [
        ("evoexp", ("numpy", "pandas", "hydra", "pinocchio")),
        ("evoexp.cli", ("numpy", "pandas", "hydra", "pinocchio", "numba", "matplotlib")),
        ("evoexp.evolution.selection", ("hydra", "pandas", "pinocchio", "matplotlib")),
        ("evoexp.paths.redistribution", ("hydra", "pandas", "pinocchio", "matplotlib")),
        ("evoexp.store.log", ("hydra", "pandas", "pinocchio", "matplotlib", "pyarrow")),
        ("evoexp.batch.replicate", ("hydra", "matplotlib", "pandas")),
    ],
)
def test_imports_stay_light(module: str, absent: tuple[str, ...]) -> None:
    code = f"import sys, {module}; print(*[m for m in {absent!r} if m in sys.modules])"
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert found == []


def test_help_imports_next_to_nothing() -> None:
    code = (
        "import sys, evoexp.cli\ntry: evoexp.cli.main(['--help'])\nexcept SystemExit: "
        "pass\nprint(len(sys.modules))"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert int(result.stdout.splitlines()[-1]) < 250
    assert "reproduce" in result.stdout


def test_scripts_are_executable() -> None:
    for name in ("scripts/evoexp", "scripts/test", ".ci/run"):
        assert os.access(ROOT / name, os.X_OK), name


def test_the_clock_is_read_by_the_batch_only() -> None:
    for path in SOURCES:
        if any(
            room in path.parts
            for room in ("planners", "evolution", "paths", "objectives", "collision", "robots")
        ):
            assert "import time" not in path.read_text(), path
