"""Compiled kernels are kept; whatever happens to their files, code is compiled and right."""

import os
import pickle
import re
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import pytest

import evoexp
from evoexp.numeric import cache_folder, compilation
from evoexp.numeric.cache_folder import cache_root, read_kept, write_kept
from evoexp.numeric.compilation import LIST, ROOMS_ABOVE, Checksums, kernel, list_files, remove_old
from matrix import first

SOURCE = Path(evoexp.__file__).parent
HEAD = "from evoexp.numeric.compilation import kernel\n"
GUEST = f"{HEAD}@kernel\ndef f(x):\n    return x + 1.0\n"
CALL = "import guest; print(guest.f(1.0), sum(guest.f.stats.cache_hits.values()))"


class Place:
    """A folder with a guest's modules and a cache."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.cache = folder, folder / "cache"
        self.write("guest.py", GUEST)

    def write(self, name: str, text: str) -> None:
        path = self.folder / "code" / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(text)

    def start(self, script: str, **environment: str) -> subprocess.Popen[str]:
        paths = os.pathsep.join([str(self.folder / "code"), str(SOURCE.parent)])
        own = {"PYTHONPATH": paths, "EVOEXP_CACHE": str(self.cache)}
        # an edit of the same length in the same second would be thought the same
        own["PYTHONDONTWRITEBYTECODE"] = "1"
        variables = os.environ | own | environment
        return subprocess.Popen(
            [sys.executable, "-c", script],
            env=variables,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def run(self, script: str = CALL, **environment: str) -> str:
        """Return what a process printed, errors among it."""
        return self.start(script, **environment).communicate()[0]


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def test_kernels_are_kept_until_their_code_changes(place: Place) -> None:
    assert place.run() == "2.0 0\n"
    place.write("guest.py", GUEST.replace("1.0", "2.0"))
    assert place.run() == "3.0 0\n"
    place.write("guest.py", GUEST)
    assert place.run() == "2.0 1\n", "the folder of the old code is still there"
    assert place.run(NUMBA_CPU_NAME="generic") == "2.0 0\n", "another processor"


def test_a_kernel_is_compiled_again_when_what_it_calls_changes(place: Place) -> None:
    """Within its package, one without `__init__.py` too, beside a module, in another package."""
    outer = f"{HEAD}from %s import g\n@kernel\ndef f(x):\n    return g(x)\n"
    inner = f"{HEAD}@kernel\ndef g(x):\n    return x + %s\n"
    place.write("loose/outer.py", outer % "loose.inner")
    place.write("other/__init__.py", "")
    place.write("outer.py", outer % "other.inner")
    script = "import loose.outer, outer; print(loose.outer.f(1.0), outer.f(1.0))"
    for added in (1.0, 2.0):
        place.write("loose/inner.py", inner % added)
        place.write("other/inner.py", inner % added)
        assert place.run(script) == f"{1.0 + added} {1.0 + added}\n"


EDITED = """
import pathlib
from guest import constants, kernels  # their code is loaded, nothing is compiled
path = pathlib.Path(constants.__file__)
path.write_text(path.read_text().replace("1.0", "5.0"))
print(kernels.f(1.0))
"""


@pytest.mark.matrix
def test_code_that_is_edited_while_it_runs_leaves_no_stale_kernel(place: Place) -> None:
    """The kernel of the loaded code is under the key of the edited one, or the reverse."""
    constants, call = "ADDED = 1.0\n", CALL.replace("guest", "guest.kernels")
    code = GUEST.replace("1.0", "ADDED").replace("\n@", "\nfrom guest.constants import ADDED\n@")
    place.write("guest/__init__.py", "")
    place.write("guest/kernels.py", code)
    place.write("guest/constants.py", constants)
    assert place.run(EDITED) == "2.0\n"
    assert place.run(call) == "6.0 0\n"
    place.write("guest/constants.py", constants)
    assert place.run(call) == "2.0 0\n"


@pytest.fixture
def listed(tmp_path: Path) -> Path:
    """Return a folder with files as of two kernels, which are listed."""
    for name in ("f.nbi", "f.1.nbc", "g.nbi", "g.1.nbc"):
        (tmp_path / name).write_bytes(name.encode() * 50)
    folder = Path(shutil.copytree(tmp_path, tmp_path / "kernels"))
    assert not is_left(folder), "no file was listed"
    shutil.copytree(tmp_path, folder, ignore=lambda *_: {"kernels"})
    list_files(folder)
    assert is_left(folder)
    return folder


def is_left(folder: Path) -> bool:
    """Return whether another process uses the files of a folder."""
    Checksums().check(folder)
    return folder.is_dir()


DAMAGES: dict[str, Callable[[Path], object]] = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-7]),
    "emptied": lambda path: path.write_bytes(b""),
    "flipped": lambda path: path.write_bytes(path.read_bytes()[:-1] + b"?"),
    "of another": lambda path: shutil.copy(path.with_name("g.1.nbc"), path),
    "removed": Path.unlink,
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", ["f.nbi", "f.1.nbc", LIST])
def test_damaged_files_are_removed(listed: Path, name: str, damage: str) -> None:
    """As after the end of a process while it writes; a kernel that is gone does no harm."""
    DAMAGES[damage](listed / name)
    assert is_left(listed) == (damage == "removed" and name != LIST)


def test_files_of_another_user_are_removed(listed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "is_own", lambda path: False)
    assert not is_left(listed)


class Opened:
    """Pickled, it notes in a file that it was unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self.path,)


