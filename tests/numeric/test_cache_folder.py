"""Files of the cache are checked before they are used, and are this user's alone."""

import os
import random
import shutil
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from evoexp.numeric import cache_folder
from evoexp.numeric.cache_folder import Damaged, cache_root, read_kept, write_kept

CONTENT = bytes(range(256)) * 4


@pytest.fixture(autouse=True)
def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look at the folder anew in every test."""
    monkeypatch.setattr(cache_folder, "_settled", cache_folder._settled.__wrapped__)


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


def taken_from_another(path: Path) -> None:
    write_kept(path.with_name("other"), b"other")
    shutil.copy(path.with_name("other"), path)


DAMAGES = (truncated, emptied, zeroed, flipped, taken_from_another)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_not_read_and_can_be_replaced(
    damage: Callable[[Path], None], tmp_path: Path
) -> None:
    path = tmp_path / "file"
    with pytest.raises(Damaged):
        read_kept(path)
    write_kept(path, CONTENT)
    assert read_kept(path) == CONTENT
    damage(path)
    with pytest.raises(Damaged):
        read_kept(path)
    write_kept(path, CONTENT)
    assert read_kept(path) == CONTENT
    assert not list(tmp_path.glob("*.tmp"))


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
        patch.setattr(cache_folder, "is_own", lambda path: False)
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
    monkeypatch.setattr(cache_folder, "is_own", lambda path: False)
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
