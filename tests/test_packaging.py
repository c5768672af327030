"""The built wheel holds what the checkout has, and runs from any directory without a network."""

import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "evoexp"

pytestmark = pytest.mark.skipif(
    find_spec("hatchling") is None, reason="needs hatchling, from evoexp[build]"
)


def execute(*command: str | Path, cwd: Path, **environment: str) -> str:
    """Run a command; return what it prints."""
    variables = os.environ | environment
    for name in {"PYTHONPATH", "EVOEXP_OUTPUTS"} - environment.keys():
        variables.pop(name, None)
    words = list(map(str, command))
    done = subprocess.run(
        words, cwd=cwd, env=variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def pip() -> list[str]:
    """Return the command of this environment's pip, or of the one that comes with Python."""
    if find_spec("pip") is not None:
        return [sys.executable, "-m", "pip"]
    place = Path(getattr(find_spec("ensurepip"), "origin", "none"))
    bundled = sorted(place.parent.glob("_bundled/pip-*.whl"))
    if not bundled:
        pytest.skip("neither this environment nor this Python has a pip")
    return [sys.executable, str(bundled[-1] / "pip")]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("wheel")
    execute(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", directory, cwd=ROOT)
    (path,) = directory.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel alone; with this directory as PYTHONPATH it comes before the checkout."""
    directory = tmp_path_factory.mktemp("installed")
    options = ("--quiet", "--no-deps", "--no-index", "--disable-pip-version-check")
    execute(*pip(), "install", *options, "--target", directory, wheel, cwd=directory)
    return directory


def test_contents(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    ours = {name for name in names if not name.partition("/")[0].endswith(".dist-info")}
    data = {"claims.yaml", "page.yaml", "claim_kinds.yaml", "moveit_messages.yaml"}
    data |= {"urdf_elements.yaml", "page_keys.yaml"}
    package = {
        path.relative_to(SOURCE.parent).as_posix()
        for path in SOURCE.rglob("*")
        if path.suffix in (".py", ".typed")
        or path.name in data
        or ("assets" in path.parts and path.is_file() and path.suffix != ".pyc")
    }
    options = [path for path in (ROOT / "conf").rglob("*") if path.is_file()]
    conf = {f"evoexp/{path.relative_to(ROOT).as_posix()}" for path in options}
    assert len(conf) > 20
    assert {"evoexp/py.typed", "evoexp/assets/shipped.json"} <= ours
    assert ours == package | conf
    for ending in ("licenses/LICENSE", "entry_points.txt"):
        assert any(name.endswith(f".dist-info/{ending}") for name in names)


def test_the_installed_package_and_command_are_those_that_run(
    installed: Path, tmp_path: Path
) -> None:
    code = "import evoexp, evoexp.shipped as s; print(evoexp.__file__, s.config_directory())"
    printed = execute(sys.executable, "-c", code, cwd=tmp_path, PYTHONPATH=str(installed))
    assert printed.split() == [f"{installed}/evoexp/__init__.py", f"{installed}/evoexp/conf"]
    for word, part in (("--help", "reproduce"), ("list", "rana_planar")):
        command = installed / "bin" / "evoexp"
        assert part in execute(command, word, cwd=tmp_path, PYTHONPATH=str(installed))


@pytest.mark.matrix
def test_the_installed_package_runs_an_experiment_from_any_directory(
    installed: Path, tmp_path: Path
) -> None:
    command = ("-m", "evoexp", "run", "experiment=rana_planar", "budget=smoke", "--no-report")
    printed = execute(sys.executable, *command, cwd=tmp_path, PYTHONPATH=str(installed))
    assert printed.count("2 of 2") >= 2
    assert len(list(tmp_path.glob("outputs/runs/*/replicates/*.mcap"))) == 6
