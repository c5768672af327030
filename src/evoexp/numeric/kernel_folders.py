"""Where numba keeps compiled kernels: folders of the user's cache, with checksums of their files.

A folder's name is a hash of all that a kernel is made of: evoexp's sources, those of the package of
a guest's kernel, numba, llvmlite and the processor. So an edit compiles kernels again.

numba reads its files as they are: a damaged one would end in a traceback, or run as machine code.
So files are listed with their checksums when they are written, and those that are not as they were
listed are removed before the first kernel of a folder is loaded.
"""

import contextlib
import functools
import hashlib
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import xxhash
from numba.core import event

from evoexp.numeric.cache_folder import cache_root, is_own

LIST = "checksums"  # name of the file that lists the others: a line of checksum and name for each
NUM_KEPT = 4  # [-] folders that are kept
KEPT_S = 86_400.0  # [s] and any that was used so lately
LEAST_ROOM = 2**27  # [B] free on the disk: numba fails if it cannot write a kernel
PATIENCE_S = 10.0  # [s] for another process that writes a kernel

# The rooms above all kernels, by the layers of imports: kernels are not made of their code.
ROOMS_ABOVE = frozenset(
    {"batch", "commands", "configuration", "papers", "playback", "report", "testing", "assets"}
)
_OWN = __name__.split(".")[0]
_STATES: dict[Path, tuple[int, int] | None] = {}  # of the sources, when they were hashed
_KINDS = (".nbi", ".nbc")  # numba's files: indices, machine code


@contextlib.contextmanager
def kept_kernels(function: Callable[..., Any]) -> Iterator[bool]:
    """Have numba keep the kernels that are defined meanwhile; yield whether it can.

    numba looks at its settings where a kernel is defined, and they are as before afterwards.
    """
    folder = None if function.__name__ == "<lambda>" else _folder_of(function)  # lines may be alike
    if folder is None:
        yield False
        return
    config: Any = numba.config
    before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
    config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(folder), "UserProvidedCacheLocator"
    try:
        yield True
    finally:
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before


def _folder_of(function: Callable[..., Any]) -> Path | None:
    """Return the folder for a function; None if its sources or a place to write are missing."""
    callees = [value for value in function.__globals__.values() if hasattr(value, "py_func")]
    modules = {each.__module__ for each in (function, *callees)}
    packages = frozenset(module.split(".")[0] for module in modules) | {_OWN}
    try:
        root = cache_root() / "kernels"
        return _made(root, _key(packages))
    except OSError:
        return None


@functools.cache
def _made(root: Path, name: str) -> Path | None:
    """Return a folder for kernels that was made, and remove old ones; None on a full disk."""
    folder = root / name
    folder.mkdir(parents=True, exist_ok=True)
    if shutil.disk_usage(folder).free < LEAST_ROOM:
        return None
    os.utime(folder)
    remove_old(root)
    return folder


def remove_old(root: Path) -> None:
    """Remove folders of kernels, but not the newest ones and those that were used of late."""
    with contextlib.suppress(OSError):
        folders = sorted(root.iterdir(), key=lambda folder: folder.stat().st_mtime)
        for folder in folders[:-NUM_KEPT]:
            if time.time() - folder.stat().st_mtime > KEPT_S:
                shutil.rmtree(folder, ignore_errors=True)


@functools.cache
def _key(packages: frozenset[str]) -> str:
    """Return the hash of some packages' sources, the compilers' versions and the processor."""
    compilers = sys.version, numba.__version__, llvmlite.__version__
    features = llvmlite.binding.get_host_cpu_features().flatten()
    processor = llvmlite.binding.get_host_cpu_name(), features
    key = hashlib.sha256(repr((compilers, processor)).encode())
    for package in sorted(packages):
        key.update(sources_key(package).encode())
    return key.hexdigest()[:16]


@functools.cache
def sources_key(package: str = _OWN) -> str:
    """Return the hash of all sources of a package that kernels can be made of.

    Raises:
        OSError: If there are none, as for what is typed into an interpreter.
    """
    key = hashlib.sha256()
    for path in sorted(_sources(package)):
        _STATES[path] = _state(path)
        key.update(f"{path.name}\0".encode())
        key.update(path.read_bytes())
    return key.hexdigest()


