"""The built wheel holds what the checkout has, and runs from any directory.

Nothing here needs a network.
"""

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
    inherited = {
        name: value
        for name, value in os.environ.items()
        if name not in ("PYTHONPATH", "EVOEXP_OUTPUTS")
    }
    words, variables = list(map(str, command)), inherited | environment
    done = subprocess.run(
        words, cwd=cwd, env=variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def pip() -> list[str]:
    """Return the command of this environment's pip, or of the one that comes with Python.

    Uv installs none.
    """
    if find_spec("pip") is not None:
        return [sys.executable, "-m", "pip"]
    ensurepip = find_spec("ensurepip")
    bundled = (
        sorted(Path(ensurepip.origin).parent.glob("_bundled/pip-*.whl"))
        if ensurepip and ensurepip.origin
        else []
    )
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
    options = (
        "--quiet",
        "--no-deps",
        "--no-index",
        "--disable-pip-version-check",
        "--target",
        directory,
    )
    execute(*pip(), "install", *options, wheel, cwd=directory)
    return directory


def test_contents(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    ours = {name for name in names if not name.partition("/")[0].endswith(".dist-info")}
    package = {
        path.relative_to(SOURCE.parent).as_posix()
        for path in SOURCE.rglob("*")
        if path.suffix in (".py", ".typed")
        or path.name in ("claims.yaml", "page.yaml", "claim_kinds.yaml")
    }
    assets = {
        path.relative_to(SOURCE.parent).as_posix()
        for path in (SOURCE / "assets").rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    conf = {
        f"evoexp/{path.relative_to(ROOT).as_posix()}"
        for path in (ROOT / "conf").rglob("*")
        if path.is_file()
    }
    assert len(conf) > 20
    assert {"evoexp/py.typed", "evoexp/assets/shipped.json"} <= ours
    assert ours == package | assets | conf
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)
    assert any(name.endswith(".dist-info/entry_points.txt") for name in names)


def test_the_installed_package_is_the_one_that_runs(installed: Path, tmp_path: Path) -> None:
    code = (
        "import evoexp, evoexp.shipped as s; print(evoexp.__file__, s.config_directory(), "
        "sep='\\n')"
    )
    printed = execute(sys.executable, "-c", code, cwd=tmp_path, PYTHONPATH=str(installed))
    assert printed.splitlines() == [f"{installed}/evoexp/__init__.py", f"{installed}/evoexp/conf"]


def test_the_installed_command(installed: Path, tmp_path: Path) -> None:
    command = installed / "bin" / "evoexp"
    assert "reproduce" in execute(command, "--help", cwd=tmp_path, PYTHONPATH=str(installed))
    assert "rana_planar" in execute(command, "list", cwd=tmp_path, PYTHONPATH=str(installed))


@pytest.mark.matrix
def test_the_installed_package_runs_an_experiment_from_any_directory(
    installed: Path, tmp_path: Path
) -> None:
    command = ("-m", "evoexp", "run", "experiment=rana_planar", "budget=smoke", "--no-report")
    printed = execute(sys.executable, *command, cwd=tmp_path, PYTHONPATH=str(installed))
    assert printed.count("2 of 2") >= 2
    assert len(list(tmp_path.glob("outputs/runs/*/replicates/*.mcap"))) == 6
