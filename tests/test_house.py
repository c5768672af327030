"""The house rules that no linter knows."""

import ast
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
SOURCES = sorted(
    path for path in (ROOT / "src" / "evoexp").rglob("*.py") if "assets" not in path.parts
)
OPTIONS = sorted((ROOT / "conf").rglob("*.yaml"))
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")
ROLES = (
    "planner.py",
    "kernels.py",
    "settings.py",
    "measures.py",
    "claims.py",
)
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


def test_no_number_claims_to_come_from_a_drawing() -> None:
    """The papers' texts came without their figures: what is not printed was assumed."""
    pages = [*SOURCES, ROOT / "README.md"]
    assert not [
        f"{path.name}: {match[0]}"
        for path in [*OPTIONS, *pages]
        for match in READ_OFF.finditer(path.read_text())
    ]
    for bad in ("assumed: read off Fig. 4", "assumed: the width of Fig. 2"):
        assert READ_OFF.search(bad)


def test_the_rule_about_numbers_can_fail() -> None:
    assert NUMBER.search(" 0.5 ")
    assert NUMBER.search(" [4.0, 4.0]")
    assert not NUMBER.search(" rana_planar")
    assert not SOURCE.match("# assumed")
    assert not SOURCE.match("# [deg] guessed")
    assert SOURCE.match("# [1/deg] paper: Tab. 1, k1")


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


RIDDLES = (
    r'"""(Return|Say|Yield|Tell|Print|Declare|Draw|Write|Give|Name|Take)s? (what|whether what)\b',
    r"; (the|where|what) [a-z]+ one\b",
    r'"""What\b',
    r'"""[^"\n]*[,;:] ?\n',  # a summary that was cut in two
    r"\b(Eq|Eqs|Fig|Figs|Tab|Sec)\.\n",
)
"""Sentences that a stranger reads twice."""


def test_docstrings_name_things() -> None:
    """Plain words: no clause stands for a noun, and no summary is cut in two."""
    found = [
        f"{path.relative_to(ROOT)}: {match[0]!r}"
        for path in SOURCES
        for riddle in RIDDLES
        for match in re.finditer(riddle, path.read_text())
    ]
    assert not found


def test_the_rule_about_docstrings_can_fail() -> None:
    bad = ('"""Return what `create` writes."""', '"""What a page holds."""', '"""Cut,\n')
    assert all(any(re.search(riddle, text) for riddle in RIDDLES) for text in bad)
    assert not any(re.search(riddle, '"""Return the files of a page."""') for riddle in RIDDLES)


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


def test_imports_stay_light() -> None:
    code = (
        "import importlib, sys\n"
        f"for module, absent in {LIGHT!r}.items():\n"
        "    importlib.import_module(module)\n"
        "    print(*[f'{module}: {name}' for name in absent if name in sys.modules], end='')"
    )
    command = [sys.executable, "-c", code]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == ""


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
