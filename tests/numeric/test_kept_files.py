"""Files of the cache are checked before they are used, and are this user's alone."""

import os
import pickle
import random
import shutil
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from evoexp.numeric import kept_files
from evoexp.numeric.kept_files import Damaged, cache_root, read_kept, write_kept
from evoexp.numeric.kernel_files import KernelFiles

FORM = {"machine code": b"\x00\x01" * 500}
OTHER = {"machine code": b"\x02\x03" * 500}


class Opened:
    """Pickled, it notes in a file that it was unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self.path,)


@pytest.fixture(autouse=True)
def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Say everything anew in every test."""
    monkeypatch.setattr(kept_files.MESSAGES, "_said", set())
    monkeypatch.setattr(kept_files.MESSAGES, "are_printed", True)
    kept_files._settled.cache_clear()


def truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-7])


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def zeroed(path: Path) -> None:
    path.write_bytes(bytes(path.stat().st_size))


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[random.Random(1).randrange(len(content))] ^= 4
    path.write_bytes(content)


def made_a_directory(path: Path) -> None:
    path.unlink()
    (path / "inside").mkdir(parents=True)


def taken_from_another(path: Path) -> None:
    other = KernelFiles(path.parent, "other")
    other.save("double", OTHER)
    shutil.copy(next(path.parent.glob(f"other*{path.suffix}")), path)


def replaced_by_a_pickle(path: Path) -> None:
    path.write_bytes(pickle.dumps(Opened(path.parent / "opened")))


DAMAGES = (
    truncated,
    emptied,
    zeroed,
    flipped,
    made_a_directory,
    taken_from_another,
    replaced_by_a_pickle,
)


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("which", [".nbi", ".nbc"])
def test_a_damaged_file_counts_as_missing_is_said_once_and_replaced(
    damage: Callable[[Path], None],
    which: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    KernelFiles(tmp_path, "kernel").save("double", FORM)
    assert KernelFiles(tmp_path, "kernel").load("double") == FORM
    assert KernelFiles(tmp_path, "kernel").load("int") is None
    (path,) = tmp_path.glob(f"kernel*{which}")
    damage(path)
    files = KernelFiles(tmp_path, "kernel")
    assert files.load("double") is None
    assert files.load("double") is None
    text = f"evoexp: {path}: damaged; damaged kernels are compiled again\n"
    assert capsys.readouterr().err == text
    assert not (tmp_path / "opened").exists(), "nothing is unpickled unchecked"
    files.save("double", FORM)
    assert KernelFiles(tmp_path, "kernel").load("double") == FORM
    assert not list(tmp_path.glob("*.tmp"))


def test_a_form_that_is_replaced_leaves_no_file(tmp_path: Path) -> None:
    files = KernelFiles(tmp_path, "kernel")
    files.save("double", FORM)
    files.save("int", FORM | {"more": b""})
    files.save("double", OTHER)
    assert files.load("double") == OTHER
    assert files.load("int") == FORM | {"more": b""}
    assert len(list(tmp_path.iterdir())) == 3


def test_another_process_finds_the_damage_that_a_server_leaves(tmp_path: Path) -> None:
    KernelFiles(tmp_path, "kernel").save("double", FORM)
    flipped(next(tmp_path.glob("*.nbc")))
    server = KernelFiles(tmp_path, "kernel")
    with kept_files.damage_left_alone():
        assert server.load("double") is None
        server.save("double", FORM)
    with pytest.raises(Damaged):
        read_kept(next(tmp_path.glob("*.nbc")))


def test_a_full_disk_leaves_no_part_of_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: bytes) -> int:
        path.touch()
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        write_kept(tmp_path / "a", b"content")
    assert list(tmp_path.iterdir()) == []


# Whose the cache is


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the directory that is named as the cache; not there yet."""
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_the_cache_is_private_whatever_the_umask(own: Path) -> None:
    before = os.umask(0)
    try:
        assert cache_root() == own
    finally:
        os.umask(before)
    assert stat.S_IMODE(own.stat().st_mode) == 0o700


def test_a_cache_that_others_may_write_is_closed_to_them(own: Path) -> None:
    own.mkdir()
    own.chmod(0o777)
    assert cache_root() == own
    assert stat.S_IMODE(own.stat().st_mode) == 0o755


def test_the_cache_of_another_user_is_not_used(
    own: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    own.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kept_files, "_owner", lambda: os.geteuid() + 1)
        other = cache_root()
    assert other != own
    assert stat.S_IMODE(other.stat().st_mode) == 0o700
    reason = "belongs to another user, whose files are not run"
    text = f"evoexp: {own}: {reason}; kernels are compiled for this command and not kept\n"
    assert capsys.readouterr().err == text
    assert os.environ["EVOEXP_CACHE"] == str(other), "workers use it too"
    shutil.rmtree(other)


def test_a_file_of_another_user_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_kept(tmp_path / "a", b"content")
    assert read_kept(tmp_path / "a") == b"content"
    monkeypatch.setattr(kept_files, "_owner", lambda: os.geteuid() + 1)
    with pytest.raises(Damaged):
        read_kept(tmp_path / "a")


@pytest.mark.parametrize("reason", ["a file", "no home"])
def test_without_a_cache_a_temporary_one_is_used_and_said(
    reason: str,
    own: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if reason == "a file":
        own.touch()
    else:
        monkeypatch.delenv("EVOEXP_CACHE")
        monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: f"~/.cache/{name}")
        monkeypatch.chdir(own.parent)
    other = cache_root()
    assert other.is_dir()
    assert own.parent not in other.parents
    assert list(own.parent.glob("~*")) == []
    assert capsys.readouterr().err.count("\n") == 1
    assert cache_root() == other
    assert capsys.readouterr().err == ""
    monkeypatch.delenv("EVOEXP_CACHE")
    shutil.rmtree(other)
