"""A planner's package, from an empty folder to its report, in an environment of its own.

Nothing is downloaded: the environment sees the packages of the one that runs the tests.
"""

import json
import os
import re
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

NAME = "lambda_search"
SOURCE = Path(__file__).parents[1] / "src"

pytestmark = [
    pytest.mark.matrix,
    pytest.mark.skipif(find_spec("hatchling") is None, reason="needs hatchling, evoexp[build]"),
    pytest.mark.skipif(find_spec("pip") is None, reason="needs pip"),
]

Execute = Callable[..., str]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an empty folder, beside an environment with all packages of this one."""
    root = tmp_path_factory.mktemp("guest")
    venv.create(root / "environment", with_pip=False)
    (packages,) = (root / "environment").glob("lib/python*/site-packages")
    theirs = [path for path in sys.path if path.endswith("site-packages")]
    lines = "".join(f"site.addsitedir({path!r}); " for path in theirs)
    (packages / "shared.pth").write_text(f"import site; {lines}\n")
    (root / "work").mkdir()
    return root


@pytest.fixture(scope="module")
def execute(place: Path) -> Execute:
    """Return a function that runs a command in the folder with the environment's Python."""
    environment = {
        name: value for name, value in os.environ.items() if name not in ("EVOEXP_OUTPUTS",)
    }
    scripts = place / "environment" / Path(sysconfig.get_path("scripts")).name
    environment |= {"PATH": f"{scripts}:{environment['PATH']}", "COLUMNS": "120"}

    def run(*words: str, cwd: str = "work") -> str:
        python = str(scripts / "python")
        done = subprocess.run(
            [python, "-m", *words],
            cwd=place / cwd,
            env=environment,
            capture_output=True,
            text=True,
            timeout=900,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="module")
def installed(place: Path, execute: Execute) -> str:
    """Write the package and install it as its README says, without the network."""
    execute("evoexp", "new", "planner", NAME)
    words = ("--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check")
    execute("pip", "install", "--quiet", *words, "-e", NAME)
    return NAME


@pytest.fixture(scope="module")
def run(execute: Execute, installed: str) -> list[str]:
    """Run the experiment at the smallest budget; return the hashes of its conditions."""
    printed = execute("evoexp", "run", f"experiment={installed}", "budget=smoke")
    hashes = re.findall(r"[0-9a-f]{12}", printed.partition("report: ")[0])
    assert len(hashes) == 3
    assert printed.count("2 of 2") >= 3
    return hashes


def test_it_is_found(execute: Execute, installed: str) -> None:
    listed = json.loads(execute("evoexp", "list", "--json"))["experiments"]
    (mine,) = [each for each in listed if each["name"] == installed]
    assert mine["origin"] == f"{installed} 0.1.0"
    shown = execute("evoexp", "show", f"experiment={installed}", "--only", "λ = 4")
    assert f"{installed} 1 ({installed} 0.1.0)" in shown


def test_it_runs_and_reproduces(execute: Execute, run: list[str]) -> None:
    for each in run:
        assert execute("evoexp", "reproduce", each).endswith("2 of 2 MATCH\n")


def test_manifest_and_log_name_the_package(place: Path, run: list[str], installed: str) -> None:
    for each in run:
        text = (place / "work/outputs/runs" / each / "manifest.json").read_text()
        assert f"{installed} 0.1.0" in text


def test_it_reports(place: Path, execute: Execute, run: list[str], installed: str) -> None:
    execute("evoexp", "report", installed, "budget=smoke")
    text = (place / f"work/outputs/reports/{installed}@smoke/index.md").read_text()
    assert "λ = 16" in text and "random search" in text
    assert f"evoexp report {installed} budget=smoke" in text


def test_it_evaluates_plays_and_exports(
    place: Path, execute: Execute, run: list[str], installed: str
) -> None:
    straight = np.linspace([45.0, 225.0, 225.0, 225.0], [135.0, 135.0, 315.0, 315.0], 5)
    (place / "work/motion.json").write_text(json.dumps([straight.tolist()]))
    words = ("motion.json", f"experiment={installed}", "--only", "λ = 4")
    terms = json.loads(execute("evoexp", "evaluate", *words, "--json"))
    assert terms["length_deg"] == pytest.approx(180.0)
    assert terms["certified"] is False
    for command in ("view", "play", "export"):
        execute("evoexp", command, run[0])
        execute("evoexp", command, *words)
    made = {path.suffix for path in (place / "work/outputs/motions").iterdir()}
    assert made >= {".html", ".mcap", ".json"}


def test_its_own_tests_pass(execute: Execute, installed: str) -> None:
    printed = execute("pytest", "-q", "-p", "no:cacheprovider", cwd=f"work/{installed}")
    assert re.search(r"^\d+ passed", printed.splitlines()[-1])
    assert "skipped" not in printed


def test_it_runs_from_a_wheel_too(place: Path, execute: Execute, run: list[str]) -> None:
    """The options are in the wheel: the package is installed, and the folder is gone."""
    words = ("--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check")
    execute("pip", "wheel", "--quiet", *words, "-w", "wheels", f"./{NAME}")
    (wheel,) = (place / "work/wheels").glob("*.whl")
    execute("pip", "install", "--quiet", *words, "--force-reinstall", str(wheel))
    (place / "work" / NAME).rename(place / "gone")
    printed = execute("evoexp", "run", f"experiment={NAME}", "budget=smoke", "--no-report")
    assert printed.startswith("nothing to run: every replicate is there")


def test_a_run_whose_package_is_gone_names_it(
    place: Path, execute: Execute, run: list[str]
) -> None:
    execute("pip", "uninstall", "--quiet", "--disable-pip-version-check", "-y", NAME)
    with pytest.raises(AssertionError) as failed:
        execute("evoexp", "reproduce", run[0])
    assert f"needs {NAME} 0.1.0, which is not installed" in str(failed.value)
    assert "not installed here" in execute("evoexp", "show", run[0])
