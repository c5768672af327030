"""Run commands in this process, and small stored runs to run them on."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_samples import SERIAL, Evoexp, Said, content, exit_code

from evoexp.configuration import compose
from evoexp.store.run_directory import RunDirectory


@pytest.fixture
def evoexp(outputs: Path, capsys: pytest.CaptureFixture[str], blank_figures: None) -> Evoexp:
    """Return what runs a command; figures of its reports are blank."""

    def run(*words: str) -> Said:
        capsys.readouterr()
        code = exit_code(*words)
        return Said(code, *capsys.readouterr())

    return run


@pytest.fixture
def refused(evoexp: Evoexp, outputs: Path) -> Callable[..., str]:
    """Return what runs a command that cannot be done: one line, exit code 2, nothing written."""

    def run(*words: str) -> str:
        before = content(outputs)
        said = evoexp(*words)
        assert said.code == 2, said
        assert said.out == ""
        assert said.err.startswith("evoexp: ")
        assert said.err.endswith("\n")
        assert said.err.count("\n") == 1
        assert "Traceback" not in said.err
        assert content(outputs) == before
        return said.err.removeprefix("evoexp: ").rstrip("\n")

    return run


@pytest.fixture(scope="session")
def stored_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return outputs with a small run of both conditions of `rana_planar`, two replicates each.

    Not to be changed.
    """
    root = tmp_path_factory.mktemp("stored") / "outputs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EVOEXP_OUTPUTS", str(root))
        assert exit_code("run", "experiment=rana_planar", *SERIAL, "--no-report") == 0
    return root


@pytest.fixture
def stored(stored_once: Path, outputs: Path) -> Path:
    """Return a copy of those outputs for this test."""
    shutil.copytree(stored_once, outputs)
    return outputs


@pytest.fixture
def run(stored: Path) -> RunDirectory:
    """Return the stored run of the experiment's first condition, two replicates."""
    (experiment,) = compose.expand(["experiment=rana_planar", *SERIAL])
    return RunDirectory(stored, experiment.conditions[0].condition.id)


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    """Return a file with the straight motion of the two arms, 21 instants."""
    ends = ([[45.0, 225.0], [225.0, 225.0]], [[135.0, 135.0], [315.0, 315.0]])
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(np.linspace(*ends, 21).swapaxes(0, 1).tolist()))
    return path


@pytest.fixture(params=[80, 140])
def width(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    """Have lines of that many columns."""
    monkeypatch.setenv("COLUMNS", str(request.param))
    return int(request.param)


@pytest.fixture
def wide_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have lines of 160 columns, wherever tests run."""
    monkeypatch.setenv("COLUMNS", "160")