def _state(path: Path) -> tuple[int, int] | None:
    """Return when a file was changed, and its size; None if it is not there."""
    with contextlib.suppress(OSError):
        status = path.stat()
        return status.st_mtime_ns, status.st_size
    return None


def _are_edited() -> bool:
    """Return whether sources changed since they were hashed: other ones may be loaded by now."""
    return any(_state(path) != state for path, state in _STATES.items())


def _sources(package: str) -> Iterator[Path]:
    """Yield the Python files of a package; for a module, those in its folder."""
    module = sys.modules[package]
    if file := getattr(module, "__file__", None):
        folders = [Path(file).parent]
    else:
        folders = [Path(each) for each in getattr(module, "__path__", ())]  # without __init__.py
    if not folders:
        raise FileNotFoundError(package)
    is_package = hasattr(module, "__path__")
    for folder in folders:
        for place, rooms, files in os.walk(folder):
            hidden = ROOMS_ABOVE if package == _OWN and Path(place) == folder else frozenset[str]()
            rooms[:] = sorted(set(rooms) - hidden) if is_package else []
            yield from (Path(place) / name for name in files if name.endswith(".py"))


class Checksums(event.Listener):
    """The checksums of numba's files, and a lock while one is written.

    numba says when it has compiled a kernel, before it writes it, and when it lets its own lock go.
    """

    def __init__(self) -> None:
        """Know no folder."""
        self._lines: dict[Path, set[str]] = {}  # of the list of each folder
        self._states = set[tuple[str, int, int]]()  # of files that are listed
        self._writing: list[tuple[Path, contextlib.ExitStack]] = []

    def check(self, folder: Path) -> None:
        """Remove the files of a folder that are not as they were listed; looked at once."""
        if folder in self._lines:
            return
        self._lines[folder] = set(_read_list(folder))
        if self._unlisted(folder):
            with _locked(folder):
                self._lines[folder] = set(_read_list(folder))
                for path, _ in self._unlisted(folder):
                    _remove(path)

    def on_start(self, event: Any) -> None:
        """Do nothing."""

    def on_end(self, event: Any) -> None:
        """Lock a folder before a kernel is written to it; then list its files."""
        if event.kind == "numba:compile":
            folder = Path(event.data["dispatcher"].stats.cache_path or "")
            if folder in self._lines:
                lock = contextlib.ExitStack()
                lock.enter_context(_locked(folder))
                self._writing.append((folder, lock))
            return
        while self._writing:
            folder, lock = self._writing.pop()
            with lock, contextlib.suppress(OSError):
                if not _are_edited():
                    self.list_new(folder)

    def list_new(self, folder: Path) -> None:
        """Append the files of a folder that are new or changed to its list."""
        lines = [line for _, line in self._unlisted(folder)]
        with open(folder / LIST, "a", encoding="utf-8") as file:
            file.write("".join(f"{line}\n" for line in lines))
        self._lines[folder].update(lines)

    def _unlisted(self, folder: Path) -> list[tuple[Path, str]]:
        """Return numba's files that are not as they were listed, and their lines in the list."""
        unlisted = []
        for entry in os.scandir(folder):
            if not entry.name.endswith(_KINDS):
                continue
            status = entry.stat()
            state = entry.path, status.st_mtime_ns, status.st_size
            if state in self._states:
                continue
            line = f"{_checksum(Path(entry.path))} {entry.name}"
            if line in self._lines[folder]:
                self._states.add(state)
            else:
                unlisted.append((Path(entry.path), line))
        return unlisted


CHECKSUMS = Checksums()
for _kind in ("numba:compile", "numba:compiler_lock"):
    event.register(_kind, CHECKSUMS)


def _read_list(folder: Path) -> list[str]:
    path = folder / LIST
    content = path.read_bytes() if path.is_file() and is_own(path) else b""
    return content.decode(errors="replace").splitlines()


def _checksum(path: Path) -> str:
    """Return the checksum of a file; none of what is no file of this user."""
    if not path.is_file() or not is_own(path):
        return "none"
    return xxhash.xxh3_128_hexdigest(path.read_bytes())


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Let no other process write to a folder meanwhile; a lock that cannot be had is no reason."""
    from filelock import FileLock, Timeout  # only what compiles needs it

    with contextlib.ExitStack() as lock:
        with contextlib.suppress(OSError, Timeout):
            lock.enter_context(FileLock(folder / "lock").acquire(timeout=PATIENCE_S))
        yield
