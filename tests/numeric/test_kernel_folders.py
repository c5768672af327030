"""Compiled kernels are kept; whatever happens to their files, code is compiled and right."""

import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numba
import pytest

import evoexp
from evoexp.numeric import kernel_folders
from evoexp.numeric.compilation import kernel
from evoexp.numeric.kernel_folders import LIST, ROOMS_ABOVE, Checksums, list_files, remove_old
from matrix import first

SOURCE = Path(evoexp.__file__).parent
HEAD = "from evoexp.numeric.compilation import kernel\n"
GUEST = f"{HEAD}@kernel\ndef f(x):\n    return x + 1.0\n"
CALL = "import guest; print(guest.f(1.0), sum(guest.f.stats.cache_hits.values()))"


class Said(NamedTuple):
    """What a process printed."""

    out: str
    errors: str


class Place:
    """A folder with a guest's modules and a cache."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.cache = folder, folder / "cache"
        (folder / "code").mkdir()
        self.write("guest.py", GUEST)

    def write(self, name: str, text: str) -> None:
        path = self.folder / "code" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)

    def run(self, script: str = CALL, **environment: str) -> Said:
        paths = os.pathsep.join([str(self.folder / "code"), str(SOURCE.parent)])
        own = {"PYTHONPATH": paths, "EVOEXP_CACHE": str(self.cache)}
        # an edit of the same length in the same second would be thought the same
        own["PYTHONDONTWRITEBYTECODE"] = "1"
        done = subprocess.run(
            [sys.executable, "-c", script],
            env=os.environ | own | environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return Said(done.stdout, done.stderr)

    def files(self, ending: str) -> Iterator[Path]:
        """Yield the files of the guest's kernel."""
        return self.cache.rglob(f"guest.f*{ending}")


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def test_kernels_are_kept_until_their_code_changes(place: Place) -> None:
    assert place.run() == ("2.0 0\n", "")
    place.write("guest.py", GUEST.replace("1.0", "2.0"))
    assert place.run() == ("3.0 0\n", "")
    place.write("guest.py", GUEST)
    assert place.run() == ("2.0 1\n", ""), "the folder of the old code is still there"
    assert place.run(NUMBA_CPU_NAME="generic").out == "2.0 0\n", "another processor"


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
        assert place.run(script) == (f"{1.0 + added} {1.0 + added}\n", "")


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
    assert place.run(EDITED).out == "2.0\n"
    assert place.run(call).out == "6.0 0\n"
    place.write("guest/constants.py", constants)
    assert place.run(call).out == "2.0 0\n"


def truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-7])


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def removed(path: Path) -> None:
    path.unlink()


class Opened:
    """Pickled, it notes in a file that it was unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self.path,)


@pytest.fixture
def listed(tmp_path: Path) -> Path:
    """Return a folder with files as of two kernels, which are listed."""
    for name in ("f.nbi", "f.1.nbc", "g.nbi", "g.1.nbc"):
        (tmp_path / name).write_bytes(name.encode() * 50)
    folder = Path(shutil.copytree(tmp_path, tmp_path / "kernels"))
    assert not is_left(folder), "no file was listed"
    shutil.copytree(tmp_path, folder, ignore=lambda *_: {"kernels"})
    list_files(folder)
    return folder


def is_left(folder: Path) -> bool:
    """Return whether another process uses the files of a folder."""
    Checksums().check(folder)
    return folder.is_dir()


def taken_from_another(path: Path) -> None:
    shutil.copy(path.with_name("g.1.nbc"), path)


@pytest.mark.parametrize("damage", [truncated, emptied, flipped, taken_from_another])
@pytest.mark.parametrize("name", ["f.nbi", "f.1.nbc"])
def test_damaged_files_are_removed(listed: Path, name: str, damage: Callable[[Path], None]) -> None:
    assert is_left(listed)
    damage(listed / name)
    assert not is_left(listed)


@pytest.mark.parametrize("damage", [emptied, removed])
def test_files_that_no_list_names_are_removed(listed: Path, damage: Callable[[Path], None]) -> None:
    """As after the end of a process while it writes."""
    damage(listed / LIST)
    assert not is_left(listed)


def test_files_of_another_user_are_removed(listed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_folders, "is_own", lambda path: False)
    assert not is_left(listed)


def test_damaged_kernels_are_compiled_again(place: Place) -> None:
    assert place.run().out == "2.0 0\n"
    for path in [*place.files(".nbi"), *place.files(".nbc")]:
        path.write_bytes(pickle.dumps(Opened(path.parent / "opened")))
    assert place.run() == ("2.0 0\n", "")
    assert not list(place.cache.rglob("opened")), "nothing is unpickled unchecked"


@pytest.mark.matrix
def test_two_processes_at_once_leave_whole_kernels(place: Place) -> None:
    scripts = [f"import guest; print(guest.f({value}))" for value in ("1", "1.0")]
    paths = os.pathsep.join([str(place.folder / "code"), str(SOURCE.parent)])
    environment = os.environ | {"PYTHONPATH": paths, "EVOEXP_CACHE": str(place.cache)}
    running = [
        subprocess.Popen([sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE)
        for script in scripts
    ]
    found = [process.communicate()[0] for process in running]
    assert found == [b"2.0\n"] * 2
    assert place.run().out in ("2.0 0\n", "2.0 1\n")


@pytest.mark.parametrize("obstacle", first(1, ["no room", "a file"]))
def test_where_kernels_cannot_be_kept_they_are_compiled(place: Place, obstacle: str) -> None:
    script = CALL
    if obstacle == "a file":
        place.cache.mkdir()
        (place.cache / "kernels").touch()
    else:
        script = f"from evoexp.numeric import kernel_folders as k; k.LEAST_ROOM = 2**80; {CALL}"
    assert place.run(script) == ("2.0 0\n", "")
    assert not list(place.folder.rglob("*.nbi")), "nor beside the source"


def test_functions_without_a_file_are_compiled_and_not_kept(place: Place) -> None:
    typed = "from evoexp.numeric.compilation import kernel\nf = kernel(eval('lambda x: x + 1.0'))"
    script = f"{typed}\nexec('def g(x): return x + 2.0')\nprint(f(1.0), kernel(g)(1.0))"
    assert place.run(script) == ("2.0 3.0\n", "")


def test_functions_of_one_line_are_told_apart() -> None:
    one, two = kernel(lambda x: x + 1.0), kernel(lambda x: x + 2.0)
    assert (one(0.5), two(0.5)) == (1.5, 2.5)


def test_numba_is_left_as_it_was() -> None:
    config: Any = numba.config

    @kernel
    def double(x: float) -> float:
        return 2.0 * x

    assert double(1.0) == 2.0
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
        assert not [text for text in texts if "evoexp.numeric.compilation" in text]