def test_damaged_kernels_are_compiled_again(place: Place) -> None:
    assert place.run() == "2.0 0\n"
    files = list(place.cache.rglob("guest.f*.nb?"))
    assert len(files) > 1
    for path in files:
        path.write_bytes(pickle.dumps(Opened(path.parent / "opened")))
    assert place.run() == "2.0 0\n"
    assert not list(place.cache.rglob("opened")), "nothing is unpickled unchecked"


@pytest.mark.matrix
def test_two_processes_at_once_leave_whole_kernels(place: Place) -> None:
    running = [place.start(f"import guest; print(guest.f({value}))") for value in ("1", "1.0")]
    assert [process.communicate()[0] for process in running] == ["2.0\n"] * 2
    assert place.run() in ("2.0 0\n", "2.0 1\n")


@pytest.mark.parametrize("obstacle", first(1, ["no room", "a file"]))
def test_where_kernels_cannot_be_kept_they_are_compiled(place: Place, obstacle: str) -> None:
    script = f"from evoexp.numeric import compilation as k; k.LEAST_ROOM = 2**80; {CALL}"
    if obstacle == "a file":
        script = CALL
        place.cache.mkdir()
        (place.cache / "kernels").touch()
    assert place.run(script) == "2.0 0\n"
    assert not list(place.folder.rglob("*.nbi")), "nor beside the source"


def test_functions_without_a_file_are_compiled_and_not_kept(place: Place) -> None:
    typed = "from evoexp.numeric.compilation import kernel\nf = kernel(eval('lambda x: x + 1.0'))"
    script = f"{typed}\nexec('def g(x): return x + 2.0')\nprint(f(1.0), kernel(g)(1.0))"
    assert place.run(script) == "2.0 3.0\n"


def test_functions_of_one_line_are_told_apart_and_numba_is_left_as_it_was() -> None:
    config: Any = numba.config
    one, two = kernel(lambda x: x + 1.0), kernel(lambda x: x + 2.0)
    assert (one(0.5), two(0.5)) == (1.5, 2.5)
    assert (config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES) == ("", "")


def test_old_folders_go_but_recent_and_used_ones_stay(tmp_path: Path) -> None:
    folders = [tmp_path / f"{age:016x}" for age in range(8)]
    for age, folder in enumerate(folders):
        (folder / "evolution").mkdir(parents=True)
        os.utime(folder, (1e9 - age, 1e9 - age))
    os.utime(folders[6])
    remove_old(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {folders[i].name for i in (6, 0, 1, 2)}
    remove_old(tmp_path / "file" / "nothing")  # silent where nothing is there


def test_kernels_are_made_of_no_room_above_them() -> None:
    """What is left out of the hash of the sources holds no kernel; imports only point downwards."""
    for room in ROOMS_ABOVE:
        paths = (SOURCE / room).rglob("*.py")
        texts = [path.read_text() for path in paths if "assets/new_" not in path.as_posix()]
        assert (SOURCE / room).is_dir()  # templates of other packages are copied, and not imported
        kernels = re.compile("evoexp.numeric.compilation import (?!sources_key\n)")
        assert not list(filter(kernels.search, texts))


# The cache: files that are checked, in a folder that is this user's alone

CONTENT = bytes(range(256)) * 4


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the directory that is named as the cache, looked at anew; it is not there yet."""
    monkeypatch.setattr(cache_folder, "_settled", cache_folder._settled.__wrapped__)
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_and_another_users_are_not_read_and_can_be_replaced(
    damage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file"
    write_kept(tmp_path / "g.1.nbc", CONTENT)  # the same under another name
    assert read_kept(path) is None
    write_kept(path, CONTENT)
    assert read_kept(path) == CONTENT
    DAMAGES[damage](path)
    assert read_kept(path) is None
    write_kept(path, CONTENT)
    assert read_kept(path) == CONTENT
    assert not list(tmp_path.glob("*.tmp"))
    monkeypatch.setattr(cache_folder, "is_own", lambda path: False)
    assert read_kept(path) is None


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


def test_the_cache_is_closed_to_others_whatever_the_umask_or_its_mode(own: Path) -> None:
    before = os.umask(0)
    try:
        assert cache_root() == own
    finally:
        os.umask(before)
    assert stat.S_IMODE(own.stat().st_mode) == 0o700
    own.chmod(0o777)
    assert cache_root() == own
    assert stat.S_IMODE(own.stat().st_mode) == 0o755


@pytest.mark.parametrize(
    "reason", ["belongs to another user", "File exists", "must be an absolute"]
)
def test_without_a_cache_of_ones_own_a_temporary_one_is_used_and_said(
    reason: str, own: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if reason == "File exists":
        own.touch()
    elif reason == "must be an absolute":  # a user without a home
        monkeypatch.delenv("EVOEXP_CACHE")
        monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: f"~/.cache/{name}")
        monkeypatch.chdir(own.parent)
    with pytest.MonkeyPatch.context() as patch:
        if reason == "belongs to another user":
            patch.setattr(cache_folder, "is_own", lambda path: False)
        other = cache_root()
    assert other.is_dir() and own.parent not in other.parents
    assert stat.S_IMODE(other.stat().st_mode) == 0o700
    assert list(own.parent.glob("~*")) == []
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f": {reason}" in said
    assert said.endswith("; kernels are compiled for this command and not kept\n")
    assert os.environ["EVOEXP_CACHE"] == str(other), "workers use it too"
    assert cache_root() == other
    assert capsys.readouterr().err == ""
    shutil.rmtree(other)
