"""The manifest: what it says, what it must not say, and how two are compared."""

import json
import subprocess
from importlib import metadata
from pathlib import Path

import pytest

import evoexp
from evoexp.store import manifest as module
from evoexp.store.manifest import Difference, differences, environment, git_state, manifest


def test_manifest_names_versions_and_processor_and_no_paths() -> None:
    made = manifest("a" * 64)
    assert made["condition"] == "a" * 64
    assert made["versions"]["numpy"] == metadata.version("numpy")
    assert set(made["cpu"]) == {"name", "features"} and isinstance(made["cpu"]["features"], list)
    text = json.dumps(made)
    assert json.loads(text) == made
    assert str(Path.home()) not in text
    assert str(Path(evoexp.__file__).parent) not in text


def test_git_state_never_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    state = git_state.__wrapped__()
    assert state is None or set(state) == {"commit", "dirty"}

    def absent(*_: object, **__: object) -> None:
        raise FileNotFoundError("git")

    monkeypatch.setattr(subprocess, "run", absent)
    assert git_state.__wrapped__() in (None, {"commit": None, "dirty": None})


def test_an_installed_package_has_no_git_state(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(
        module, "__file__", str(tmp_path / "lib" / "evoexp" / "store" / "manifest.py")
    )
    assert git_state.__wrapped__() is None


def test_git_state_of_a_checkout(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "src" / "evoexp" / "store" / "manifest.py"
    path.parent.mkdir(parents=True)
    path.write_text("")
    (tmp_path / "pyproject.toml").write_text("")
    git = ["git", "-C", str(tmp_path), "-c", "user.name=x", "-c", "user.email=x@x"]
    subprocess.run([*git, "init", "-q"], check=True)
    monkeypatch.setattr(module, "__file__", str(path))
    assert git_state.__wrapped__() == {"commit": None, "dirty": True}
    subprocess.run([*git, "add", "."], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "x"], check=True)
    clean = git_state.__wrapped__()
    assert clean is not None and len(clean["commit"]) == 40 and clean["dirty"] is False
    path.write_text("x = 1\n")
    assert git_state.__wrapped__() == {"commit": clean["commit"], "dirty": True}


def test_differences() -> None:
    assert differences(manifest("a" * 64), environment()) == []
    was = {
        "condition": "a",
        "versions": {"numpy": "2.4.5", "gone": "1"},
        "cpu": {"features": ["avx", "avx2"]},
        "git": None,
    }
    now = {
        "condition": "b",
        "versions": {"numpy": "2.4.6"},
        "cpu": {"features": ["avx", "fma"]},
        "extra": {"x": 1},
    }
    found = differences(was, now)
    assert found == [
        Difference("cpu.features", ["avx2"], ["fma"]),
        Difference("versions.gone", "1", None),
        Difference("versions.numpy", "2.4.5", "2.4.6"),
    ]
    assert str(found[2]) == "versions.numpy: was 2.4.5, now 2.4.6"
