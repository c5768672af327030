"""Facts about conditions that follow from the installed code, kept on disk under its content.

To find them, a condition's components are loaded, which takes most of a second. What they are kept
under is the content of all code that has a say, so an edit or another version finds them anew.
"""

import contextlib
import functools
import hashlib
import importlib.util
import json
import os
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

from evoexp.numeric.cache_folder import Damaged, cache_root, read_kept, write_kept
from evoexp.registry import COMPONENTS, Registration, registrations
from evoexp.version import version_of

Stamp = tuple[str, int, int]  # path, size and time of a file

LOOK_S = 0.05  # [s] for which code that was looked at is taken to stay; a fact takes longer

_LIBRARIES = ("numpy", "numba", "scipy", "pin", "coal")
_OF_THIS_PROCESS = os.urandom(16)
_FIRST = dict[tuple[Path | str, ...], bytes]()  # hashes of code when this process first asked
_LOADED_HERE = set[str]()  # modules that were loaded only to find a fact


def kept_fact(kind: str, about: bytes, modules: Iterable[str], find: Callable[[], Any]) -> Any:
    """Return a fact, from where it is kept if it was found before.

    Args:
        kind: Of the fact.
        about: Everything but the code that it follows from.
        modules: Modules that are loaded to find it; where all of them were before, it is found
            again and not kept.
        find: Finds it, as plain data; what it raises is not kept.
    """
    if set(modules) <= sys.modules.keys() - _LOADED_HERE:
        return find()

    def found() -> Any:
        before = set(sys.modules)
        fact = find()
        _LOADED_HERE.update(sys.modules.keys() - before)
        return fact

    return kept_answer(kind, about, found)


def kept_answer(kind: str, about: bytes, find: Callable[[], Any]) -> Any:
    """Return an answer that takes long to find whatever is loaded, from where it is kept.

    Args:
        kind: Of the answer.
        about: Everything but the code that it follows from.
        find: Finds it, as plain data; what it raises is not kept.
    """
    digest = hashlib.sha256(installed_code())
    digest.update(json.dumps([kind, *map(version_of, _LIBRARIES)]).encode())
    digest.update(about)
    path = cache_root() / "facts" / digest.hexdigest()[:32]
    with contextlib.suppress(FileNotFoundError, Damaged):
        return json.loads(read_kept(path))
    found = find()
    with contextlib.suppress(OSError):
        write_kept(path, json.dumps(found).encode())
    return found


def installed_code(without: Collection[str] = ()) -> bytes:
    """Return the hash of the code of evoexp and of all guests, as it is now.

    Where a file changed since this process first asked, the loaded code may be another one: the
    hash is then one that no other process has.

    Args:
        without: Folders of evoexp that do not count.
    """
    components = registrations(COMPONENTS)
    own = Path(__file__).parents[1]
    code = [own, *(root for each in components for root in _sources(each))]
    left_out = tuple(f"{own / folder}{os.sep}" for folder in without)
    found = _LOOKED.stamps(tuple(map(str, dict.fromkeys(code))))
    stamps = [stamp for stamp in found if not stamp[0].startswith(left_out)]
    digest = _hash_of_code(json.dumps(components), tuple(stamps))
    is_unchanged = digest == _FIRST.setdefault((*code, *without), digest)
    return digest if is_unchanged else digest + _OF_THIS_PROCESS


@functools.lru_cache(maxsize=2)
def _hash_of_code(components: str, stamps: tuple[Stamp, ...]) -> bytes:
    """Read all code, once per process as long as no file is written again."""
    digest = hashlib.sha256(components.encode())
    add_files(digest, (path for path, _, _ in stamps))
    return digest.digest()


class _Looked:
    """The files of code as they were when last looked at: a batch asks once per condition."""

    def __init__(self) -> None:
        """Begin without any."""
        self._roots: tuple[str, ...] = ()
        self._at, self._found = 0.0, list[Stamp]()

    def stamps(self, roots: tuple[str, ...]) -> list[Stamp]:
        """Return the stamps of all code in folders, sorted, no older than `LOOK_S`."""
        now = time.monotonic()
        if roots != self._roots or now - self._at > LOOK_S:
            found = sorted({stamp for root in roots for stamp in _stamps(root)})
            self._roots, self._at, self._found = roots, now, found
        return self._found


_LOOKED = _Looked()


def _stamps(root: str) -> Iterator[Stamp]:
    """Yield path, size and time of every Python file in a folder and those within."""
    with contextlib.suppress(OSError), os.scandir(root) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                status = entry.stat()
                yield entry.path, status.st_size, status.st_mtime_ns
            elif entry.is_dir() and entry.name != "__pycache__":
                yield from _stamps(entry.path)


def file_stamps(roots: Iterable[Path]) -> Iterator[Stamp]:
    """Yield path, size and time of every file in folders and those within, in order; no locks."""
    for root in roots:
        for folder, names, files in os.walk(root):
            names.sort()
            for name in sorted(files):
                if name.startswith("."):  # locks
                    continue
                with contextlib.suppress(OSError):
                    status = os.stat(path := os.path.join(folder, name))
                    yield path, status.st_size, status.st_mtime_ns


def add_files(digest: Any, paths: Iterable[Path | str]) -> None:
    """Add names and contents of files, of those that are there, to a hash."""
    for path in paths:
        if os.path.isfile(path):
            with open(path, "rb", buffering=0) as file:  # two thirds of the time of a `Path`'s
                content = file.readall()
            digest.update(f"{path}\0{len(content)}\0".encode(errors="surrogateescape") + content)


def _sources(registration: Registration) -> list[Path]:
    """Return the folders with the code of a guest's component; nothing is imported."""
    if registration.is_own:
        return []
    with contextlib.suppress(ImportError, ValueError):
        spec = importlib.util.find_spec(registration.module.partition(".")[0])
        if spec is not None and spec.submodule_search_locations:
            return [Path(location) for location in spec.submodule_search_locations]
        if spec is not None and spec.origin:
            return [Path(spec.origin).parent]
    return []
