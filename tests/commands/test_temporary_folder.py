"""A command's temporary files are in one folder, and a killed one's are removed by the next."""

import fcntl
import os
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from evoexp.commands.command_process import LOCK, PREFIX, remove_abandoned

COMMAND = """
import os, signal, sys, tempfile
from pathlib import Path
from evoexp import cli
from evoexp.batch.workers import Workers, in_order

def command(words):
    Path(tempfile.mkdtemp(), "file").write_text("of a library")
    with Workers(2) as workers:
        print(tempfile.gettempdir(), *in_order(workers, tempfile.gettempdir, [()]), flush=True)
        if sys.argv[2:] == ["--failed"]:
            os.kill(os.getpid(), signal.SIGKILL)
    return 0

cli.command_module = lambda name: type("", (), {"main": command})
sys.exit(cli.main())
"""


def run(place: Path, *words: str) -> tuple[int, list[str]]:
    """Run a command with temporary files in a place; return its exit code and its folders."""
    done = subprocess.run(
        [sys.executable, "-c", f"import os; os.umask(0)\n{COMMAND}", "list", *words],
        env=os.environ | {"TMPDIR": str(place)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.stderr == ""
    return done.returncode, done.stdout.split()


def test_what_a_killed_command_leaves_is_removed_by_the_next(tmp_path: Path) -> None:
    code, (folder, of_worker) = run(tmp_path, "--failed")
    assert code == -signal.SIGKILL
    assert folder == of_worker
    (left,) = tmp_path.iterdir()
    assert str(left) == folder
    assert stat.S_IMODE(left.stat().st_mode) == 0o700
    assert list(left.rglob("file"))
    code, (other, _) = run(tmp_path)
    assert (code, list(tmp_path.iterdir())) == (0, [])
    assert other != folder


def folder_of(place: Path, name: str) -> Path:
    folder = place / f"{PREFIX}{name}"
    folder.mkdir()
    (folder / LOCK).touch()
    (folder / "file").touch()
    return folder


def test_folders_with_a_living_owner_stay(tmp_path: Path) -> None:
    alive, abandoned = folder_of(tmp_path, "alive"), folder_of(tmp_path, "abandoned")
    os.utime(alive, (0, 0))  # age decides nothing
    with open(alive / LOCK) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        remove_abandoned(tmp_path)
        assert (alive / "file").exists()
        assert not abandoned.exists()
    remove_abandoned(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_nothing_else_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, elsewhere = tmp_path / "place", tmp_path / "elsewhere"
    place.mkdir()
    elsewhere.mkdir()
    (place / f"{PREFIX}without_lock").mkdir()
    (place / f"{PREFIX}file").touch()
    (place / "evoexp-cache" / LOCK).parent.mkdir()
    (place / "evoexp-cache" / LOCK).touch()
    (place / "joblib_memmapping_folder_1").mkdir()
    (place / f"{PREFIX}link").symlink_to(folder_of(elsewhere, "target"))
    (place / f"{PREFIX}linked_lock").mkdir()
    (elsewhere / "lock").touch()
    (place / f"{PREFIX}linked_lock" / LOCK).symlink_to(elsewhere / "lock")
    before = sorted(tmp_path.rglob("*"))
    remove_abandoned(place)
    assert sorted(tmp_path.rglob("*")) == before
    folder_of(place, "of_another_user")
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    remove_abandoned(place)
    assert sorted(tmp_path.rglob("*")) == before


def test_where_no_folder_can_be_made_files_are_where_they_would_be(tmp_path: Path) -> None:
    missing = tmp_path / "missing"
    code, (folder, _) = run(missing)
    assert code == 0
    assert Path(folder).parent == Path(tempfile.gettempdir()) or Path(folder).parent.exists()
    assert not missing.exists()
