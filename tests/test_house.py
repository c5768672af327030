"""The house rules that no linter knows."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections import Counter
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
SOURCES = sorted(
    path for path in (ROOT / "src" / "evoexp").rglob("*.py") if "assets" not in path.parts
)
OPTIONS = sorted((ROOT / "conf").rglob("*.yaml"))
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")
ROLES = ("planner.py", "kernels.py", "settings.py", "measures.py", "claims.py", "figures.py")
SOURCE = re.compile(r"# \[[^\]]+\] (paper: \S+|assumed)")


def test_every_number_has_unit_and_source() -> None:
    missing = []
    for path in OPTIONS:
        for line in path.read_text().splitlines():
            code, _, comment = line.partition("#")
            value = code.partition(":")[2] if ":" in code else code
            value = re.sub(r"\"[^\"]*\"|'[^']*'|=\S*", "", value)
            if NUMBER.search(value) and not SOURCE.match("#" + comment):
                missing.append(f"{path.name}: no '# [unit] paper: …' or '# [unit] assumed': {line}")
    assert OPTIONS
    assert not missing


READ_OFF = re.compile(
    r"\b((read|taken|measured|digiti[sz]ed|estimated) (off|from|in)|(width|size|scale) of) "
    r"(the (paper's |printed )?)?Fig",
    re.IGNORECASE,
)
RIDDLES = (  # sentences that a stranger reads twice
    r'"""(Return|Say|Yield|Tell|Print|Declare|Draw|Write|Give|Name|Take)s? (what|whether what)\b',
    r"; (the|where|what) [a-z]+ one\b",
    r'"""What\b',
    r'"""[^"\n]*[,;:] ?\n',  # a summary that was cut in two
    r"\b(Eq|Eqs|Fig|Figs|Tab|Sec)\.\n",
)


def test_no_number_claims_to_come_from_a_drawing() -> None:
    """The papers' texts came without their figures: what is not printed was assumed."""
    pages = [*OPTIONS, *SOURCES, ROOT / "README.md"]
    assert not [path.name for path in pages if READ_OFF.search(path.read_text())]


def test_docstrings_name_things() -> None:
    """Plain words: no clause stands for a noun, and no summary is cut in two."""
    texts = {path: path.read_text() for path in SOURCES}
    assert not [(path, r) for path, text in texts.items() for r in RIDDLES if re.search(r, text)]


def test_rules_can_fail() -> None:
    assert NUMBER.search(" 0.5 ") and NUMBER.search(" [4.0, 4.0]")
    assert not NUMBER.search(" rana_planar")
    assert not SOURCE.match("# assumed") and not SOURCE.match("# [deg] guessed")
    assert SOURCE.match("# [1/deg] paper: Tab. 1, k1")
    assert all(map(READ_OFF.search, ("assumed: read off Fig. 4", "assumed: the width of Fig. 2")))
    bad = ('"""Return what `create` writes."""', '"""What a page holds."""', '"""Cut,\n')
    assert all(any(re.search(riddle, text) for riddle in RIDDLES) for text in bad)
    assert not any(re.search(riddle, '"""Return the files of a page."""') for riddle in RIDDLES)


def test_every_experiment_says_its_command_and_content() -> None:
    for path in (ROOT / "conf" / "experiment").glob("*.yaml"):
        first, second, third, *_ = path.read_text().splitlines()
        assert first == "# @package _global_", path
        assert second == f"# evoexp run experiment={path.stem}"
        assert third.startswith("# ") and len(third) > 20, path


def test_no_shipped_option_names_the_choice_of_another_group() -> None:
    """`Composer` joins compositions of shipped options because of this."""
    for path in OPTIONS:
        assert "${" not in str((yaml.safe_load(path.read_text()) or {}).get("defaults")), path


def test_files_functions_and_lines_are_short() -> None:
    long = []
    for path in SOURCES:
        text = path.read_text()
        if len(text.splitlines()) > 400:
            long.append(f"{path.parent.name}/{path.name}")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and (node.end_lineno or 0) - node.lineno >= 60:
                long.append(f"{path.name}: {node.name}")
    assert not long


def test_a_file_name_occurs_once_but_for_the_roles() -> None:
    """A role (planner.py, page.py) repeats in every package of its kind; other names are found."""
    seen = Counter(path.name for path in SOURCES if path.name != "__init__.py")
    repeated = {name for name, count in seen.items() if count > 1}
    assert repeated <= set(ROLES)
    for path in SOURCES:
        if path.name in set(ROLES) & repeated and path.parent.name != "planners":
            assert path.parents[1].name in ("planners", "papers"), path


