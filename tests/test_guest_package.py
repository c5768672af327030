"""A planner's package, from an empty folder to its report, in an environment of its own.

Nothing is downloaded: the environment sees the packages of the one that runs the tests.
"""

import json
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from test_documentation import blocks

NAME = "lambda_search"
OFFLINE = ("--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check")

pytestmark = [
    pytest.mark.matrix,
    pytest.mark.skipif(find_spec("hatchling") is None, reason="needs hatchling, evoexp[build]"),
    pytest.mark.skipif(find_spec("pip") is None, reason="needs pip"),
]

Execute = Callable[..., str]


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an empty folder, beside an environment with all packages of this one."""
    root = tmp_path_factory.mktemp("guest")
    venv.create(root / "environment", with_pip=False)
    (packages,) = (root / "environment").glob("lib/python*/site-packages")
    theirs = [path for path in sys.path if path.endswith("site-packages")]
    lines = "".join(f"site.addsitedir({path!r}); " for path in theirs)
    (packages / "shared.pth").write_text(f"import site; {lines}\n")
    (root / "work").mkdir()
    return root / "work"


@pytest.fixture(scope="module")
def execute(work: Path) -> Execute:
    """Return a function that runs a command in the folder with the environment's Python."""
    environment = os.environ | {"COLUMNS": "120"}
    environment.pop("EVOEXP_OUTPUTS", None)
    scripts = work.parent / "environment" / Path(sysconfig.get_path("scripts")).name
    environment["PATH"] = f"{scripts}:{environment['PATH']}"

    def run(*words: str, folder: str = ".") -> str:
        done = subprocess.run(
            [str(scripts / "python"), "-m", *words],
            cwd=work / folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=900,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="module")
def run(execute: Execute) -> list[str]:
    """Write the package, install it as its README says, run it; return its conditions' hashes."""
    execute("evoexp", "new", "planner", NAME)
    execute("pip", "install", "--quiet", *OFFLINE, "-e", NAME)
    printed = execute("evoexp", "run", f"experiment={NAME}", "budget=smoke")
    hashes = re.findall(r"[0-9a-f]{12}", printed.partition("report: ")[0])
    assert len(hashes) == 3
    assert printed.count("2 of 2") >= 3
    return hashes


def test_it_is_found_and_named(work: Path, execute: Execute, run: list[str]) -> None:
    listed = json.loads(execute("evoexp", "list", "--json"))["experiments"]
    (mine,) = [each for each in listed if each["name"] == NAME]
    assert mine["origin"] == f"{NAME} 0.1.0"
    shown = execute("evoexp", "show", f"experiment={NAME}", "--only", "λ = 4")
    assert f"{NAME} 1 ({NAME} 0.1.0)" in shown
    for each in run:
        assert f"{NAME} 0.1.0" in (work / "outputs/runs" / each / "manifest.json").read_text()


def test_it_reproduces_and_reports(work: Path, execute: Execute, run: list[str]) -> None:
    for each in run:
        assert execute("evoexp", "reproduce", each).endswith("2 of 2 MATCH\n")
    execute("evoexp", "report", NAME, "budget=smoke")
    text = (work / f"outputs/reports/{NAME}@smoke/index.md").read_text()
    for part in ("λ = 16", "random search", f"evoexp report {NAME} budget=smoke"):
        assert part in text


def test_it_evaluates_plays_and_exports(work: Path, execute: Execute, run: list[str]) -> None:
    straight = np.linspace([45.0, 225.0, 225.0, 225.0], [135.0, 135.0, 315.0, 315.0], 5)
    (work / "motion.json").write_text(json.dumps([straight.tolist()]))
    words = ("motion.json", f"experiment={NAME}", "--only", "λ = 4")
    terms = json.loads(execute("evoexp", "evaluate", *words, "--json"))
    assert terms["length_deg"] == pytest.approx(180.0)
    assert terms["certified"] is False
    for command in ("view", "play", "export"):
        execute("evoexp", command, run[0])
        execute("evoexp", command, *words)
    made = {path.suffix for path in (work / "outputs/motions").iterdir()}
    assert made >= {".html", ".mcap", ".json"}


def test_its_own_tests_pass(execute: Execute, run: list[str]) -> None:
    printed = execute("pytest", "-q", "-p", "no:cacheprovider", folder=NAME)
    assert re.search(r"^\d+ passed", printed.splitlines()[-1])
    assert "skipped" not in printed


def test_the_tutorial_of_a_paper_as_it_stands(work: Path, execute: Execute) -> None:
    printed = ""
    for block in blocks(Path(__file__).parents[1] / "docs/own_paper.md"):
        if block.name:
            assert (work / block.name).is_file(), "it takes the place of another one"
            (work / block.name).write_text(block.text)
            continue
        for line in block.text.splitlines():
            hashes = re.findall(r"[0-9a-f]{12}", printed)
            words = shlex.split(line.replace("HASH", hashes[0] if hashes else ""), comments=True)
            words[2:2] = ["--quiet", *OFFLINE] if words[0] == "pip" else []
            said = execute(*words)
            printed = said if words[:2] == ["evoexp", "run"] else printed
            if "claims" in words:
                assert "reproduced" in said and "not run" not in said
            assert "reproduce" not in words or said.endswith("50 of 50 MATCH\n")


def test_it_runs_from_a_wheel_and_is_missed_when_it_is_gone(
    work: Path, execute: Execute, run: list[str]
) -> None:
    """The options are in the wheel: the package is installed, and the folder is gone."""
    execute("pip", "wheel", "--quiet", *OFFLINE, "-w", "wheels", f"./{NAME}")
    (wheel,) = (work / "wheels").glob("*.whl")
    execute("pip", "install", "--quiet", *OFFLINE, "--force-reinstall", str(wheel))
    (work / NAME).rename(work / "gone")
    printed = execute("evoexp", "run", f"experiment={NAME}", "budget=smoke", "--no-report")
    assert printed.startswith("nothing to run: every replicate is stored")
    execute("pip", "uninstall", "--quiet", "--disable-pip-version-check", "-y", NAME)
    with pytest.raises(AssertionError, match=f"needs {NAME} 0.1.0, which is not installed"):
        execute("evoexp", "reproduce", run[0])
    assert "not installed here" in execute("evoexp", "show", run[0])
