"""The built wheel holds what the checkout has, and runs from any directory; nothing here needs a network."""

import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "evoexp"

pytestmark = pytest.mark.skipif(find_spec("hatchling") is None, reason="needs hatchling, from evoexp[build]")


def execute(*command: str | Path, cwd: Path, **environment: str) -> str:
    """Run a command without the checkout's paths; return what it prints."""
    inherited = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "EVOEXP_OUTPUTS")}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=inherited | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("wheel")
    execute(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", directory, cwd=ROOT)
    (path,) = directory.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel into a new virtual environment, which borrows only the dependencies of this one."""
    if find_spec("ensurepip") is None:
        pytest.skip("this Python comes without ensurepip")
    directory = tmp_path_factory.mktemp("installed")
    execute(sys.executable, "-m", "venv", directory, cwd=directory)
    python = directory / "bin" / "python"
    execute(python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=directory)
    (site,) = directory.glob("lib/python3.*/site-packages")
    # A path named in a .pth file is not searched for .pth files, so this environment's editable install stays out.
    borrowed = [path for path in sys.path if path.endswith("site-packages")]
    (site / "borrowed.pth").write_text("\n".join(borrowed) + "\n")
    return directory


def test_contents(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    ours = {name for name in names if not name.partition("/")[0].endswith(".dist-info")}
    package = {
        path.relative_to(SOURCE.parent).as_posix() for path in SOURCE.rglob("*") if path.suffix in (".py", ".typed")
    }
    assets = {path.relative_to(SOURCE.parent).as_posix() for path in (SOURCE / "assets").iterdir()}
    conf = {f"evoexp/{path.relative_to(ROOT).as_posix()}" for path in (ROOT / "conf").rglob("*.yaml")}
    assert len(conf) > 20
    assert {"evoexp/py.typed", "evoexp/assets/shipped.json"} <= ours
    assert ours == package | assets | conf
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)
    assert any(name.endswith(".dist-info/entry_points.txt") for name in names)


def test_the_installed_package_is_the_one_that_runs(environment: Path, tmp_path: Path) -> None:
    code = "import evoexp, evoexp.compose as c; print(evoexp.__file__, c.config_directory(), sep='\\n')"
    lines = execute(environment / "bin" / "python", "-c", code, cwd=tmp_path).splitlines()
    assert all(Path(line).is_relative_to(environment) for line in lines)
    assert lines[1].endswith("evoexp/conf")


def test_the_installed_command(environment: Path, tmp_path: Path) -> None:
    evoexp = environment / "bin" / "evoexp"
    assert "reproduce" in execute(evoexp, "--help", cwd=tmp_path)
    assert "rana_planar" in execute(evoexp, "list", cwd=tmp_path)


def test_the_installed_package_runs_an_experiment_from_any_directory(environment: Path, tmp_path: Path) -> None:
    command = ("-m", "evoexp", "run", "experiment=rana_planar", "budget=smoke", "--no-report")
    printed = execute(environment / "bin" / "python", *command, "--only", "via-point GA", cwd=tmp_path)
    assert "2 of 2" in printed
    assert len(list(tmp_path.glob("outputs/runs/*/replicates/*.mcap"))) == 2