def test_kernels_are_annotated() -> None:
    assert not [path.name for path in SOURCES if "no-untyped-def" in path.read_text()]


def test_no_global_randomness_and_nothing_irreproducible() -> None:
    allowed = ("Generator", "PCG64", "SeedSequence", "default_rng")
    libm = r"np\.(sin|cos|tan|exp|log|power|arc\w+|linalg\.norm|dot|random\.default_rng)\("
    rooms = ("planners", "evolution", "paths", "objectives", "collision")
    for path in SOURCES:
        text = path.read_text()
        assert all(name in allowed for name in re.findall(r"np\.random\.(\w+)", text)), path
        assert not re.search(r"fastmath *= *True", text), path
        if any(room in path.parts for room in rooms):
            assert not re.search(libm, text), path


LIGHT = {  # module → packages that neither it nor those before it may load
    "evoexp": ("numpy", "pandas", "hydra", "pinocchio"),
    "evoexp.cli": ("numpy", "pandas", "hydra", "pinocchio", "numba", "matplotlib"),
    "evoexp.store.log": ("hydra", "pandas", "pinocchio", "pyarrow", "numba", "scipy"),
    "evoexp.evolution.operators.selection": ("hydra", "pandas", "pinocchio", "matplotlib"),
    "evoexp.paths.redistribution": ("hydra", "pandas", "pinocchio", "matplotlib"),
    "evoexp.batch.replicate": ("hydra", "matplotlib", "pandas"),
}
IMPORTS = f"""
import importlib, sys
for module, absent in {LIGHT!r}.items():
    importlib.import_module(module)
    print(*[f'{{module}}: {{name}}' for name in absent if name in sys.modules], end='')
"""
HELP = """
import sys, evoexp.cli
try: evoexp.cli.main(['--help'])
except SystemExit: pass
print(len(sys.modules))
"""


def test_imports_stay_light_and_help_imports_next_to_nothing() -> None:
    assert subprocess.check_output([sys.executable, "-c", IMPORTS], text=True) == ""
    printed = subprocess.check_output([sys.executable, "-c", HELP], text=True)
    assert int(printed.splitlines()[-1]) < 250
    assert "reproduce" in printed


def test_scripts_are_executable() -> None:
    for name in ("scripts/evoexp", "scripts/test", ".ci/run"):
        assert os.access(ROOT / name, os.X_OK), name


def test_the_clock_is_read_by_the_batch_only() -> None:
    rooms = {"planners", "evolution", "paths", "objectives", "collision", "robots"}
    for path in SOURCES:
        assert not rooms & {*path.parts} or "import time" not in path.read_text(), path


# Every library that evoexp imports is one that it declares.

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
    optional = (PROJECT["optional-dependencies"][extra] for extra in extras)
    lines = [line for group in (PROJECT["dependencies"], *optional) for line in group]
    return {plain(re.match(r"[\w.-]+", line)[0]): line for line in lines}  # type: ignore[index]


@cache
def imported() -> dict[str, str]:
    """Return top-level module → a file of evoexp that imports it."""
    modules, known = {}, {*sys.stdlib_module_names, "evoexp"}
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            modules |= dict.fromkeys((n.partition(".")[0] for n in names), path.name)
    return {name: file for name, file in modules.items() if name not in known}


installed = cache(packages_distributions)


@pytest.mark.parametrize("module", imported())
def test_an_imported_library_is_declared(module: str) -> None:
    extras = PROJECT["optional-dependencies"].keys() - {"test", "docs"}
    owners = installed().get(module, [MODULES.get(module, module)])
    assert {plain(owner) for owner in owners} & declared(*extras).keys(), (
        f"{imported()[module]} imports {module}, of {owners}, which pyproject.toml does not name"
    )


@pytest.mark.parametrize("distribution", DEEP)
def test_what_evoexp_depends_on_in_depth_has_an_upper_bound(distribution: str) -> None:
    assert "<" in declared()[distribution]


def test_every_locked_distribution_has_its_licence() -> None:
    page = (ROOT / "docs/licences.md").read_text()
    rows = re.findall(r"^\| (\S+) \| \S.* \| (runs|extras) \|$", page, re.MULTILINE)
    run, every = (
        re.findall(r"^([^ =]+)==", (ROOT / lock).read_text(), re.MULTILINE)
        for lock in ("requirements.lock", "requirements-test.lock")
    )
    assert dict(rows) == dict.fromkeys(every, "extras") | dict.fromkeys(run, "runs")


# No behaviour is tested with --all only: `matrix_counterparts.toml` names tests of examples

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
